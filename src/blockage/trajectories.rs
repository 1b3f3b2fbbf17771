//! Samples of one person's next second: the path of each, and what stays constant through its steps.
//!
//! All data are arrays by sample, in single precision and relative to the mean of the step, so that loops over
//! samples run in vector registers.

use super::body;
use super::draws::Draws;
use super::figure::{Figure, RODS};
use super::lanes::{WORD, cos_sin, larger, smaller};
use super::numbers::Numbers;
use super::phases::Phases;
use super::spread::Spread;
use super::steps::{heading_at, position_at};
use crate::forecast::Forecast;
use crate::gait::{self, FOREMOST_RAD, Gait, HAND_SWING, LEFTMOST_RAD, WALKS_FROM_MPS, sway_share};
use crate::geometry::DVec2;
use crate::site::{Hall, Ue};
use crate::track::Track;
use crate::{STEP_S, STEPS};

/// Now and every step.
pub(crate) const MOMENTS: usize = STEPS + 1;

/// Everybody in it is within `radius_m` of `center_m`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Disc {
    pub(crate) center_m: DVec2,
    pub(crate) radius_m: f64,
}

/// Samples of one person, in whole words. What belongs to step s and sample k stands at `s * samples + k`; step 0 is now.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trajectories {
    pub(crate) samples: usize,
    /// How many of them were asked for.
    asked: usize,
    pub(crate) track: u64,
    /// The track whose thing this is.
    pub(crate) part_of: Option<u64>,
    /// By step: the mean, round which the samples lie.
    pub(crate) mean_m: [DVec2; MOMENTS],
    /// By step: how far.
    pub(crate) spread: [Spread; MOMENTS],
    /// By step: the heading's unit vector, to be turned by the sample's turn.
    pub(crate) ahead: [DVec2; MOMENTS],
    /// By step and sample: from the step's mean.
    pub(crate) off_m: [Vec<f32>; 2],
    /// By step: how high the floor is at the mean, on which all samples stand; then the least and the most of them.
    pub(crate) floor_m: [f64; MOMENTS],
    pub(crate) floors_m: [f64; 2],
    /// The samples of all steps.
    pub(crate) second: Disc,
    /// The least and the most of all samples.
    pub(crate) heights_m: [f64; 2],
    /// One over both.
    pub(super) per_height: [f64; 2],
    /// No part of a sample's body is higher, as a share of its height,
    /// or farther from its position; the same of what each plan holds.
    pub(super) top: f64,
    pub(super) reach_m: f64,
    pub(super) reach_of_m: Vec<f64>,
    /// By sample.
    pub(crate) height_m: Vec<f32>,
    pub(crate) width_scale: Vec<f32>,
    pub(crate) turn_rad: Vec<f32>,
    /// By sample: how far ahead of the axis, left of it, and above its mean height the device is. Empty where it is on the axis.
    pub(crate) device_m: [Vec<f32>; 3],
    speed_mps: Vec<f32>,
    of_track: Gait,
    /// Factors on how far arms swing on the mean, right and left; samples have that, and a share `swing_by` more or less at most.
    pub(super) swings: [f64; 2],
    swing_by: f64,
    /// Phases of even shares, in their order.
    even_rad: Vec<f32>,
    pub(super) gait: Walking,
    /// Of this person's outline.
    figure: Option<Figure>,
    /// Offset and drift of each sample at the step that is drawn.
    state: [Vec<f32>; 4],
}

/// How samples walk.
#[derive(Debug, Clone, Default)]
pub(super) struct Walking {
    /// By step and sample: the swaying axis of the trunk, from the step's mean.
    pub(super) axis_m: [Vec<f32>; 2],
    /// By step and sample: the unit vector that the trunk faces.
    pub(super) own: [Vec<f32>; 2],
    /// By step and sample: how far the arms swing, left ahead, as speed over hip height.
    pub(super) wave_hz: Vec<f32>,
    /// By sample: speed over hip height of whoever swings the arms; 0 for arms that hang still.
    pub(super) swing_hz: Vec<f32>,
    /// By sample: cosine and sine of the trunk's turn from the heading, of the phase at the step that is worked out, and of
    /// what it turns in a step; the sway's share in metres.
    turn: [Vec<f32>; 2],
    phase: [Vec<f32>; 2],
    step: [Vec<f32>; 2],
    sway_m: Vec<f32>,
}

