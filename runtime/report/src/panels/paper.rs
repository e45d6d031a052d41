//! What a publication says of the same scenario, beside what was measured.

use minijinja::context;
use minijinja::value::Serde;

use super::{Content, Panel};
use crate::Member;
use crate::suite::beside;
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "paper",
    title: "Beside the paper",
    template: include_str!("../suite/tables.html"),
    script: None,
    fills: false,
    content,
};

fn content(view: &View) -> Option<Content> {
    let published = view.input.published.as_ref()?;
    let member = Member {
        plan: view.input.plan,
        variant: &published.variant,
        report: String::new(),
        summary: view.input.summary,
    };
    let tables: Vec<_> = published.tables.iter().map(|table| beside(table, &[&member])).collect();
    (!tables.is_empty()).then(|| Content { context: context! { tables => Serde(tables) }, data: None })
}
