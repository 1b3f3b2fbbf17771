//! The roles of nodes, by name.

use serde::{Deserialize, Serialize};
use umbracast::Error;

/// A node's work. A process may do several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Stage 1 up to the foreground, beside the sensors.
    Sensor,
    /// The rest of stage 1: joins the front ends, follows people.
    Track,
    /// Stage 2.
    Forecast,
    /// Stage 3: links and warnings.
    Cast,
    /// Writes recordings.
    Record,
    /// Serves the page and its interface.
    Serve,
    /// Looks at everything, writes nothing.
    Display,
    /// A radio controller: reads warnings and links.
    Controller,
    /// Passes on between those who do not meet: the door of a site.
    Router,
}

impl Role {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Sensor,
        Self::Track,
        Self::Forecast,
        Self::Cast,
        Self::Record,
        Self::Serve,
        Self::Display,
        Self::Controller,
        Self::Router,
    ];

    /// Its name in keys, files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Track => "track",
            Self::Forecast => "forecast",
            Self::Cast => "cast",
            Self::Record => "record",
            Self::Serve => "serve",
            Self::Display => "display",
            Self::Controller => "controller",
            Self::Router => "router",
        }
    }
}

impl std::str::FromStr for Role {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|role| role.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::new(format!("expected one of {names}, found {name:?}"))
        })
    }
}
