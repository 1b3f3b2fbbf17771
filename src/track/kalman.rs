//! Constant-velocity Kalman filters over the floor, with the sway of a walking body.
//!
//! x: state (x, y, vx, vy, then how far the body sways to the left and ahead: see [`super::sway`]); P: its
//! covariance; F: motion; Q: process noise; H: picks what is measured, the position with the sway; R: measurement
//! noise; S: covariance of the innovation; K: gain. Written by hand: F and H are mostly zeros, which a matrix library
//! would multiply, and the code keeps the paper's letters.
#![allow(non_snake_case)]

use super::gaussian::{Mat2, State, inverted, plus, quadratic};
use super::numbers::{MotionModel, Numbers};
use super::remembered::{Remembered, Words};
use super::sway::{AHEAD, Axes, LEFT, Sway};
use crate::geometry::DVec2;

/// How long a motion model holds on the mean, seconds.
const MEAN_SOJOURN_S: f64 = 2.4;
/// A new track's velocity, one standard deviation of an axis: a walk in any direction.
const BIRTH_SPEED_MPS: f64 = 1.2;

/// Numbers of a hypothesis' state.
const N: usize = 8;

/// A Gaussian over the first `M` numbers of a state: four without the sway.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gaussian<const M: usize> {
    x: [f64; M],
    P: [[f64; M]; M],
}

/// A Gaussian over position, velocity and sway.
type Full = Gaussian<N>;

/// One person's filter: a constant velocity under one or several process noises at once (interacting multiple
/// models: Blom and Bar-Shalom 1988), so that it is calm while a person walks on and quick when one turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// In the order of the motion models.
    hypotheses: Vec<Hypothesis>,
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

impl Remembered for Filter {
    /// There are as many hypotheses as motion models.
    fn visit(&mut self, words: &mut impl Words) {
        for hypothesis in &mut self.hypotheses {
            words.f64(&mut hypothesis.weight);
            words.f64s(&mut hypothesis.state.x);
            words.f64s(hypothesis.state.P.as_flattened_mut());
        }
    }
}

impl Filter {
    /// A track's first state: somewhere near the first detection, at any walking velocity.
    pub fn new(numbers: &Numbers, position_m: DVec2, R: f64) -> Self {
        let (p, v) = (R, BIRTH_SPEED_MPS.powi(2));
        let [left, ahead] = numbers.sway_m.map(|sway_m| sway_m.powi(2));
        let mut state = Full { x: [0.0; N], P: [[0.0; N]; N] };
        (state.x[0], state.x[1]) = (position_m.x, position_m.y);
        for (i, variance) in [p, p, v, v, left, left, ahead, ahead].into_iter().enumerate() {
            state.P[i][i] = variance;
        }
        let hypothesis = |model: &MotionModel| Hypothesis { weight: model.share, state };
        Self { hypotheses: numbers.motion_models.iter().map(hypothesis).collect() }
    }

    /// The one Gaussian with the mean and the covariance of all hypotheses together.
    pub fn state(&self) -> State {
        let Gaussian { x, P } = mixture(self.weighted());
        State { x, P }
    }

    /// The position of [`Filter::state_after`], without its covariance.
    pub fn position_after(&self, dt_s: f64) -> DVec2 {
        let [x, y, ..] = self.means();
        DVec2::new(x, y) + dt_s.max(0.0) * self.velocity_mps()
    }

    /// The same of [`Filter::state`].
    pub fn position_m(&self) -> DVec2 {
        self.position_after(0.0)
    }

    /// The velocity of [`Filter::state`].
    pub fn velocity_mps(&self) -> DVec2 {
        let [_, _, vx, vy] = self.means();
        DVec2::new(vx, vy)
    }

    fn means(&self) -> [f64; 4] {
        mean(self.weighted())
    }

    fn weighted(&self) -> impl Iterator<Item = (f64, &Full)> + Clone {
        self.hypotheses.iter().map(|h| (h.weight, &h.state))
    }

    /// [`Filter::state`] as it will be `dt_s` later, without changing the filter.
    pub fn state_after(&self, numbers: &Numbers, dt_s: f64) -> State {
        let mut later: Gaussian<4> = mixture(self.weighted());
        if dt_s > 0.0 {
            let weighted = self.hypotheses.iter().zip(&numbers.motion_models);
            let psd_m2ps3 = weighted.map(|(h, model)| h.weight * model.acceleration_psd_m2ps3).sum();
            later.walk(dt_s, &process_noise(psd_m2ps3, dt_s));
        }
        State { x: later.x, P: later.P }
    }

