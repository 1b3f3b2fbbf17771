//! Fits all sensors at once: people seen by several, walls seen by one, each with its weight.
//!
//! The unknowns are each sensor's yaw, place and clock, and the offset of each surface of the hall from the site
//! file. Each sensor sees the near side of a body, and a small bias toward the sensor remains after detection. It is
//! not fitted. Two sensors that face one another cannot tell it from an error of their distance: the difference
//! between both is smaller than the change of the bias with range. The fit takes the bias as zero, and the standard
//! deviations include its possible effect.

use nalgebra::DMatrix;
use umbracast::geometry::{DVec2, DVec3};

use crate::hall::Outline;
use crate::normal::{Normal, robust};
use crate::people::{self, Sighting, Way};
use crate::plan::Plan;

/// Unknowns of a sensor: yaw, x, y, clock, bias.
pub const OF_SENSOR: usize = 5;
const YAW: usize = 0;
const X: usize = 1;
const Y: usize = 2;
const AHEAD: usize = 3;
const BIAS: usize = 4;

/// One standard deviation of what the detections leave of the one-sided view, metres: of simulated adults 3 mm, of a thick
/// coat more.
const BIAS_M: f64 = 0.01;
/// Of a clock that nothing is known of.
const CLOCK_S: f64 = 0.1;
/// Of a place and a yaw as somebody puts them into a site file: they hold the frame where nothing else does.
const FILE_M: f64 = 0.3;
const FILE_RAD: f64 = 0.087;
/// Of a surface against the site file, and of a return against its surface.
const SURFACE_M: f64 = 0.02;
const RETURN_M: f64 = 0.03;
/// A surface is even no better than that: more returns of it tell no more than so many.
const RETURNS_MAX: f64 = 40.0;
/// The share of a position's error that is not in the covariance of the detection: the two sensors see other sides of a
/// coat.
const COAT_M: f64 = 0.02;
/// People are one when they are this near, round after round, metres; the same for returns and surfaces.
const GATES_M: [f64; 8] = [1.0, 0.8, 0.6, 0.5, 0.5, 0.5, 0.5, 0.5];
/// Holds what nothing determines.
const OPEN: f64 = 1e-2;
const HELD: f64 = 1e4;

/// Where one sensor stands, as far as its people tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// From its level frame to the site's.
    pub site_from_level: Plan,
    /// Its clock before the first sensor's, seconds.
    pub ahead_s: f64,
}

/// What one sensor has seen.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// The people, in its level frame.
    pub ways: Vec<Way>,
    /// Points of upright surfaces that lie still, in its level frame.
    pub upright_m: Vec<DVec3>,
    /// Sensors that share people stand in one group.
    pub group: usize,
    /// Whether walls hold its group.
    pub by_walls: bool,
    /// Where the site file has it.
    pub guess: Plan,
}

/// What came out.
#[derive(Debug)]
pub struct Solution {
    /// By sensor.
    pub placed: Vec<Placed>,
    /// Of the unknowns, [`OF_SENSOR`] a sensor; given the frame where the site file gave it.
    pub covariance: DMatrix<f64>,
    /// Sightings by two sensors that were laid together.
    pub joint: usize,
    /// How far apart they lie, root mean square, metres.
    pub apart_m: f64,
}

/// Fits everything, from where the sensors stand about. `None` where numbers fail.
pub fn solve(seen: &[Seen], start: &[Placed], outline: &Outline) -> Option<Solution> {
    let mut placed = start.to_vec();
    let mut surfaces_m = vec![0.0; outline.len()];
    let unknowns = OF_SENSOR * seen.len() + surfaces_m.len();
    for gate_m in GATES_M {
        let mut normal = Normal::new(unknowns);
        people_rows(seen, &placed, gate_m, &mut normal);
        wall_rows(seen, &placed, outline, &surfaces_m, gate_m, &mut normal);
        prior_rows(seen, &placed, &surfaces_m, &mut normal);
        file_rows(seen, &placed, &mut normal);
        let step = normal.step()?;
        for (s, placed) in placed.iter_mut().enumerate() {
            let of = |k: usize| step[OF_SENSOR * s + k];
            placed.site_from_level.yaw_rad += of(YAW);
            placed.site_from_level.at_m += DVec2::new(of(X), of(Y));
            placed.ahead_s += of(AHEAD);
        }
        for (k, surface_m) in surfaces_m.iter_mut().enumerate() {
            *surface_m += step[OF_SENSOR * seen.len() + k];
        }
    }
    let mut normal = Normal::new(unknowns);
    let (joint, apart_m) = people_rows(seen, &placed, GATES_M[GATES_M.len() - 1], &mut normal);
    wall_rows(seen, &placed, outline, &surfaces_m, GATES_M[GATES_M.len() - 1], &mut normal);
    prior_rows(seen, &placed, &surfaces_m, &mut normal);
    held_rows(seen, &placed, &mut normal);
    Some(Solution { placed, covariance: normal.covariance()?, joint, apart_m })
}

