//! A walk planned along a trajectory: heading, phase of the stride, footprints and the height of the hips, in
//! steps of 10 ms.
//!
//! The phase advances with the travelled distance, so feet keep pace with the body at every speed. Each contact
//! leaves a footprint where the pelvis will be a little later; on it the foot stands still until it leaves (the
//! published gait alone slides by 0.2 to 0.4 m a step). Before and after its samples the trajectory is
//! continued evenly, so that a person who starts at walking speed has walked before.

use umbracast::geometry::DVec2;

use super::build::Build;
use super::facing;
use super::feet::{self, Footprint};
use super::fidget::Fidget;
use super::gait;
use super::individual::Individual;
use super::skeleton::{FootPose, PelvisPose};
use crate::crowd::Trajectory;

const STEP_NS: i64 = 10_000_000;
const STEP_S: f64 = 0.01;
/// Steps planned before the first and after the last sample: longer than the slowest stride that matters.
const PAD: usize = 300;
/// Slower than this a person stands: the heading is held and the feet come to rest.
const STANDING_MPS: f64 = 0.1;
/// From this speed on nobody fidgets.
const WALKING_MPS: f64 = 0.4;
/// Velocity is smoothed by a Gaussian of this width: a crowd model may turn at once, a body may not.
const SMOOTHING_S: f64 = 0.15;
/// Feet that are not under a standing body step there at this many strides a second.
const SETTLE_HZ: f64 = 0.9;
/// A foot this near to its place under a standing body may stay.
const HOME_M: f64 = 0.05;
/// Pelvis over the heel this much of a stride after contact.
const HEEL_UNDER_PELVIS: f64 = 0.18;
/// Roll of the pelvis of who stands on one leg, for each metre of its shift (from memory), and share of the trunk's turn
/// in which it takes part.
const LIST_RADPM: f64 = 1.5;
const PELVIS_TURNS: f64 = 0.3;
/// Share of a leg's length that a step may use, so that knees never lock.
const REACH: f64 = 0.995;

/// One instant of the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// The trunk's heading, not wrapped.
    pub heading_rad: f64,
    /// Smoothed speed.
    pub speed_mps: f64,
    /// Strides since the beginning: whole numbers are right heel contacts, halves left ones.
    pub phase: f64,
    /// The hip joints above the floor.
    pub hip_height_m: f64,
    /// Of who stands: how far the pelvis has shifted to the left, and how far the trunk has turned there.
    pub shift_m: f64,
    /// See `shift_m`.
    pub twist_rad: f64,
}

/// The whole plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Walk {
    start_ns: i64,
    instants: Vec<Instant>,
    /// Print `i` belongs to the contact at phase i / 2: even ones to the right foot.
    prints: Vec<Footprint>,
    own: Individual,
}

impl Walk {
    /// Plans the walk of a body; `first_phase` in [0, 1) tells people apart who start together, and `seed` draws where they
    /// face and how they fidget while they stand. Without one they face along their way, and hold that while they stand.
    pub fn plan(
        trajectory: &Trajectory,
        build: &Build,
        own: &Individual,
        first_phase: f64,
        seed: Option<u64>,
    ) -> Self {
        let positions = padded(trajectory);
        let velocities = smoothed(&positions);
        let headings = facing::headings(&velocities, STEP_S, STANDING_MPS, seed);
        let mut fidget = seed.map(Fidget::draw);
        let mut walk = Self {
            start_ns: trajectory.start_ns - PAD as i64 * STEP_NS,
            instants: velocities
                .iter()
                .zip(&headings)
                .map(|(velocity, &heading_rad)| {
                    let speed_mps = velocity.length();
                    let rest =
                        1.0 - feet::smoothstep((speed_mps - STANDING_MPS) / (WALKING_MPS - STANDING_MPS));
                    let [shift_m, twist_rad] = fidget.as_mut().map_or([0.0; 2], |f| f.after(STEP_S));
                    Instant {
                        heading_rad,
                        speed_mps,
                        phase: 0.0,
                        hip_height_m: build.hip_height_m(),
                        shift_m: rest * shift_m,
                        twist_rad: rest * twist_rad,
                    }
                })
                .collect(),
            prints: Vec::new(),
            own: *own,
        };
        walk.step(&positions, build, first_phase);
        walk.carry_hips(&positions, build);
        walk
    }