impl Trajectories {
    /// Draws so many samples of a track, up to whole words.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        numbers: &Numbers,
        figure: &Figure,
        draws: &Draws,
        samples: usize,
        track: &Track,
        forecast: &Forecast,
    ) {
        self.samples = samples.next_multiple_of(WORD);
        self.asked = numbers.samples;
        self.track = track.id;
        self.part_of = track.part_of;
        self.of_track = track.gait;
        let [left, right] = track.gait.hand_swing.map(|swing| swing / HAND_SWING);
        (self.swings, self.swing_by) = ([right, left], swing_by(&track.gait));
        self.mean_m = std::array::from_fn(|s| position_at(track, forecast, s));
        self.ahead = std::array::from_fn(|s| DVec2::from_angle(heading_at(track, forecast, s)));
        self.start(draws, &root(&forecast.coupling.state));
        self.take_traits(numbers, draws, track);
        // Process noise: a constant acceleration over each step with the step's share of the white one.
        let noise_root_mps2 =
            root(&forecast.coupling.acceleration_psd_m2ps3.map(|row| row.map(|psd| psd / STEP_S)));
        self.off_m.iter_mut().for_each(|off_m| off_m.resize(MOMENTS * self.samples, 0.0));
        for s in 0..MOMENTS {
            if s > 0 {
                self.go_on(&draws.process_noise[s - 1], noise_root_mps2);
            }
            self.place(s, numbers.joint);
        }
        let own = self.figure.get_or_insert_with(|| figure.clone());
        own.take_outline(figure, track);
        self.bound();
    }

    /// The body that stands in the way of others.
    pub(super) fn own_figure<'a>(&'a self, usual: &'a Figure) -> &'a Figure {
        self.figure.as_ref().unwrap_or(usual)
    }

    /// Where each sample has the device.
    pub(super) fn hold(&mut self, ue: &Ue, draws: &Draws) {
        let samples = if ue.is_on_axis() { 0 } else { self.samples };
        let (mean_m, spread_m) = ([ue.forward_m, ue.left_m, 0.0].map(|m| m as f32), ue.spread_m as f32);
        for ((device_m, mean_m), z) in self.device_m.iter_mut().zip(mean_m).zip(&draws.device) {
            renew(device_m, z[..samples].iter().map(|z| mean_m + spread_m * z));
        }
    }

    /// The device as sample `k` has it.
    #[cfg(test)]
    pub(crate) fn device_of(&self, ue: &Ue, k: usize) -> Ue {
        if ue.is_on_axis() {
            return *ue;
        }
        let [forward_m, left_m, up_m] = [0, 1, 2].map(|i| f64::from(self.device_m[i][k]));
        let height_share = ue.height_share + up_m / f64::from(self.height_m[k]);
        Ue { forward_m, left_m, height_share, ..*ue }
    }

    /// The floor below each step.
    pub(super) fn stand_on(&mut self, hall: &Hall) {
        self.floor_m = self.mean_m.map(|mean_m| hall.floor_m(mean_m));
        let least_and_most = |[least, most]: [f64; 2], m: &f64| [m.min(least), m.max(most)];
        self.floors_m = self.floor_m.iter().fold([self.floor_m[0]; 2], least_and_most);
    }

    /// The samples' errors now: of position and of velocity.
    #[inline(always)]
    fn start(&mut self, draws: &Draws, root: &[[f64; 4]; 4]) {
        let z = &draws.state;
        for (r, (state, row)) in self.state.iter_mut().zip(root).enumerate() {
            let row = row.map(|x| x as f32);
            renew(state, z[0][..self.samples].iter().map(|z| row[0] * z));
            for (weight, z) in row[1..=r].iter().zip(&z[1..]) {
                state.iter_mut().zip(z).for_each(|(state, z)| *state += weight * z);
            }
        }
    }

    /// One step: the drift goes on, the noise pushes.
    #[inline(always)]
    fn go_on(&mut self, noise: &[Vec<f32>; 2], noise_root_mps2: [[f64; 2]; 2]) {
        const STEP: f32 = STEP_S as f32;
        let [[xx, _], [xy, yy]] = noise_root_mps2.map(|row| row.map(|x| x as f32));
        let [x, y, vx, vy] = &mut self.state;
        let n = x.len();
        let (y, vx, vy, [a, b]) = (&mut y[..n], &mut vx[..n], &mut vy[..n], [&noise[0][..n], &noise[1][..n]]);
        for k in 0..n {
            let push_mps2 = [xx * a[k], xy * a[k] + yy * b[k]];
            x[k] += vx[k] * STEP + push_mps2[0] * (0.5 * STEP * STEP);
            y[k] += vy[k] * STEP + push_mps2[1] * (0.5 * STEP * STEP);
            vx[k] += push_mps2[0] * STEP;
            vy[k] += push_mps2[1] * STEP;
        }
    }

    /// Puts the samples round the mean of a step.
    #[inline(always)]
    fn place(&mut self, s: usize, joint: bool) {
        let [x, y, ..] = &self.state;
        self.spread[s] = Spread::of(x, y);
        // Drawn each by itself: every step takes its positions from other samples.
        let first = if joint { 0 } else { s * 37 % self.samples };
        let row = s * self.samples..(s + 1) * self.samples;
        for (off_m, state) in self.off_m.iter_mut().zip([x, y]) {
            let (begin, end) = off_m[row.clone()].split_at_mut(first);
            let (head, tail) = state.split_at(self.samples - first);
            end.copy_from_slice(head);
            begin.copy_from_slice(tail);
        }
    }

    /// What stays through the steps of a sample.
    #[inline(always)]
    fn take_traits(&mut self, numbers: &Numbers, draws: &Draws, track: &Track) {
        let velocity = track.velocity_mps;
        let walks = velocity.length() > WALKS_FROM_MPS;
        let trunk_rad = numbers.heading_sigma_rad;
        let turn_sigma_rad = if walks { trunk_rad } else { track.heading_sigma_rad.hypot(trunk_rad) } as f32;
        let (height_m, width) = (track.height_m as f32, track.width_scale as f32);
        let height_sigma_m = track.height_sigma_m.hypot(numbers.height_sigma_m) as f32;
        let width_sigma = track.width_scale_sigma.hypot(numbers.width_sigma) as f32;
        let [vx, vy] = velocity.to_array().map(|v| v as f32);
        // Who walks faces where he goes: an error of the velocity is one of the heading.
        let per2 = if walks { 1.0 / velocity.length_squared() as f32 } else { 0.0 };
        let drifts = || self.state[2].iter().zip(&self.state[3]);
        renew(
            &mut self.height_m,
            draws.height[..self.samples].iter().map(|z| larger(height_m + height_sigma_m * z, 0.5)),
        );
        renew(
            &mut self.width_scale,
            draws.width[..self.samples].iter().map(|z| smaller(larger(width + width_sigma * z, 0.5), 1.8)),
        );
        renew(&mut self.speed_mps, drifts().map(|(x, y)| ((vx + x) * (vx + x) + (vy + y) * (vy + y)).sqrt()));
        renew(
            &mut self.turn_rad,
            drifts().zip(&draws.heading).map(|((x, y), z)| (vx * y - vy * x) * per2 + turn_sigma_rad * z),
        );
        if !walks && track.heading_behind > 0.0 {
            // The phase of who stands turns nothing: its draw is free.
            let behind = track.heading_behind as f32;
            let turned = self.turn_rad.iter_mut().zip(&draws.phase).filter(|(_, share)| **share < behind);
            turned.for_each(|(turn_rad, _)| *turn_rad += std::f32::consts::PI);
        }
    }

    /// How far the samples and their bodies reach.
    #[inline(always)]
    fn bound(&mut self) {
        let Some(figure) = &self.figure else { return };
        let largest = |values: &[f32]| values.iter().fold(0.0_f32, |a, b| larger(a, *b));
        let least_m = self.height_m.iter().fold(f32::MAX, |a, b| smaller(a, *b));
        self.heights_m = [least_m, largest(&self.height_m)].map(f64::from);
        self.per_height = self.heights_m.map(|height_m| 1.0 / height_m);
        let (height_m, width) = (self.heights_m[1], f64::from(largest(&self.width_scale)).max(1.0));
        // Arms that swing farther are as those of somebody who is faster.
        let swing = self.swings[0].abs().max(self.swings[1].abs()) * (1.0 + self.swing_by);
        let fastest_hz = swing * body::relative_speed_hz(f64::from(largest(&self.speed_mps)), height_m);
        self.top = figure.top();
        self.reach_of_m.clear();
        let arms: [f64; RODS] = std::array::from_fn(|i| {
            figure.plans.get(i).map_or(0.0, |plan| plan.arms_reach(width, fastest_hz))
        });
        let plans = figure.plans.chunks_exact(RODS).flat_map(|of_stretch| of_stretch.iter().zip(&arms));
        self.reach_of_m.extend(plans.map(|(plan, arms)| height_m * plan.reach(width, *arms)));
        self.reach_m = self.reach_of_m.iter().fold(0.0, |a, b| b.max(a));
        let ends = self.mean_m.iter();
        let (least, most) =
            ends.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        let center_m = 0.5 * (least + most);
        let far = |(mean_m, spread): (&DVec2, &Spread)| mean_m.distance(center_m) + spread.radius_m;
        let radius_m = self.mean_m.iter().zip(&self.spread).map(far).fold(0.0, f64::max);
        self.second = Disc { center_m, radius_m };
    }

    /// Works out how the samples walk and face.
    #[inline(always)]
    pub(super) fn walk(&mut self, figure: &Figure, draws: &Draws) {
        let (n, gait) = (self.samples, &mut self.gait);
        let [axis_x, axis_y] = &mut gait.axis_m;
        let [own_x, own_y] = &mut gait.own;
        for by_step in [axis_x, axis_y, own_x, own_y, &mut gait.wave_hz] {
            by_step.resize(MOMENTS * n, 0.0);
        }
        for by_sample in [&mut gait.swing_hz, &mut gait.sway_m, &mut gait.step[0], &mut gait.phase[0]] {
            by_sample.resize(n, 0.0);
        }
        let (speed_mps, height_m) = (&self.speed_mps[..n], &self.height_m[..n]);
        let (swing_hz, sway_m) = (&mut gait.swing_hz[..n], &mut gait.sway_m[..n]);
        let (step_rad, arm_swing) = (&mut gait.step[0][..n], &draws.arm_swing[..n]);
        for k in 0..n {
            let (speed_mps, height_m) = (f64::from(speed_mps[k]), f64::from(height_m[k]));
            let speed_hz = body::relative_speed_hz(speed_mps, height_m);
            swing_hz[k] = (speed_hz * swing_of(self.swing_by, arm_swing[k])) as f32;
            sway_m[k] = (sway_share(speed_hz) * height_m) as f32;
            step_rad[k] = (gait::stride_hz(speed_mps, height_m) * RAD_OF_STRIDES) as f32;
        }
        cos_sin(&mut gait.step);
        gait.turn[0].clone_from(&self.turn_rad);
        cos_sin(&mut gait.turn);
        // The shares of the phases are those of as many even ones, in any order.
        let asked = self.asked;
        let phases = Phases::new(&self.of_track);
        self.even_rad.clear();
        self.even_rad.extend(phases.even(asked).map(|rad| rad as f32));
        for (phase_rad, share) in gait.phase[0].iter_mut().zip(&draws.phase) {
            *phase_rad = self.even_rad[(share * asked as f32) as usize];
        }
        cos_sin(&mut gait.phase);
        for step in 0..MOMENTS {
            let off_m = [0, 1].map(|i| &self.off_m[i][step * n..(step + 1) * n]);
            gait.walk_step(figure, step, self.ahead[step], off_m);
        }
    }
}