/// Everybody whom two sensors see at once; gives how many and how far apart (root mean square).
fn people_rows(seen: &[Seen], placed: &[Placed], gate_m: f64, normal: &mut Normal) -> (usize, f64) {
    let (mut joint, mut squares_m2) = (0, 0.0);
    for (b, second) in seen.iter().enumerate() {
        for (a, first) in seen.iter().enumerate().take(b).filter(|(_, first)| first.group == second.group) {
            let later_ns = ((placed[a].ahead_s - placed[b].ahead_s) * 1e9).round() as i64;
            for (way_b, sighting) in
                second.ways.iter().enumerate().flat_map(|(w, way)| way.iter().map(move |s| (w, s)))
            {
                let at_b = Row::new(sighting, &placed[b]);
                let time_ns = sighting.time_ns + later_ns;
                let others = first.ways.iter().enumerate();
                let others =
                    others.filter_map(|(w, way)| Some((w, Row::new(&people::at(way, time_ns)?, &placed[a]))));
                let off_m = |row: &Row| row.at_m.distance(at_b.at_m);
                let Some((way_a, at_a)) = others.min_by(|x, y| off_m(&x.1).total_cmp(&off_m(&y.1))) else {
                    continue;
                };
                if off_m(&at_a) < gate_m {
                    joint += 1;
                    squares_m2 += off_m(&at_a).powi(2);
                    // The two sensors see other sides of a body as long as its way is straight: what is wrong with a walker is
                    // wrong with him until the end.
                    let group = [a, b, way_a, way_b];
                    same_person(a, &at_a, b, &at_b, group, normal);
                }
            }
        }
    }
    (joint, (squares_m2 / f64::from(u32::try_from(joint.max(1)).unwrap_or(u32::MAX))).sqrt())
}

/// A sighting in the site's frame with its derivatives.
struct Row {
    at_m: DVec2,
    by_yaw: DVec2,
    by_bias: DVec2,
    velocity_mps: DVec2,
    covariance_m2: [f64; 3],
}

impl Row {
    fn new(sighting: &Sighting, placed: &Placed) -> Self {
        let plan = &placed.site_from_level;
        let away = sighting.position_m.normalize_or_zero();
        let arm_m = plan.direction(sighting.position_m);
        let [[xx, xy], [_, yy]] = sighting.covariance_m2;
        let (sin, cos) = plan.yaw_rad.sin_cos();
        let covariance_m2 = [
            cos * cos * xx - 2.0 * sin * cos * xy + sin * sin * yy,
            sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy,
            sin * sin * xx + 2.0 * sin * cos * xy + cos * cos * yy,
        ];
        Self {
            at_m: arm_m + plan.at_m,
            by_yaw: arm_m.perp(),
            by_bias: plan.direction(away),
            velocity_mps: plan.direction(sighting.velocity_mps),
            covariance_m2,
        }
    }
}

