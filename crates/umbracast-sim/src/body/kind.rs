//! Kinds of bodies.

use std::str::FromStr;

use umbracast::Error;

/// What sets a body apart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Kind {
    /// An adult with empty hands whose arms swing.
    #[default]
    Plain,
    /// A shoulder bag or a backpack.
    Bag,
    /// A telephone at one ear.
    Phone,
    /// Both hands in the pockets.
    Pockets,
    /// 3 to 12 years old.
    Child,
    /// Seated in a wheelchair.
    Wheelchair,
    /// An adult who moves as a motion capture does.
    CmuWalk,
    /// An adult who talks with both hands.
    Gesturing,
    /// An adult who sits down where he stays for long.
    Sitting,
    /// A rucksack on both shoulders; the arms swing.
    Rucksack,
    /// A bag in each hand.
    Bags,
    /// An open umbrella over the head.
    Umbrella,
    /// A telephone before the face, in both hands.
    Screen,
    /// A small child on one arm.
    Carrying,
    /// Pushes a pram.
    Pram,
    /// Pulls a suitcase behind.
    Trolley,
    /// Walks with a frame on wheels (rollator).
    Frame,
    /// Pushes somebody in a wheelchair: both are one body, which is as tall as who walks.
    Pushed,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Plain,
        Self::Bag,
        Self::Phone,
        Self::Pockets,
        Self::Child,
        Self::Wheelchair,
        Self::CmuWalk,
        Self::Gesturing,
        Self::Sitting,
        Self::Rucksack,
        Self::Bags,
        Self::Umbrella,
        Self::Screen,
        Self::Carrying,
        Self::Pram,
        Self::Trolley,
        Self::Frame,
        Self::Pushed,
    ];

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Bag => "bag",
            Self::Phone => "phone",
            Self::Pockets => "pockets",
            Self::Child => "child",
            Self::Wheelchair => "wheelchair",
            Self::CmuWalk => "cmu-walk",
            Self::Gesturing => "gesturing",
            Self::Sitting => "sitting",
            Self::Rucksack => "rucksack",
            Self::Bags => "bags",
            Self::Umbrella => "umbrella",
            Self::Screen => "screen",
            Self::Carrying => "carrying",
            Self::Pram => "pram",
            Self::Trolley => "trolley",
            Self::Frame => "frame",
            Self::Pushed => "pushed",
        }
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new(format!("kind of body: expected one of {names}, found {name:?}"))
        })
    }
}
