//! What names can stand for.

use crate::ast::{ExternKind, Item, Name};

/// Names of different spaces do not clash: the place of use tells which is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Space {
    /// What stands in expressions: parameters, lets, functions, groups, formations.
    Value,
    Motion,
    Shape,
    Algorithm,
    Controller,
    Body,
    Solid,
    Filter,
    Room,
    Lighting,
    Camera,
    Odometry,
    /// What landmarks look like.
    LandmarkKind,
    /// What localisers are.
    LocaliserKind,
    Localiser,
    Preset,
    Protocol,
    Stage,
    Variant,
    Unit,
    Dimension,
}

impl Space {
    /// Of the names of a kind of `extern`.
    pub fn of(kind: ExternKind) -> Space {
        match kind {
            ExternKind::Algorithm => Space::Algorithm,
            ExternKind::Controller => Space::Controller,
            ExternKind::Body => Space::Body,
            ExternKind::Solid => Space::Solid,
            ExternKind::Filter => Space::Filter,
            ExternKind::Room => Space::Room,
            ExternKind::Lighting => Space::Lighting,
            ExternKind::Camera => Space::Camera,
            ExternKind::Odometry => Space::Odometry,
            ExternKind::Landmark => Space::LandmarkKind,
            ExternKind::Localiser => Space::LocaliserKind,
        }
    }

    /// With its article.
    pub fn people(self) -> &'static str {
        match self {
            Space::Value => "a value",
            Space::Motion => "a motion",
            Space::Shape => "a formation shape",
            Space::Algorithm => "a learning algorithm",
            Space::Controller => "a controller",
            Space::Body => "a body",
            Space::Solid => "an outline of obstacles",
            Space::Filter => "a safety filter",
            Space::Room => "a room",
            Space::Lighting => "a lighting",
            Space::Camera => "a camera",
            Space::Odometry => "a kind of odometry",
            Space::LandmarkKind => "a kind of landmark",
            Space::LocaliserKind => "a kind of localiser",
            Space::Localiser => "a localiser",
            Space::Preset => "a preset",
            Space::Protocol => "an evaluation",
            Space::Stage => "a stage",
            Space::Variant => "a variant",
            Space::Unit => "a unit",
            Space::Dimension => "a dimension",
        }
    }

    pub const ALL: [Space; 21] = [
        Space::Value,
        Space::Motion,
        Space::Shape,
        Space::Algorithm,
        Space::Controller,
        Space::Body,
        Space::Solid,
        Space::Filter,
        Space::Room,
        Space::Lighting,
        Space::Camera,
        Space::Odometry,
        Space::LandmarkKind,
        Space::LocaliserKind,
        Space::Localiser,
        Space::Preset,
        Space::Protocol,
        Space::Stage,
        Space::Variant,
        Space::Unit,
        Space::Dimension,
    ];
}

/// Words with a meaning of their own in expressions.
pub const BUILT_IN: [&str; 15] = [
    "p",
    "v",
    "heading",
    "u",
    "du",
    "world",
    "t",
    "all",
    "obstacles",
    "pairs",
    "edges",
    "members",
    "nearest",
    "box",
    "size",
];

/// The name that an item declares.
pub fn declared(item: &Item) -> Option<(Space, &Name)> {
    Some(match item {
        Item::Dimension { name, .. } => (Space::Dimension, name),
        Item::Unit { name, .. } => (Space::Unit, name),
        Item::Param(param) => (Space::Value, &param.name),
        Item::Let(decl) => (Space::Value, &decl.name),
        Item::Function(decl) => (Space::Value, &decl.name),
        Item::Agents(decl) => (Space::Value, &decl.name),
        Item::Obstacles(decl) | Item::Landmarks(decl) => (Space::Value, &decl.name),
        Item::Formation(decl) => (Space::Value, &decl.name),
        Item::Recording { name, .. } => (Space::Value, name),
        Item::Motion(decl) => (Space::Motion, &decl.name),
        Item::Shape(decl) => (Space::Shape, &decl.name),
        Item::Extern(decl) => (Space::of(decl.kind), &decl.name),
        Item::Localiser { name, .. } => (Space::Localiser, name),
        Item::Preset { name, .. } => (Space::Preset, name),
        Item::Evaluate { name, .. } => (Space::Protocol, name),
        Item::Stage(decl) => (Space::Stage, &decl.name),
        Item::Variant { name, .. } => (Space::Variant, name),
        _ => return None,
    })
}
