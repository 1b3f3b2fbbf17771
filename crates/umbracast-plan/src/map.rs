//! What a site's sensors see and which links are blocked, cell by cell.

use rayon::prelude::*;
use serde::Serialize;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::{AccessPoint, Sensor};
use umbracast::{Error, Site};

use crate::crowd::Crowd;
use crate::floor::Floor;
use crate::{SEEN_RETURNS, rays};

/// Where on a body a sensor must look to see a person: above the hips, whatever stands before the legs.
const LOOKED_AT: f64 = 0.7;

/// Maps of a floor, by y, then by x.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// The cells.
    pub floor: Floor,
    /// People on a square metre.
    pub density_per_m2: f64,
    /// Points on a person alone in one revolution, all sensors; -1 where nobody can stand.
    pub returns: Vec<f32>,
    /// Sensors that get enough of them each.
    pub sensors_seeing: Vec<u8>,
    /// Share of time in which some sensor sees a person there, whoever stands between them.
    pub seen: Vec<f32>,
    /// For each access point, the share of time in which the link to it is blocked by others or the hall.
    pub blocked: Vec<Vec<f32>>,
    /// Share of time in which all links are.
    pub all_blocked: Vec<f32>,
    /// Means over the floor: seen alone by one sensor or more, `seen`, `all_blocked`.
    pub means: [f64; 3],
    /// The mean of each access point's map.
    pub blocked_means: Vec<f64>,
}

/// Computes all maps, sensors and access points each on a thread.
///
/// # Errors
/// A hall without a floor, a sensor whose beams nobody knows.
pub fn map(site: &Site, people: f64, height_m: f64, step_m: Option<f64>) -> Result<Map, Error> {
    let floor = Floor::of(site, step_m)?;
    let crowd = Crowd { density_per_m2: people / floor.area_m2(), height_m };
    let of_sensors: Vec<(Vec<f32>, Vec<f32>)> = site
        .sensors
        .par_iter()
        .map(|sensor| {
            let returns = rays::returns(site, sensor, &floor, height_m, None)?;
            let sees = sees(site, sensor, &floor, &crowd, &returns);
            Ok((returns, sees))
        })
        .collect::<Result<_, Error>>()?;
    let blocked: Vec<Vec<f32>> =
        site.access_points.par_iter().map(|ap| blocked(site, ap, &floor, &crowd)).collect();
    let cells = 0..floor.open.len();
    let sum = |cell: usize| of_sensors.iter().map(|(returns, _)| returns[cell]).sum::<f32>();
    let returns = cells.clone().map(|cell| if floor.open[cell] { sum(cell) } else { -1.0 }).collect();
    let seeing = |cell: usize| {
        of_sensors.iter().filter(|(returns, _)| f64::from(returns[cell]) >= SEEN_RETURNS).count()
    };
    let sensors_seeing: Vec<u8> = cells.clone().map(|cell| seeing(cell).min(255) as u8).collect();
    let unseen = |cell: usize| of_sensors.iter().map(|(_, sees)| 1.0 - sees[cell]).product::<f32>();
    let seen: Vec<f32> = cells.clone().map(|cell| 1.0 - unseen(cell)).collect();
    let all = |cell: usize| blocked.iter().map(|blocked| blocked[cell]).product::<f32>();
    let all_blocked: Vec<f32> = cells.map(all).collect();
    let means = [
        floor.mean(|cell| f64::from(u8::from(sensors_seeing[cell] > 0))),
        floor.mean(|cell| f64::from(seen[cell])),
        floor.mean(|cell| f64::from(all_blocked[cell])),
    ];
    let blocked_means = blocked.iter().map(|blocked| floor.mean(|cell| f64::from(blocked[cell]))).collect();
    let density_per_m2 = crowd.density_per_m2;
    Ok(Map {
        floor,
        density_per_m2,
        returns,
        sensors_seeing,
        seen,
        blocked,
        all_blocked,
        means,
        blocked_means,
    })
}

/// Share of time in which this sensor sees a person in each cell.
pub(crate) fn sees(site: &Site, sensor: &Sensor, floor: &Floor, crowd: &Crowd, returns: &[f32]) -> Vec<f32> {
    let eye_m = DVec3::from_array(sensor.position_m);
    let of = |cell: usize| {
        if f64::from(returns[cell]) < SEEN_RETURNS {
            return 0.0;
        }
        let place_m = floor.place_m(cell);
        let floor_m = site.hall.floor_m(place_m);
        crowd.free(eye_m, place_m.extend(floor_m + LOOKED_AT * crowd.height_m), floor_m) as f32
    };
    (0..floor.open.len()).map(of).collect()
}

/// Share of time in which the link of somebody in each cell to this access point is blocked.
pub(crate) fn blocked(site: &Site, access_point: &AccessPoint, floor: &Floor, crowd: &Crowd) -> Vec<f32> {
    let from_m = access_point.position();
    let of = |cell: usize| {
        if !floor.open[cell] {
            return 1.0;
        }
        let place_m: DVec2 = floor.place_m(cell);
        let floor_m = site.hall.floor_m(place_m);
        let ue_m = place_m.extend(floor_m + site.ue.height_share * crowd.height_m);
        match cut(site, from_m, ue_m) {
            true => 1.0,
            false => 1.0 - crowd.free(from_m, ue_m, floor_m) as f32,
        }
    };
    (0..floor.open.len()).map(of).collect()
}

/// Whether pillars, furniture or an inner wall cut a link.
fn cut(site: &Site, from_m: DVec3, to_m: DVec3) -> bool {
    let way = to_m - from_m;
    let far_m = way.length();
    // The last millimetre does not count: who leans at a wall is not behind it.
    rays::hits_at(site, from_m, way / far_m, far_m - 1e-3) < far_m - 2e-3
}
