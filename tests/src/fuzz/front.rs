//! One input through the whole front end, and a few steps of the simulator if it compiles.

use std::panic::{AssertUnwindSafe, catch_unwind};

use mpgx_lang::format::format;
use mpgx_lang::parse::parse;
use mpgx_lang::plan::Plan;
use mpgx_lang::problem::{Problems, Style, render, render_json, render_short};
use mpgx_lang::source::{NoFiles, Sources};
use mpgx_lang::{Compilation, codes, compile, describe, meaning_hash, print};
use mpgx_sim::{EpisodeKey, Mode, Task};

/// How far an input came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reached {
    /// It has syntax errors.
    Text,
    /// Its syntax is right.
    Tree,
    /// It compiles.
    Plan,
    /// It was simulated.
    Steps,
}

/// Parsing may allocate so much for a file, and for each of its bytes.
const PARSE_BYTES: u64 = 200_000;
const PARSE_BYTES_PER_BYTE: u64 = 4_000;
/// A whole compilation, which a short text can make long: of a thousand robots, say.
const COMPILE_BYTES: u64 = 1 << 30;
/// Agents of a world that is simulated.
const AGENTS: usize = 40;

/// The Plan of a scenario without files of its own, if it compiles.
pub fn plan(text: &str) -> Option<Plan> {
    compile("a.scn", text.to_owned(), &[], &NoFiles).plan
}

/// Says what is wrong with the compiler, if this text shows it. Allocations stand for work, so that the answer
/// needs no clock.
pub fn survives(text: &str) -> Result<Reached, String> {
    let mut result = Ok(Reached::Text);
    let work = allocation_counter::measure(|| {
        result = catch_unwind(AssertUnwindSafe(|| walk(text))).unwrap_or_else(|panic| {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            Err(format!("a panic: {}", words.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no words")))
        });
    });
    match result {
        Ok(_) if work.bytes_total > COMPILE_BYTES => {
            Err(format!("{} bytes are allocated for {} bytes", work.bytes_total, text.len()))
        }
        result => result,
    }
}

fn walk(text: &str) -> Result<Reached, String> {
    let mut tree = None;
    let work = allocation_counter::measure(|| tree = said(text));
    if work.bytes_total > PARSE_BYTES + PARSE_BYTES_PER_BYTE * text.len() as u64 {
        return Err(format!("parsing {} bytes allocates {} bytes", text.len(), work.bytes_total));
    }
    let Some(tree) = tree else {
        told(&compile("a.scn", text.to_owned(), &[], &NoFiles))?;
        return Ok(Reached::Text);
    };
    same("print, parse, print", &tree, said(&tree).as_deref())?;
    let laid_out = formatted(text).ok_or("its syntax is right, and it is not laid out")?;
    same("what is laid out", &tree, said(&laid_out).as_deref())?;
    same("laid out twice", &laid_out, formatted(&laid_out).as_deref())?;
    let compilation = compile("a.scn", text.to_owned(), &[], &NoFiles);
    told(&compilation)?;
    let Some(plan) = &compilation.plan else { return Ok(Reached::Tree) };
    described(plan, &compilation)?;
    simulated(plan)
}

/// What a text says, printed; `None` if it has syntax errors.
fn said(text: &str) -> Option<String> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    let tree = parse(&sources, file, &mut problems);
    problems.is_empty().then(|| print::file(&tree))
}

fn formatted(text: &str) -> Option<String> {
    let (mut sources, mut problems) = (Sources::default(), Problems::default());
    let file = sources.add("a.scn", text.to_owned());
    format(&sources, file, &mut problems)
}

fn same(what: &str, first: &str, second: Option<&str>) -> Result<(), String> {
    match second {
        Some(second) if second == first => Ok(()),
        other => Err(format!("{what}: first\n{first}\nthen\n{}", other.unwrap_or("syntax errors"))),
    }
}

/// Without a Plan there is an error, with one there is none; each has a known code, a place and words.
fn told(compilation: &Compilation) -> Result<(), String> {
    let Compilation { problems, sources, plan, .. } = compilation;
    if plan.is_some() == problems.has_errors() {
        return Err(format!("a Plan: {}, errors: {}", plan.is_some(), problems.errors()));
    }
    for problem in problems.iter() {
        if problem.message.is_empty() || problem.span().is_none() || codes::find(problem.code.name).is_none()
        {
            return Err(format!("a problem without words, a place or a code: {problem:?}"));
        }
    }
    if !problems.is_empty() {
        render(problems, sources, Style::Plain);
        render_short(problems, sources);
        render_json(problems, sources);
    }
    Ok(())
}

fn described(plan: &Plan, compilation: &Compilation) -> Result<(), String> {
    let ron = plan.to_ron();
    let read = Plan::from_ron(&ron)?;
    same("a Plan, written and read", &ron, Some(&read.to_ron()))?;
    same("its meaning", &meaning_hash(plan), Some(&meaning_hash(&read)))?;
    describe::describe(&compilation.hir, &compilation.units);
    Ok(())
}

/// Three steps of training and of evaluation. A world may be refused, with words; it may not panic.
fn simulated(plan: &Plan) -> Result<Reached, String> {
    if plan.world.agents() > AGENTS {
        return Ok(Reached::Plan);
    }
    let task = match Task::new(plan, &plan.world) {
        Ok(task) => task,
        Err(refused) if !refused.to_string().is_empty() => return Ok(Reached::Plan),
        Err(_) => return Err("a world is refused without words".into()),
    };
    for mode in [Mode::Train, Mode::Evaluate] {
        let mut episode = task.episode();
        if task.reset(&mut episode, EpisodeKey::default()).is_err() {
            return Ok(Reached::Plan);
        }
        for k in 0..3 {
            let action: Vec<f32> = (0..task.action_len()).map(|at| ((at + k) % 3) as f32 - 1.0).collect();
            let step = task.step(&mut episode, &action, mode);
            if step.fault.is_none() && !step.reward.is_finite() {
                return Err(format!("a reward of {} and no fault", step.reward));
            }
            if step.fault.is_some() || step.ended.is_some() || step.last {
                break;
            }
        }
    }
    Ok(Reached::Steps)
}
