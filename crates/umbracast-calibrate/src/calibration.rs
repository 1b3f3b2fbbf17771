//! From what every sensor has seen to where it hangs, and how well that is known.

use serde::Serialize;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::{Rotation, Sensor};
use umbracast::{Error, Site};

use crate::floor::Level;
use crate::hall::Outline;
use crate::joint::{self, OF_SENSOR, Placed, Seen};
use crate::misfit::{self, Misfit};
use crate::plan::{Plan, wrapped};
use crate::{gauge, matching};

/// A clock is taken for apart from the first by so many of its standard deviations; below that it stays as given.
const CLOCK_TELLS: f64 = 3.0;
/// A turn counts at this arm, and a clock at this pace, where directions of error are compared.
const ARM_M: f64 = 10.0;
const PACE_MPS: f64 = 1.3;
/// So many of the weakest directions are named, with the unknowns that have this share of them.
const NAMED: usize = 3;
const NAMED_SHARE: f64 = 0.3;

/// Where all sensors hang.
#[derive(Debug, Clone, Serialize)]
pub struct Calibration {
    /// In the site's order.
    pub sensors: Vec<Found>,
    /// Sightings of a person by two sensors at once.
    pub joint_sightings: usize,
    /// How far apart two sensors see a person, root mean square, metres.
    pub apart_m: f64,
    /// In which directions the least is known, worst first.
    pub weak: Vec<Weak>,
    /// What was found and what was not, for a reader.
    pub told: Vec<String>,
    /// What may be wrong, and wants a look before the poses are used.
    pub doubts: Vec<String>,
    /// What each sensor has seen, in its level frame.
    #[serde(skip)]
    pub seen: Vec<Seen>,
}

/// One sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// Its name.
    pub sensor: String,
    /// Where it hangs.
    pub position_m: [f64; 3],
    /// How it is turned.
    pub rotation_deg: Rotation,
    /// Its times before the first sensor's.
    pub clock_offset_ms: f64,
    /// One standard deviation of each number; none of what stays as the site file says.
    pub sigma: Sigma,
    /// What holds yaw and place in plan view, all sensors together.
    pub frame: Frame,
    /// Sensors that saw the same people.
    pub with: Vec<String>,
    /// People that it saw.
    pub people: usize,
    /// Against the site file: turned by, and moved by.
    pub turned_deg: f64,
    /// Against the site file, metres.
    pub moved_m: f64,
}

/// Standard deviations.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Sigma {
    /// Metres, given the frame.
    pub x_m: Option<f64>,
    /// Metres, given the frame.
    pub y_m: Option<f64>,
    /// Metres over the floor.
    pub z_m: Option<f64>,
    /// Degrees, given the frame.
    pub yaw_deg: Option<f64>,
    /// Degrees against the floor.
    pub pitch_deg: Option<f64>,
    /// Degrees against the floor.
    pub roll_deg: Option<f64>,
    /// Against the first sensor that saw the same people.
    pub clock_ms: Option<f64>,
}

/// What holds sensors in the site's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// Walls, pillars and furniture of the site file.
    Walls,
    /// The poses in the site file, by least squares over the sensors that saw the same people.
    SiteFile,
}

/// A direction of which little is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Weak {
    /// One standard deviation along it, metres; a turn counts at 10 m, a clock at 1.3 m/s.
    pub sigma_m: f64,
    /// What it is made of: `yaw of lidar_west`, with its share.
    pub of: Vec<(String, f64)>,
}

/// How the site file has a sensor in plan view.
pub fn plan_of(sensor: &Sensor) -> Plan {
    let [x, y, _] = sensor.position_m;
    Plan { yaw_rad: sensor.rotation_deg.yaw.to_radians(), at_m: DVec2::new(x, y) }
}

