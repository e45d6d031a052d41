//! Numbers and words for people.

use minijinja::HtmlEscape;

const MINUS: char = '\u{2212}';
const MISSING: &str = "–";

/// How the numbers of one column or axis are written: a unit, its factor and the digits behind the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Format {
    pub unit: &'static str,
    pub factor: f64,
    pub digits: usize,
}

impl Format {
    /// Three significant digits at a size; one more unit of precision than people can use is noise.
    pub fn number(size: f64) -> Format {
        Format { unit: "", factor: 1.0, digits: digits(size) }
    }

    /// Metres, or millimetres below one metre.
    pub fn length(size_m: f64) -> Format {
        if size_m.abs() < 1.0 {
            Format { unit: "mm", factor: 1000.0, digits: digits(size_m * 1000.0).min(2) }
        } else {
            Format { unit: "m", factor: 1.0, digits: digits(size_m) }
        }
    }

    pub fn percent(size: f64) -> Format {
        Format { unit: "%", factor: 100.0, digits: usize::from(size.abs() < 0.1) }
    }

    pub fn ratio() -> Format {
        Format { unit: "×", factor: 1.0, digits: 2 }
    }

    /// The number alone.
    pub fn plain(&self, value: f64) -> String {
        if !value.is_finite() {
            return MISSING.into();
        }
        let text = format!("{:.*}", self.digits, value * self.factor);
        match text.strip_prefix('-') {
            Some(rest) if rest.bytes().all(|byte| byte == b'0' || byte == b'.') => rest.into(),
            Some(rest) => format!("{MINUS}{rest}"),
            None => text,
        }
    }

    /// The number and its unit.
    pub fn full(&self, value: f64) -> String {
        if self.unit.is_empty() {
            self.plain(value)
        } else {
            format!("{}\u{202f}{}", self.plain(value), self.unit)
        }
    }

    /// The same unit with as many digits as three significant ones of this value need.
    pub fn at(&self, value: f64) -> Format {
        Format { digits: digits(value * self.factor), ..*self }
    }

    /// `[lo, hi]`.
    pub fn interval(&self, lo: Option<f64>, hi: Option<f64>) -> Option<String> {
        Some(format!("[{}, {}]", self.plain(lo?), self.plain(hi?)))
    }
}

/// Digits behind the point that give three significant ones.
fn digits(size: f64) -> usize {
    let size = size.abs();
    if size == 0.0 || !size.is_finite() {
        return 0;
    }
    (2.0 - libm::floor(libm::log10(size))).clamp(0.0, 8.0) as usize
}

/// `20k`, `1.5M`: counts on an axis.
pub fn count(value: f64) -> String {
    for (size, letter) in [(1e9, "G"), (1e6, "M"), (1e3, "k")] {
        if value >= size {
            return format!("{}{letter}", (value / size * 100.0).round() / 100.0);
        }
    }
    format!("{value}")
}

/// `1 seed`, `2 seeds`.
pub fn plural(count: usize, noun: &str) -> String {
    let s = if count == 1 { "" } else { "s" };
    format!("{count}\u{a0}{noun}{s}")
}

/// `a`, `a and b`, `a, b and c`.
pub fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [only] => only.clone(),
        [init @ .., last] => format!("{} and {last}", init.join(", ")),
    }
}

/// `2 min 5 s`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Text as HTML.
pub fn escape(text: &str) -> String {
    HtmlEscape(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits_and_a_true_minus() {
        assert_eq!(Format::number(12.3).plain(-12.345), "\u{2212}12.3");
        assert_eq!(Format::number(0.01234).plain(0.01234), "0.0123");
        assert_eq!(Format::number(1234.0).plain(1234.4), "1234");
        assert_eq!(Format::number(1.0).plain(-0.001), "0.00");
        assert_eq!(Format::number(1.0).plain(f64::NAN), "–");
        assert_eq!(Format::length(0.0624).full(0.0624), "62.4\u{202f}mm");
        assert_eq!(Format::length(1.2).full(1.234), "1.23\u{202f}m");
        assert_eq!(Format::percent(0.02).full(0.021), "2.1\u{202f}%");
    }

    #[test]
    fn words_follow_their_counts() {
        assert_eq!(plural(1, "seed"), "1\u{a0}seed");
        assert_eq!(plural(0, "seed"), "0\u{a0}seeds");
        assert_eq!(list(&["a".into(), "b".into(), "c".into()]), "a, b and c");
        assert_eq!([count(500.0), count(20_000.0), count(1.25e6)], ["500", "20k", "1.25M"]);
        assert_eq!([duration(3.21), duration(125.0), duration(7260.0)], ["3.2 s", "2 min 5 s", "2 h 1 min"]);
    }
}
