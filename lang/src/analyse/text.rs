//! What is known, for people.

use std::fmt::Write;

use super::interval::Interval;
use super::{Analysis, Episodes};

impl Analysis {
    /// Bounds with their units, and what is seen and commanded.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for episodes in &self.episodes {
            self.episodes(&mut text, episodes);
        }
        let sizes = &self.sizes;
        let _ = writeln!(text, "state: {} numbers", sizes.state_len());
        for (name, entries) in &sizes.state {
            let _ = writeln!(text, "    {entries:>4}  {name}");
        }
        let _ = writeln!(text, "action: {} numbers", sizes.action_len());
        match sizes.action.as_slice() {
            few if few.len() <= 8 => {
                for name in few {
                    let _ = writeln!(text, "       2  velocity of {name}");
                }
            }
            many => {
                let end = |end: Option<&String>| end.cloned().unwrap_or_default();
                let (first, last) = (end(many.first()), end(many.last()));
                let _ = writeln!(text, "          velocities of {first} to {last}");
            }
        }
        for work in &sizes.learners {
            let _ = writeln!(
                text,
                "{}: at most {} steps and {} updates a seed; {} weights in the actor, {} in a critic",
                work.label,
                count(work.steps),
                count(work.updates),
                count(work.actor),
                count(work.critic)
            );
        }
        text
    }

    fn episodes(&self, text: &mut String, episodes: &Episodes) {
        let Episodes { name, terms, bounds } = episodes;
        let unit = self.unit.trim();
        let _ = writeln!(text, "{name}");
        let names = terms.iter().map(String::as_str).chain(["costs", "reward", "return"]);
        let width = names.clone().map(str::len).max().unwrap_or(0);
        let totals = [bounds.costs, bounds.reward, bounds.total];
        for (name, bounds) in names.zip(bounds.terms.iter().copied().chain(totals)) {
            if name == "costs" && bounds == Interval::ZERO {
                continue;
            }
            let line = format!("    {name:width$}  {} .. {} {unit}", shown(bounds.low), shown(bounds.high));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
}

/// Rounded to five digits.
fn shown(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return (value + 0.0).to_string().replace("inf", "∞").replace('-', "−");
    }
    let digits = 4 - (libm::floor(libm::log10(value.abs())) as i32).clamp(-300, 4);
    let scale = libm::pow(10.0, f64::from(digits));
    ((value * scale).round() / scale).to_string().replace('-', "−")
}

/// With spaces between thousands.
fn count(value: f64) -> String {
    if !value.is_finite() {
        return "∞".to_owned();
    }
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k) % 3 == 0 {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_spaces_between_thousands() {
        let told = [0.0, 999.0, 1000.0, 1_234_567.0, f64::INFINITY].map(count);
        assert_eq!(told, ["0", "999", "1 000", "1 234 567", "∞"]);
    }
}
