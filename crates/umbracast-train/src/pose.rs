//! Fits the network of the pose, `umbracast::detect::pose`.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use umbracast::Error;
use umbracast::detect::SHIFT_M;
use umbracast::detect::point_network::{BODY_UNITS, OUTPUTS, POINT_UNITS, PointNetwork};
use umbracast::detect::pose::{LOG_VARIANCE, Pose, UNIT_M, pose};
use umbracast::detect::pose_view::{OF_BODY, OF_POINT, POINTS, PoseView};
use umbracast::geometry::DVec2;

use crate::point_network::{EPOCHS, SEED, Sample, fit};
use crate::sightings::{Seen, held_out_name, scenes_listed, watch_all};

/// Errors beyond so many units pull no harder: some clusters are of two people.
const PULL_LIMIT: f64 = 4.0;
/// The density of an angle is summed up at so many.
const ANGLES: usize = 72;

/// Fits the network; returns the weights file and its card. `commit`, which state of the source this is, goes into the card.
/// `scene_done` is called with scenes done and scenes in all, from any thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_pose(
    commit: &str,
    scene_done: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<u8>, String), Error> {
    let [training, held_out] = watch_all(scene_done)?;
    let samples: Vec<Sample> =
        training.iter().map(|seen| Sample { view: seen.view, truth: Truth::of(seen) }).collect();
    let weights = fit(&samples)?;
    let network = PointNetwork::from_safetensors(&weights)?;
    Ok((weights, card(&network, &training, &held_out, commit)))
}

