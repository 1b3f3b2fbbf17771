//! Casts that only an oracle can make, from the rows of truth and run: the constant-velocity baseline, and the error
//! budget, in which the truth replaces one stage at a time and the rest is the mode's own.

use std::collections::{BTreeMap, VecDeque};

use umbracast::blockage::Caster;
use umbracast::config::{BlockageConfig, BlockageMethod, BoxKind};
use umbracast::forecast::constant_velocity::ACCELERATION_PSD_M2PS3;
use umbracast::forecast::{Coupling, Forecast, Gaussian2, Weights, constant_velocity};
use umbracast::gait::{Gait, WALKS_FROM_MPS};
use umbracast::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};
use umbracast::site::Hall;
use umbracast::track::{OBSERVED, Observed, Track, WIDTH_SCALE_SIGMA};
use umbracast::{Config, Error, STEP_S, STEPS};
use umbracast_io::rows::{PeopleRow, TrackRow};

use crate::oracle::true_forecasts::TrueForecasts;
use crate::score::links::Said;
use crate::score::scene::{Matching, SceneRun, TruthIndex};

/// Front to back and side to side of the box given to a person whom no track has measured (PAPER's ladder).
const PERSON_BOX_M: [f64; 2] = [0.28, 0.46];

/// Constant velocity on true positions: everybody's true state carried on and cast by the mode's stage 3, with
/// a box of the same size for all.
pub fn constant_velocity_of_truth(truth: &TruthIndex, config: &Config) -> Said {
    let mut caster = Caster::new(&config.blockage, &config.site);
    let (mut said, mut blockages) = (Said::default(), Vec::new());
    for &frame in &truth.frames {
        let tracks: Vec<Track> = truth
            .people_of(frame)
            .map(|row| true_track(truth, row, person_box(row, &config.site.hall)))
            .collect();
        let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
        caster.cast(&tracks, &forecasts, &mut blockages);
        said.add(frame, &blockages);
    }
    said
}

/// Algorithm 1 of the paper on a run's tracks and forecasts, with boxes of this kind, whatever the mode's own
/// stage 3 is: everything before it is the run's.
pub fn algorithm_1(run: &SceneRun, config: &Config, person_box: BoxKind) -> Said {
    let blockage =
        BlockageConfig { method: BlockageMethod::Algorithm1, person_box, ..config.blockage.clone() };
    let mut caster = Caster::new(&blockage, &config.site);
    let (mut said, mut blockages) = (Said::default(), Vec::new());
    for (frame, rows) in present_by_frame(run) {
        let ahead = |row: &&TrackRow| with_own_future(row);
        let (tracks, forecasts): (Vec<Track>, Vec<Forecast>) = rows.iter().map(ahead).unzip();
        caster.cast(&tracks, &forecasts, &mut blockages);
        said.add(frame, &blockages);
    }
    said
}

/// Positions and velocities replaced: everybody's true state into the mode's forecast and cast, also of those
/// whom the run missed. Who has a track keeps its height and its boxes, moved to the true position.
///
/// # Errors
/// The mode's forecast needs weights and there are none.
pub fn true_state(
    truth: &TruthIndex,
    run: &SceneRun,
    matching: &Matching,
    config: &Config,
    weights: Option<&Weights>,
    made: &mut TrueForecasts,
) -> Result<Said, Error> {
    let mut caster = Caster::new(&config.blockage, &config.site);
    let rows: BTreeMap<(u64, u64), &TrackRow> = run.tracks.iter().map(|r| ((r.frame, r.track), r)).collect();
    let (mut said, mut blockages) = (Said::default(), Vec::new());
    let track = |row: &PeopleRow| {
        let own = matching.get(&(row.frame, row.person)).and_then(|track| rows.get(&(row.frame, *track)));
        match own {
            Some(own) => with_true_state(truth, own, row, &config.site.hall),
            None => true_track(truth, row, person_box(row, &config.site.hall)),
        }
    };
    let tracks: Vec<Vec<Track>> =
        truth.frames.iter().map(|&frame| truth.people_of(frame).map(track).collect()).collect();
    let forecasts = made.of(&config.forecast, weights, &tracks)?;
    for ((&frame, tracks), forecasts) in truth.frames.iter().zip(&tracks).zip(forecasts) {
        caster.cast(tracks, forecasts, &mut blockages);
        said.add(frame, &blockages);
    }
    Ok(said)
}

