//! The pose of a body as the network shall say it, and how well it does.

use std::f64::consts::TAU;

use umbracast::detect::point_network::OUTPUTS;
use umbracast::detect::pose::{LOG_VARIANCE, SWING_LOG_VARIANCE, SWING_UNIT, UNIT_M};
use umbracast::detect::pose_view::PoseView;
use umbracast::geometry::DVec2;

use crate::sightings::Seen;

/// Errors beyond so many units pull no harder: some clusters are of two people.
const PULL_LIMIT: f64 = 4.0;
/// The density of an angle is summed up at so many.
const ANGLES: usize = 72;

/// A body's pose in its view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Truth {
    /// How far the axis stands off the view's base along and across, in units of [`UNIT_M`].
    pub(crate) off: [f64; 2],
    /// From the line of sight toward the side across, of who is known to stand.
    heading_rad: Option<f64>,
    /// Of the stride, of who walks.
    phase_rad: Option<f64>,
    /// How far the hands swing, in units of [`SWING_UNIT`].
    hand_swing: Option<[f64; 2]>,
}

impl Truth {
    pub(crate) fn of(seen: &Seen) -> Self {
        let view = &seen.view;
        let in_view = |heading_rad: f64| {
            let ahead = DVec2::from_angle(heading_rad);
            ahead.dot(view.across).atan2(ahead.dot(view.along))
        };
        Self {
            heading_rad: seen.heading_rad.map(in_view),
            phase_rad: seen.phase_rad.map(|phase_rad| phase_rad - view.phase_of_mirror_rad()),
            hand_swing: seen.hand_swing.map(|swing| view.sides(swing).map(|swing| swing / SWING_UNIT)),
            ..Self::at_offset(view, seen.off_m)
        }
    }

    /// Of somebody of whom no more is known.
    pub(crate) fn at_offset(view: &PoseView, off_m: DVec2) -> Self {
        let off = [view.along, view.across].map(|axis| off_m.dot(axis) / UNIT_M);
        Self { off, heading_rad: None, phase_rad: None, hand_swing: None }
    }

    /// Of a body that is so many times as large.
    pub(crate) fn scaled(self, share: f64) -> Self {
        let off = self.off.map(|units| share * units);
        // A share of a height, for a speed over another.
        Self { off, hand_swing: self.hand_swing.map(|swing| swing.map(|units| share * units)), ..self }
    }

    /// The negative log-likelihood of the truth but for a constant, and its gradient to the outputs.
    pub(crate) fn loss(&self, outputs: &[f64; OUTPUTS]) -> (f64, [f64; OUTPUTS]) {
        let mut to_outputs = [0.0; OUTPUTS];
        let mut loss = 0.0;
        let mut add = |first: usize, (of_part, to_part): (f64, &[f64])| {
            loss += of_part;
            to_outputs[first..first + to_part.len()].copy_from_slice(to_part);
        };
        let [a, b, c, d, e, f, g, h, cos, sin, left, right, log_left, log_right] = *outputs;
        let (of_offset, to_offset) = loss_of_pair(self.off, [a, b, c, d], LOG_VARIANCE);
        add(0, (of_offset, &to_offset));
        if let Some(rad) = self.heading_rad {
            let (of_heading, to_heading) = loss_of_angle(rad, [e, f, g, h]);
            add(4, (of_heading, &to_heading));
        }
        if let Some(rad) = self.phase_rad {
            // A von Mises distribution has the first wave alone.
            let (of_phase, to_phase) = loss_of_angle(rad, [cos, sin, 0.0, 0.0]);
            add(8, (of_phase, &to_phase[..2]));
        }
        if let Some(swing) = self.hand_swing {
            let (of_swing, to_swing) =
                loss_of_pair(swing, [left, right, log_left, log_right], SWING_LOG_VARIANCE);
            add(10, (of_swing, &to_swing));
        }
        (loss, to_outputs)
    }
}

