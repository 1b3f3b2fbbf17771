//! One person followed: filter, height, heading, boxes, and how sure it is that somebody is there.
//!
//! P: covariance of (x, y, vx, vy).
#![allow(non_snake_case)]

use std::collections::VecDeque;

use super::gait::Gait;
use super::girth::Girth;
use super::height::Height;
use super::kalman::{Filter, Mat2, State, plus};
use super::stride::Stride;
use super::visibility::{Body, View};
use super::{OBSERVED, Observed, Track};
use crate::config::{Boxes, TrackConfig};
use crate::detect::{Detection, Prior};
use crate::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};

/// Nobody is believed in more firmly than this, so that a track that should be seen dies within frames.
const EXISTENCE_MAX: f64 = 0.99;
/// What one sighting alone is worth.
const EXISTENCE_AT_BIRTH: f64 = 0.5;
/// The step that chances of detection are meant for.
const STEP_S: f64 = crate::STEP_S;
/// Variance of a heading that may be any: even over a turn.
const ANY_HEADING_RAD2: f64 = std::f64::consts::PI * std::f64::consts::PI / 3.0;
/// How fast who stands may turn away from the last heading: 40 degrees (one sigma) in a second. A guess: nothing
/// that is measured here tells it.
const STANDING_TURN_RAD2PS: f64 = 0.5;
/// The width of a box until one was seen.
const WIDTH_M: f64 = 0.5;

/// A track with everything behind it, at the time of the last frame.
#[derive(Debug, Clone)]
pub(super) struct Person {
    pub(super) id: u64,
    pub(super) filter: Filter,
    stride: Stride,
    pub(super) confirmed: bool,
    /// Probability that somebody is there.
    pub(super) existence: f64,
    pub(super) hits: u32,
    /// How long an elder track has stood in the same place.
    pub(super) doubled_s: f64,
    born_ns: i64,
    last_hit_ns: i64,
    points: u32,
    heading_rad: f64,
    heading_variance_rad2: f64,
    /// When the track was last given out.
    given_ns: i64,
    height: Height,
    girth: Girth,
    /// The last detection's boxes, moved so that the detection's position is at the origin.
    aabb: Aabb,
    obb: Obb,
    /// Averaged extent along x and y.
    extent_m: DVec2,
    observed: VecDeque<Observed>,
}

impl Person {
    pub(super) fn born(config: &TrackConfig, id: u64, detection: &Detection, time_ns: i64) -> Self {
        let noise = plus(noise(config, detection, &View::default()), sway(config));
        let variance = noise[0][0].max(noise[1][1]);
        let mut person = Self {
            id,
            filter: Filter::new(config, detection.position_m, detection.z_m, variance),
            stride: Stride::default(),
            confirmed: config.confirm_hits <= 1,
            existence: EXISTENCE_AT_BIRTH,
            hits: 1,
            doubled_s: 0.0,
            born_ns: time_ns,
            last_hit_ns: time_ns,
            points: 0,
            heading_rad: 0.0,
            heading_variance_rad2: ANY_HEADING_RAD2,
            given_ns: time_ns,
            height: Height::new(config.height_mean_m, config.height_sigma_m, config.children_share),
            girth: Girth::default(),
            aabb: Aabb::EMPTY,
            obb: Obb::from_aabb(&Aabb::EMPTY),
            extent_m: DVec2::splat(WIDTH_M),
            observed: VecDeque::with_capacity(OBSERVED),
        };
        person.see(detection, &View::default(), 0.0, config);
        person
    }

    /// Moves filter and stride on.
    pub(super) fn predict(&mut self, config: &TrackConfig, dt_s: f64) {
        self.stride.predict(config, self.speed_mps(), self.height.mean_m(), dt_s);
        self.filter.predict(config, self.height.mean_m(), dt_s);
    }

    fn speed_mps(&self) -> f64 {
        self.filter.state().velocity_mps().length()
    }

    /// The frame's detection of this person, `after_s` after the last frame; the filter stands at it.
    pub(super) fn hit(
        &mut self,
        config: &TrackConfig,
        detection: &Detection,
        view: &View,
        time_ns: i64,
        step_s: f64,
    ) {
        self.filter.correct(detection.position_m, detection.z_m, noise(config, detection, view));
        let there = self.existence * config.hit_ratio;
        self.existence = (there / (there + 1.0 - self.existence)).min(EXISTENCE_MAX);
        self.hits += 1;
        self.last_hit_ns = time_ns;
        self.confirmed |= self.hits >= config.confirm_hits;
        self.see(detection, view, step_s, config);
    }