fn card(network: &PointNetwork, training: &[Seen], held_out: &[Seen], commit: &str) -> String {
    let error = |s: &Seen| pose(network, &s.view).position_m - s.view.base_m - s.off_m;
    let squared = |s: &Seen| {
        let ([[xx, xy], [_, yy]], e) = (pose(network, &s.view).covariance_m2, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let rmse =
        |of: &dyn Fn(&Seen) -> DVec2, seen: &[Seen]| mean(seen.iter().map(|s| of(s).length_squared())).sqrt();
    let off_rad = |(pose, s): &(Pose, &Seen)| Some(turned(pose.facing?.heading_rad - s.heading_rad?));
    let off_phase_rad = |(pose, s): &(Pose, &Seen)| Some(turned(pose.gait?.phase_rad - s.phase_rad?));
    let poses = || held_out.iter().map(|s| (pose(network, &s.view), s));
    let headings: Vec<f64> = poses().filter_map(|seen| off_rad(&seen)).collect();
    let phases: Vec<f64> = poses().filter_map(|seen| off_phase_rad(&seen)).collect();
    let within = |rad: f64, off_rad: &[f64]| mean(off_rad.iter().map(|off| f64::from(off.abs() < rad)));
    let mut off_line_deg: Vec<f64> = headings
        .iter()
        .map(|off| ((off + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2).abs().to_degrees())
        .collect();
    off_line_deg.sort_by(f64::total_cmp);
    let quantile =
        |share: f64| off_line_deg[((share * off_line_deg.len() as f64) as usize).min(off_line_deg.len() - 1)];
    let commit = if commit.is_empty() { "unknown" } else { commit };
    format!(
        "# Network of the pose of a body\n\n\
         From what the sensors saw of one body in one frame to where its axis stands, with the error's covariance, which way it \
         faces if it stands, and where in the stride it is if it walks: up to {POINTS} points of {OF_POINT} numbers, each through \
         {POINT_UNITS:?} units, then with {OF_BODY} numbers of the whole body through {BODY_UNITS:?} units, {OUTPUTS} outputs \
         (`src/detect/pose.rs`).\n\n\
         Written by `umbracast train pose`, commit {commit}.\n\n\
         ## Data\n\n{}\n{} bodies; {EPOCHS} epochs, Adam, negative log-likelihood, every fifth body made smaller or larger, seed \
         {SEED}.\n\n\
         ## What one frame tells\n\n\
         | | training | {} |\n|---|---|---|\n\
         | axis, each point moved {SHIFT_M} m away from its sensor, m | {:.4} | {:.4} |\n| axis, this network, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {:.2} |\n\
         | facing: front and back are not mistaken, of {} who stand | | {:.3} |\n\
         | off the line, either way, median | | {:.1} degrees |\n| 90 % | | {:.1} degrees |\n\
         | phase of the stride: off by an eighth at most, of {} who walk | | {:.3} |\n",
        scenes_listed(),
        training.len(),
        held_out_name(),
        rmse(&|s| s.off_m, training),
        rmse(&|s| s.off_m, held_out),
        rmse(&error, training),
        rmse(&error, held_out),
        mean(held_out.iter().map(squared)),
        headings.len(),
        within(FRAC_PI_2, &headings),
        quantile(0.5),
        quantile(0.9),
        phases.len(),
        within(FRAC_PI_4, &phases),
    )
}

fn mean(of: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = of.len() as f64;
    of.sum::<f64>() / n
}

/// From -pi to pi.
fn turned(rad: f64) -> f64 {
    (rad + PI).rem_euclid(TAU) - PI
}

/// A body's pose in its view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Truth {
    /// How far the axis stands off the view's base along and across, in units of [`UNIT_M`].
    pub(crate) off: [f64; 2],
    /// From the line of sight toward the side across, of who is known to stand.
    heading_rad: Option<f64>,
    /// Of the stride, of who walks.
    phase_rad: Option<f64>,
}

impl Truth {
    fn of(seen: &Seen) -> Self {
        let view = &seen.view;
        let in_view = |heading_rad: f64| {
            let ahead = DVec2::from_angle(heading_rad);
            ahead.dot(view.across).atan2(ahead.dot(view.along))
        };
        Self {
            heading_rad: seen.heading_rad.map(in_view),
            phase_rad: seen.phase_rad.map(|phase_rad| phase_rad - view.phase_of_mirror_rad()),
            ..Self::standing_off(view, seen.off_m)
        }
    }

    /// Of somebody of whom no more is known.
    pub(crate) fn standing_off(view: &PoseView, off_m: DVec2) -> Self {
        let off = [view.along, view.across].map(|axis| off_m.dot(axis) / UNIT_M);
        Self { off, heading_rad: None, phase_rad: None }
    }

    /// Of a body that is so many times as large.
    pub(crate) fn scaled(self, share: f64) -> Self {
        Self { off: self.off.map(|units| share * units), ..self }
    }

    /// The negative log-likelihood of the truth but for a constant, and its gradient to the outputs.
    pub(crate) fn loss(&self, outputs: &[f64; OUTPUTS]) -> (f64, [f64; OUTPUTS]) {
        let mut to_outputs = [0.0; OUTPUTS];
        let mut loss = 0.0;
        let mut add = |first: usize, (of_part, to_part): (f64, &[f64])| {
            loss += of_part;
            to_outputs[first..first + to_part.len()].copy_from_slice(to_part);
        };
        let [a, b, c, d, e, f, g, h, cos, sin] = *outputs;
        let (of_offset, to_offset) = self.loss_of_offset([a, b, c, d]);
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
        (loss, to_outputs)
    }

    fn loss_of_offset(&self, outputs: [f64; 4]) -> (f64, [f64; 4]) {
        let (mut loss, mut to_outputs) = (0.0, [0.0; 4]);
        for k in 0..2 {
            let log_variance = outputs[k + 2].clamp(LOG_VARIANCE.0, LOG_VARIANCE.1);
            let weight = (-log_variance).exp();
            let error = (outputs[k] - self.off[k]).clamp(-PULL_LIMIT, PULL_LIMIT);
            loss += 0.5 * (error * error * weight + log_variance);
            to_outputs[k] = error * weight;
            to_outputs[k + 2] = 0.5 * (1.0 - error * error * weight);
        }
        (loss, to_outputs)
    }
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
        let outputs = [0.3, -0.6, 0.2, -0.4, 0.4, -1.1, 0.7, 2.0, 1.3, -0.8];
        let truth = Truth { off: [0.9, -0.2], heading_rad: Some(0.8), phase_rad: Some(2.5) };
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

    #[test]
    fn who_is_not_known_to_stand_or_to_walk_teaches_no_heading_and_no_phase() {
        let (loss, slope) = Truth { off: [0.0; 2], heading_rad: None, phase_rad: None }.loss(&[0.0; OUTPUTS]);
        assert_eq!((loss, &slope[4..]), (0.0, &[0.0; 6][..]));
        let (loss, _) =
            Truth { off: [0.0; 2], heading_rad: Some(1.0), phase_rad: Some(1.0) }.loss(&[0.0; OUTPUTS]);
        assert!(loss.abs() < 1e-12, "{loss}");
    }
}
