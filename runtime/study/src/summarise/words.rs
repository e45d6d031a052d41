//! Numbers for people.

use super::scores::Sample;

/// Four significant digits and the unit of the metric.
pub(super) fn quantity(value: f64, metric: &str) -> String {
    match metric {
        "error_m" => format!("{} m", significant(value)),
        "error_over_oracle" => format!("{} times the oracle's", significant(value)),
        "collision_episodes" | "late_collision_episodes" | "outside_episodes" => percent(value),
        "hit_episodes" | "late_hit_episodes" => percent(value),
        _ => significant(value),
    }
}

/// What a metric measures.
pub(super) fn name(metric: &str) -> String {
    match metric {
        "error_m" | "error_over_oracle" => "error".to_string(),
        "collision_episodes" => "share of episodes with a collision".to_string(),
        "late_collision_episodes" => "share of episodes with a late collision".to_string(),
        "hit_episodes" => "share of episodes with a hit on an obstacle".to_string(),
        "late_hit_episodes" => "share of episodes with a late hit on an obstacle".to_string(),
        "outside_episodes" => "share of episodes with an agent outside its arena".to_string(),
        _ => metric.strip_prefix("reward/").map_or(metric.to_string(), |term| format!("reward term {term}")),
    }
}

/// A share in percent.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// `10 seeds`, and how many of them failed.
pub(super) fn seeds(sample: &Sample) -> String {
    let n = sample.measured.len();
    let failed = sample.measured.iter().filter(|value| value.is_none()).count();
    let all = if n == 1 { "1 seed".to_string() } else { format!("{n} seeds") };
    if failed == 0 { all } else { format!("{all}, {failed} of them failed and counted as the worst") }
}

/// Four significant digits, no zeros at the end.
fn significant(value: f64) -> String {
    let scientific = format!("{value:.3e}");
    let exponent = scientific.split_once('e').and_then(|(_, digits)| digits.parse::<i32>().ok());
    let Some(exponent @ -4..=5) = exponent else { return scientific };
    let text = format!("{value:.*}", (3 - exponent).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits_and_a_unit() {
        let of_return = [0.0, -1.5, 0.123456, 999.96, 123456.0, 1234567.0, 0.00001].map(significant);
        assert_eq!(of_return, ["0", "-1.5", "0.1235", "1000", "123456", "1.235e6", "1.000e-5"]);
        assert_eq!(quantity(0.12, "error_m"), "0.12 m");
        assert_eq!(quantity(0.025, "outside_episodes"), "2.5 %");
        assert_eq!(quantity(1.08, "error_over_oracle"), "1.08 times the oracle's");
        assert_eq!(name("reward/gap"), "reward term gap");
    }
}