    /// No detection in this frame, although there was one with chance `detection_probability` a step.
    pub(super) fn missed(&mut self, detection_probability: f64, step_s: f64) {
        let unseen = (1.0 - detection_probability).powf(step_s / STEP_S);
        self.existence = self.existence * unseen / (1.0 - self.existence * (1.0 - unseen));
        self.points = 0;
    }

    pub(super) fn is_dead(&self, config: &TrackConfig, time_ns: i64) -> bool {
        let seconds_since = |then_ns: i64| (time_ns - then_ns) as f64 * 1e-9;
        let spread = self.filter.state().position_covariance();
        let spread_z = self.filter.vertical.map_or(0.0, |z| z.P[0][0]);
        self.existence < config.existence_min
            || seconds_since(self.last_hit_ns) > config.coast_max_s
            || spread[0][0] + spread[1][1] + spread_z >= config.position_variance_max_m2
            || self.doubled_s > config.duplicate_after_s
            || !self.confirmed && seconds_since(self.born_ns) > config.confirm_within_s
    }

    /// The body that others may hide behind.
    pub(super) fn body(&self, position_m: DVec2) -> Body {
        Body { position_m, height_m: self.height.mean_m() }
    }

    pub(super) fn prior(&self, config: &TrackConfig, after_s: f64) -> Prior {
        let state = self.filter.state_after(config, after_s);
        Prior {
            position_m: state.position_m(),
            velocity_mps: state.velocity_mps(),
            position_sigma_m: largest_sigma(state.position_covariance()),
            height_m: self.height.mean_m(),
            confirmed: self.confirmed,
        }
    }

    /// The track at the frame's time, where the filter stands.
    pub(super) fn track(&mut self, config: &TrackConfig, time_ns: i64) -> Track {
        let state = self.filter.state();
        let (position_m, velocity_mps) = (state.position_m(), state.velocity_mps());
        self.turn(config, &state, (time_ns - self.given_ns) as f64 * 1e-9);
        self.given_ns = time_ns;
        if self.observed.len() == OBSERVED {
            self.observed.pop_front();
        }
        self.observed.push_back(Observed { time_ns, position_m, velocity_mps });
        let (aabb, obb) = self.boxes(config, &state);
        let (girth, girth_sigma) = if config.girth { self.girth.factor() } else { Girth::default().factor() };
        Track {
            id: self.id,
            position_m,
            velocity_mps,
            covariance: state.P,
            heading_rad: self.heading_rad,
            heading_sigma_rad: self.heading_variance_rad2.sqrt(),
            height_m: self.height.mean_m(),
            height_sigma_m: self.height.sigma_m(),
            girth,
            girth_sigma,
            gait: self.gait(config, velocity_mps.length()),
            points: self.points,
            confirmed: self.confirmed && largest_sigma(state.position_covariance()) < config.told_sigma_max_m,
            aabb,
            obb,
            observed: self.observed.clone(),
        }
    }

    fn gait(&self, config: &TrackConfig, speed_mps: f64) -> Gait {
        let limbs = if config.gait_from_limbs { self.stride.gait(speed_mps) } else { Gait::UNKNOWN };
        limbs.surer(if config.gait_from_sway { self.filter.gait() } else { Gait::UNKNOWN })
    }

    /// The heading follows the velocity of who walks; who stands may turn on the spot.
    fn turn(&mut self, config: &TrackConfig, state: &State, step_s: f64) {
        let (v, P) = (state.velocity_mps(), &state.P);
        let squared = v.length_squared();
        if v.length() > config.heading_speed_mps {
            self.heading_rad = v.y.atan2(v.x);
            // d(heading) = (v x dv) / |v|^2.
            let across = P[3][3] * v.x * v.x - 2.0 * P[2][3] * v.x * v.y + P[2][2] * v.y * v.y;
            self.heading_variance_rad2 = (across / (squared * squared)).min(ANY_HEADING_RAD2);
        } else {
            self.heading_variance_rad2 =
                (self.heading_variance_rad2 + STANDING_TURN_RAD2PS * step_s).min(ANY_HEADING_RAD2);
        }
    }