/// Of the phase in a step, for each stride a second.
const RAD_OF_STRIDES: f64 = std::f64::consts::TAU * STEP_S;

impl Walking {
    /// One step of all samples; their phases go on to the next.
    #[inline(always)]
    fn walk_step(&mut self, figure: &Figure, step: usize, ahead: DVec2, [off_x, off_y]: [&[f32]; 2]) {
        let n = off_x.len();
        let off_y = &off_y[..n];
        let row = step * n..(step + 1) * n;
        let [axis_x, axis_y] = &mut self.axis_m;
        let (axis_x, axis_y) = (&mut axis_x[row.clone()][..n], &mut axis_y[row.clone()][..n]);
        let [own_x, own_y] = &mut self.own;
        let (own_x, own_y) = (&mut own_x[row.clone()][..n], &mut own_y[row.clone()][..n]);
        let wave_hz = &mut self.wave_hz[row][..n];
        let (turn_x, turn_y) = (&self.turn[0][..n], &self.turn[1][..n]);
        let [phase_x, phase_y] = &mut self.phase;
        let (phase_x, phase_y) = (&mut phase_x[..n], &mut phase_y[..n]);
        let (step_x, step_y) = (&self.step[0][..n], &self.step[1][..n]);
        let (sway_m, swing_hz) = (&self.sway_m[..n], &self.swing_hz[..n]);
        let [leftmost, foremost] = [LEFTMOST_RAD, FOREMOST_RAD].map(|at| [at.cos() as f32, at.sin() as f32]);
        let (sway_ahead, sway_left) = (figure.sway_ahead as f32, figure.sway_left as f32);
        let [ahead_x, ahead_y] = ahead.to_array().map(|x| x as f32);
        for k in 0..n {
            let (x, y) =
                (ahead_x * turn_x[k] - ahead_y * turn_y[k], ahead_y * turn_x[k] + ahead_x * turn_y[k]);
            // The trunk rides over the foot that stands, once a stride, and goes ahead and back with every step.
            let (cos, sin) = (phase_x[k], phase_y[k]);
            let from_foremost = cos * foremost[0] + sin * foremost[1];
            let fore_m = sway_ahead * sway_m[k] * (2.0 * from_foremost * from_foremost - 1.0);
            let left_m = sway_left * sway_m[k] * (cos * leftmost[0] + sin * leftmost[1]);
            (own_x[k], own_y[k]) = (x, y);
            (axis_x[k], axis_y[k]) = (off_x[k] + fore_m * x - left_m * y, off_y[k] + fore_m * y + left_m * x);
            wave_hz[k] = swing_hz[k] * cos;
            // The phase turns by the same angle in every step.
            (phase_x[k], phase_y[k]) = (cos * step_x[k] - sin * step_y[k], sin * step_x[k] + cos * step_y[k]);
        }
    }
}

