//! The model of the body axis: a small network that computes the position of a body's axis from what the sensors saw
//! of it.
//!
//! One hidden layer of `tanh`. It runs twice, on the view and on its mirror image, so that mirrored people get
//! mirrored positions. It ships as `models/body_axis.toml`; the card beside it has data and scores. It was fitted on
//! simulated returns by `umbracast train axis`.

use std::array::from_fn;

use serde::Deserialize;

use super::features::{AxisFeatures, EVEN, ODD};
use crate::Error;
use crate::elementary::{tanh, wide};
use crate::geometry::DVec2;

/// Numbers that the network gives: the offset from the view's base away from the sensor and to the left of that, in
/// units of [`UNIT_M`], then the logarithms of their variances.
pub const OUTPUTS: usize = 4;
/// Unit of the network's offsets.
pub const UNIT_M: f64 = 0.05;
/// Inputs are held within so many standard deviations.
pub const INPUT_LIMIT: f64 = 4.0;
/// A cluster that is no single body shall not be moved about.
const OFFSET_LIMIT_M: f64 = 0.15;
/// Nor believed without end, nor be worth nothing: logarithms of variances in units.
const LOG_VARIANCE: (f64, f64) = (-5.0, 4.0);

/// The network's numbers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisModel {
    /// Mean of each even input in the training data. Odd inputs have a mean of zero.
    pub even_mean: Vec<f64>,
    /// Standard deviation of each even input.
    pub even_scale: Vec<f64>,
    /// Standard deviation of each odd input.
    pub odd_scale: Vec<f64>,
    /// A row for each hidden unit, its weights of the even and then the odd inputs.
    pub hidden: Vec<Vec<f64>>,
    /// One for each hidden unit.
    pub hidden_bias: Vec<f64>,
    /// A row for each output, its weights of the hidden units.
    pub output: Vec<Vec<f64>>,
    /// One for each output.
    pub output_bias: Vec<f64>,
}

impl AxisModel {
    /// The model that is embedded in the program.
    pub fn shipped() -> Self {
        Self::parse(include_str!("../../models/body_axis.toml"))
            .expect("the embedded file is proven by a test")
    }

    /// Reads a model.
    ///
    /// # Errors
    /// No TOML, or matrices of another shape, with what was expected and found.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let model: Self =
            toml::from_str(text).map_err(|e| Error::new(format!("model of the body axis: {e}")))?;
        let units = model.hidden.len();
        let shapes = [
            ("even_mean", EVEN, model.even_mean.len()),
            ("even_scale", EVEN, model.even_scale.len()),
            ("odd_scale", ODD, model.odd_scale.len()),
            ("hidden_bias", units, model.hidden_bias.len()),
            ("output", OUTPUTS, model.output.len()),
            ("output_bias", OUTPUTS, model.output_bias.len()),
        ];
        let rows = |name, expected, rows: &[Vec<f64>]| {
            rows.iter().map(|row| (name, expected, row.len())).collect::<Vec<_>>()
        };
        let hidden = rows("a row of hidden", EVEN + ODD, &model.hidden);
        let output = rows("a row of output", units, &model.output);
        match shapes.into_iter().chain(hidden).chain(output).find(|(_, expected, found)| expected != found) {
            None => Ok(model),
            Some((name, expected, found)) => Err(Error::new(format!(
                "model of the body axis: {name}: expected {expected} numbers, found {found}"
            ))),
        }
    }

    /// Ground point of the body axis, and the covariance of its error, m^2.
    pub fn locate(&self, view: &AxisFeatures) -> (DVec2, [[f64; 2]; 2]) {
        Network::of(self.clone()).locate(view)
    }

    /// The inputs of the network: as many standard deviations off their means.
    pub fn inputs(&self, even: &[f64; EVEN], odd: &[f64; ODD]) -> [f64; EVEN + ODD] {
        from_fn(|i| {
            let input = if i < EVEN {
                (even[i] - self.even_mean[i]) / self.even_scale[i]
            } else {
                odd[i - EVEN] / self.odd_scale[i - EVEN]
            };
            input.clamp(-INPUT_LIMIT, INPUT_LIMIT)
        })
    }
}

/// So many hidden units are summed up side by side.
const UNITS: usize = 16;

