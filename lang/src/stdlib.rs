//! The standard library, embedded.

/// Modules by the path that `use` names, with their text.
pub const MODULES: &[(&str, &str)] = &[
    ("std.control", include_str!("../../stdlib/control.scn")),
    ("std.formation", include_str!("../../stdlib/formation.scn")),
    ("std.learn", include_str!("../../stdlib/learn.scn")),
    ("std.motion", include_str!("../../stdlib/motion.scn")),
    ("std.prelude", include_str!("../../stdlib/prelude.scn")),
    ("std.reward", include_str!("../../stdlib/reward.scn")),
    ("std.start", include_str!("../../stdlib/start.scn")),
];

/// Modules that every file sees without `use`.
pub const PRELUDE: &[&str] = &["std.prelude", "std.learn", "std.control"];

/// The text of a module.
pub fn module(path: &str) -> Option<&'static str> {
    MODULES.iter().find(|(name, _)| *name == path).map(|(_, text)| *text)
}
