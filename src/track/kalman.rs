//! Constant-velocity Kalman filters over the floor, with the sway of a walking body beside.
//!
//! x: state (x, y, vx, vy, then how far the body sways to the left and ahead: see [`super::gait`]); P: its
//! covariance; F: motion; Q: process noise (the base of the paper calls it R); H: picks what is measured, the
//! position with the sway; R: measurement noise; S: covariance of the innovation; K: gain.
#![allow(non_snake_case)]

use super::gait::{AHEAD, Axes, Gait, LEFT, Sway};
use crate::config::{ProcessNoise, TrackConfig};
use crate::geometry::DVec2;

/// A symmetric 2x2 matrix.
pub type Mat2 = [[f64; 2]; 2];
/// A symmetric 4x4 matrix over (x, y, vx, vy).
pub type Mat4 = [[f64; 4]; 4];

/// A Gaussian over (x, y, vx, vy), metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Mean.
    pub x: [f64; 4],
    /// Covariance.
    pub P: Mat4,
}

/// A Gaussian over one coordinate and its rate: the height of the points, where it is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// Mean.
    pub x: [f64; 2],
    /// Covariance.
    pub P: Mat2,
}

/// Numbers of a hypothesis' state.
const N: usize = 8;

/// A Gaussian over position, velocity and sway.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Full {
    x: [f64; N],
    P: [[f64; N]; N],
}

/// One person's filter: a constant velocity under one or several process noises at once (interacting multiple
/// models: Blom and Bar-Shalom 1988), so that it is calm while a person walks on and quick when one turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    hypotheses: Vec<Hypothesis>,
    /// Present where the height of the points is followed.
    pub vertical: Option<Vertical>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    weight: f64,
    state: Full,
}

/// What a step adds to the covariance: `position`, `cross` and `velocity` on the diagonals of P's blocks.
struct Q {
    position: f64,
    cross: f64,
    velocity: f64,
}

impl Filter {
    /// A track's first state: somewhere near the first detection, at any walking velocity.
    pub fn new(config: &TrackConfig, position_m: DVec2, z_m: f64, R: f64) -> Self {
        let (p, v) = (config.birth_variance_per_noise * R, config.birth_speed_mps.powi(2));
        let [left, ahead] = [config.sway_left_m.powi(2), config.sway_ahead_m.powi(2)];
        let mut state = Full { x: [0.0; N], P: [[0.0; N]; N] };
        (state.x[0], state.x[1]) = (position_m.x, position_m.y);
        for (i, variance) in [p, p, v, v, left, left, ahead, ahead].into_iter().enumerate() {
            state.P[i][i] = variance;
        }
        let hypotheses = models(config).map(|model| Hypothesis { weight: model.share, state }).collect();
        let vertical = config.follow_z.then_some(Vertical { x: [z_m, 0.0], P: [[p, 0.0], [0.0, v]] });
        Self { hypotheses, vertical }
    }

    /// The one Gaussian with the mean and the covariance of all hypotheses together.
    pub fn state(&self) -> State {
        self.full().kinematic()
    }

    /// Where in the stride the person is.
    pub fn gait(&self) -> Gait {
        let Full { x, P } = self.full();
        let variance_m2 = 0.5 * (P[LEFT][LEFT] + P[LEFT + 1][LEFT + 1]);
        Gait::of_sway(x[LEFT], x[LEFT + 1], variance_m2, x[2].hypot(x[3]))
    }

    fn full(&self) -> Full {
        let parts: Vec<(f64, &Full)> = self.hypotheses.iter().map(|h| (h.weight, &h.state)).collect();
        mixture(&parts)
    }

    /// [`Filter::state`] as it will be `dt_s` later, without changing the filter.
    pub fn state_after(&self, config: &TrackConfig, dt_s: f64) -> State {
        let mut later = self.full();
        if dt_s > 0.0 {
            let density = |(h, model): (&Hypothesis, Model)| h.weight * model.acceleration_m2ps3;
            let density = self.hypotheses.iter().zip(models(config)).map(density).sum();
            later.walk(dt_s, &process_noise(config, density, dt_s));
        }
        later.kinematic()
    }