/// The model as it is asked: hidden units side by side, so that sums run in vector registers.
#[derive(Debug, Clone)]
pub(super) struct Network {
    model: AxisModel,
    units: Vec<Units>,
}

/// Some hidden units; of those that are not there every weight is 0.
#[derive(Debug, Clone)]
struct Units {
    of_inputs: [[f64; UNITS]; EVEN + ODD],
    bias: [f64; UNITS],
    to_outputs: [[f64; UNITS]; OUTPUTS],
}

impl Network {
    pub(super) fn of(model: AxisModel) -> Self {
        let units = |first: usize| {
            let of = |weight: &dyn Fn(usize) -> f64| -> [f64; UNITS] {
                from_fn(|u| if first + u < model.hidden.len() { weight(first + u) } else { 0.0 })
            };
            Units {
                of_inputs: from_fn(|i| of(&|u| model.hidden[u][i])),
                bias: of(&|u| model.hidden_bias[u]),
                to_outputs: from_fn(|o| of(&|u| model.output[o][u])),
            }
        };
        let units = (0..model.hidden.len()).step_by(UNITS).map(units).collect();
        Self { model, units }
    }

    /// See [`AxisModel::locate`].
    pub(super) fn locate(&self, view: &AxisFeatures) -> (DVec2, [[f64; 2]; 2]) {
        let [own, mirrored] = self.forward(view);
        let offset = DVec2::new(own[0] + mirrored[0], own[1] - mirrored[1]) * (0.5 * UNIT_M);
        let offset = offset.clamp_length_max(OFFSET_LIMIT_M);
        let variance = |i: usize| {
            (0.5 * (own[i] + mirrored[i])).clamp(LOG_VARIANCE.0, LOG_VARIANCE.1).exp() * UNIT_M * UNIT_M
        };
        let (along, across) = (variance(2), variance(3));
        let (a, l) = (view.away, view.away.perp());
        let xy = along * a.x * a.y + across * l.x * l.y;
        let covariance =
            [[along * a.x * a.x + across * l.x * l.x, xy], [xy, along * a.y * a.y + across * l.y * l.y]];
        (view.base_m + a * offset.x + l * offset.y, covariance)
    }

    wide! {
        fn forward(&self, view: &AxisFeatures) -> [[f64; OUTPUTS]; 2] = forward_avx2 or forward_portably
    }

    /// What the network says of a view and of its mirror image, whose odd inputs have the other sign: the sums over the even
    /// ones are the same.
    #[inline(always)]
    fn forward_portably(&self, view: &AxisFeatures) -> [[f64; OUTPUTS]; 2] {
        let inputs = self.model.inputs(&view.even, &view.odd);
        let bias: [f64; OUTPUTS] = from_fn(|o| self.model.output_bias[o]);
        let mut outputs = [bias; 2];
        for units in &self.units {
            let mut own = [0.0; UNITS];
            for (weights, x) in units.of_inputs[..EVEN].iter().zip(&inputs) {
                (0..UNITS).for_each(|u| own[u] += weights[u] * x);
            }
            let mut mirrored = own;
            for (weights, x) in units.of_inputs[EVEN..].iter().zip(&inputs[EVEN..]) {
                for u in 0..UNITS {
                    let product = weights[u] * x;
                    own[u] += product;
                    mirrored[u] -= product;
                }
            }
            for (outputs, mut sums) in outputs.iter_mut().zip([own, mirrored]) {
                (0..UNITS).for_each(|u| sums[u] = tanh(sums[u] + units.bias[u]));
                for (output, weights) in outputs.iter_mut().zip(&units.to_outputs) {
                    *output += weights.iter().zip(&sums).map(|(weight, unit)| weight * unit).sum::<f64>();
                }
            }
        }
        outputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_model_has_the_shape_that_is_read() {
        assert!(AxisModel::shipped().hidden.len() >= 8);
    }

    #[test]
    fn a_model_of_another_shape_is_refused_with_what_was_expected() {
        let text = include_str!("../../models/body_axis.toml");
        let short = text.replacen("hidden_bias = [", "hidden_bias = [0.5, ", 1);
        let message = AxisModel::parse(&short).unwrap_err().to_string();
        assert!(message.contains("hidden_bias: expected"), "{message}");
        assert!(AxisModel::parse("hidden = 3").is_err());
    }
}