/// The future replaced: the run's tracks as they are, moved to where their persons truly are and will be. A
/// track of nobody keeps its own forecast.
pub fn true_future(truth: &TruthIndex, run: &SceneRun, matching: &Matching, config: &Config) -> Said {
    let mut caster = Caster::new(&config.blockage, &config.site);
    let person_of: BTreeMap<(u64, u64), u32> =
        matching.iter().map(|(&(frame, person), &track)| ((frame, track), person)).collect();
    let (mut said, mut blockages) = (Said::default(), Vec::new());
    for (frame, rows) in present_by_frame(run) {
        let ahead = |row: &&TrackRow| {
            let person = person_of.get(&(frame, row.track));
            match person.and_then(|&person| truth.person(frame, person)) {
                Some(person) => with_true_future(truth, row, person, &config.site.hall),
                None => with_own_future(row),
            }
        };
        let (tracks, forecasts): (Vec<Track>, Vec<Forecast>) = rows.iter().map(ahead).unzip();
        caster.cast(&tracks, &forecasts, &mut blockages);
        said.add(frame, &blockages);
    }
    said
}

/// Constant velocity from the true state, for comparison with stage 2.
pub fn constant_velocity_steps(row: &PeopleRow) -> [Gaussian2; STEPS] {
    let at = |i| {
        let (p, v) = (DVec2::new(row.x_m, row.y_m), DVec2::new(row.vx_mps, row.vy_mps));
        let coupling =
            Coupling { acceleration_psd_m2ps3: constant_velocity::alike(ACCELERATION_PSD_M2PS3), ..CERTAIN };
        constant_velocity::position_at(p, v, &coupling, (i + 1) as f64 * STEP_S)
    };
    std::array::from_fn(at)
}

/// The steps of a track's row.
pub fn forecast_of(row: &TrackRow) -> [Gaussian2; STEPS] {
    row.steps.map(|[x, y, xx_m2, xy_m2, yy_m2]| Gaussian2 { mean_m: DVec2::new(x, y), xx_m2, xy_m2, yy_m2 })
}

/// What stage 3 gets: confirmed tracks, frame by frame.
/// Confirmed tracks, and things that somebody moves.
fn present_by_frame(run: &SceneRun) -> BTreeMap<u64, Vec<&TrackRow>> {
    let mut by_frame: BTreeMap<u64, Vec<&TrackRow>> = BTreeMap::new();
    for row in run.tracks.iter().filter(|row| row.confirmed || row.part_of.is_some()) {
        by_frame.entry(row.frame).or_default().push(row);
    }
    by_frame
}

/// What is known has no spread.
const CERTAIN: Coupling = Coupling { state: [[0.0; 4]; 4], acceleration_psd_m2ps3: [[0.0; 2]; 2] };

/// A track with the true state of its person. Its heading follows the velocity as the tracker's does; below
/// walking speed the track's own is held.
fn with_true_state(truth: &TruthIndex, own: &TrackRow, row: &PeopleRow, hall: &Hall) -> Track {
    let track = true_track(truth, row, box_moved_to(own, row, hall));
    let walks = track.velocity_mps.length() > WALKS_FROM_MPS;
    let (heading_rad, heading_sigma_rad) =
        if walks { (track.velocity_mps.to_angle(), 0.0) } else { (own.heading_rad, own.heading_sigma_rad) };
    let Track { height_m, height_sigma_m, width_scale, width_scale_sigma, outline_m, canopy, gait, .. } =
        track_of(own);
    Track {
        heading_rad,
        heading_sigma_rad,
        height_m,
        height_sigma_m,
        width_scale,
        width_scale_sigma,
        outline_m,
        canopy,
        gait,
        ..track
    }
}

/// A track at the true positions of its person, now and at every step. The present is moved as well: a body
/// turns as its trajectory does, and one from an estimate to the truth would turn it by the estimate's error.
fn with_true_future(truth: &TruthIndex, own: &TrackRow, now: &PeopleRow, hall: &Hall) -> (Track, Forecast) {
    let (aabb, obb) = box_moved_to(own, now, hall);
    let position_m = DVec2::new(now.x_m, now.y_m);
    let track = Track { position_m, aabb, obb, ..track_of(own) };
    let offset_m = position_m - DVec2::new(own.x_m, own.y_m);
    let mut steps = forecast_of(own);
    for (h, step) in (1..).zip(&mut steps) {
        // Who has left the scene goes on as foreseen.
        let there = truth.person(now.frame + h, now.person);
        let mean_m = there.map_or(step.mean_m + offset_m, |there| DVec2::new(there.x_m, there.y_m));
        *step = Gaussian2 { mean_m, ..Gaussian2::default() };
    }
    (track, Forecast { track: own.track, steps, coupling: CERTAIN })
}