    /// Moves the filter of a person `height_m` tall `dt_s` on; not at all where no time has passed.
    pub fn predict(&mut self, config: &TrackConfig, height_m: f64, dt_s: f64) {
        if dt_s <= 0.0 {
            return;
        }
        // The chance to stay in a model is exp(-dt / dwell), else one is drawn by its share; so two steps do the
        // same as one that is as long as both.
        let all = self.full();
        let sway = Sway::after(config, all.kinematic().velocity_mps().length(), height_m, dt_s);
        let stay = (-dt_s / config.model_dwell_s).exp();
        for (h, model) in self.hypotheses.iter_mut().zip(models(config)) {
            let stayed = stay * h.weight;
            h.weight = stayed + (1.0 - stay) * model.share;
            h.state = mixture(&[(stayed, &h.state), (h.weight - stayed, &all)]);
            if let Some(speed_mps) = model.standing_mps {
                h.state.stand(speed_mps);
            }
            h.state.walk(dt_s, &process_noise(config, model.acceleration_m2ps3, dt_s));
            h.state.sway(&sway);
        }
        if let Some(z) = &mut self.vertical {
            let q = process_noise(config, config.acceleration_m2ps3[0], dt_s);
            z.x[0] += dt_s * z.x[1];
            z.P = [
                [
                    z.P[0][0] + 2.0 * dt_s * z.P[0][1] + dt_s * dt_s * z.P[1][1] + q.position,
                    z.P[0][1] + dt_s * z.P[1][1] + q.cross,
                ],
                [z.P[1][0] + dt_s * z.P[1][1] + q.cross, z.P[1][1] + q.velocity],
            ];
        }
    }

    /// Takes a measured position whose error has covariance `R`, and the height of the points where followed.
    pub fn correct(&mut self, position_m: DVec2, z_m: f64, R: Mat2) {
        let axes = Axes::along(self.state().velocity_mps());
        let mut logs = Vec::with_capacity(self.hypotheses.len());
        for h in &mut self.hypotheses {
            logs.push(h.weight.ln() + h.state.correct(position_m, R, &axes));
        }
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = logs.iter().map(|log| (log - most).exp()).sum();
        for (h, log) in self.hypotheses.iter_mut().zip(logs) {
            h.weight = (log - most).exp() / total;
        }
        if let Some(z) = &mut self.vertical {
            let S = z.P[0][0] + R[0][0];
            let K = [z.P[0][0] / S, z.P[1][0] / S];
            let y = z_m - z.x[0];
            z.x = [z.x[0] + K[0] * y, z.x[1] + K[1] * y];
            let (p, c) = (z.P[0][0], z.P[0][1]);
            z.P = [[(1.0 - K[0]) * p, (1.0 - K[0]) * c], [(1.0 - K[0]) * c, z.P[1][1] - K[1] * c]];
        }
    }
}

impl State {
    /// The position's mean.
    pub fn position_m(&self) -> DVec2 {
        DVec2::new(self.x[0], self.x[1])
    }

    /// The velocity's mean.
    pub fn velocity_mps(&self) -> DVec2 {
        DVec2::new(self.x[2], self.x[3])
    }

    /// The position's covariance.
    pub fn position_covariance(&self) -> Mat2 {
        [[self.P[0][0], self.P[0][1]], [self.P[1][0], self.P[1][1]]]
    }
}

impl Full {
    fn kinematic(&self) -> State {
        let first = |row: &[f64; N]| [row[0], row[1], row[2], row[3]];
        State { x: first(&self.x), P: std::array::from_fn(|i| first(&self.P[i])) }
    }

    /// The state of somebody who stands, but for a velocity of `speed_mps` (one sigma of an axis).
    fn stand(&mut self, speed_mps: f64) {
        for i in 2..4 {
            self.x[i] = 0.0;
            for j in 0..N {
                (self.P[i][j], self.P[j][i]) = (0.0, 0.0);
            }
            self.P[i][i] = speed_mps * speed_mps;
        }
    }

    /// x = F x, P = F P F' + Q, with F the motion over `dt_s`.
    fn walk(&mut self, dt_s: f64, q: &Q) {
        let (dt, P) = (dt_s, self.P);
        for i in 0..2 {
            self.x[i] += dt * self.x[i + 2];
            for j in 0..2 {
                self.P[i][j] = P[i][j] + dt * (P[i][j + 2] + P[i + 2][j]) + dt * dt * P[i + 2][j + 2];
                self.P[i][j + 2] = P[i][j + 2] + dt * P[i + 2][j + 2];
                self.P[j + 2][i] = self.P[i][j + 2];
            }
            for j in LEFT..N {
                self.P[i][j] += dt * P[i + 2][j];
                self.P[j][i] = self.P[i][j];
            }
        }
        for i in 0..2 {
            self.P[i][i] += q.position;
            self.P[i][i + 2] += q.cross;
            self.P[i + 2][i] += q.cross;
            self.P[i + 2][i + 2] += q.velocity;
        }
    }

