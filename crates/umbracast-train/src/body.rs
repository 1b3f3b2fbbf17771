//! Fits the predictor's body on recorded tuning scenes: the few numbers with which the true blockages are most
//! likely, at people's true positions and headings, with height and gait as the tracker knows them. The fit moves one
//! number at a time as long as it helps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use umbracast::blockage::body::{self, Posture};
use umbracast::blockage::probability::Phases;
use umbracast::blockage::{BodyModel, Numbers};
use umbracast::gait::Gait;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::track::WIDTH_SCALE_SIGMA;
use umbracast::{Config, Error};
use umbracast_io::rows::{PeopleLinkRow, PeopleRow, TrackRow};
use umbracast_io::tables;

/// Every so many frames; what lies between looks alike.
const EVERY: u64 = 3;
/// Who is farther than this from the segment, seen from above, is left out.
const NEAR_M: f64 = 0.6;
/// A track nearer than this is the person's.
const OWN_M: f64 = 0.3;
/// Postures tried of each body: phases of the gait, widths.
const POSTURES: usize = 12;
/// Middles of 12 equal shares of a standard normal distribution, mixed against the phases.
const NORMAL: [f64; POSTURES] =
    [0.10, -1.73, 0.55, -0.32, 1.15, -0.81, -0.10, 1.73, -0.55, 0.32, -1.15, 0.81];

/// One link in one frame: the ray, those near it, and whether it was blocked.
struct Case {
    access_point: u32,
    start_m: DVec3,
    ue_m: DVec3,
    /// With how far the right and the left arm swing, beside usual ones, and how high the floor is that each stands on.
    near: Vec<(PeopleRow, Phases, [f64; 2], f64)>,
    blocked: bool,
}

/// Fits the body on recordings, each a folder that `simulate` wrote and one that `run` made of it; returns the tables
/// for `models/body.toml`. `told` is called with each improvement.
///
/// # Errors
/// A table that cannot be read, or recordings in which nobody comes near a link.
pub fn fit_body(recordings: &[(PathBuf, PathBuf)], mut told: impl FnMut(&str)) -> Result<String, Error> {
    let config = Config::default();
    let mut cases = Vec::new();
    for (simulated, run) in recordings {
        cases.extend(cases_of(simulated, run, &config)?);
    }
    if cases.is_empty() {
        return Err(Error::new("training: expected links with somebody near them, found none"));
    }
    let numbers = Numbers::new(&config.blockage);
    let mut best = numbers.body.clone();
    let mut least = loss(&best, &numbers, &cases);
    let start = f1(&best, &numbers, &cases);
    told(&format!("{} links, {least:.5}; F1 by access point {start:.4?}", cases.len()));
    let count = fields(&mut best).len();
    let mut steps = vec![0.008; count];
    while steps.iter().any(|&step| step > 0.001) {
        for i in 0..count {
            let mut moved = false;
            for change in [steps[i], -steps[i]] {
                let mut trial = best.clone();
                *fields(&mut trial)[i].1 += change;
                let value = loss(&trial, &numbers, &cases);
                if value < least {
                    (best, least, moved) = (trial, value, true);
                    let (name, field) = &fields(&mut best)[i];
                    told(&format!("{least:.5} {name} = {field:.4}"));
                    break;
                }
            }
            steps[i] *= if moved { 1.5 } else { 0.5 };
        }
    }
    told(&format!("F1 by access point {:.4?}", f1(&best, &numbers, &cases)));
    Ok(toml(&mut best))
}

/// The numbers as `models/body.toml` has them.
fn toml(body: &mut BodyModel) -> String {
    let slices = body.slices.iter().map(|slice| {
        format!(
            "  {{ top = {:.3}, half_depth = {:.3}, half_width = {:.3}, ahead = {:.3} }},\n",
            slice.top, slice.half_depth, slice.half_width, slice.ahead
        )
    });
    let slices: String = slices.collect();
    let others = fields(body).into_iter().filter(|(name, _)| !name.starts_with("slice"));
    let others: Vec<String> = others.map(|(name, value)| format!("{name} = {value:.4}\n")).collect();
    let (sways, arms) = others.split_at(SWAYS);
    format!("slices = [\n{slices}]\n{}\n[arms]\n{}", sways.concat(), arms.concat())
}

/// How many of the fields that are no slice's are the trunk's.
const SWAYS: usize = 2;

/// What may be turned.
fn fields(body: &mut BodyModel) -> Vec<(String, &mut f64)> {
    let mut all: Vec<(String, &mut f64)> = Vec::new();
    let last = body.slices.len() - 1;
    for (i, slice) in body.slices.iter_mut().enumerate() {
        if i < last {
            all.push((format!("slice {i} top"), &mut slice.top));
        }
        all.push((format!("slice {i} half_depth"), &mut slice.half_depth));
        all.push((format!("slice {i} half_width"), &mut slice.half_width));
        all.push((format!("slice {i} ahead"), &mut slice.ahead));
    }
    let arms = &mut body.arms;
    let named: [(&str, &mut f64); 13] = [
        ("sway_left", &mut body.sway_left),
        ("sway_ahead", &mut body.sway_ahead),
        ("shoulder_up", &mut arms.shoulder_up),
        ("shoulder_out", &mut arms.shoulder_out),
        ("elbow_up", &mut arms.elbow_up),
        ("elbow_out", &mut arms.elbow_out),
        ("hand_up", &mut arms.hand_up),
        ("hand_out", &mut arms.hand_out),
        ("upper_radius", &mut arms.upper_radius),
        ("fore_radius", &mut arms.fore_radius),
        ("elbow_swing", &mut arms.elbow_swing),
        ("hand_ahead", &mut arms.hand_ahead),
        ("hand_swing", &mut arms.hand_swing),
    ];
    all.extend(named.map(|(name, value)| (name.to_owned(), value)));
    all
}

