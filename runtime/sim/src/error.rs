//! What can be wrong with a Plan, as the simulator sees it. The compiler reports most of this earlier and
//! better; a Plan made by hand or damaged on disk meets it here.

use mpgx_lang::plan::Place;
use thiserror::Error;

/// Why a World cannot be simulated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SimError {
    #[error("{what} is {value}; it must be {must}{}", suffix(at))]
    OutOfRange { what: String, value: f64, must: &'static str, at: Place },

    #[error("{what}: the limits {low} and {high} must be finite, the lower one first{}", suffix(at))]
    BadRange { what: String, low: f64, high: f64, at: Place },

    #[error("there is no {kind} `{name}` in the simulator; it has {known}{}", suffix(at))]
    Unknown { kind: &'static str, name: String, known: String, at: Place },

    #[error("{owner} has no setting `{setting}`; it reads {known}{}", suffix(at))]
    UnknownSetting { owner: String, setting: String, known: String, at: Place },

    #[error("{owner} lacks the setting `{setting}`, {expected}{}", suffix(at))]
    MissingSetting { owner: String, setting: &'static str, expected: &'static str, at: Place },

    #[error("setting `{setting}` of {owner} must be {expected}{}", suffix(at))]
    BadSetting { owner: String, setting: &'static str, expected: &'static str, at: Place },

    #[error("{what}: {flaw}{}", suffix(at))]
    Expression { what: String, flaw: Flaw, at: Place },

    #[error("`{group}` has no start; give it `start ~ …` or a motion that tells positions{}", suffix(at))]
    NoStart { group: String, at: Place },

    #[error(
        "a motion that tells positions cannot move the body `{body}` of `{group}`; use one that tells velocities, or the body `point`{}",
        suffix(at)
    )]
    PositionsForBody { group: String, body: String, at: Place },

    #[error(
        "formation `{formation}` has {slots} slots, but its group `{group}` has {members} members{}",
        suffix(at)
    )]
    SlotsOfFormation { formation: String, slots: usize, group: String, members: usize, at: Place },

    #[error(
        "formation `{formation}` has {distances} distances for {edges} edges; it needs one, or one for each{}",
        suffix(at)
    )]
    DistancesOfFormation { formation: String, distances: usize, edges: usize, at: Place },

    #[error("formation `{formation}` refers to the {what} {id}, which does not exist{}", suffix(at))]
    BadFormation { formation: String, what: &'static str, id: usize, at: Place },

    #[error(
        "no start of `{group}` fulfilled requirement {requirement} in {attempts} attempts; give the starts more room or ask for less{}",
        suffix(at)
    )]
    StartsRejected { group: String, requirement: usize, attempts: u64, at: Place },

    #[error("parameter `{param}` was drawn as {value}; it must be a finite number{}", suffix(at))]
    DrawnNotFinite { param: String, value: f64, at: Place },

    #[error("`{group}` cannot have {what}{}", suffix(at))]
    BadGroup { group: String, what: String, at: Place },

    #[error("recorded path `{track}` {flaw}{}", suffix(at))]
    BadTrack { track: String, flaw: &'static str, at: Place },

    #[error("the start of {agent} is not a finite number{}", suffix(at))]
    StartNotFinite { agent: String, at: Place },

    #[error(
        "the controller `{controller}` steers to slots, but {agent} has no place in a formation{}",
        suffix(at)
    )]
    NoSlot { controller: String, agent: String, at: Place },

    #[error(
        "the controller `{controller}` steers by neighbours, but {agent} has none in a formation{}",
        suffix(at)
    )]
    NoNeighbour { controller: String, agent: String, at: Place },
}

/// What is wrong inside an expression.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Flaw {
    #[error("parameter {id} does not exist")]
    UnknownParam { id: usize },
    #[error("agent {id} does not exist")]
    UnknownAgent { id: usize },
    #[error("group {id} does not exist")]
    UnknownGroup { id: usize },
    #[error("formation {id} does not exist")]
    UnknownFormation { id: usize },
    #[error("state variable {id} does not exist here")]
    UnknownState { id: usize },
    #[error("index variable {id} is not bound here")]
    UnboundVariable { id: usize },
    #[error("a reduction binds {found} variables, but its index set has {expected}")]
    Binders { expected: usize, found: usize },
    #[error("{inner} cannot be the members of another set")]
    SetInSet { inner: &'static str },
    #[error("{agent} is no member of the formation's group")]
    NotInFormation { agent: String },
    #[error("places and distances of formations cannot be used inside a formation")]
    FormationInFormation,
    #[error("the places of a formation need an agent that they are about")]
    AboutNobody,
    #[error("formation `{formation}` tells distances, not places")]
    NoPlaces { formation: String },
    #[error("they are no neighbours in this formation, or not the two variables of its edges")]
    NoNeighbours,
    #[error("the edge {edge:?} is not between two of {nodes} nodes, which are numbered from 0")]
    UnknownNode { edge: (usize, usize), nodes: usize },
    #[error("a graph of {count} edges is too large; at most {most} are possible")]
    TooManyEdges { count: usize, most: usize },
    #[error("two obstacles have no clearance")]
    NoClearance,
    #[error("recorded path {id} does not exist")]
    UnknownTrack { id: usize },
    #[error("a list needs entries")]
    EmptyList,
    #[error("parameter `{param}` is not drawn yet")]
    NotYetDrawn { param: String },
    #[error("terms and measures are known only in tests")]
    OnlyInTests,
    #[error("there is no such term or end")]
    UnknownMeasure,
    #[error("{agent} is not commanded by the policy")]
    NotLearned { agent: String },
    #[error("the member's own quantities are known only in starts and motions")]
    NoMember,
    #[error("slot numbers are known only inside a formation")]
    NoSlotNumber,
    #[error("random draws are possible only in starts and motions")]
    NoDraw,
    #[error("a random argument cannot be used more than once in a reduction")]
    DrawInReduction,
    #[error("more than {most} random draws in one expression")]
    TooManyDraws { most: usize },
    #[error("{agent} is placed later than the start that refers to it")]
    NotYetPlaced { agent: String },
    #[error("expected {expected}, found {found}")]
    Kind { expected: &'static str, found: &'static str },
    #[error("{function} takes {expected} arguments, found {found}")]
    Arity { function: String, expected: usize, found: usize },
    #[error("more than {most} expressions inside each other")]
    TooDeep { most: usize },
    #[error("more than {most} index variables inside each other")]
    TooManyVariables { most: usize },
    #[error("a filter of an observation must not change during an episode")]
    ChangingFilter,
    #[error("every member needs as many entries, but {found}; leave out the filter or change it")]
    UnequalStates { found: String },
    #[error("a delay of {delay} steps is too long for so many entries")]
    TooLate { delay: usize },
    #[error("it must be a finite number, not negative, but is {value}")]
    Negative { value: f64 },
}

/// ` (file:line:column)`, nothing where the place is unknown.
fn suffix(at: &Place) -> String {
    if at.file.is_empty() { String::new() } else { format!(" ({}:{}:{})", at.file, at.line, at.column) }
}
