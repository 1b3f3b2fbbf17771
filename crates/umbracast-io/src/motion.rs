//! Motion captures in either of the formats that are read: BVH ([`crate::bvh`]) or rows of turns ([`crate::turns`]).

use std::path::Path;

use umbracast::Error;

use crate::bvh::{self, Motion};
use crate::turns;

/// Reads a file. What it holds tells the format: rows of turns begin with a number.
///
/// # Errors
/// A file that cannot be read, or that is wrong in its format, with its path.
pub fn read(path: &Path) -> Result<Motion, Error> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::new(e.to_string()).within(path.display()))?;
    parse(&text).map_err(|e| e.within(path.display()))
}

/// The same from text.
///
/// # Errors
/// As [`bvh::parse`] or [`turns::parse`].
pub fn parse(text: &str) -> Result<Motion, Error> {
    let begins_with_number = |c: char| c.is_ascii_digit() || c == '-' || c == '.';
    match text.trim_start().starts_with(begins_with_number) {
        true => turns::parse(text),
        false => bvh::parse(text),
    }
}