fn cases_of(directory: &Path, run: &Path, config: &Config) -> Result<Vec<Case>, Error> {
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    let mut people: BTreeMap<(u32, u64), Vec<PeopleRow>> = BTreeMap::new();
    for row in tables::read::<PeopleRow>(directory, &names)? {
        people.entry((row.scene, row.frame)).or_default().push(row);
    }
    let mut tracks: BTreeMap<(u32, u64), Vec<TrackRow>> = BTreeMap::new();
    for row in tables::read::<TrackRow>(run, &names)? {
        tracks.entry((row.scene, row.frame)).or_default().push(row);
    }
    // Of the nearest track.
    let known = |p: &PeopleRow| {
        let off_m = |t: &&TrackRow| (t.x_m - p.x_m).hypot(t.y_m - p.y_m);
        let all = tracks.get(&(p.scene, p.frame))?.iter();
        let own = all.filter(|t| t.confirmed).min_by(|a, b| off_m(a).total_cmp(&off_m(b)))?;
        (off_m(&own) < OWN_M).then_some((own.gait(), own.height_m))
    };
    let mut cases = Vec::new();
    for link in tables::read::<PeopleLinkRow>(directory, &names)? {
        let Some(all) = people.get(&(link.scene, link.frame)).filter(|_| link.frame % EVERY == 0) else {
            continue;
        };
        let Some(own) = all.iter().find(|p| p.person == link.person) else { continue };
        let start_m = config.site.access_points[link.access_point as usize].position();
        let ue_m = config.site.ue_m(DVec2::new(own.x_m, own.y_m), own.heading_rad, own.height_m);
        let (from, to) = (start_m.truncate(), ue_m.truncate());
        let near = |p: &&PeopleRow| {
            let at = DVec2::new(p.x_m, p.y_m);
            let t = ((at - from).dot(to - from) / to.distance_squared(from)).clamp(0.0, 1.0);
            p.person != own.person && at.distance(from.lerp(to, t)) < NEAR_M
        };
        let with_phase = |p: &PeopleRow| {
            let (gait, height_m) = known(p).unwrap_or((Gait::UNKNOWN, p.height_m));
            let floor_m = config.site.hall.floor_m(DVec2::new(p.x_m, p.y_m));
            (PeopleRow { height_m, ..*p }, Phases::new(&gait), gait.arm_swing(), floor_m)
        };
        let near: Vec<_> = all.iter().filter(near).map(with_phase).collect();
        if !near.is_empty() {
            cases.push(Case { access_point: link.access_point, start_m, ue_m, near, blocked: link.blocked });
        }
    }
    Ok(cases)
}

/// Chance that the link is blocked.
fn probability(body: &BodyModel, numbers: &Numbers, case: &Case) -> f64 {
    let hits = (0..POSTURES).filter(|&k| {
        case.near.iter().any(|(p, phases, arm_swing, floor_m)| {
            let down = DVec3::NEG_Z * *floor_m;
            let share = ((k as f64 + 0.5) / POSTURES as f64 + 0.37 * f64::from(p.person)).fract();
            let posture = Posture {
                width_scale: 1.0
                    + WIDTH_SCALE_SIGMA.hypot(numbers.width_sigma)
                        * NORMAL[(k + p.person as usize) % POSTURES],
                speed_mps: p.vx_mps.hypot(p.vy_mps),
                phase_rad: phases.at(share),
                arm_swing: *arm_swing,
                ..Posture::standing(DVec2::new(p.x_m, p.y_m), DVec2::from_angle(p.heading_rad), p.height_m)
            };
            body::blocks(body, &posture, case.start_m + down, case.ue_m + down)
        })
    });
    hits.count() as f64 / POSTURES as f64
}

/// Mean negative logarithm of what was said of the truth; nothing is said to be certain.
fn loss(body: &BodyModel, numbers: &Numbers, cases: &[Case]) -> f64 {
    let of = |case: &Case| {
        let p = 0.01 + 0.98 * probability(body, numbers, case);
        -(if case.blocked { p } else { 1.0 - p }).ln()
    };
    let losses: Vec<f64> = cases.par_iter().map(of).collect();
    losses.iter().sum::<f64>() / cases.len() as f64
}

/// At one half, for each access point.
fn f1(body: &BodyModel, numbers: &Numbers, cases: &[Case]) -> Vec<f64> {
    let mut counts: BTreeMap<u32, [u64; 2]> = BTreeMap::new();
    for case in cases {
        let count = counts.entry(case.access_point).or_default();
        match (probability(body, numbers, case) >= 0.5, case.blocked) {
            (true, true) => count[0] += 1,
            (false, false) => {}
            _ => count[1] += 1,
        }
    }
    counts.values().map(|[hits, errors]| 2.0 * *hits as f64 / (2 * hits + errors) as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_as_the_same_body() {
        let mut body = BodyModel::shipped();
        assert_eq!(BodyModel::parse(&toml(&mut body)).unwrap(), body);
    }
}
