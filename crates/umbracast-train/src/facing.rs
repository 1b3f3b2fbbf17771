//! Fits the model of which way somebody faces who stands, `umbracast::detect::facing`.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use umbracast::Error;
use umbracast::detect::axis_view::AxisView;
use umbracast::detect::facing::face;
use umbracast::detect::point_network::{OUTPUTS, PointNetwork};

use crate::point_network::{Sample, Truth, fit};
use crate::sightings::{Seen, card_head, held_out_name, watch_all};

/// The density is summed up at so many headings.
const HEADINGS: usize = 72;

/// Fits the model; see [`crate::axis::train_axis`].
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_facing(
    commit: &str,
    scene_done: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<u8>, String), Error> {
    let [training, held_out] = watch_all(scene_done)?.map(|mut seen| {
        seen.retain(|s| s.view.stands());
        seen
    });
    let samples: Vec<Sample<Heading>> = training
        .iter()
        .map(|s| Sample { view: s.view, truth: Heading::of(&s.view, s.heading_rad) })
        .collect();
    let weights = fit(&samples)?;
    let model = PointNetwork::from_safetensors(&weights)?;
    Ok((weights, card(&model, training.len(), &held_out, commit)))
}

fn card(model: &PointNetwork, bodies: usize, held_out: &[Seen], commit: &str) -> String {
    let off_rad = |s: &Seen| (face(model, &s.view).heading_rad - s.heading_rad + PI).rem_euclid(TAU) - PI;
    let off_line_rad = |s: &Seen| (off_rad(s) + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
    let n = held_out.len() as f64;
    let right = held_out.iter().filter(|s| off_rad(s).abs() < FRAC_PI_2).count() as f64 / n;
    let mut off_deg: Vec<f64> = held_out.iter().map(|s| off_line_rad(s).abs().to_degrees()).collect();
    off_deg.sort_by(f64::total_cmp);
    let quantile = |share: f64| off_deg[((share * n) as usize).min(off_deg.len() - 1)];
    let nats = held_out
        .iter()
        .map(|s| -Heading::of(&s.view, s.heading_rad).loss(&model.outputs(&s.view)).0)
        .sum::<f64>()
        / n;
    format!(
        "{}## What one frame tells\n\n\
         | {}, {} bodies that stand | |\n|---|---|\n\
         | front and back are not mistaken | {right:.3} |\n\
         | off the line, either way, median | {:.1} degrees |\n| 90 % | {:.1} degrees |\n\
         | more than any heading alike, nats | {nats:.2} |\n",
        card_head(
            "Model of which way somebody faces who stands",
            "the density of its heading",
            "facing",
            commit,
            bodies
        ),
        held_out_name(),
        held_out.len(),
        quantile(0.5),
        quantile(0.9),
    )
}

/// The heading from the line of sight, toward the side across.
#[derive(Debug, Clone, Copy)]
struct Heading(f64);

impl Heading {
    fn of(view: &AxisView, heading_rad: f64) -> Self {
        let ahead = umbracast::geometry::DVec2::from_angle(heading_rad);
        Self(ahead.dot(view.across).atan2(ahead.dot(view.along)))
    }
}

/// What the outputs are multiplied with in the logarithm of the density.
fn waves(rad: f64) -> [f64; OUTPUTS] {
    let ((sin, cos), (sin_2, cos_2)) = (rad.sin_cos(), (2.0 * rad).sin_cos());
    [cos, sin, cos_2, sin_2]
}

impl Truth for Heading {
    /// Zero where every heading is alike.
    fn loss(&self, outputs: &[f64; OUTPUTS]) -> (f64, [f64; OUTPUTS]) {
        let log_density = |waves: &[f64; OUTPUTS]| waves.iter().zip(outputs).map(|(a, b)| a * b).sum::<f64>();
        let all: [[f64; OUTPUTS]; HEADINGS] =
            std::array::from_fn(|k| waves(TAU * k as f64 / HEADINGS as f64));
        let logs = all.map(|waves| log_density(&waves));
        let most = logs.iter().copied().fold(f64::MIN, f64::max);
        let weights = logs.map(|log| (log - most).exp());
        let sum: f64 = weights.iter().sum();
        let own = waves(self.0);
        let to_outputs = std::array::from_fn(|o| {
            all.iter().zip(&weights).map(|(waves, weight)| waves[o] * weight).sum::<f64>() / sum - own[o]
        });
        (most + (sum / HEADINGS as f64).ln() - log_density(&own), to_outputs)
    }

    fn scaled(&self, _: f64) -> Self {
        *self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_of_the_loss_is_that_of_finite_differences() {
        const MOVED: f64 = 1e-6;
        let (outputs, truth) = ([0.4, -1.1, 0.7, 2.0], Heading(0.8));
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
        assert!(truth.loss(&[0.0; OUTPUTS]).0.abs() < 1e-12);
    }
}
