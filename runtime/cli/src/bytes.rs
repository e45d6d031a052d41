//! Sizes as people write them.

use std::fmt;
use std::str::FromStr;

/// A number of bytes.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Bytes(pub f64);

/// Longest first where one ends with the other.
const UNITS: [(&str, f64); 8] = [
    ("KiB", 1024.0),
    ("MiB", 1024.0 * 1024.0),
    ("GiB", 1024.0 * 1024.0 * 1024.0),
    ("kB", 1e3),
    ("KB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
    ("B", 1.0),
];

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (value, unit) = match self.0 {
            ..1e6 => (self.0 / 1e3, "kB"),
            ..1e9 => (self.0 / 1e6, "MB"),
            _ => (self.0 / 1e9, "GB"),
        };
        if value < 10.0 { write!(f, "{value:.1} {unit}") } else { write!(f, "{value:.0} {unit}") }
    }
}

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Bytes, String> {
        let read = UNITS.iter().find_map(|(unit, factor)| {
            let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
            Some(Bytes(number * factor))
        });
        read.filter(|Bytes(bytes)| bytes.is_finite() && *bytes > 0.0)
            .ok_or_else(|| "write a size with its unit, for example 500MB or 2GiB".to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_short() {
        let told = [1.0, 12_345_678.0, 2.5e9].map(|bytes| Bytes(bytes).to_string());
        assert_eq!(told, ["0.0 kB", "12 MB", "2.5 GB"]);
    }

    #[test]
    fn sizes_are_read_with_their_unit() {
        let read = |text: &str| text.parse().map(|Bytes(bytes)| bytes);
        assert_eq!(read("500MB"), Ok(5e8));
        assert_eq!(read("1.5 GiB"), Ok(1_610_612_736.0));
        assert_eq!(read("64kB"), Ok(64e3));
        assert_eq!(read("12B"), Ok(12.0));
        for wrong in ["", "5", "GB", "-1GB", "0MB", "infGB", "1TB", "1 G"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