/// Matches, fits, and says how well.
///
/// # Errors
/// A fit without a solution.
pub fn fit(
    site: &Site,
    outline: &Outline,
    levels: &[(Option<Level>, Level)],
    mut seen: Vec<Seen>,
) -> Result<Calibration, Error> {
    let (mut told, mut doubts) = (Vec::new(), Vec::new());
    let (start, links) = linked(site, &mut seen, &mut told);
    let no_solution = || Error::new("calibrate: expected a fit with a solution, found none");
    let by_people = joint::solve(&seen, &start, outline).ok_or_else(no_solution)?;
    let mut wrong = Vec::new();
    let placed = on_walls(site, outline, &mut seen, by_people.placed, &mut wrong, &mut told);
    doubts.extend(wrong.iter().map(|(sensors, misfit)| named(outline, sensors, misfit)));
    let walls: Vec<usize> = wrong.iter().map(|(_, misfit)| misfit.wall).collect();
    let solution = joint::solve(&seen, &placed, &outline.without(&walls)).ok_or_else(no_solution)?;
    let found = |(s, sensor): (usize, &Sensor)| {
        let is_linked = links.iter().any(|&(a, b)| a == s || b == s);
        let (floor, level) = levels[s];
        let sigma = |k: usize| solution.covariance[(OF_SENSOR * s + k, OF_SENSOR * s + k)].sqrt();
        let in_plan = |k: usize| (is_linked || seen[s].by_walls).then(|| sigma(k));
        let by_floor = |k: usize| floor.map(|floor| floor.sigma[k]);
        let at_place = hung(sensor, &solution.placed[s], &level);
        let ahead_ms = at_place.clock_offset_ms - sensor.clock_offset_ms;
        let clock_tells = ahead_ms.abs() > CLOCK_TELLS * 1e3 * sigma(3);
        let mine = Found {
            sensor: sensor.name.clone(),
            clock_offset_ms: if clock_tells { at_place.clock_offset_ms } else { sensor.clock_offset_ms },
            sigma: Sigma {
                x_m: in_plan(1),
                y_m: in_plan(2),
                z_m: by_floor(0),
                yaw_deg: in_plan(0).map(f64::to_degrees),
                pitch_deg: by_floor(1).map(f64::to_degrees),
                roll_deg: by_floor(2).map(f64::to_degrees),
                clock_ms: is_linked.then(|| 1e3 * sigma(3)),
            },
            frame: if seen[s].by_walls { Frame::Walls } else { Frame::SiteFile },
            with: (links.iter().filter(|(a, b)| *a == s || *b == s))
                .map(|&(a, b)| site.sensors[a + b - s].name.clone())
                .collect(),
            people: seen[s].ways.len(),
            ..at_place
        };
        if floor.is_none() {
            doubts.push(format!("{}: no floor was seen; height, pitch and roll stay as given", sensor.name));
        }
        if level.far_from_file {
            doubts.push(format!(
                "{}: the floor lies {:.2} m below the sensor, and the site file says {:.2} m; nothing that may be a floor was \
                 seen at that height; one of the two is wrong",
                sensor.name, level.height_m, sensor.position_m[2]
            ));
        }
        if in_plan(0).is_none() {
            told.push(format!("{}: yaw, x and y stay as given: neither people nor walls tell", sensor.name));
        }
        mine
    };
    let sensors = site.sensors.iter().enumerate().map(found).collect();
    let weak = weak(site, &seen, &links, &solution.covariance);
    Ok(Calibration {
        sensors,
        joint_sightings: solution.joint,
        apart_m: solution.apart_m,
        weak,
        told,
        doubts,
        seen,
    })
}

