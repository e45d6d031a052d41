//! Every kind of problem the compiler knows.

use crate::problem::Code;

/// All codes, by name.
pub const ALL: &[&Code] = &[];

/// The code of a name.
pub fn find(name: &str) -> Option<&'static Code> {
    ALL.iter().find(|code| code.name == name).copied()
}