    /// The plan at a time of the trajectory.
    pub fn at(&self, time_ns: i64) -> Instant {
        let offset = (time_ns - self.start_ns) as f64 / STEP_NS as f64;
        let offset = offset.clamp(0.0, (self.instants.len() - 1) as f64);
        let i = (offset as usize).min(self.instants.len() - 2);
        let (a, b, u) = (&self.instants[i], &self.instants[i + 1], offset - i as f64);
        Instant {
            heading_rad: a.heading_rad + u * (b.heading_rad - a.heading_rad),
            speed_mps: a.speed_mps + u * (b.speed_mps - a.speed_mps),
            phase: a.phase + u * (b.phase - a.phase),
            hip_height_m: a.hip_height_m + u * (b.hip_height_m - a.hip_height_m),
            shift_m: a.shift_m + u * (b.shift_m - a.shift_m),
            twist_rad: a.twist_rad + u * (b.twist_rad - a.twist_rad),
        }
    }

    /// Gives every stride the same length at every speed; footprints are of no use then.
    pub fn keep_pace(&mut self, stride_m: f64) {
        let mut phase = self.instants[0].phase;
        for instant in &mut self.instants {
            phase += instant.speed_mps * STEP_S / stride_m;
            instant.phase = phase;
        }
    }

    /// From when until when the body stands still, time and again; what it did before and does after the plan goes on.
    pub fn rests_ns(&self) -> impl Iterator<Item = [i64; 2]> {
        let time_ns = |i: usize| self.start_ns + i as i64 * STEP_NS;
        let stands = |i: &usize| self.instants[*i].speed_mps < STANDING_MPS;
        let last = self.instants.len();
        let begins = (0..last).filter(move |&i| stands(&i) && (i == 0 || !stands(&(i - 1))));
        begins.map(move |begin| {
            let end = (begin..last).find(|i| !stands(i));
            [if begin == 0 { i64::MIN } else { time_ns(begin) }, end.map_or(i64::MAX, time_ns)]
        })
    }

    /// The footprints between which a foot is: the one it stands on or left last, and the next one.
    pub fn prints_of(&self, left: bool, phase: f64) -> [Footprint; 2] {
        let contact = (2.0 * (phase - if left { 0.5 } else { 0.0 })).floor().max(0.0) as usize;
        // The newest contact of this foot: an odd one for the left foot.
        let newest = contact - contact % 2 + usize::from(left);
        let last = self.prints.len() - 1;
        let current = self.prints[newest.min(last - (last + newest) % 2)];
        [current, self.prints.get(newest + 2).copied().unwrap_or(current)]
    }

