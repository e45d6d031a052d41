//! Text for terminals of any width: tables that become lists where they do not fit, lines that are folded
//! between words. Where nobody looks (a pipe, a file) a line stays whole.

use std::io::{stderr, stdout};

use terminal_size::{Width, terminal_size_of};

/// Columns of the terminal that stdout is, if it is one.
pub fn width_of_stdout() -> Option<usize> {
    terminal_size_of(stdout()).map(|(Width(columns), _)| usize::from(columns))
}

/// The same of stderr.
pub fn width_of_stderr() -> Option<usize> {
    terminal_size_of(stderr()).map(|(Width(columns), _)| usize::from(columns))
}

/// Two spaces between columns, the first to the left, the others to the right. A table wider than `width` is
/// written as a list: the first cell of each row, and below it a line for each other cell with its head. `-` cells
/// of a list are left out.
pub fn table(head: &[String], rows: &[Vec<String>], width: Option<usize>) -> String {
    let columns = head.len();
    let longest = |k: usize| {
        let cells = rows.iter().filter_map(|row| row.get(k)).chain(head.get(k));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(longest).collect();
    let whole = widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1);
    if width.is_some_and(|width| whole > width) {
        return list(head, rows, width);
    }
    let line = |cells: &[String]| {
        let padded = cells.iter().zip(&widths).enumerate().map(|(k, (cell, width))| match k {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        padded.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    [line(head)].into_iter().chain(rows.iter().map(|row| line(row))).collect()
}

fn list(head: &[String], rows: &[Vec<String>], width: Option<usize>) -> String {
    let Some((title, names)) = head.split_first() else { return String::new() };
    let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut out = format!("{title}\n");
    for row in rows {
        let Some((first, cells)) = row.split_first() else { continue };
        out += &fold(&format!("  {first}"), 4, width);
        for (name, cell) in names.iter().zip(cells).filter(|(_, cell)| *cell != MISSING) {
            out += &fold(&format!("    {name:<longest$}  {cell}"), 6, width);
        }
    }
    out
}

/// What stands where there is nothing to tell.
pub const MISSING: &str = "–";

/// Lines broken between words where they do not fit, the rest of each `indent` spaces to the right of the margin. A
/// word longer than a line stays whole.
pub fn fold(text: &str, indent: usize, width: Option<usize>) -> String {
    let Some(width) = width else { return lines(text) };
    let mut out = String::new();
    for line in text.lines() {
        let own = line.chars().take_while(|c| *c == ' ').count();
        let (mut at, mut margin) = (own, own);
        out += &" ".repeat(own);
        for word in pieces(line.trim_start()) {
            let length = word.trim_end().chars().count();
            if at > margin && at + length > width {
                out.truncate(out.trim_end().len());
                margin = indent.min(width / 2);
                out += &format!("\n{}", " ".repeat(margin));
                at = margin;
            }
            out += word;
            at += word.chars().count();
        }
        out.truncate(out.trim_end_matches(' ').len());
        out.push('\n');
    }
    out
}

fn lines(text: &str) -> String {
    text.lines().map(|line| format!("{line}\n")).collect()
}

/// Words with the spaces behind them; an interval `[lo, hi]` is one word.
fn pieces(line: &str) -> impl Iterator<Item = &str> {
    let mut rest = line;
    std::iter::from_fn(move || {
        let (mut inside, mut space) = (false, false);
        let end = rest.char_indices().find(|&(_, c)| {
            let begins = space && c != ' ';
            inside = (inside || c == '[') && c != ']';
            space = c == ' ' && !inside;
            begins
        });
        let (piece, left) = rest.split_at(end.map_or(rest.len(), |(at, _)| at));
        rest = left;
        (!piece.is_empty()).then_some(piece)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> (Vec<String>, Vec<Vec<String>>) {
        let of = |cells: [&str; 3]| cells.map(String::from).to_vec();
        (
            of(["random", "return [95 %]", "error"]),
            vec![of(["mpg", "-1.5 [-1.6, -1.4]", "78.8 mm"]), of(["oracle", "-1.0", "–"])],
        )
    }

    #[test]
    fn a_table_that_fits_has_columns() {
        let (head, rows) = rows();
        let whole = "\
random      return [95 %]    error
mpg     -1.5 [-1.6, -1.4]  78.8 mm
oracle               -1.0        –
";
        assert_eq!(table(&head, &rows, None), whole);
        assert_eq!(table(&head, &rows, Some(34)), whole);
    }

    #[test]
    fn a_table_that_does_not_fit_becomes_a_list() {
        let (head, rows) = rows();
        let list = "\
random
  mpg
    return [95 %]  -1.5
      [-1.6, -1.4]
    error          78.8 mm
  oracle
    return [95 %]  -1.0
";
        assert_eq!(table(&head, &rows, Some(33)), list);
        for width in 20..34 {
            let text = table(&head, &rows, Some(width));
            assert!(text.lines().all(|line| line.chars().count() <= width.max(24)), "{width}:\n{text}");
        }
    }

    #[test]
    fn lines_are_folded_between_words_and_whole_in_a_pipe() {
        let line = "random: mpg against td3 on return: +10.7 [+8.4, +14.6]  better";
        assert_eq!(fold(line, 2, None), format!("{line}\n"));
        assert_eq!(fold(line, 2, Some(80)), format!("{line}\n"));
        assert_eq!(
            fold(line, 2, Some(40)),
            "random: mpg against td3 on return: +10.7\n  [+8.4, +14.6]  better\n"
        );
        assert_eq!(fold("a/path/longer/than/a/line b", 2, Some(10)), "a/path/longer/than/a/line\n  b\n");
        assert_eq!(
            fold("  kept margin of a line\n\nnext", 4, Some(12)),
            "  kept\n    margin\n    of a\n    line\n\nnext\n"
        );
    }
}
