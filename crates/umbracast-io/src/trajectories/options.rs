//! What a file of recorded people may leave open.

use umbracast::Error;

/// Unit of length of a PeTrack file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metre,
    /// Centimetres.
    Centimetre,
}

impl Unit {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
        }
    }
}

/// What a file may leave open. What is given here goes before what the file says.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Options {
    /// Frames per second of one frame number (TrajNet++: of a person's rows).
    pub fps: Option<f64>,
    /// Of x, y and z in PeTrack text; metres if nobody says.
    pub unit: Option<Unit>,
}

impl Unit {
    pub(super) fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
        }
    }
}

impl std::str::FromStr for Unit {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        match name {
            "m" => Ok(Self::Metre),
            "cm" => Ok(Self::Centimetre),
            _ => Err(Error::new(format!("unit: expected m or cm, found {name:?}"))),
        }
    }
}
