//! Fits the model of the body axis, `umbracast::detect::axis`.

use umbracast::Error;
use umbracast::detect::SHIFT_M;
use umbracast::detect::axis::{UNIT_M, locate};
use umbracast::detect::axis_view::AxisView;
use umbracast::detect::point_network::{OUTPUTS, PointNetwork};
use umbracast::geometry::DVec2;

use crate::point_network::{Sample, Truth, fit};
use crate::sightings::{Seen, card_head, held_out_name, watch_all};

/// Errors beyond so many units pull no harder: some clusters are of two people.
const PULL_LIMIT: f64 = 4.0;
/// Logarithms of variances are held within.
const LOG_VARIANCE: (f64, f64) = (-6.0, 4.0);

/// Fits the model; returns the weights file and its card. `commit`, which state of the source this is, goes into the card.
/// `scene_done` is called with scenes done and scenes in all, from any thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_axis(
    commit: &str,
    scene_done: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<u8>, String), Error> {
    let [training, held_out] = watch_all(scene_done)?;
    let samples: Vec<Sample<Offset>> =
        training.iter().map(|s| Sample { view: s.view, truth: Offset::of(&s.view, s.off_m) }).collect();
    let weights = fit(&samples)?;
    let model = PointNetwork::from_safetensors(&weights)?;
    Ok((weights, card(&model, &training, &held_out, commit)))
}

fn card(model: &PointNetwork, training: &[Seen], held_out: &[Seen], commit: &str) -> String {
    let error = |s: &Seen| locate(model, &s.view).0 - s.view.base_m - s.off_m;
    let rmse = |of: &dyn Fn(&Seen) -> DVec2, samples: &[Seen]| {
        (samples.iter().map(|s| of(s).length_squared()).sum::<f64>() / samples.len() as f64).sqrt()
    };
    let squared = |s: &Seen| {
        let ([[xx, xy], [_, yy]], e) = (locate(model, &s.view).1, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let consistency = held_out.iter().map(squared).sum::<f64>() / held_out.len() as f64;
    let what = "where its axis stands, with the error's covariance";
    format!(
        "{}## Error of one frame\n\n\
         | | training | {} |\n|---|---|---|\n\
         | each point moved {SHIFT_M} m away from its sensor, m | {:.4} | {:.4} |\n| this model, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {consistency:.2} |\n",
        card_head("Model of the body axis", what, "axis", commit, training.len()),
        held_out_name(),
        rmse(&|s| s.off_m, training),
        rmse(&|s| s.off_m, held_out),
        rmse(&error, training),
        rmse(&error, held_out),
    )
}

/// How far the axis stands off the view's base along and across, in units of [`UNIT_M`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Offset(pub(crate) [f64; 2]);

impl Offset {
    pub(crate) fn of(view: &AxisView, off_m: DVec2) -> Self {
        Self([view.along, view.across].map(|axis| off_m.dot(axis) / UNIT_M))
    }
}

impl Truth for Offset {
    fn loss(&self, outputs: &[f64; OUTPUTS]) -> (f64, [f64; OUTPUTS]) {
        let (mut loss, mut to_outputs) = (0.0, [0.0; OUTPUTS]);
        for k in 0..2 {
            let log_variance = outputs[k + 2].clamp(LOG_VARIANCE.0, LOG_VARIANCE.1);
            let weight = (-log_variance).exp();
            let error = (outputs[k] - self.0[k]).clamp(-PULL_LIMIT, PULL_LIMIT);
            loss += 0.5 * (error * error * weight + log_variance);
            to_outputs[k] = error * weight;
            to_outputs[k + 2] = 0.5 * (1.0 - error * error * weight);
        }
        (loss, to_outputs)
    }

    fn scaled(&self, share: f64) -> Self {
        Self(self.0.map(|units| share * units))
    }
}
