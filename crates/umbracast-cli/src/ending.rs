//! How a command ends.

/// How a command that did not fail ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Everything was used.
    Done,
    /// Something was lost or skipped; says what.
    DataLost(String),
}