fn same_person(a: usize, at_a: &Row, b: usize, at_b: &Row, group: [usize; 4], normal: &mut Normal) {
    let off_m = at_a.at_m - at_b.at_m;
    let [xx, xy, yy]: [f64; 3] = std::array::from_fn(|i| {
        at_a.covariance_m2[i] + at_b.covariance_m2[i] + if i == 1 { 0.0 } else { COAT_M * COAT_M }
    });
    // The Cholesky factor of the covariance turns both residuals into independent ones of unit variance.
    let l = xx.sqrt();
    let (m, n) = (xy / l, (yy - xy * xy / xx).max(1e-9).sqrt());
    let whitened = |v: DVec2| [v.x / l, (v.y - m * v.x / l) / n];
    let residuals = whitened(off_m);
    let weight = robust(residuals[0].powi(2) + residuals[1].powi(2));
    let slopes = [
        (OF_SENSOR * a + YAW, at_a.by_yaw),
        (OF_SENSOR * a + X, DVec2::X),
        (OF_SENSOR * a + Y, DVec2::Y),
        (OF_SENSOR * a + AHEAD, at_a.velocity_mps),
        (OF_SENSOR * a + BIAS, at_a.by_bias),
        (OF_SENSOR * b + YAW, -at_b.by_yaw),
        (OF_SENSOR * b + X, -DVec2::X),
        (OF_SENSOR * b + Y, -DVec2::Y),
        (OF_SENSOR * b + AHEAD, -at_a.velocity_mps),
        (OF_SENSOR * b + BIAS, -at_b.by_bias),
    ];
    for k in 0..2 {
        let of_axis = slopes.map(|(unknown, slope)| (unknown, whitened(slope)[k]));
        normal.add(residuals[k], &of_axis, weight, Some(group));
    }
}

/// Returns on the hall's surfaces, of the sensors whose group is held by walls.
fn wall_rows(
    seen: &[Seen],
    placed: &[Placed],
    outline: &Outline,
    surfaces_m: &[f64],
    gate_m: f64,
    normal: &mut Normal,
) {
    for (s, of) in seen.iter().enumerate().filter(|(_, of)| of.by_walls) {
        let plan = &placed[s].site_from_level;
        let feet = of.upright_m.iter().filter_map(|point| {
            let arm_m = plan.direction(point.truncate());
            let foot = outline.foot((arm_m + plan.at_m).extend(point.z))?;
            (foot.off_m.abs() < gate_m).then_some((arm_m, foot))
        });
        let feet: Vec<_> = feet.collect();
        let mut count = vec![0.0; surfaces_m.len()];
        feet.iter().for_each(|(_, foot)| count[foot.surface] += 1.0);
        for (arm_m, foot) in feet {
            let residual = (foot.off_m - surfaces_m[foot.surface]) / RETURN_M;
            let slopes = [
                (OF_SENSOR * s + YAW, foot.normal.dot(arm_m.perp()) / RETURN_M),
                (OF_SENSOR * s + X, foot.normal.x / RETURN_M),
                (OF_SENSOR * s + Y, foot.normal.y / RETURN_M),
                (OF_SENSOR * seen.len() + foot.surface, -1.0 / RETURN_M),
            ];
            let weight = robust(residual * residual) * (RETURNS_MAX / count[foot.surface]).min(1.0);
            normal.add(residual, &slopes, weight, None);
        }
    }
}

/// What is known before: clocks, biases, surfaces.
fn prior_rows(seen: &[Seen], placed: &[Placed], surfaces_m: &[f64], normal: &mut Normal) {
    for (s, placed) in placed.iter().enumerate() {
        let unknown = |k: usize| OF_SENSOR * s + k;
        let first = seen.iter().position(|other| other.group == seen[s].group) == Some(s);
        let clock_s = if first { 1.0 / HELD } else { CLOCK_S };
        normal.add(placed.ahead_s / clock_s, &[(unknown(AHEAD), 1.0 / clock_s)], 1.0, None);
        normal.consider(unknown(BIAS), BIAS_M);
        [YAW, X, Y].iter().for_each(|&k| normal.add(0.0, &[(unknown(k), OPEN)], 1.0, None));
    }
    for (k, surface_m) in surfaces_m.iter().enumerate() {
        normal.add(surface_m / SURFACE_M, &[(OF_SENSOR * seen.len() + k, 1.0 / SURFACE_M)], 1.0, None);
    }
}

