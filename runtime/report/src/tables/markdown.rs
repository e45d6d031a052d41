//! Tables as Markdown (CommonMark with the tables of GitHub).

use super::{Align, Block, Document, Table, one_line};

impl Document {
    /// As Markdown; whatever stands in a name stays text.
    pub fn markdown(&self) -> String {
        let parts = self.blocks.iter().map(|block| match block {
            Block::Heading(title) => format!("## {}\n", escape(title)),
            Block::Text(text) => format!("{}\n", escape(text)),
            Block::Table(it) => table(it),
        });
        parts.collect::<Vec<_>>().join("\n")
    }
}

fn table(table: &Table) -> String {
    let mut out = format!("**{}**\n\n", escape(&table.caption));
    let line = |cells: &mut dyn Iterator<Item = String>| {
        let cells: Vec<String> = cells.collect();
        format!("| {} |\n", cells.join(" | "))
    };
    out += &line(&mut table.columns.iter().map(|(head, _)| escape(head)));
    let marks = table.columns.iter().map(|(_, align)| if *align == Align::Right { "--:" } else { "---" });
    out += &line(&mut marks.map(String::from));
    for row in &table.rows {
        out += &line(&mut row.iter().map(|cell| escape(cell)));
    }
    out
}

/// Text that is nothing but text: what could be a mark is escaped.
fn escape(text: &str) -> String {
    const MARKS: &str = "\\`*_[]<>#|~$&@^";
    let text = one_line(text);
    let number = text.bytes().take_while(u8::is_ascii_digit).count();
    let mut out = String::new();
    for (k, c) in text.char_indices() {
        let rest = &text[k..];
        let before = &text[..k];
        let ends = rest.chars().nth(1).is_none_or(|next| next == ' ');
        let list = ends && ((k == 0 && "+-".contains(c)) || (k == number && k > 0 && ".)".contains(c)));
        // GitHub makes links of addresses, and pictures of words between colons.
        let address = c == '.' && before.to_lowercase().ends_with("www");
        let colon = c == ':' && !ends;
        if MARKS.contains(c) || list || address || colon {
            out.push('\\');
        }
        out.push(c);
    }
    out
}