    /// Moves the filter of a person `height_m` tall `dt_s` on; not at all where no time has passed.
    pub fn predict(&mut self, numbers: &Numbers, height_m: f64, dt_s: f64) {
        if dt_s <= 0.0 {
            return;
        }
        // The chance to stay in a model is exp(-dt / mean sojourn), else one is drawn by its share; so two steps do the
        // same as one that is as long as both.
        let all: Full = mixture(self.weighted());
        let speed_mps = DVec2::new(all.x[2], all.x[3]).length();
        let sway = Sway::after(numbers.sway_m, speed_mps, height_m, dt_s);
        let stay = (-dt_s / MEAN_SOJOURN_S).exp();
        for (h, model) in self.hypotheses.iter_mut().zip(&numbers.motion_models) {
            let stayed = stay * h.weight;
            h.weight = stayed + (1.0 - stay) * model.share;
            h.state = mixture([(stayed, &h.state), (h.weight - stayed, &all)].into_iter());
            if let Some(speed_mps) = model.standing_mps {
                h.state.stand(speed_mps);
            }
            h.state.walk(dt_s, &process_noise(model.acceleration_psd_m2ps3, dt_s));
            h.state.sway(&sway);
        }
    }

    /// Takes a measured position whose error has covariance `R`.
    pub fn correct(&mut self, position_m: DVec2, R: Mat2) {
        let axes = Axes::along(self.velocity_mps());
        // A weight is a logarithm until all are known.
        for h in &mut self.hypotheses {
            h.weight = h.weight.ln() + h.state.correct(position_m, R, &axes);
        }
        let most = self.hypotheses.iter().map(|h| h.weight).fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = self.hypotheses.iter().map(|h| (h.weight - most).exp()).sum();
        for h in &mut self.hypotheses {
            h.weight = (h.weight - most).exp() / total;
        }
    }
}

impl<const M: usize> Gaussian<M> {
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
            for j in LEFT..M {
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
}

impl Full {
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

/// White acceleration integrated over the step: two steps add what one of their length adds.
fn process_noise(psd_m2ps3: f64, dt_s: f64) -> Q {
    Q {
        position: psd_m2ps3 * dt_s.powi(3) / 3.0,
        cross: psd_m2ps3 * dt_s.powi(2) / 2.0,
        velocity: psd_m2ps3 * dt_s,
    }
}

/// One Gaussian with the mean and covariance of a weighted mixture, of the state's first `M` numbers.
fn mixture<'a, const M: usize>(parts: impl Iterator<Item = (f64, &'a Full)> + Clone) -> Gaussian<M> {
    let total: f64 = parts.clone().map(|part| part.0).sum();
    let mut mixture = Gaussian { x: mean(parts.clone()), P: [[0.0; M]; M] };
    for (weight, part) in parts {
        let d: [f64; M] = std::array::from_fn(|i| part.x[i] - mixture.x[i]);
        for i in 0..M {
            for j in 0..M {
                mixture.P[i][j] += weight / total * (part.P[i][j] + d[i] * d[j]);
            }
        }
    }
    mixture
}

/// The mean of [`mixture`].
fn mean<'a, const M: usize>(parts: impl Iterator<Item = (f64, &'a Full)> + Clone) -> [f64; M] {
    let total: f64 = parts.clone().map(|part| part.0).sum();
    let mut mean = [0.0; M];
    for (weight, part) in parts {
        for i in 0..M {
            mean[i] += weight / total * part.x[i];
        }
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use crate::track::gaussian::round;

    fn numbers() -> Numbers {
        Numbers::new(&Config::default().track)
    }

    /// With one model of this density alone.
    fn calm(acceleration_psd_m2ps3: f64) -> Numbers {
        let model = MotionModel { acceleration_psd_m2ps3, share: 1.0, standing_mps: None };
        Numbers { motion_models: vec![model], ..numbers() }
    }

    fn filter(numbers: &Numbers) -> Filter {
        let mut filter = Filter::new(numbers, DVec2::ZERO, 0.01);
        for i in 1..20 {
            filter.predict(numbers, 1.75, 0.1);
            filter.correct(DVec2::new(0.1 * f64::from(i), 0.0), round(0.01));
        }
        filter
    }

    #[test]
    fn two_steps_do_what_one_as_long_as_both_does() {
        let numbers = calm(0.2);
        let (mut once, mut twice) = (filter(&numbers), filter(&numbers));
        once.predict(&numbers, 1.75, 0.1);
        twice.predict(&numbers, 1.75, 0.03);
        twice.predict(&numbers, 1.75, 0.07);
        let (once, twice) = (once.state(), twice.state());
        for i in 0..4 {
            assert!((once.x[i] - twice.x[i]).abs() < 1e-12);
            for j in 0..4 {
                assert!((once.P[i][j] - twice.P[i][j]).abs() < 1e-12, "P[{i}][{j}]");
            }
        }
    }

    #[test]
    fn a_stop_is_followed_sooner_by_several_models_than_by_the_calm_one() {
        let several = numbers();
        let calm = calm(several.motion_models[0].acceleration_psd_m2ps3);
        let speed_after_stop = |numbers: &Numbers| {
            let mut filter = filter(numbers);
            for _ in 0..8 {
                filter.predict(numbers, 1.75, 0.1);
                filter.correct(DVec2::new(1.9, 0.0), round(0.0013));
            }
            filter.state().velocity_mps().length()
        };
        let (quick, slow) = (speed_after_stop(&several), speed_after_stop(&calm));
        assert!(quick < 0.2 && slow > 0.4, "{quick} and {slow} m/s");
    }
}
