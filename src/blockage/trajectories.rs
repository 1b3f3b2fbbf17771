//! Samples of one person's next second: where each goes, and what stays through its steps.
//!
//! Everything lies in arrays by sample, so that loops over samples run in vector registers. What only a body in somebody's
//! way needs, its gait above all, is worked out when it is first asked for ([`Trajectories::walk`]).

use std::f64::consts::TAU;

use super::body;
use super::draws::Draws;
use super::numbers::Numbers;
use super::phases::Phases;
use super::steps::{heading_at, position_at};
use crate::forecast::Forecast;
use crate::gait::{self, GaitPhase, WALKS_FROM_MPS, sway_share};
use crate::geometry::DVec2;
use crate::track::Track;
use crate::{STEP_S, STEPS};

/// Now and every step.
pub(super) const MOMENTS: usize = STEPS + 1;

/// Everybody in it is within `radius_m` of `center_m`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Disc {
    pub(super) center_m: DVec2,
    pub(super) radius_m: f64,
}

/// Samples of one person. What belongs to step s and sample k stands at `s * samples + k`; step 0 is now.
#[derive(Debug, Clone, Default)]
pub(super) struct Trajectories {
    pub(super) samples: usize,
    pub(super) track: u64,
    /// By step and sample.
    pub(super) x_m: Vec<f64>,
    pub(super) y_m: Vec<f64>,
    /// The same from the middle of the step's disc, for tests that need not be exact.
    pub(super) off_x_m: Vec<f32>,
    pub(super) off_y_m: Vec<f32>,
    /// By step: the heading's unit vector, to be turned by the sample's turn.
    pub(super) ahead: [DVec2; MOMENTS],
    /// By step: the samples.
    pub(super) discs: [Disc; MOMENTS],
    /// The samples of all steps.
    pub(super) second: Disc,
    pub(super) height_min_m: f64,
    pub(super) height_max_m: f64,
    /// No part of a sample's body is farther from its position.
    pub(super) reach_m: f64,
    /// By sample.
    pub(super) height_m: Vec<f64>,
    pub(super) width_scale: Vec<f64>,
    pub(super) turn_rad: Vec<f64>,
    speed_mps: Vec<f64>,
    phase: Option<GaitPhase>,
    /// Empty until the body is in somebody's way.
    pub(super) gait: Gait,
    /// Offset and drift of each sample at the step that is drawn.
    state: [Vec<f64>; 4],
}

/// How samples walk.
#[derive(Debug, Clone, Default)]
pub(super) struct Gait {
    /// By sample: cosine and sine of the trunk's turn from the heading.
    pub(super) turn: [Vec<f64>; 2],
    /// By sample: share of the full sway of the trunk.
    pub(super) sway: Vec<f64>,
    /// By sample: speed over hip height of whoever swings the arms; 0 for arms that hang still.
    pub(super) swing_hz: Vec<f64>,
    /// By step and sample: cosine and sine of the phase since the right heel touched the floor.
    pub(super) phase: [Vec<f64>; 2],
    pub(super) rough: Rough,
    known: bool,
}

/// A body's samples in single precision, for tests that need not be exact.
#[derive(Debug, Clone, Default)]
pub(super) struct Rough {
    /// By sample, as in [`Trajectories`] and [`Gait`].
    pub(super) height_m: Vec<f32>,
    pub(super) width: Vec<f32>,
    pub(super) turn: [Vec<f32>; 2],
    pub(super) sway: Vec<f32>,
    pub(super) swing: Vec<f32>,
    /// By step and sample.
    pub(super) phase: [Vec<f32>; 2],
}

impl Rough {
    /// In the order of the fields.
    fn round(&mut self, exact: [&[f64]; 8]) {
        let [to_x, to_y] = &mut self.turn;
        let [of_x, of_y] = &mut self.phase;
        let rounded =
            [&mut self.height_m, &mut self.width, to_x, to_y, &mut self.sway, &mut self.swing, of_x, of_y];
        for (rounded, exact) in rounded.into_iter().zip(exact) {
            rounded.clear();
            rounded.extend(exact.iter().map(|x| *x as f32));
        }
    }
}

