//! Recorded paths: CSV files of positions over time.
//!
//! The first line names the columns: `t`, `x` and `y` in any order, others are ignored. A unit may follow in
//! brackets or after `_`: `t [ms], x_cm, y_cm`; without one it is seconds and metres. Times rise from line to line.

use crate::ast::Span;
use crate::problem::{Code, Problem};

/// Seconds and metres: time, (x, y).
pub type Points = Vec<(f64, (f64, f64))>;

/// Lines of a recording, at most.
const LONGEST: usize = 1_000_000;

/// The points of a file.
pub fn read(text: &str, file: usize) -> Result<Points, Box<Problem>> {
    let mut lines = Lines { text, at: 0 };
    let Some((start, header)) = lines.next() else {
        return Err(Box::new(bad(file, 0..text.len(), "the file is empty")));
    };
    let columns: Vec<&str> = header.split(',').map(str::trim).collect();
    let column = |name: &str, units: &[(&str, f64)]| {
        let found =
            columns.iter().enumerate().find_map(|(k, column)| Some((k, factor(column, name, units)?)));
        found.ok_or_else(|| {
            let span = start..start + header.len();
            let what = format!("no column is called `{name}`");
            Box::new(bad(file, span, &what).help(
                "name the columns in the first line: `t, x, y`, or with units `t [ms], x [cm], y [cm]`",
            ))
        })
    };
    const LENGTHS: &[(&str, f64)] = &[("", 1.0), ("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("km", 1000.0)];
    const TIMES: &[(&str, f64)] = &[("", 1.0), ("s", 1.0), ("ms", 0.001), ("us", 1e-6), ("min", 60.0)];
    let (t, x, y) = (column("t", TIMES)?, column("x", LENGTHS)?, column("y", LENGTHS)?);
    let mut points = Points::new();
    for (start, line) in lines {
        let whole = start..start + line.len();
        let number = |(k, factor): (usize, f64)| {
            let entry = line.split(',').nth(k).map(str::trim);
            let Some(entry) = entry else {
                return Err(Box::new(bad(
                    file,
                    whole.clone(),
                    &format!("this line has no column {}", k + 1),
                )));
            };
            let from = start + (entry.as_ptr() as usize - line.as_ptr() as usize);
            let value: Option<f64> = entry.parse().ok().filter(|value: &f64| value.is_finite());
            value.map(|value| value * factor).ok_or_else(|| {
                Box::new(bad(file, from..from + entry.len(), &format!("`{entry}` is no finite number")))
            })
        };
        let point = (number(t)?, (number(x)?, number(y)?));
        if points.last().is_some_and(|last| point.0 <= last.0) {
            return Err(Box::new(bad(file, whole, "the times do not rise from line to line")));
        }
        if points.len() == LONGEST {
            return Err(Box::new(bad(file, whole, &format!("there are more than {LONGEST} lines"))));
        }
        points.push(point);
    }
    match points.is_empty() {
        true => Err(Box::new(bad(file, 0..text.len(), "the file has no line of numbers"))),
        false => Ok(points),
    }
}

/// The factor of a column's unit if it has this name.
fn factor(column: &str, name: &str, units: &[(&str, f64)]) -> Option<f64> {
    let rest = column.strip_prefix(name)?.trim();
    let unit = rest.strip_prefix('[').and_then(|unit| unit.strip_suffix(']')).or(rest.strip_prefix('_'));
    let unit = if rest.is_empty() { "" } else { unit?.trim() };
    units.iter().find(|(known, _)| *known == unit).map(|(_, factor)| *factor)
}

/// The lines that are neither empty nor comments (`#`), with the byte at which each begins.
struct Lines<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Iterator for Lines<'t> {
    type Item = (usize, &'t str);

    fn next(&mut self) -> Option<(usize, &'t str)> {
        loop {
            let start = self.at;
            let rest = self.text.get(start..).filter(|rest| !rest.is_empty())?;
            let line = rest.split('\n').next()?;
            self.at = start + line.len() + 1;
            let line = line.trim_end();
            if !line.trim().is_empty() && !line.starts_with('#') {
                return Some((start, line));
            }
        }
    }
}

fn bad(file: usize, bytes: std::ops::Range<usize>, why: &str) -> Problem {
    let span = Span { file, start: bytes.start, end: bytes.end };
    Problem::error(&BAD_RECORDING, format!("this recording cannot be read: {why}")).at(span, "")
}

pub const BAD_RECORDING: Code = Code {
    name: "bad-recording",
    explain: "\
A recording is a CSV file beside the scenario. Its first line names the columns, each other line is a moment:

    t, x, y
    0.0, 0.10, 0.00
    0.1, 0.12, 0.01

Units are seconds and metres, or stand with the names: `t [ms], x [cm], y [cm]`. Times rise.

    recording walk = \"walk.csv\"
    motion = recorded(walk)",
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_names_units_and_any_order() {
        let text = "# by hand\ny [cm], note, t_ms, x\r\n10, a, 0, 1\n\n20, b, 500, 2\n";
        assert_eq!(read(text, 0).unwrap(), [(0.0, (1.0, 0.1)), (0.5, (2.0, 0.2))]);
    }

    #[test]
    fn each_mistake_is_found_in_its_place() {
        for (text, at, why) in [
            ("", 0, "empty"),
            ("t,x\n1,2", 0, "`y`"),
            ("t,x,y\n", 0, "no line of numbers"),
            ("t,x,y\n1,2", 6, "no column 3"),
            ("t,x,y\n0,1,2\n1,NaN,2", 14, "`NaN`"),
            ("t,x,y\n0,1,2\n0,1,2", 12, "rise"),
            ("t [h],x,y\n0,1,2", 0, "`t`"),
        ] {
            let problem = read(text, 3).expect_err(text);
            assert_eq!(problem.span().map(|span| (span.file, span.start)), Some((3, at)), "{text}");
            assert!(problem.message.contains(why), "{}", problem.message);
        }
    }

    /// Seen to fail with the limit raised.
    #[test]
    fn a_recording_has_an_end() {
        let lines = |number: usize| (0..number).map(|k| format!("\n{k},0,0")).collect::<String>();
        assert_eq!(read(&format!("t,x,y{}", lines(LONGEST)), 0).map(|points| points.len()), Ok(LONGEST));
        let longer = read(&format!("t,x,y{}", lines(1_000_001)), 0).expect_err("one line more");
        assert!(longer.message.contains("more than 1000000 lines"), "{}", longer.message);
    }
}
