//! The numbers behind the page, to take away.

use minijinja::context;

use super::{Content, Panel};
use crate::view::View;

pub const PANEL: Panel = Panel {
    id: "data",
    title: "Data",
    template: include_str!("data.html"),
    script: Some(include_str!("../script/download.js")),
    fills: false,
    content,
};

fn content(view: &View) -> Option<Content> {
    let summary = serde_json::to_value(view.input.summary).ok()?;
    let data = serde_json::json!({ "scenario": view.input.plan.name, "summary": summary });
    Some(Content { context: context! {}, data: Some(data) })
}