    /// Both oscillations go on.
    fn sway(&mut self, sway: &Sway) {
        for (at, wave) in [(LEFT, &sway.left), (AHEAD, &sway.ahead)] {
            (self.x[at], self.x[at + 1]) = wave.turned(self.x[at], self.x[at + 1]);
            for i in 0..N {
                (self.P[at][i], self.P[at + 1][i]) = wave.turned(self.P[at][i], self.P[at + 1][i]);
            }
            for row in &mut self.P {
                (row[at], row[at + 1]) = wave.turned(row[at], row[at + 1]);
            }
            self.P[at][at] += wave.new;
            self.P[at + 1][at + 1] += wave.new;
        }
    }

    /// The Kalman update with the position of a swaying body; returns the log of the measurement's likelihood.
    fn correct(&mut self, position_m: DVec2, R: Mat2, axes: &Axes) -> f64 {
        let P = self.P;
        let (left, ahead) = (axes.left.to_array(), axes.ahead.to_array());
        let HP: [[f64; N]; 2] = std::array::from_fn(|a| {
            std::array::from_fn(|j| P[a][j] + left[a] * P[LEFT][j] + ahead[a] * P[AHEAD][j])
        });
        let times_H = |row: &[f64; N], b: usize| row[b] + left[b] * row[LEFT] + ahead[b] * row[AHEAD];
        let S = plus(std::array::from_fn(|a| std::array::from_fn(|b| times_H(&HP[a], b))), R);
        let (inverse, det) = inverted(S);
        let y = position_m - DVec2::new(times_H(&self.x, 0), times_H(&self.x, 1));
        // K = P H' S^-1.
        let K: [[f64; 2]; N] = std::array::from_fn(|i| {
            std::array::from_fn(|j| HP[0][i] * inverse[0][j] + HP[1][i] * inverse[1][j])
        });
        for i in 0..N {
            self.x[i] += K[i][0] * y.x + K[i][1] * y.y;
        }
        // Joseph's form, (I - K H) P (I - K H)' + K R K': stays symmetric and positive whatever the rounding.
        let A: [[f64; N]; N] = std::array::from_fn(|i| {
            std::array::from_fn(|j| P[i][j] - K[i][0] * HP[0][j] - K[i][1] * HP[1][j])
        });
        for i in 0..N {
            let AH = [times_H(&A[i], 0), times_H(&A[i], 1)];
            for j in i..N {
                let left = A[i][j] - AH[0] * K[j][0] - AH[1] * K[j][1];
                let right: f64 =
                    (0..2).map(|a| (0..2).map(|b| K[i][a] * R[a][b] * K[j][b]).sum::<f64>()).sum();
                self.P[i][j] = left + right;
                self.P[j][i] = left + right;
            }
        }
        -0.5 * (quadratic(inverse, y) + det.ln()) - std::f64::consts::TAU.ln()
    }
}

/// What a hypothesis believes of the motion.
struct Model {
    acceleration_m2ps3: f64,
    share: f64,
    /// Of who stands: how far the velocity may be from zero, one sigma of an axis.
    standing_mps: Option<f64>,
}

/// The models of motion, in the order of a filter's hypotheses; who stands comes last.
fn models(config: &TrackConfig) -> impl Iterator<Item = Model> + '_ {
    let walking = config.acceleration_m2ps3.iter().zip(&config.model_share);
    let walking =
        walking.map(|(&acceleration_m2ps3, &share)| Model { acceleration_m2ps3, share, standing_mps: None });
    let standing = Model {
        acceleration_m2ps3: 0.0,
        share: config.standing_share,
        standing_mps: Some(config.standing_speed_mps),
    };
    walking.chain((config.standing_share > 0.0).then_some(standing))
}

fn process_noise(config: &TrackConfig, density_m2ps3: f64, dt_s: f64) -> Q {
    match config.process_noise {
        // White acceleration integrated over the step: two steps add what one of their length adds.
        ProcessNoise::WhiteAcceleration => Q {
            position: density_m2ps3 * dt_s.powi(3) / 3.0,
            cross: density_m2ps3 * dt_s.powi(2) / 2.0,
            velocity: density_m2ps3 * dt_s,
        },
        ProcessNoise::PerStep => {
            Q { position: config.step_position_m2, cross: 0.0, velocity: config.step_velocity_m2ps2 }
        }
    }
}