/// Sensors that no walls hold stand, all together, as near as can be to where the site file has them.
fn file_rows(seen: &[Seen], placed: &[Placed], normal: &mut Normal) {
    for (s, (of, placed)) in seen.iter().zip(placed).enumerate().filter(|(_, (of, _))| !of.by_walls) {
        let (at, guess) = (&placed.site_from_level, &of.guess);
        let off_m = at.at_m - guess.at_m;
        let turned = crate::plan::wrapped(at.yaw_rad - guess.yaw_rad);
        for (k, off, sigma) in [(YAW, turned, FILE_RAD), (X, off_m.x, FILE_M), (Y, off_m.y, FILE_M)] {
            normal.add(off / sigma, &[(OF_SENSOR * s + k, 1.0 / sigma)], 1.0, None);
        }
    }
}

/// The same sensors with the frame taken as given: a group's middle and its turn as a whole.
fn held_rows(seen: &[Seen], placed: &[Placed], normal: &mut Normal) {
    for group in 0..seen.len() {
        let own = || (0..seen.len()).filter(|&s| seen[s].group == group && !seen[s].by_walls);
        let count = own().count() as f64;
        let middle_m = own().map(|s| placed[s].site_from_level.at_m).sum::<DVec2>() / count.max(1.0);
        let arm_m = FILE_M / FILE_RAD;
        let (mut along_x, mut along_y, mut turn) = (Vec::new(), Vec::new(), Vec::new());
        for s in own() {
            let off_m = placed[s].site_from_level.at_m - middle_m;
            along_x.push((OF_SENSOR * s + X, HELD / count));
            along_y.push((OF_SENSOR * s + Y, HELD / count));
            turn.extend([
                (OF_SENSOR * s + X, -off_m.y * HELD),
                (OF_SENSOR * s + Y, off_m.x * HELD),
                (OF_SENSOR * s + YAW, arm_m * arm_m * HELD),
            ]);
        }
        [along_x, along_y, turn].iter().for_each(|slopes| normal.add(0.0, slopes, 1.0, None));
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;
    use umbracast::Config;

    use super::*;

    /// Somebody's way of ten seconds as two sensors see it, the second with an error that stays: it sees another side of him.
    fn seen_twice(random: &mut Pcg64) -> [Way; 2] {
        let mut within = |most: f64| random.random_range(-most..most);
        let from_m = DVec2::new(within(8.0), within(8.0));
        let velocity_mps = 1.3 * DVec2::from_angle(within(std::f64::consts::PI));
        let stays_m = DVec2::new(within(0.1), within(0.1));
        let mut sighting = |k: i64, off_m: DVec2| Sighting {
            time_ns: k * 100_000_000,
            position_m: from_m
                + velocity_mps * 0.1 * k as f64
                + off_m
                + DVec2::new(within(0.01), within(0.01)),
            covariance_m2: [[4e-4, 0.0], [0.0, 4e-4]],
            velocity_mps,
        };
        [DVec2::ZERO, stays_m].map(|off_m| (0..100).map(|k| sighting(k, off_m)).collect())
    }

    #[test]
    fn clocks_that_agree_are_not_found_apart_by_a_walker_who_looks_otherwise_from_behind() {
        let outline = Outline::new(&Config::default().site);
        let mut random = Pcg64::seed_from_u64(5);
        let mut in_sigmas = Vec::new();
        for _ in 0..40 {
            let mut seen = vec![Seen::default(), Seen::default()];
            for _ in 0..12 {
                let ways = seen_twice(&mut random);
                seen.iter_mut().zip(ways).for_each(|(seen, way)| seen.ways.push(way));
            }
            let start = [Placed { site_from_level: Plan::default(), ahead_s: 0.0 }; 2];
            let found = solve(&seen, &start, &outline).expect("a fit with a solution");
            let at = OF_SENSOR + AHEAD;
            in_sigmas.push(found.placed[1].ahead_s / found.covariance[(at, at)].sqrt());
        }
        let spread = (in_sigmas.iter().map(|off| off * off).sum::<f64>() / in_sigmas.len() as f64).sqrt();
        let apart = in_sigmas.iter().filter(|off| off.abs() > 3.0).count();
        assert!(spread < 1.7 && apart <= 2, "{spread:.2} standard deviations, {apart} of 40 beyond 3");
    }
}