/// Groups the sensors by the people they share, and lays every group together, the first where the site file has it.
fn linked(site: &Site, seen: &mut [Seen], told: &mut Vec<String>) -> (Vec<Placed>, Vec<(usize, usize)>) {
    let mut matches = Vec::new();
    for b in 0..seen.len() {
        for a in 0..b {
            let guess = seen[a].guess.inverse().after(&seen[b].guess);
            matches.extend(matching::find(&seen[a].ways, &seen[b].ways, &guess).map(|found| (a, b, found)));
        }
    }
    matches.sort_by(|x, y| y.2.score.total_cmp(&x.2.score));
    let mut plans: Vec<Plan> = vec![Plan::default(); seen.len()];
    for (s, of) in seen.iter_mut().enumerate() {
        of.group = s;
        plans[s] = of.guess;
    }
    let mut links = Vec::new();
    for (a, b, found) in matches {
        if found.doubtful {
            let (a, b) = (&site.sensors[a].name, &site.sensors[b].name);
            told.push(format!(
                "{a} and {b}: the people seen fit in more than one way; the one next to the site file was taken"
            ));
        }
        links.push((a, b));
        let (from, to) = (seen[b].group, seen[a].group);
        if from != to {
            let moved = plans[a].after(&found.first_from_second).after(&plans[b].inverse());
            for s in (0..seen.len()).filter(|&s| seen[s].group == from).collect::<Vec<_>>() {
                plans[s] = moved.after(&plans[s]);
                seen[s].group = to;
            }
        }
    }
    for group in 0..seen.len() {
        let own: Vec<usize> = (0..seen.len()).filter(|&s| seen[s].group == group).collect();
        let pairs: Vec<_> = own.iter().flat_map(|&s| arms(&seen[s].guess, &plans[s])).collect();
        if let Some(back) = Plan::aligning(&pairs) {
            own.iter().for_each(|&s| plans[s] = back.after(&plans[s]));
        }
    }
    let place = |site_from_level| Placed { site_from_level, ahead_s: 0.0 };
    (plans.into_iter().map(place).collect(), links)
}

/// Two points of a sensor, before and after: so a yaw and a place weigh as a tape measure and a compass err.
fn arms(to: &Plan, from: &Plan) -> [(DVec2, DVec2, f64); 2] {
    [3.0, -3.0].map(|x| (to.point(DVec2::new(x, 0.0)), from.point(DVec2::new(x, 0.0)), 1.0))
}

/// Moves every group onto the walls where they are to be seen.
fn on_walls(
    site: &Site,
    outline: &Outline,
    seen: &mut [Seen],
    mut placed: Vec<Placed>,
    wrong: &mut Vec<(String, Misfit)>,
    told: &mut Vec<String>,
) -> Vec<Placed> {
    for group in 0..seen.len() {
        let own: Vec<usize> = (0..seen.len()).filter(|&s| seen[s].group == group).collect();
        let points_m: Vec<DVec3> = (own.iter())
            .flat_map(|&s| seen[s].upright_m.iter().map(move |p| (s, p)))
            .map(|(s, p)| placed[s].site_from_level.point(p.truncate()).extend(p.z))
            .collect();
        let names: Vec<&str> = own.iter().map(|&s| site.sensors[s].name.as_str()).collect();
        let (moved, misfits) = held(&points_m, outline);
        wrong.extend(misfits.into_iter().map(|misfit| (names.join(", "), misfit)));
        match moved {
            Some(moved) => {
                for &s in &own {
                    placed[s].site_from_level = moved.after(&placed[s].site_from_level);
                    seen[s].by_walls = true;
                }
                told.push(format!("{}: held by walls, pillars and furniture of the site file", names.join(", ")));
            }
            None if own.is_empty() => {}
            None => told.push(format!(
                "{}: held by the poses of the site file, by least squares: the hall's walls are not to be seen, or are not \
                 where the file has them",
                names.join(", ")
            )),
        }
    }
    placed
}

/// The motion that brings a group onto the walls, and the walls that are not where the file has them. Where one is wrong, the
/// sensors may be laid onto it or onto those that are right: then they stay as near as can be to where the file has them.
fn held(points_m: &[DVec3], outline: &Outline) -> (Option<Plan>, Vec<Misfit>) {
    let as_filed = Plan { yaw_rad: 0.0, at_m: DVec2::ZERO };
    let moved = gauge::by_walls(points_m, outline);
    let misfits = misfit::misfits(points_m, outline, &moved.unwrap_or(as_filed));
    if misfits.is_empty() {
        return (moved, misfits);
    }
    let middle_m = points_m.iter().map(|p| p.truncate()).sum::<DVec2>() / points_m.len().max(1) as f64;
    let but_for = |wall: usize| {
        let moved = gauge::by_walls(points_m, &outline.without(&[wall]))?;
        let misfits = misfit::misfits(points_m, outline, &moved);
        let off_m = moved.point(middle_m).distance(middle_m) + ARM_M * moved.yaw_rad.abs();
        (misfits.iter().all(|misfit| misfit.wall == wall)).then_some((off_m, moved, misfits))
    };
    let best = (0..outline.walls()).filter_map(but_for).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((moved, misfits), |(_, moved, misfits)| (Some(moved), misfits))
}

