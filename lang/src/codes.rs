//! Every kind of problem the compiler knows.

use crate::parse;
use crate::problem::Code;

/// All codes.
pub const ALL: &[&Code] = &[
    &parse::CHAINED_COMPARISON,
    &parse::FILE_TOO_LARGE,
    &parse::FORBIDDEN_CHARACTER,
    &parse::FUNCTION_BODY,
    &parse::MISPLACED_DOC_COMMENT,
    &parse::MISSING_SEPARATOR,
    &parse::NESTED_TOO_DEEPLY,
    &parse::NUMBER_TOO_LARGE,
    &parse::RESERVED_WORD,
    &parse::SYNTAX,
    &parse::TOO_COMPLEX,
    &parse::UNBALANCED_BRACKETS,
    &parse::UNKNOWN_ITEM,
];

/// The code of a name.
pub fn find(name: &str) -> Option<&'static Code> {
    ALL.iter().find(|code| code.name == name).copied()
}