/// A track with its own forecast. Its spread is that of a constant velocity: tables do not hold the joint one.
fn with_own_future(own: &TrackRow) -> (Track, Forecast) {
    let track = track_of(own);
    let acceleration_psd_m2ps3 = constant_velocity::alike(ACCELERATION_PSD_M2PS3);
    let coupling = Coupling { state: track.covariance, acceleration_psd_m2ps3 };
    (track, Forecast { track: own.track, steps: forecast_of(own), coupling })
}

/// A person of the truth as the tracker would see him if it made no error.
pub fn true_track(truth: &TruthIndex, row: &PeopleRow, (aabb, obb): (Aabb, Obb)) -> Track {
    let first = row.frame.saturating_sub(OBSERVED as u64 - 1);
    let observed: VecDeque<Observed> = (first..=row.frame)
        .filter_map(|frame| truth.person(frame, row.person))
        .map(|then| Observed {
            time_ns: then.time_ns,
            position_m: DVec2::new(then.x_m, then.y_m),
            velocity_mps: DVec2::new(then.vx_mps, then.vy_mps),
        })
        .collect();
    Track {
        id: u64::from(row.person),
        position_m: DVec2::new(row.x_m, row.y_m),
        velocity_mps: DVec2::new(row.vx_mps, row.vy_mps),
        covariance: CERTAIN.state,
        heading_rad: row.heading_rad,
        heading_sigma_rad: 0.0,
        heading_behind: 0.0,
        height_m: row.height_m,
        height_sigma_m: 0.0,
        width_scale: 1.0,
        width_scale_sigma: WIDTH_SCALE_SIGMA,
        outline_m: Default::default(),
        canopy: None,
        gait: Gait::UNKNOWN,
        points: row.returns,
        confirmed: true,
        part_of: None,
        aabb,
        obb,
        observed,
    }
}

/// The boxes of a person of usual size.
fn person_box(row: &PeopleRow, hall: &Hall) -> (Aabb, Obb) {
    let half_m = DVec3::new(PERSON_BOX_M[0] / 2.0, PERSON_BOX_M[1] / 2.0, row.height_m / 2.0);
    let position_m = DVec2::new(row.x_m, row.y_m);
    let center_m = position_m.extend(hall.floor_m(position_m) + half_m.z);
    let site_from_box = DMat3::from_rotation_z(row.heading_rad);
    let reach_m = site_from_box.x_axis.abs() * half_m.x + site_from_box.y_axis.abs() * half_m.y;
    let reach_m = DVec3::new(reach_m.x, reach_m.y, half_m.z);
    let aabb = Aabb { min_m: center_m - reach_m, max_m: center_m + reach_m };
    (aabb, Obb { center_m, half_m, site_from_box })
}

/// The boxes of a track, moved with its position to the true one.
fn box_moved_to(track: &TrackRow, row: &PeopleRow, hall: &Hall) -> (Aabb, Obb) {
    let offset_m = DVec2::new(row.x_m - track.x_m, row.y_m - track.y_m);
    let up_m = hall.floor_m(DVec2::new(row.x_m, row.y_m)) - hall.floor_m(DVec2::new(track.x_m, track.y_m));
    let (aabb, obb) = boxes_of(track);
    (aabb.moved_by(offset_m).raised_by(up_m), obb.moved_by(offset_m, 0.0).raised_by(up_m))
}

fn boxes_of(row: &TrackRow) -> (Aabb, Obb) {
    let at = |values: &[f64]| DVec3::new(values[0], values[1], values[2]);
    let (b, o) = (&row.aabb_m, &row.obb);
    let site_from_box = DMat3::from_cols(at(&o[6..9]), at(&o[9..12]), at(&o[12..15]));
    (
        Aabb { min_m: at(&b[0..3]), max_m: at(&b[3..6]) },
        Obb { center_m: at(&o[0..3]), half_m: at(&o[3..6]), site_from_box },
    )
}

