//! `--seeds N` and `--seeds A..B`.

use std::str::FromStr;

/// The largest number of a seed, and the most there can be.
const MOST: usize = 100_000;

/// Training seeds, one after another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    pub first: usize,
    pub count: usize,
}

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Seeds, String> {
        let number = |text: &str| text.trim().parse::<usize>().ok().filter(|number| *number <= MOST);
        let (first, end) = match text.split_once("..") {
            Some((first, end)) => (number(first), number(end)),
            None => (Some(0), number(text)),
        };
        match (first, end) {
            (Some(first), Some(end)) if first < end => Ok(Seeds { first, count: end - first }),
            _ => Err(format!(
                "write a number of seeds, for example 10, or A..B for A to B - 1, for example 10..20; at most {MOST}"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_or_a_range() {
        let read = |text: &str| text.parse().map(|Seeds { first, count }| (first, count));
        assert_eq!(read("10"), Ok((0, 10)));
        assert_eq!(read("10..20"), Ok((10, 10)));
        assert_eq!(read("3 .. 4"), Ok((3, 1)));
        for wrong in [
            "0",
            "",
            "-1",
            "5..5",
            "6..5",
            "..5",
            "5..",
            "1.5",
            "100001",
            "0..100001",
            "99999999999999999999",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
