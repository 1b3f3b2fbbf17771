//! What a site's sensors see of a standing person at each place, and which links the hall itself blocks. A planner
//! needs this before anybody walks.
//!
//! The sensors are the simulator's own, so the figures are the means over noise of `people.returns` in a scene.

mod summary;
mod picture;
mod columns;

use rayon::prelude::*;
use std::f64::consts::TAU;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::{Error, Site};
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::Trajectory;
use umbracast_sim::sensor::{Seen, Sensors, Survey};
use umbracast_sim::truth::fixtures;

pub use columns::columns;
pub use picture::svg;
pub use summary::{Region, Row, Summary, summary};

/// With fewer returns a person is missed more often than not (tables of recall by returns).
pub const SEEN_RETURNS: f64 = 6.0;
/// The detector of the paper's authors asks for so many.
pub const WELL_SEEN_RETURNS: f64 = 16.0;
/// Nobody's body axis comes nearer to a wall, a pillar or a piece of furniture: half a body's width.
const ELBOW_ROOM_M: f64 = 0.25;
/// Places of a survey: more would take hours.
const MOST_PLACES: f64 = 250_000.0;

/// How the floor is surveyed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// From place to place, metres.
    pub step_m: f64,
    /// Standing height of the body, metres.
    pub height_m: f64,
    /// Evenly spread headings, each with a build of its own; counts are means over them.
    pub headings: usize,
}

/// Where a person may stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Of the body axis.
    pub position_m: DVec2,
    /// Points on the body in one revolution, one a sensor of the site.
    pub returns: Vec<f64>,
    /// Heights above the floor of the lowest and the highest point, metres; `None` without any.
    pub span_m: Option<(f64, f64)>,
    /// Does the hall or its furniture cut the link to the UE, at some heading at least? One an access point.
    pub static_blocked: Vec<bool>,
}

/// A surveyed floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// How it was surveyed.
    pub options: Options,
    /// By y, then by x. Places in pillars and furniture are left out.
    pub places: Vec<Place>,
}

impl Place {
    /// Of all sensors.
    pub fn all_returns(&self) -> f64 {
        self.returns.iter().sum()
    }

    /// Sensors that see the person by themselves.
    pub fn sensors_seeing(&self) -> usize {
        self.returns.iter().filter(|&&returns| returns >= SEEN_RETURNS).count()
    }
}

/// Puts a body on every place of the floor. Places are multiples of the step.
///
/// # Errors
/// A step, height or number of headings that cannot be, a site without sensors or floor, a sensor that cannot be
/// simulated.
pub fn survey(site: &Site, options: Options) -> Result<Coverage, Error> {
    let [least_m, most_m] = site.hall.bounds_m();
    let (least_m, most_m) = (least_m + ELBOW_ROOM_M, most_m - ELBOW_ROOM_M);
    check(site, &options, most_m - least_m)?;
    let survey = Survey::new(site, &Sensors::new(site, 0)?);
    let bodies: Vec<(Walker, f64)> = (0..options.headings)
        .map(|i| {
            let heading_rad = i as f64 / options.headings as f64 * TAU;
            (standing(options.height_m, i as u64), heading_rad)
        })
        .collect();
    let least = (least_m / options.step_m).ceil().as_i64vec2();
    let most = (most_m / options.step_m).floor().as_i64vec2();
    let positions: Vec<DVec2> = (least.y..=most.y)
        .flat_map(|j| (least.x..=most.x).map(move |i| DVec2::new(i as f64, j as f64) * options.step_m))
        .filter(|&position_m| is_floor(site, position_m))
        .collect();
    let look = |survey: &mut Survey, position_m| look(site, survey, &bodies, position_m);
    let places: Vec<Place> = positions.into_par_iter().map_init(|| survey.clone(), look).collect();
    Ok(Coverage { options, places })
}

fn check(site: &Site, options: &Options, floor_m: DVec2) -> Result<(), Error> {
    let Options { step_m, height_m, headings } = *options;
    let expected = |what: &str, found: &dyn std::fmt::Display| {
        Err(Error::new(format!("{what}, found {found}")).within(format!("site {:?}", site.name)))
    };
    if site.sensors.is_empty() {
        return expected("site.sensors: expected one or more", &"none");
    }
    if !(floor_m.min_element() >= 0.0 && floor_m.is_finite()) {
        let DVec2 { x, y } = floor_m + 2.0 * ELBOW_ROOM_M;
        let found = format!("{x} x {y} m");
        return expected("site.hall: expected a floor for a person to stand on", &found);
    }
    let places = floor_m.x * floor_m.y / (step_m * step_m);
    if !(step_m > 0.0 && places <= MOST_PLACES) {
        return expected("step: expected more than 0 m and at most 250000 places on the floor", &step_m);
    }
    if !(0.5..=2.5).contains(&height_m) {
        return expected("height: expected 0.5 to 2.5 m", &height_m);
    }
    if !(1..=64).contains(&headings) {
        return expected("headings: expected 1 to 64", &headings);
    }
    Ok(())
}

/// A body at the origin that looks along x.
fn standing(height_m: f64, seed: u64) -> Walker {
    let trajectory = Trajectory {
        person: 0,
        start_ns: 0,
        step_ns: 10_000_000,
        positions_m: vec![DVec2::ZERO; 21],
        arrived_ns: None,
        height_m: Some(height_m),
    };
    Walker::new(trajectory, seed)
}

/// Within the walls and outside of every pillar and piece of furniture, with room for the elbows.
fn is_floor(site: &Site, position_m: DVec2) -> bool {
    let in_hall = site.hall.clearance_m(position_m) >= ELBOW_ROOM_M;
    let in_pillar = site.pillars.iter().any(|pillar| {
        position_m.distance(DVec2::from_array(pillar.position_m)) < pillar.radius_m + ELBOW_ROOM_M
    });
    let in_furniture = site.furniture.iter().any(|item| {
        let offset_m = position_m - DVec2::from_array(item.position_m);
        let own_m = DVec2::from_angle(-item.yaw_deg.to_radians()).rotate(offset_m);
        let half_m = DVec3::from_array(item.size_m).truncate() * 0.5;
        (own_m.abs() - half_m).max(DVec2::ZERO).length() < ELBOW_ROOM_M
    });
    in_hall && !in_pillar && !in_furniture
}

fn look(site: &Site, survey: &mut Survey, bodies: &[(Walker, f64)], position_m: DVec2) -> Place {
    let mut place = Place {
        position_m,
        returns: vec![0.0; site.sensors.len()],
        span_m: None,
        static_blocked: vec![false; site.access_points.len()],
    };
    for (body, heading_rad) in bodies {
        let seen: Vec<Seen> = survey.see(body, position_m, *heading_rad);
        for (sum, seen) in place.returns.iter_mut().zip(&seen) {
            *sum += seen.returns / bodies.len() as f64;
            if let Some((low_m, high_m)) = seen.span_m {
                let (lowest_m, highest_m) = place.span_m.unwrap_or((low_m, high_m));
                place.span_m = Some((lowest_m.min(low_m), highest_m.max(high_m)));
            }
        }
        let ue_m = site.ue_m(position_m, *heading_rad, body.build.height_m());
        for (blocked, access_point) in place.static_blocked.iter_mut().zip(&site.access_points) {
            *blocked |= fixtures::block(site, access_point.position(), ue_m);
        }
    }
    place
}

#[cfg(test)]
mod tests;