/// A track as its row tells it. The row does not hold the observed positions, which stage 3 does not use.
fn track_of(row: &TrackRow) -> Track {
    let (aabb, obb) = boxes_of(row);
    let mut covariance = [[0.0; 4]; 4];
    let upper = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
    for ((i, j), &value) in upper.zip(&row.covariance) {
        (covariance[i][j], covariance[j][i]) = (value, value);
    }
    Track {
        id: row.track,
        position_m: DVec2::new(row.x_m, row.y_m),
        velocity_mps: DVec2::new(row.vx_mps, row.vy_mps),
        covariance,
        heading_rad: row.heading_rad,
        heading_sigma_rad: row.heading_sigma_rad,
        heading_behind: 0.0,
        height_m: row.height_m,
        height_sigma_m: row.height_sigma_m,
        width_scale: row.width_scale,
        width_scale_sigma: row.width_scale_sigma,
        outline_m: row.outline_m,
        canopy: row.canopy(),
        gait: row.gait(),
        points: row.points,
        confirmed: row.confirmed,
        part_of: row.part_of,
        aabb,
        obb,
        observed: VecDeque::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::{track_row, truth_of};
    use crate::score::instances::instances;
    use crate::score::scene::SceneTruth;
    use umbracast::Mode;

    /// The access point hangs beside person 0, 3 m up at x = -4; person 1 walks by in front of person 0 within
    /// 0.4 s and is the only one in the way.
    fn crossing() -> (SceneTruth, Config) {
        let mut truth = truth_of(2, 19, |_, _| false);
        for row in truth.people.iter_mut().filter(|row| row.person == 1) {
            row.vy_mps = 1.0;
            (row.x_m, row.y_m) = (-1.0, -0.4 + 0.1 * (row.frame as f64 - 9.0));
        }
        let mut config = Config::for_mode(Mode::Default);
        config.site.access_points.truncate(1);
        config.site.access_points[0].position_m = [-4.0, 0.0, 1.5];
        (truth, config)
    }

    fn said_of_person_0(said: &Said, truth: &SceneTruth) -> Vec<bool> {
        let instances = instances(&TruthIndex::new(truth));
        said.of_persons(&instances)[0].blocked.to_vec()
    }

    #[test]
    fn constant_velocity_sees_the_crossing_a_few_steps_ahead() {
        let (truth, config) = crossing();
        let said = constant_velocity_of_truth(&TruthIndex::new(&truth), &config);
        let blocked = said_of_person_0(&said, &truth);
        assert!(!blocked[0] && blocked[3] && blocked[8], "{blocked:?}");
    }

    #[test]
    fn the_true_state_needs_no_track() {
        let (truth, config) = crossing();
        let index = TruthIndex::new(&truth);
        let (run, matching) = (SceneRun::default(), Matching::new());
        let made = &mut TrueForecasts::default();
        let said = true_state(&index, &run, &matching, &config, None, made).unwrap();
        assert!(said_of_person_0(&said, &truth)[3]);
    }

    #[test]
    fn forecasts_that_two_modes_share_are_those_that_each_would_make() {
        let (truth, _) = crossing();
        let index = TruthIndex::new(&truth);
        let weights =
            Weights::from_safetensors(include_bytes!("../../../../models/paper_lstm.safetensors")).unwrap();
        // Both follow person 1; the modes' tracks differ.
        let matching = Matching::from([((9, 1), 7)]);
        let run = |height_m, heading_rad| SceneRun {
            tracks: vec![TrackRow { height_m, heading_rad, ..track_row(9, 7, -0.6, -0.5) }],
            links: Vec::new(),
        };
        let mut shared = TrueForecasts::default();
        let runs = [(Mode::Hdl, run(1.9, 0.3)), (Mode::Paper, run(1.6, 1.3)), (Mode::Default, run(1.7, 2.0))];
        for (mode, run) in runs {
            let config = Config::for_mode(mode);
            let said = |made: &mut TrueForecasts| {
                true_state(&index, &run, &matching, &config, Some(&weights), made).unwrap()
            };
            assert_eq!(said(&mut shared), said(&mut TrueForecasts::default()), "{}", mode.name());
        }
    }

    /// Person 1 of the crossing at frame 9 and a track of it: off to the side, taller, and turned.
    fn track_beside(truth: &TruthIndex) -> (PeopleRow, TrackRow) {
        let row = *truth.person(9, 1).unwrap();
        let own =
            TrackRow { height_m: 1.9, heading_rad: 0.3, ..track_row(9, 7, row.x_m + 0.4, row.y_m - 0.1) };
        (row, own)
    }

    #[test]
    fn an_error_of_the_present_turns_nobody_whose_future_is_known() {
        let (truth, _) = crossing();
        let index = TruthIndex::new(&truth);
        let (row, own) = track_beside(&index);
        let (track, forecast) = with_true_future(&index, &own, &row, &umbracast::Config::default().site.hall);
        let (first, last) = (forecast.steps[0].mean_m - track.position_m, forecast.steps[8].mean_m);
        assert!(first.angle_to(last - forecast.steps[7].mean_m).abs() < 1e-9, "{first}");
        assert!(track.aabb.min_m.abs_diff_eq(DVec3::new(-0.4, 0.1, 0.0), 1e-9), "{}", track.aabb.min_m);
        assert_eq!((track.heading_rad, track.height_m), (0.3, 1.9));
        assert_eq!(forecast.coupling, CERTAIN);
    }

    #[test]
    fn a_track_of_nobody_keeps_its_forecast_and_its_spread() {
        let (truth, config) = crossing();
        let index = TruthIndex::new(&truth);
        // Person 0 is followed. Nobody's track stands in the way, if only it were known where: it hardly is.
        let (mut run, mut matching) = (SceneRun::default(), Matching::new());
        let standing = |track, x_m: f64| TrackRow {
            height_m: 1.8,
            steps: [[x_m, 0.0, 0.0, 0.0, 0.0]; STEPS],
            ..track_row(9, track, x_m, 0.0)
        };
        let mut nobody = standing(8, -1.0);
        [nobody.covariance[0], nobody.covariance[4]] = [4.0, 4.0];
        run.tracks = vec![standing(7, 0.0), nobody];
        matching.insert((9, 0), 7);
        let instances = instances(&index);
        let said = true_future(&index, &run, &matching, &config).of_tracks(&instances, &matching);
        assert!(said[0].p[0] > 0.0 && said[0].p[0] < 0.5, "{:?}", said[0].p);
        let (_, forecast) = with_own_future(&run.tracks[1]);
        assert_eq!(
            (forecast.coupling.state[1][1], forecast.coupling.acceleration_psd_m2ps3[1][1]),
            (4.0, 0.01)
        );
    }

    #[test]
    fn the_true_state_leaves_a_track_its_height_and_who_stands_his_heading() {
        let (truth, _) = crossing();
        let index = TruthIndex::new(&truth);
        let (row, own) = track_beside(&index);
        let track = with_true_state(&index, &own, &row, &umbracast::Config::default().site.hall);
        assert_eq!((track.position_m, track.height_m), (DVec2::new(row.x_m, row.y_m), 1.9));
        assert_eq!(track.heading_rad, std::f64::consts::FRAC_PI_2);
        let slow = PeopleRow { vx_mps: 0.1, vy_mps: 0.0, ..row };
        assert_eq!(
            with_true_state(&index, &own, &slow, &umbracast::Config::default().site.hall).heading_rad,
            own.heading_rad
        );
    }

    #[test]
    fn rows_of_a_track_give_back_its_boxes_and_covariance() {
        let mut row = TrackRow { aabb_m: [1.0, 2.0, 0.0, 1.4, 2.6, 1.8], ..TrackRow::default() };
        row.covariance = std::array::from_fn(|i| i as f64);
        row.obb[6..15].copy_from_slice(&DMat3::from_rotation_z(0.3).to_cols_array());
        let track = track_of(&row);
        assert_eq!(track.covariance[0], [0.0, 1.0, 2.0, 3.0]);
        assert_eq!((track.covariance[3][1], track.covariance[2][2]), (6.0, 7.0));
        assert_eq!(track.obb.site_from_box, DMat3::from_rotation_z(0.3));
        assert_eq!(track.aabb.max_m, DVec3::new(1.4, 2.6, 1.8));
    }

    #[test]
    fn a_person_turned_by_90_degrees_is_wide_along_x() {
        let row =
            PeopleRow { heading_rad: std::f64::consts::FRAC_PI_2, height_m: 1.8, ..PeopleRow::default() };
        let (aabb, obb) = person_box(&row, &umbracast::Config::default().site.hall);
        assert!((aabb.size_m() - DVec3::new(0.46, 0.28, 1.8)).length() < 1e-12, "{:?}", aabb.size_m());
        assert_eq!(obb.half_m, DVec3::new(0.14, 0.23, 0.9));
    }
}
