//! How a command ends.

/// How a command that did not fail ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Everything was used.
    Done,
    /// What was looked at is wrong, as was said.
    Wrong,
    /// What was found may be wrong; says what.
    Doubtful(String),
    /// Something was lost or skipped; says what.
    DataLost(String),
}

impl Ending {
    /// Lost where one of the counts is more than nothing, or where the recorder says that it fails.
    pub fn of_losses(counts: &[(u64, &str)], failing: Option<&str>) -> Self {
        let lost =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
        let told: Vec<String> = lost.chain(failing.map(str::to_owned)).collect();
        if told.is_empty() { Self::Done } else { Self::DataLost(told.join("; ")) }
    }
}
