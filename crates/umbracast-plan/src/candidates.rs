//! Where sensors and access points may hang: on the walls, and access points below the ceiling too.

use rand::{Rng, RngExt};
use umbracast::Site;
use umbracast::geometry::DVec2;
use umbracast::site::{AccessPoint, Sensor};

/// Places along the walls, at most.
const ON_WALLS: f64 = 64.0;
/// No two of them are nearer, metres.
const APART_M: f64 = 0.5;
/// From the wall to the device, metres.
const BEFORE_WALL_M: f64 = 0.3;
/// Tilts that are tried, degrees.
const PITCHES_DEG: [f64; 4] = [5.0, 15.0, 25.0, 35.0];
/// Access points hang so far below the ceiling, metres.
const BELOW_CEILING_M: f64 = 0.3;
/// Places below the ceiling along the longer side.
const BELOW_CEILING: f64 = 8.0;

/// A place at a wall: just before it, and the direction into the hall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AtWall {
    place_m: DVec2,
    inwards_deg: f64,
}

/// Evenly along all walls.
pub(crate) fn at_walls(site: &Site) -> Vec<AtWall> {
    let around_m: f64 = site.hall.walls().map(|[a, b]| a.distance(b)).sum();
    let apart_m = (around_m / ON_WALLS).max(APART_M);
    let count = (around_m / apart_m).floor().max(1.0) as usize;
    (0..count).filter_map(|i| at_wall(site, (i as f64 + 0.5) / count as f64)).collect()
}

/// The place at this share of the way round the hall, from 0 to 1; none where there is no room.
pub(crate) fn at_wall(site: &Site, share: f64) -> Option<AtWall> {
    let around_m: f64 = site.hall.walls().map(|[a, b]| a.distance(b)).sum();
    let mut left_m = share.rem_euclid(1.0) * around_m;
    for [a, b] in site.hall.walls() {
        let long_m = a.distance(b);
        if left_m <= long_m && long_m > 0.0 {
            let along = (b - a) / long_m;
            let inwards = along.perp(); // Corners go round counter-clockwise.
            let place_m = a + along * left_m + inwards * BEFORE_WALL_M;
            let inwards_deg = inwards.to_angle().to_degrees();
            return site.hall.contains(place_m).then_some(AtWall { place_m, inwards_deg });
        }
        left_m -= long_m;
    }
    None
}

/// Something that hangs somewhere, as good as its map of values.
pub(crate) trait Hangs: Clone + Send + Sync {
    /// All places that are tried.
    fn candidates(&self, site: &Site) -> Vec<Self>;
    /// A place drawn from all that a fitter could choose.
    fn random(&self, site: &Site, draws: &mut impl Rng) -> Self;
    /// The same a little elsewhere, `by` from 1 (a step between candidates) down; other ways of it by `way`.
    fn near(&self, site: &Site, way: usize, by: f64) -> Option<Self>;
    /// How many ways `near` knows.
    const WAYS: usize;
}

impl Hangs for Sensor {
    const WAYS: usize = 6;

    fn candidates(&self, site: &Site) -> Vec<Self> {
        let tilted = |at: AtWall| PITCHES_DEG.map(|pitch| hung(self, at.place_m, at.inwards_deg, pitch));
        at_walls(site).into_iter().flat_map(tilted).collect()
    }

    fn random(&self, site: &Site, draws: &mut impl Rng) -> Self {
        loop {
            if let Some(at) = at_wall(site, draws.random()) {
                let yaw = at.inwards_deg + draws.random_range(-60.0..60.0);
                return hung(self, at.place_m, yaw, draws.random_range(0.0..45.0));
            }
        }
    }

    fn near(&self, site: &Site, way: usize, by: f64) -> Option<Self> {
        let place_m = DVec2::new(self.position_m[0], self.position_m[1]);
        let (yaw, pitch) = (self.rotation_deg.yaw, self.rotation_deg.pitch);
        let aside = DVec2::from_angle(yaw.to_radians()).perp() * by;
        let moved = match way {
            0 => hung(self, place_m + aside, yaw, pitch),
            1 => hung(self, place_m - aside, yaw, pitch),
            2 => hung(self, place_m, yaw + 20.0 * by, pitch),
            3 => hung(self, place_m, yaw - 20.0 * by, pitch),
            4 => hung(self, place_m, yaw, (pitch + 6.0 * by).min(60.0)),
            _ => hung(self, place_m, yaw, (pitch - 6.0 * by).max(0.0)),
        };
        site.hall.contains(DVec2::new(moved.position_m[0], moved.position_m[1])).then_some(moved)
    }
}