    /// Runs the phase along the way and leaves the footprints.
    fn step(&mut self, positions: &[DVec2], build: &Build, first_phase: f64) {
        let last = positions.len() - 1;
        let own = self.own;
        let print_at = |i: usize, at: usize, contact: usize, instants: &[Instant]| {
            let (here, there) = (&instants[i], &instants[at]);
            feet::print(build, &own, contact, positions[at], there.heading_rad, here.speed_mps)
        };
        let mut phase = 1.0 + 0.5 * (2.0 * first_phase).floor();
        let mut contact = (2.0 * phase) as usize;
        for earlier in 0..=contact {
            self.prints.push(print_at(0, 0, earlier, &self.instants));
        }
        if self.instants[0].speed_mps >= STANDING_MPS {
            phase += first_phase % 0.5;
        }
        for i in 0..=last {
            let here = self.instants[i];
            let home = (contact - 1..=contact).all(|c| {
                let home = feet::print(build, &own, c, positions[i], here.heading_rad, 0.0);
                home.heel_m.distance(self.prints[c].heel_m) < HOME_M
            });
            let rate_hz = match (here.speed_mps < STANDING_MPS, home) {
                (true, true) if 2.0 * phase == contact as f64 => 0.0,
                (true, _) => SETTLE_HZ,
                (false, _) => self.pace_hz(i, positions[i], phase, contact, build),
            };
            phase += rate_hz * STEP_S;
            if (2.0 * phase) as usize > contact {
                contact += 1;
                if here.speed_mps < STANDING_MPS {
                    // A standing body rests only on both feet, so a step in the air is finished exactly.
                    phase = contact as f64 / 2.0;
                }
                let ahead_s = (HEEL_UNDER_PELVIS / rate_hz).min(0.45);
                let at = (i + (ahead_s / STEP_S) as usize).min(last);
                self.prints.push(print_at(i, at, contact, &self.instants));
                // Now that the weight changes over, the other foot leaves as the speed of the moment asks for,
                // and sooner where the body has run ahead of it.
                let lag_m = self.lag_m(i, positions[i], phase, contact - 1, build);
                let share = gait::stance_share(here.speed_mps / (0.53 * build.stature_m));
                let hurry = lag_m.max(0.0) / self.stride_m(i, build).max(f64::MIN_POSITIVE);
                self.prints[contact - 1].stance_share = (share - hurry).max(0.52);
            }
            self.instants[i].phase = phase;
        }
    }

    /// Strides a second: the published cadence, faster while a foot lags behind the body (after a sudden start).
    fn pace_hz(&self, i: usize, position_m: DVec2, phase: f64, contact: usize, build: &Build) -> f64 {
        let stride_m = self.stride_m(i, build);
        let lag_m = (contact - 1..=contact)
            .filter(|&c| phase - c as f64 / 2.0 < self.prints[c].stance_share)
            .map(|c| self.lag_m(i, position_m, phase, c, build))
            .fold(0.0, f64::max);
        self.instants[i].speed_mps / stride_m * (1.0 + (2.5 * lag_m / stride_m).min(1.0))
    }

    /// How much farther behind than in an even walk a print lies.
    fn lag_m(&self, i: usize, position_m: DVec2, phase: f64, contact: usize, build: &Build) -> f64 {
        let expected_m = (phase - contact as f64 / 2.0 - HEEL_UNDER_PELVIS) * self.stride_m(i, build);
        let ahead = DVec2::from_angle(self.instants[i].heading_rad);
        (position_m - self.prints[contact].heel_m).dot(ahead) - expected_m
    }

    fn stride_m(&self, i: usize, build: &Build) -> f64 {
        gait::stride_m(self.instants[i].speed_mps, build.stature_m, &self.own)
    }

    /// Lets the hips ride as high as the legs reach, smoothed: an inverted pendulum over each stance leg.
    fn carry_hips(&mut self, positions: &[DVec2], build: &Build) {
        let reach_m = REACH * (build.thigh_m() + build.shank_m());
        let standing_m = build.hip_height_m() - 0.006;
        let limits: Vec<f64> = (0..positions.len())
            .map(|i| {
                let here = self.instants[i];
                let upper = upper_body(&here, build, &self.own);
                let pelvis = PelvisPose::new(positions[i], here.heading_rad, &upper, 0.0);
                let feet = foot_poses(self, &here, build);
                let limit = |side: f64, ankle: umbracast::geometry::DVec3| {
                    let hip = pelvis.hip_m(build, side);
                    let across2 = hip.truncate().distance_squared(ankle.truncate());
                    ankle.z + (reach_m * reach_m - across2).max(0.0).sqrt() - hip.z
                };
                standing_m.min(limit(1.0, feet[0].ankle_m)).min(limit(-1.0, feet[1].ankle_m))
            })
            .collect();
        // The mean of the minima around never exceeds the limit itself.
        const HALF: usize = 6;
        let around = |i: usize| i.saturating_sub(HALF)..(i + HALF + 1).min(limits.len());
        let minima: Vec<f64> = (0..limits.len())
            .map(|i| limits[around(i)].iter().fold(f64::INFINITY, |a, &b| a.min(b)))
            .collect();
        for i in 0..limits.len() {
            let window = &minima[around(i)];
            let mean = window.iter().sum::<f64>() / window.len() as f64;
            self.instants[i].hip_height_m = mean.max(0.7 * standing_m);
        }
    }
}

