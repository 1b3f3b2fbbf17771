//! The named crowds.

use std::str::FromStr;

use umbracast::Error;

/// The crowds that can be asked for by name: the ORCA crowd's parameter sets, named by their radius, and ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// Radius 0.3 m.
    Orca03,
    /// Radius 0.6 m.
    Orca06,
    /// Speeds, starts, stops, turns and groups.
    Mixed,
    /// The same, and nobody's way is straight and even: people wander, slow down and stop as recorded ones do.
    Natural,
    /// The walks of a mixed crowd, everybody in a pair whose body axes are 0.5 m apart; an odd number is rounded up.
    Pairs,
}

impl Preset {
    /// All of them, in the order of every table.
    pub const ALL: [Self; 5] = [Self::Orca03, Self::Orca06, Self::Mixed, Self::Natural, Self::Pairs];

    /// As it is written on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Orca03 => "orca-03",
            Self::Orca06 => "orca-06",
            Self::Mixed => "mixed",
            Self::Natural => "natural",
            Self::Pairs => "pairs",
        }
    }
}

impl FromStr for Preset {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::new(format!("preset: expected one of {known}, found {name:?}"))
        })
    }
}