    /// Learns what a detection says of the body's shape and stride.
    fn see(&mut self, detection: &Detection, view: &View, step_s: f64, config: &TrackConfig) {
        self.points = detection.points;
        let speed_mps = self.speed_mps();
        if let Some(swing) = &detection.swing {
            self.stride.see(config, swing, speed_mps, self.height.mean_m());
        }
        self.height.see(detection.top_m, view.beams_per_m_at_top);
        self.girth.see(detection, view, self.height.mean_m(), speed_mps);
        self.aabb = detection.aabb.moved_by(-detection.position_m);
        self.obb = detection.obb.moved_by(-detection.position_m, 0.0);
        let new = 1.0 - (-step_s / config.box_average_s).exp();
        self.extent_m += (detection.aabb.size_m().truncate() - self.extent_m) * new;
    }

    fn boxes(&self, config: &TrackConfig, state: &State) -> (Aabb, Obb) {
        let position_m = state.position_m();
        match config.boxes {
            Boxes::Detection => (self.aabb.moved_by(position_m), self.obb.moved_by(position_m, 0.0)),
            Boxes::Averaged => {
                let half_m = (0.5 * self.extent_m).extend(0.5 * self.height.mean_m());
                let center_m = position_m.extend(half_m.z);
                let aabb = Aabb { min_m: center_m - half_m, max_m: center_m + half_m };
                let site_from_box = DMat3::from_rotation_z(self.heading_rad);
                // Shoulders are twice as wide as a trunk is deep; the plan area is what was seen.
                let depth_m = (0.5 * half_m.x * half_m.y).sqrt();
                let half_m = DVec3::new(depth_m, 2.0 * depth_m, half_m.z);
                (aabb, Obb { center_m, half_m, site_from_box })
            }
        }
    }
}

/// Covariance of a detection's position for the filter, which follows the sway itself: what the detection tells of
/// its error counts in part; beside it a part that nothing mends, and one that falls with the share of the body that
/// is seen.
pub(super) fn noise(config: &TrackConfig, detection: &Detection, view: &View) -> Mat2 {
    // 1 where hardly anything is seen, 0 from half the height and half the returns in free sight on.
    let low = 1.0 - 2.0 * detection.aabb.size_m().z / config.height_mean_m;
    let few = match view.beams_known {
        true => 1.0 - 2.0 * f64::from(detection.points) / view.returns_alone.max(f64::MIN_POSITIVE),
        false => 0.0,
    };
    let hidden = low.max(few).max(0.0);
    let variance = config.noise_floor_m.powi(2) + (config.hidden_noise_m * hidden).powi(2);
    let told = detection.covariance_m2.unwrap_or_default();
    plus(told.map(|row| row.map(|c| config.noise_share * c)), [[variance, 0.0], [0.0, variance]])
}

/// Covariance of a swaying body about the person's way, of a phase and direction that are not known.
pub(super) fn sway(config: &TrackConfig) -> Mat2 {
    let variance = 0.5 * (config.sway_left_m.powi(2) + config.sway_ahead_m.powi(2));
    [[variance, 0.0], [0.0, variance]]
}

/// One standard deviation along the longer axis of an ellipse.
fn largest_sigma(spread: Mat2) -> f64 {
    let (mean, half) = (0.5 * (spread[0][0] + spread[1][1]), 0.5 * (spread[0][0] - spread[1][1]));
    (mean + half.hypot(spread[0][1])).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    /// Variance for the filter of a whole body's height with so many returns, where a body in free sight gives 40.
    fn variance_m2(points: u32, beams_known: bool) -> f64 {
        let config = Config::default().track;
        let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::new(0.4, 0.4, config.height_mean_m) };
        let detection = Detection {
            position_m: DVec2::ZERO,
            covariance_m2: None,
            z_m: 0.9,
            time_ns: 0,
            points,
            swing: None,
            whole: true,
            top_m: config.height_mean_m,
            aabb,
            obb: Obb::from_aabb(&aabb),
        };
        noise(&config, &detection, &View { returns_alone: 40.0, beams_known, ..View::default() })[0][0]
    }

    #[test]
    fn few_returns_of_who_stands_behind_others_are_hardly_believed() {
        assert_eq!(variance_m2(20, true), variance_m2(40, true));
        assert!(
            variance_m2(8, true) > 4.0 * variance_m2(20, true),
            "{} {}",
            variance_m2(8, true),
            variance_m2(20, true)
        );
        assert!(variance_m2(2, true) > variance_m2(8, true));
    }

    #[test]
    fn few_returns_of_unknown_beams_are_believed_for_nobody_knows_how_many_there_should_be() {
        assert_eq!(variance_m2(8, false), variance_m2(40, false));
    }
}