/// How much arms may swing more or less than on the mean, as a share: evenly up to so much, so that the standard deviation is right.
fn swing_by(gait: &Gait) -> f64 {
    let [left, right] = gait.hand_swing.map(|swing| swing.max(0.5 * HAND_SWING));
    let [left_sigma, right_sigma] = gait.hand_swing_sigma;
    (3.0_f64.sqrt() * (left_sigma + right_sigma) / (left + right)).min(1.0)
}

/// The factor on the mean swing of a sample, by its even draw.
#[inline(always)]
fn swing_of(swing_by: f64, even: f32) -> f64 {
    1.0 + swing_by * (2.0 * f64::from(even) - 1.0)
}

#[inline(always)]
fn renew(values: &mut Vec<f32>, new: impl Iterator<Item = f32>) {
    values.clear();
    values.extend(new);
}

/// Lower Cholesky factor of a covariance; a direction without variance gets none.
fn root<const N: usize>(a: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut l = [[0.0; N]; N];
    for r in 0..N {
        for c in 0..=r {
            let rest = a[r][c] - (0..c).map(|i| l[r][i] * l[c][i]).sum::<f64>();
            l[r][c] = if r == c {
                rest.max(0.0).sqrt()
            } else if l[c][c] > 0.0 {
                rest / l[c][c]
            } else {
                0.0
            };
        }
    }
    l
}

#[cfg(test)]
impl Trajectories {
    /// How a sample stands or walks at a step, for bodies that are asked one by one.
    pub(super) fn posture(&self, draws: &Draws, step: usize, k: usize) -> body::Posture {
        let (speed_mps, height_m) = (f64::from(self.speed_mps[k]), f64::from(self.height_m[k]));
        let phases = Phases::new(&self.of_track);
        let walked_rad = gait::stride_hz(speed_mps, height_m) * RAD_OF_STRIDES * step as f64;
        let off_m = [0, 1].map(|i| f64::from(self.off_m[i][step * self.samples + k]));
        body::Posture {
            position_m: self.mean_m[step] + DVec2::from(off_m),
            ahead: self.ahead[step].rotate(DVec2::from_angle(f64::from(self.turn_rad[k]))),
            height_m,
            width_scale: f64::from(self.width_scale[k]),
            speed_mps,
            phase_rad: phases.at(f64::from(draws.phase[k])) + walked_rad,
            arm_swing: self.swings.map(|swing| swing * swing_of(self.swing_by, draws.arm_swing[k])),
        }
    }
}
