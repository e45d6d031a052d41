//! Tables as LaTeX, with booktabs.

use std::fmt::Write;

use super::{Align, Block, Document, Table, one_line};

/// Of a table on one page; words may need several lines.
const ROWS: usize = 30;
const HEAD: &str = "% Needs \\usepackage[T1]{fontenc} and \\usepackage{array,booktabs}.\n";

impl Document {
    /// As a fragment to `\input`; whatever stands in a name stays text.
    pub fn latex(&self) -> String {
        let parts = self.blocks.iter().map(|block| match block {
            Block::Heading(title) => format!("\\subsection*{{{}}}\n", escape(title)),
            Block::Text(text) => format!("{}\n", escape(text)),
            Block::Table(it) => table(it),
        });
        [HEAD.to_string()].into_iter().chain(parts).collect::<Vec<_>>().join("\n")
    }
}

/// In parts that fit a page.
fn table(table: &Table) -> String {
    let parts = table.rows.chunks(ROWS).enumerate().map(|(k, rows)| {
        let caption = if k == 0 { table.caption.clone() } else { format!("{}, continued", table.caption) };
        part(&caption, &table.columns, rows)
    });
    parts.collect::<Vec<_>>().join("\n")
}

fn part(caption: &str, columns: &[(String, Align)], rows: &[Vec<String>]) -> String {
    let wide = columns.iter().filter(|(_, align)| *align == Align::Wide).count().max(1);
    let kind = |(_, align): &(String, Align)| match align {
        Align::Left => "l".to_string(),
        Align::Right => "r".to_string(),
        Align::Wide => format!(">{{\\raggedright\\arraybackslash}}p{{{:.2}\\linewidth}}", 0.8 / wide as f64),
    };
    let kinds: String = columns.iter().map(kind).collect();
    let line = |cells: &mut dyn Iterator<Item = &String>| {
        format!("{} \\\\\n", cells.map(|cell| escape(cell)).collect::<Vec<_>>().join(" & "))
    };
    let head = line(&mut columns.iter().map(|(head, _)| head));
    let rows: String = rows.iter().map(|row| line(&mut row.iter())).collect();
    format!(
        "\\begin{{table}}[htbp]\n\\centering\\footnotesize\\setlength{{\\tabcolsep}}{{4pt}}\n\\caption{{{}}}\n\
         \\begin{{tabular}}{{@{{}}{kinds}@{{}}}}\n\\toprule\n{head}\\midrule\n{rows}\\bottomrule\n\
         \\end{{tabular}}\n\\end{{table}}\n",
        escape(caption)
    )
}

/// Text that is nothing but text. A character that the fonts of pdfLaTeX may lack is told by its number.
fn escape(text: &str) -> String {
    let text = one_line(text);
    let mut out = String::new();
    let mut before = None;
    for c in text.chars() {
        // Not a ligature.
        if before == Some(c) && "-,".contains(c) {
            out += "{}";
        }
        before = Some(c);
        match symbol(c) {
            Some(symbol) => out += symbol,
            None if c.is_ascii() || matches!(c, 'À'..='Ö' | 'Ø'..='ö' | 'ø'..='ÿ') => out.push(c),
            // Writing to a String cannot fail.
            None => _ = write!(out, "{{[}}U+{:04X}]", u32::from(c)),
        }
    }
    out
}

/// How to write what LaTeX reads otherwise, or not at all. A bracket or star after `\\\\` would be its argument.
fn symbol(c: char) -> Option<&'static str> {
    Some(match c {
        '\\' => "\\textbackslash{}",
        '{' => "\\{",
        '}' => "\\}",
        '[' => "{[}",
        '*' => "{*}",
        '$' => "\\$",
        '&' => "\\&",
        '#' => "\\#",
        '_' => "\\_",
        '%' => "\\%",
        '~' => "\\textasciitilde{}",
        '^' => "\\textasciicircum{}",
        '<' => "\\textless{}",
        '>' => "\\textgreater{}",
        '|' => "\\textbar{}",
        '"' => "\\textquotedbl{}",
        '`' => "\\textasciigrave{}",
        '\'' => "\\textquotesingle{}",
        '“' => "``",
        '”' => "\'\'",
        '‘' => "`",
        '’' => "\'",
        '–' => "--",
        '—' => "---",
        '…' => "\\ldots{}",
        '\u{a0}' => "~",
        '\u{202f}' => "\\,",
        '−' => "$-$",
        '×' => "$\\times$",
        '·' => "$\\cdot$",
        '±' => "$\\pm$",
        '→' => "$\\to$",
        '≤' => "$\\leq$",
        '≥' => "$\\geq$",
        '≠' => "$\\neq$",
        '∞' => "$\\infty$",
        '²' => "$^2$",
        '³' => "$^3$",
        '°' => "$^\\circ$",
        _ => return GREEK.iter().find(|(letter, _)| *letter == c).map(|(_, symbol)| *symbol),
    })
}

#[rustfmt::skip]
const GREEK: [(char, &str); 33] = [
    ('α', "$\\alpha$"), ('β', "$\\beta$"), ('γ', "$\\gamma$"), ('δ', "$\\delta$"), ('ε', "$\\varepsilon$"), ('ζ', "$\\zeta$"),
    ('η', "$\\eta$"), ('θ', "$\\theta$"), ('ι', "$\\iota$"), ('κ', "$\\kappa$"), ('λ', "$\\lambda$"), ('μ', "$\\mu$"),
    ('ν', "$\\nu$"), ('ξ', "$\\xi$"), ('π', "$\\pi$"), ('ρ', "$\\rho$"), ('σ', "$\\sigma$"), ('τ', "$\\tau$"),
    ('υ', "$\\upsilon$"), ('φ', "$\\varphi$"), ('χ', "$\\chi$"), ('ψ', "$\\psi$"), ('ω', "$\\omega$"), ('Γ', "$\\Gamma$"),
    ('Δ', "$\\Delta$"), ('Θ', "$\\Theta$"), ('Λ', "$\\Lambda$"), ('Ξ', "$\\Xi$"), ('Π', "$\\Pi$"), ('Σ', "$\\Sigma$"),
    ('Φ', "$\\Phi$"), ('Ψ', "$\\Psi$"), ('Ω', "$\\Omega$"),
];
