//! Where a drawn crowd walks: the paper's circle if the hall has room for it, else the hall's floor.

use std::sync::Arc;

use umbracast::geometry::DVec2;
use umbracast::{Error, Site};

use super::circle::circle_crossing;
use super::floor::{Floor, clearance_m};
use super::indoors;
use super::preset::Preset;
use super::trajectory::Crowd;

/// People start on the circle with noise, and pass outside of it to evade: so far beyond it nothing may stand.
const BEYOND_M: f64 = 1.0;
/// Of the disc round one person, with a hand's breadth to walk past things.
const ROOM_M: f32 = 0.4;

/// Where a drawn crowd walks.
#[derive(Debug, Clone)]
pub enum Ground {
    /// Across a circle with nothing in it.
    Circle {
        /// On which people start.
        radius_m: f64,
        /// In the site.
        middle_m: DVec2,
    },
    /// From place to place round what stands there.
    Floor(Arc<Floor>),
}

impl Ground {
    /// A circle round the origin.
    pub fn circle(radius_m: f64) -> Self {
        Self::Circle { radius_m, middle_m: DVec2::ZERO }
    }

    /// The circle round the hall's middle where it fits and the site names no entrances, else the hall's floor.
    ///
    /// # Errors
    /// A hall without free floor, an entrance or a place to stop that nobody can reach.
    pub fn of(site: &Site, radius_m: f64) -> Result<Self, Error> {
        let middle_m = site.hall.middle_m();
        let is_plain = site.simulation.entrances_m.is_empty() && site.simulation.places_m.is_empty();
        if is_plain && clearance_m(site, middle_m) >= radius_m + BEYOND_M {
            return Ok(Self::Circle { radius_m, middle_m });
        }
        Ok(Self::Floor(Arc::new(Floor::of(site, ROOM_M)?)))
    }

    /// Refuses a crowd that the floor has no room for.
    ///
    /// # Errors
    /// As said, with how many it has room for.
    pub fn hold(&self, people: usize) -> Result<(), Error> {
        let Self::Floor(floor) = self else { return Ok(()) };
        let most = floor.most_people();
        match people <= most {
            true => Ok(()),
            false => Err(Error::new(format!(
                "people: expected {most} at most, who can walk on the free floor of this hall, found {people}"
            ))),
        }
    }
}

/// A scene of people who cross the ground: on a circle see [`circle_crossing`]; on a floor everybody walks from place to
/// place, or from entrance to entrance, as the preset says.
pub fn drawn(preset: Preset, people: usize, ground: &Ground, seed: u64) -> Crowd {
    match ground {
        Ground::Circle { radius_m, middle_m } => {
            circle_crossing(preset, people, *radius_m, seed).moved(*middle_m)
        }
        Ground::Floor(floor) => indoors::crowd(preset, people, floor, seed).moved(floor.zero_m),
    }
}
