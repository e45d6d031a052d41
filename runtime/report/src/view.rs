//! The input in reading order: methods with their look, records by method and seed.

use mpgx_lang::plan::{Method, Protocol, World};
use mpgx_study::record::{CellRecord, Evaluation};
use mpgx_study::summary::Statistic;

use crate::Input;

/// The controller that other methods are measured against.
const ORACLE: &str = "oracle";

pub struct View<'a> {
    pub input: &'a Input<'a>,
    /// Learners, then controllers, as in the Plan.
    pub methods: Vec<Entry<'a>>,
    /// Bytes that a panel may fill.
    pub room: usize,
}

/// A method and what became of it.
pub struct Entry<'a> {
    pub label: &'a str,
    /// Class of its colour, dash and marker in the style sheet.
    pub style: String,
    pub learned: bool,
    /// By seed.
    pub records: Vec<&'a CellRecord>,
}

impl<'a> View<'a> {
    pub fn new(input: &'a Input<'a>) -> View<'a> {
        let learners = input.plan.learners.iter().map(|method| (method, true));
        let controllers = input.plan.controllers.iter().map(|method| (method, false));
        let mut colour = 0;
        let mut entry = |(method, learned): (&'a Method, bool)| {
            let style = if method.what.name == ORACLE {
                "ref".to_string()
            } else {
                colour += 1;
                format!("m{}", (colour - 1) % 6)
            };
            let mut records: Vec<_> =
                input.records.values().filter(|record| record.method == method.label).collect();
            records.sort_by_key(|record| record.seed);
            Entry { label: &method.label, style, learned, records }
        };
        let methods = learners.chain(controllers).map(&mut entry).collect();
        View { input, methods, room: 0 }
    }

    /// The learner the study is about.
    pub fn first(&self) -> Option<&Entry<'a>> {
        self.methods.first().filter(|method| method.learned)
    }

    pub fn learners(&self) -> impl Iterator<Item = &Entry<'a>> {
        self.methods.iter().filter(|method| method.learned)
    }

    pub fn oracle(&self) -> Option<&Entry<'a>> {
        self.methods.iter().find(|method| method.style == "ref")
    }

    pub fn style(&self, label: &str) -> &str {
        self.methods.iter().find(|method| method.label == label).map_or("m5", |method| &method.style)
    }

    pub fn world(&self, protocol: &'a Protocol) -> &'a World {
        protocol.world.as_deref().unwrap_or(&self.input.plan.world)
    }

    /// The protocol the verdict speaks of: the first.
    pub fn main_protocol(&self) -> Option<&'a Protocol> {
        self.input.plan.protocols.first()
    }

    pub fn statistic(&self, protocol: &str, method: &str, metric: &str) -> Option<&'a Statistic> {
        self.input.summary.protocols.get(protocol)?.get(method)?.get(metric)
    }

    /// `#src-0-12` for `file.scn:12:3`; nothing if the file is not part of the source.
    pub fn source_link(&self, file: &str, line: usize) -> Option<String> {
        let index = self.input.source.iter().position(|(name, _)| name == file)?;
        Some(format!("#src-{index}-{line}"))
    }

    /// The same for a place as text, `file:line:column`.
    pub fn place_link(&self, at: &str) -> Option<String> {
        let mut parts = at.rsplitn(3, ':');
        let line = parts.nth(1)?.parse().ok()?;
        self.source_link(parts.next()?, line)
    }
}

impl Entry<'_> {
    /// Evaluations of the seeds that did not fail.
    pub fn evaluations(&self, protocol: &str) -> impl Iterator<Item = (u32, &Evaluation)> {
        let protocol = protocol.to_string();
        self.records.iter().filter_map(move |record| {
            record.protocols.get(&protocol).map(|evaluation| (record.seed, evaluation))
        })
    }
}