/// Of two numbers with independent errors: the outputs are both means, then the logarithms of both variances, which have bounds.
fn loss_of_pair(truth: [f64; 2], outputs: [f64; 4], (least, most): (f64, f64)) -> (f64, [f64; 4]) {
    let (mut loss, mut to_outputs) = (0.0, [0.0; 4]);
    for k in 0..2 {
        let log_variance = outputs[k + 2].clamp(least, most);
        let weight = (-log_variance).exp();
        let error = (outputs[k] - truth[k]).clamp(-PULL_LIMIT, PULL_LIMIT);
        loss += 0.5 * (error * error * weight + log_variance);
        to_outputs[k] = error * weight;
        let to_log_variance = 0.5 * (1.0 - error * error * weight);
        // What lies beyond a bound already is not moved farther: the layers below would grow without end for nothing.
        let leaves = if to_log_variance > 0.0 { outputs[k + 2] < least } else { outputs[k + 2] > most };
        to_outputs[k + 2] = if leaves { 0.0 } else { to_log_variance };
    }
    (loss, to_outputs)
}

/// Of a generalised von Mises distribution; zero where all angles are alike.
fn loss_of_angle(rad: f64, outputs: [f64; 4]) -> (f64, [f64; 4]) {
    // What the outputs are multiplied with in the logarithm of the density.
    let waves = |rad: f64| {
        let ((sin, cos), (sin_2, cos_2)) = (rad.sin_cos(), (2.0 * rad).sin_cos());
        [cos, sin, cos_2, sin_2]
    };
    let log_density = |waves: &[f64; 4]| waves.iter().zip(outputs).map(|(a, b)| a * b).sum::<f64>();
    let all: [[f64; 4]; ANGLES] = std::array::from_fn(|k| waves(TAU * k as f64 / ANGLES as f64));
    let logs = all.map(|waves| log_density(&waves));
    let most = logs.iter().copied().fold(f64::MIN, f64::max);
    let weights = logs.map(|log| (log - most).exp());
    let sum: f64 = weights.iter().sum();
    let own = waves(rad);
    let to_outputs = std::array::from_fn(|o| {
        all.iter().zip(&weights).map(|(waves, weight)| waves[o] * weight).sum::<f64>() / sum - own[o]
    });
    (most + (sum / ANGLES as f64).ln() - log_density(&own), to_outputs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_the_loss_is_that_of_finite_differences() {
        const MOVED: f64 = 1e-6;
        let outputs = [0.3, -0.6, 0.2, -0.4, 0.4, -1.1, 0.7, 2.0, 1.3, -0.8, 0.9, 1.4, -0.3, 0.6];
        let truth = Truth {
            off: [0.9, -0.2],
            heading_rad: Some(0.8),
            phase_rad: Some(2.5),
            hand_swing: Some([1.2, 0.1]),
        };
        let (_, slope) = truth.loss(&outputs);
        for o in 0..OUTPUTS {
            let moved = |by: f64| {
                let mut outputs = outputs;
                outputs[o] += by;
                truth.loss(&outputs).0
            };
            let expected = (moved(MOVED) - moved(-MOVED)) / (2.0 * MOVED);
            assert!((slope[o] - expected).abs() < 1e-6, "{o}: {}, expected {expected}", slope[o]);
        }
    }

    /// Of still hands the network was sure without end, and learned nothing else any more.
    #[test]
    fn a_variance_at_its_bound_is_not_pushed_beyond_it() {
        let slope = |error: f64, log_variance: f64| {
            loss_of_pair([0.0; 2], [error, error, log_variance, log_variance], SWING_LOG_VARIANCE).1[2]
        };
        let (least, _) = SWING_LOG_VARIANCE;
        assert_eq!(slope(0.0, least - 0.1), 0.0);
        assert!(slope(0.0, least + 0.1) > 0.0 && slope(2.0, least - 0.1) < 0.0);
    }

    #[test]
    fn who_is_not_known_to_stand_or_to_walk_teaches_no_heading_and_no_phase() {
        let nothing = Truth { off: [0.0; 2], heading_rad: None, phase_rad: None, hand_swing: None };
        let (loss, slope) = nothing.loss(&[0.0; OUTPUTS]);
        assert_eq!((loss, &slope[4..]), (0.0, &[0.0; 10][..]));
        let (loss, _) =
            Truth { heading_rad: Some(1.0), phase_rad: Some(1.0), ..nothing }.loss(&[0.0; OUTPUTS]);
        assert!(loss.abs() < 1e-12, "{loss}");
    }
}