impl Trajectories {
    /// Draws all samples of a track.
    pub(super) fn fill(&mut self, numbers: &Numbers, draws: &Draws, track: &Track, forecast: &Forecast) {
        self.samples = numbers.samples;
        self.track = track.id;
        self.phase = Some(track.gait);
        self.gait.known = false;
        self.ahead = std::array::from_fn(|s| DVec2::from_angle(heading_at(track, forecast, s)));
        self.start(draws, &root(&forecast.coupling.state));
        self.take_traits(numbers, draws, track);
        // Process noise: a constant acceleration over each step with the step's share of the white one.
        let noise_root_mps2 =
            root(&forecast.coupling.acceleration_psd_m2ps3.map(|row| row.map(|psd| psd / STEP_S)));
        for moments in [&mut self.x_m, &mut self.y_m] {
            moments.resize(MOMENTS * self.samples, 0.0);
        }
        for moments in [&mut self.off_x_m, &mut self.off_y_m] {
            moments.resize(MOMENTS * self.samples, 0.0);
        }
        for s in 0..MOMENTS {
            if s > 0 {
                self.go_on(&draws.process_noise[s - 1], noise_root_mps2);
            }
            self.place(s, position_at(track, forecast, s), numbers.joint);
        }
        self.bound(numbers);
    }

    /// The samples' errors now: of position and of velocity.
    fn start(&mut self, draws: &Draws, root: &[[f64; 4]; 4]) {
        let z = &draws.state;
        for (r, (state, row)) in self.state.iter_mut().zip(root).enumerate() {
            state.clear();
            state.extend(z[0].iter().map(|z| row[0] * z));
            for (weight, z) in row[1..=r].iter().zip(&z[1..]) {
                state.iter_mut().zip(z).for_each(|(state, z)| *state += weight * z);
            }
        }
    }

    /// One step: the drift goes on, the noise pushes.
    fn go_on(&mut self, noise: &[Vec<f64>; 2], [[xx, _], [xy, yy]]: [[f64; 2]; 2]) {
        let [x, y, vx, vy] = &mut self.state;
        let n = x.len();
        let (y, vx, vy, [a, b]) = (&mut y[..n], &mut vx[..n], &mut vy[..n], [&noise[0][..n], &noise[1][..n]]);
        for k in 0..n {
            let push_mps2 = [xx * a[k], xy * a[k] + yy * b[k]];
            x[k] += vx[k] * STEP_S + push_mps2[0] * (0.5 * STEP_S * STEP_S);
            y[k] += vy[k] * STEP_S + push_mps2[1] * (0.5 * STEP_S * STEP_S);
            vx[k] += push_mps2[0] * STEP_S;
            vy[k] += push_mps2[1] * STEP_S;
        }
    }

    /// Puts the samples round the mean of a step.
    fn place(&mut self, s: usize, mean_m: DVec2, joint: bool) {
        let [x, y, ..] = &self.state;
        let row = s * self.samples..(s + 1) * self.samples;
        let (x_m, y_m) = (&mut self.x_m[row.clone()], &mut self.y_m[row.clone()]);
        let (off_x_m, off_y_m) = (&mut self.off_x_m[row.clone()], &mut self.off_y_m[row]);
        for (k, (x, y)) in x.iter().zip(y).enumerate() {
            // Drawn each by itself: every step takes its positions from other samples.
            let at = if joint { k } else { (k + s * 37) % self.samples };
            (x_m[at], y_m[at]) = (mean_m.x + x, mean_m.y + y);
            (off_x_m[at], off_y_m[at]) = (*x as f32, *y as f32);
        }
        let farthest2 = x.iter().zip(y).fold(0.0_f64, |far, (x, y)| far.max(x * x + y * y));
        self.discs[s] = Disc { center_m: mean_m, radius_m: farthest2.sqrt() + ROUNDED_M };
    }