impl Hangs for AccessPoint {
    const WAYS: usize = 4;

    fn candidates(&self, site: &Site) -> Vec<Self> {
        let [least_m, most_m] = site.hall.bounds_m();
        let apart_m = ((most_m - least_m).max_element() / BELOW_CEILING).max(1.0);
        let counts = ((most_m - least_m) / apart_m).floor().max(DVec2::ONE);
        let ceiling = (0..counts.y as usize)
            .flat_map(|j| (0..counts.x as usize).map(move |i| DVec2::new(i as f64, j as f64)));
        let ceiling = ceiling.map(|cell| least_m + (cell + 0.5) / counts * (most_m - least_m));
        let below = ceiling
            .filter(|&place_m| site.hall.contains(place_m))
            .map(|place_m| self.below_ceiling(site, place_m));
        let walls = at_walls(site).into_iter().map(|at| self.on_wall(at.place_m));
        walls.chain(below).collect()
    }

    fn random(&self, site: &Site, draws: &mut impl Rng) -> Self {
        let [least_m, most_m] = site.hall.bounds_m();
        loop {
            let is_below = draws.random_bool(0.5);
            let place_m = least_m + (most_m - least_m) * DVec2::new(draws.random(), draws.random());
            match at_wall(site, draws.random()) {
                Some(at) if !is_below => return self.on_wall(at.place_m),
                _ if is_below && site.hall.contains(place_m) => return self.below_ceiling(site, place_m),
                _ => {}
            }
        }
    }

    fn near(&self, site: &Site, way: usize, by: f64) -> Option<Self> {
        let step_m = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y][way % 4] * by;
        let [x, y, z] = self.position_m;
        let place_m = DVec2::new(x, y) + step_m;
        // What hangs on a wall stays there.
        let is_below = z >= site.hall.height_m - BELOW_CEILING_M - 1e-9;
        let clear_m = site.hall.clearance_m(place_m);
        let stays = is_below || (clear_m - BEFORE_WALL_M).abs() < 1e-6;
        (site.hall.contains(place_m) && stays)
            .then(|| Self { position_m: [rounded(place_m.x), rounded(place_m.y), z], ..self.clone() })
    }
}

/// How an access point may hang.
trait OnWallOrCeiling {
    fn on_wall(&self, place_m: DVec2) -> AccessPoint;
    fn below_ceiling(&self, site: &Site, place_m: DVec2) -> AccessPoint;
}

impl OnWallOrCeiling for AccessPoint {
    fn on_wall(&self, place_m: DVec2) -> AccessPoint {
        AccessPoint {
            position_m: [rounded(place_m.x), rounded(place_m.y), self.position_m[2]],
            ..self.clone()
        }
    }

    fn below_ceiling(&self, site: &Site, place_m: DVec2) -> AccessPoint {
        let z = rounded(site.hall.height_m - BELOW_CEILING_M);
        AccessPoint { position_m: [rounded(place_m.x), rounded(place_m.y), z], ..self.clone() }
    }
}

fn hung(like: &Sensor, place_m: DVec2, yaw: f64, pitch: f64) -> Sensor {
    let mut sensor = like.clone();
    sensor.position_m = [rounded(place_m.x), rounded(place_m.y), like.position_m[2]];
    sensor.rotation_deg.yaw = rounded((yaw + 180.0).rem_euclid(360.0) - 180.0);
    sensor.rotation_deg.pitch = rounded(pitch);
    sensor.rotation_deg.roll = 0.0;
    sensor
}

/// A centimetre, a hundredth of a degree: nobody hangs anything more exactly.
fn rounded(number: f64) -> f64 {
    (number * 100.0).round() / 100.0 + 0.0
}