/// A wall that does not fit, for a reader.
fn named(outline: &Outline, sensors: &str, misfit: &Misfit) -> String {
    let [from, to] = outline.wall(misfit.wall).unwrap_or_default();
    let (by_m, way) = (misfit.in_m.abs(), if misfit.in_m < 0.0 { "farther out" } else { "farther in" });
    format!(
        "the wall from [{:.2}, {:.2}] to [{:.2}, {:.2}] is seen {by_m:.2} m {way} than the site file says; the file is wrong \
         there, or at the opposite wall, or in where {sensors} hang; that wall was left out",
        from.x, from.y, to.x, to.y
    )
}

/// The pose that a site file takes.
fn hung(sensor: &Sensor, placed: &Placed, level: &Level) -> Found {
    let plan = &placed.site_from_level;
    let position_m = plan.at_m.extend(level.height_m);
    let rotation_deg = Rotation {
        yaw: wrapped(plan.yaw_rad).to_degrees(),
        pitch: level.pitch_rad.to_degrees(),
        roll: level.roll_rad.to_degrees(),
    };
    let new = Sensor { position_m: position_m.to_array(), rotation_deg, ..sensor.clone() };
    let (before, after) = (sensor.site_from_sensor(), new.site_from_sensor());
    let turn = before.rotation.transpose() * after.rotation;
    let cosine = 0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
    Found {
        sensor: sensor.name.clone(),
        position_m: new.position_m,
        rotation_deg,
        clock_offset_ms: sensor.clock_offset_ms + 1e3 * placed.ahead_s,
        sigma: Sigma::default(),
        frame: Frame::SiteFile,
        with: Vec::new(),
        people: 0,
        turned_deg: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
        moved_m: before.translation_m.distance(after.translation_m),
    }
}

/// The directions of the unknowns in which the covariance is largest.
fn weak(
    site: &Site,
    seen: &[Seen],
    links: &[(usize, usize)],
    covariance: &nalgebra::DMatrix<f64>,
) -> Vec<Weak> {
    const NAMES: [(&str, f64); 4] = [("yaw", ARM_M), ("x", 1.0), ("y", 1.0), ("clock", PACE_MPS)];
    let told = |s: usize| links.iter().any(|&(a, b)| a == s || b == s) || seen[s].by_walls;
    let unknowns: Vec<(usize, usize)> =
        (0..seen.len()).filter(|&s| told(s)).flat_map(|s| (0..NAMES.len()).map(move |k| (s, k))).collect();
    let of = |i: usize, j: usize| {
        let ((s, k), (r, l)) = (unknowns[i], unknowns[j]);
        covariance[(OF_SENSOR * s + k, OF_SENSOR * r + l)] * NAMES[k].1 * NAMES[l].1
    };
    if unknowns.is_empty() {
        return Vec::new();
    }
    let scaled = nalgebra::DMatrix::from_fn(unknowns.len(), unknowns.len(), of);
    let eigen = scaled.symmetric_eigen();
    let mut order: Vec<usize> = (0..unknowns.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let direction = |&column: &usize| {
        let shares = unknowns.iter().enumerate().map(|(row, &(s, k))| {
            (format!("{} of {}", NAMES[k].0, site.sensors[s].name), eigen.eigenvectors[(row, column)])
        });
        let of = shares.filter(|(_, share)| share.abs() >= NAMED_SHARE).collect();
        Weak { sigma_m: eigen.eigenvalues[column].max(0.0).sqrt(), of }
    };
    order.iter().take(NAMED).map(direction).collect()
}
