//! How a command ends.

/// How a command that did not fail ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Everything was used.
    Done,
    /// What was looked at is wrong, as was said.
    Wrong,
    /// Something was lost or skipped; says what.
    DataLost(String),
}