/// One Gaussian with the mean and covariance of a weighted mixture.
fn mixture(parts: &[(f64, &Full)]) -> Full {
    let total: f64 = parts.iter().map(|part| part.0).sum();
    let mut mean = Full { x: [0.0; N], P: [[0.0; N]; N] };
    for (weight, part) in parts {
        for i in 0..N {
            mean.x[i] += weight / total * part.x[i];
        }
    }
    for (weight, part) in parts {
        let d: [f64; N] = std::array::from_fn(|i| part.x[i] - mean.x[i]);
        for i in 0..N {
            for j in 0..N {
                mean.P[i][j] += weight / total * (part.P[i][j] + d[i] * d[j]);
            }
        }
    }
    mean
}

/// Sum of two matrices.
pub fn plus(a: Mat2, b: Mat2) -> Mat2 {
    [[a[0][0] + b[0][0], a[0][1] + b[0][1]], [a[1][0] + b[1][0], a[1][1] + b[1][1]]]
}

/// Inverse and determinant of a positive definite matrix.
pub fn inverted(a: Mat2) -> (Mat2, f64) {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    ([[a[1][1] / det, -a[0][1] / det], [-a[1][0] / det, a[0][0] / det]], det)
}

/// y' A y.
pub fn quadratic(a: Mat2, y: DVec2) -> f64 {
    a[0][0] * y.x * y.x + (a[0][1] + a[1][0]) * y.x * y.y + a[1][1] * y.y * y.y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, Mode};

    fn filter(config: &TrackConfig) -> Filter {
        let mut filter = Filter::new(config, DVec2::ZERO, 0.9, 0.01);
        for i in 1..20 {
            filter.predict(config, 1.75, 0.1);
            filter.correct(DVec2::new(0.1 * f64::from(i), 0.0), 0.9, [[0.01, 0.0], [0.0, 0.01]]);
        }
        filter
    }

    #[test]
    fn two_steps_do_what_one_as_long_as_both_does() {
        let mut config = Config::for_mode(Mode::Default).track;
        (config.acceleration_m2ps3, config.model_share, config.standing_share) = (vec![0.2], vec![1.0], 0.0);
        let (mut once, mut twice) = (filter(&config), filter(&config));
        once.predict(&config, 1.75, 0.1);
        twice.predict(&config, 1.75, 0.03);
        twice.predict(&config, 1.75, 0.07);
        let (once, twice) = (once.state(), twice.state());
        for i in 0..4 {
            assert!((once.x[i] - twice.x[i]).abs() < 1e-12);
            for j in 0..4 {
                assert!((once.P[i][j] - twice.P[i][j]).abs() < 1e-12, "P[{i}][{j}]");
            }
        }
    }

    #[test]
    fn hdl_has_the_steady_gains_measured_on_the_original() {
        let config = Config::for_mode(Mode::Hdl).track;
        let mut filter = Filter::new(&config, DVec2::ZERO, 0.9, 0.2);
        for _ in 0..300 {
            filter.predict(&config, 1.75, 0.1);
            filter.correct(DVec2::ZERO, 0.9, [[0.2, 0.0], [0.0, 0.2]]);
        }
        // K = P H' / R after the update: 0.355 for the position, 0.180 for the velocity.
        let P = filter.state().P;
        assert!((P[0][0] / 0.2 - 0.355).abs() < 1e-3 && (P[0][2] / 0.2 - 0.180).abs() < 1e-3, "{P:?}");
        let z = filter.vertical.unwrap();
        assert!((z.P[0][0] - P[0][0]).abs() < 1e-12);
    }

    #[test]
    fn a_stop_is_followed_sooner_by_several_models_than_by_the_calm_one() {
        let several = Config::for_mode(Mode::Default).track;
        let mut calm = several.clone();
        (calm.acceleration_m2ps3, calm.model_share, calm.standing_share) =
            (vec![several.acceleration_m2ps3[0]], vec![1.0], 0.0);
        let speed_after_stop = |config: &TrackConfig| {
            let mut filter = filter(config);
            for _ in 0..8 {
                filter.predict(config, 1.75, 0.1);
                filter.correct(DVec2::new(1.9, 0.0), 0.9, [[0.0013, 0.0], [0.0, 0.0013]]);
            }
            filter.state().velocity_mps().length()
        };
        let (quick, slow) = (speed_after_stop(&several), speed_after_stop(&calm));
        assert!(quick < 0.2 && slow > 0.4, "{quick} and {slow} m/s");
    }
}