/// Pelvis, trunk and arms at an instant; below walking speed the swing fades out.
pub fn upper_body(instant: &Instant, build: &Build, own: &Individual) -> gait::UpperBody {
    let fade = (instant.speed_mps / STANDING_MPS).min(1.0);
    let relative_speed = instant.speed_mps * fade / (0.53 * build.stature_m);
    let mut upper = gait::upper_body(instant.phase.rem_euclid(1.0), relative_speed, own);
    upper.pelvis_left_m += instant.shift_m;
    // The hip without weight hangs lower.
    upper.pelvis_list_rad += LIST_RADPM * instant.shift_m;
    upper.pelvis_yaw_rad += PELVIS_TURNS * instant.twist_rad;
    upper.thorax_yaw_rad += instant.twist_rad;
    upper
}

/// Both feet at an instant, left and right.
pub fn foot_poses(walk: &Walk, instant: &Instant, build: &Build) -> [FootPose; 2] {
    [true, false].map(|left| {
        let [current, next] = walk.prints_of(left, instant.phase);
        let stood = instant.phase - current.contact;
        let amount = roll(instant, build, &walk.own);
        if stood <= current.stance_share {
            feet::standing_on(&current, stood / current.stance_share, amount, build)
        } else {
            let air = (next.contact - current.contact - current.stance_share).max(1e-6);
            let progress = ((stood - current.stance_share) / air).min(1.0);
            feet::swinging([&current, &next], progress, amount, build, &walk.own)
        }
    })
}

/// How much of the foot's roll is there: all of it in strides of 1.4 m, none while standing.
fn roll(instant: &Instant, build: &Build, own: &Individual) -> f64 {
    let stride_m = gait::stride_m(instant.speed_mps, build.stature_m, own);
    (stride_m / 1.4).min(1.0) * (instant.speed_mps / STANDING_MPS).min(1.0)
}

/// The trajectory every 10 ms, continued evenly at both ends.
fn padded(trajectory: &Trajectory) -> Vec<DVec2> {
    let length_ns = trajectory.step_ns * (trajectory.positions_m.len() as i64 - 1).max(0);
    let steps = length_ns / STEP_NS;
    let at = |i: i64| trajectory.at(trajectory.start_ns + i * STEP_NS).unwrap_or_default();
    let ((first, v_first), (last, v_last)) = (at(0), at(steps));
    let pad = PAD as i64;
    (-pad..=steps + pad)
        .map(|i| match i {
            i if i < 0 => first + v_first * (i as f64 * STEP_S),
            i if i > steps => last + v_last * ((i - steps) as f64 * STEP_S),
            i => at(i).0,
        })
        .collect()
}

fn smoothed(positions: &[DVec2]) -> Vec<DVec2> {
    let half = (3.0 * SMOOTHING_S / STEP_S) as usize;
    let weight = |k: usize| (-0.5 * (k as f64 * STEP_S / SMOOTHING_S).powi(2)).exp();
    let weights: Vec<f64> = (0..=half).map(weight).collect();
    let last = positions.len() - 1;
    let raw = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (positions[b] - positions[a]) / ((b - a).max(1) as f64 * STEP_S)
    };
    let velocities: Vec<DVec2> = (0..=last).map(raw).collect();
    let total = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    (0..=last)
        .map(|i| {
            let pair = |k: usize| velocities[i.saturating_sub(k)] + velocities[(i + k).min(last)];
            let sum = velocities[i] * weights[0] + (1..=half).map(|k| pair(k) * weights[k]).sum::<DVec2>();
            sum / total
        })
        .collect()
}