    /// What stays through the steps of a sample.
    fn take_traits(&mut self, numbers: &Numbers, draws: &Draws, track: &Track) {
        let velocity = track.velocity_mps;
        let walks = velocity.length() > WALKS_FROM_MPS;
        let trunk_rad = numbers.heading_sigma_rad;
        let turn_sigma_rad = if walks { trunk_rad } else { track.heading_sigma_rad.hypot(trunk_rad) };
        let height_sigma_m = track.height_sigma_m.hypot(numbers.height_sigma_m);
        let width_sigma = track.width_scale_sigma.hypot(numbers.width_sigma);
        let velocity2 = velocity.length_squared();
        let drifts = || self.state[2].iter().zip(&self.state[3]).map(|(x, y)| DVec2::new(*x, *y));
        renew(
            &mut self.height_m,
            draws.height.iter().map(|z| (track.height_m + height_sigma_m * z).max(0.5)),
        );
        renew(
            &mut self.width_scale,
            draws.width.iter().map(|z| (track.width_scale + width_sigma * z).clamp(0.5, 1.8)),
        );
        renew(&mut self.speed_mps, drifts().map(|drift| (velocity + drift).length()));
        renew(
            &mut self.turn_rad,
            drifts().zip(&draws.heading).map(|(drift, z)| {
                // Who walks faces where he goes: an error of the velocity is one of the heading.
                let turned_rad = if walks { velocity.perp_dot(drift) / velocity2 } else { 0.0 };
                turned_rad + turn_sigma_rad * z
            }),
        );
    }

    /// How far the samples and their bodies reach.
    fn bound(&mut self, numbers: &Numbers) {
        let largest = |values: &[f64], least: f64| values.iter().fold(least, |a, b| a.max(*b));
        self.height_min_m = self.height_m.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        self.height_max_m = largest(&self.height_m, 0.0);
        let (width_max, fastest_mps) = (largest(&self.width_scale, 1.0), largest(&self.speed_mps, 0.0));
        self.reach_m = body::reach_m(&numbers.body, self.height_max_m, width_max, fastest_mps);
        let ends = self.discs.iter().map(|disc| disc.center_m);
        let (least, most) =
            ends.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        let center_m = 0.5 * (least + most);
        let far = |disc: &Disc| disc.center_m.distance(center_m) + disc.radius_m;
        let radius_m = self.discs.iter().map(far).fold(0.0, f64::max);
        self.second = Disc { center_m, radius_m };
    }

    /// Whether gait and turn of every sample are known.
    pub(super) fn walks(&self) -> bool {
        self.gait.known
    }

    /// Works them out.
    pub(super) fn walk(&mut self, still_share: f64, draws: &Draws) {
        let (n, gait) = (self.samples, &mut self.gait);
        gait.known = true;
        gait.phase.iter_mut().for_each(|of| of.resize(MOMENTS * n, 0.0));
        gait.turn.iter_mut().for_each(Vec::clear);
        gait.sway.clear();
        gait.swing_hz.clear();
        let phases = Phases::new(&self.phase.unwrap_or(GaitPhase::UNKNOWN));
        for k in 0..n {
            let (sin, cos) = self.turn_rad[k].sin_cos();
            gait.turn[0].push(cos);
            gait.turn[1].push(sin);
            let (speed_mps, height_m) = (self.speed_mps[k], self.height_m[k]);
            let speed_hz = body::relative_speed_hz(speed_mps, height_m);
            gait.sway.push(sway_share(speed_hz));
            gait.swing_hz.push(if draws.arm_swing[k] < still_share { 0.0 } else { speed_hz });
            let stride_m = gait::stride_m(speed_mps, height_m);
            let step_rad = if stride_m > 0.0 { TAU * speed_mps * STEP_S / stride_m } else { 0.0 };
            // The phase turns by the same angle in every step: two sines in place of twenty, the last bit apart.
            let (step_sin, step_cos) = step_rad.sin_cos();
            let (mut sin, mut cos) = phases.at(draws.phase[k]).sin_cos();
            for s in 0..MOMENTS {
                (gait.phase[0][s * n + k], gait.phase[1][s * n + k]) = (cos, sin);
                (sin, cos) = (sin * step_cos + cos * step_sin, cos * step_cos - sin * step_sin);
            }
        }
        let ([turn_x, turn_y], [phase_x, phase_y]) = (&gait.turn, &gait.phase);
        let bodies: [&[f64]; 2] = [&self.height_m, &self.width_scale];
        gait.rough.round([
            bodies[0],
            bodies[1],
            turn_x,
            turn_y,
            &gait.sway,
            &gait.swing_hz,
            phase_x,
            phase_y,
        ]);
    }
}

/// More than rounding takes from a distance.
const ROUNDED_M: f64 = 1e-9;

fn renew(values: &mut Vec<f64>, new: impl Iterator<Item = f64>) {
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
    pub(super) fn speed_mps(&self, sample: usize) -> f64 {
        self.speed_mps[sample]
    }
}
