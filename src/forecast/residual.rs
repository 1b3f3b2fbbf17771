//! Constant velocity from the filtered state, and a small network for how people depart from it: how they set off,
//! slow down and make way, and the spread that remains.
//!
//! Two hidden layers read a track and its most urgent neighbours ([`super::inputs`]). Their output is not a position.
//! Each axis has three coefficients for the departure from a constant velocity (t, t^2 and t^3) and four numbers for
//! the joint distribution of the errors ([`Coupling`]). The means therefore bend smoothly, and the spread of each
//! step is the marginal of the distribution that stage 3 samples from.

use std::array::from_fn;
use std::fmt;
use std::sync::Arc;

use safetensors::SafeTensors;

use super::constant_velocity::ACCELERATION_PSD_M2PS3;
use super::inputs::{INPUTS, Seen, mirror, see};
use super::{Coupling, Forecast, Gaussian2, constant_velocity};
use crate::elementary::{sigmoid_f32, wide};
use crate::geometry::DVec2;
use crate::tensors::Layer;
use crate::track::Track;
use crate::{Error, STEP_S, STEPS};

/// Units of each hidden layer.
pub const UNITS: usize = 64;
/// Coefficients of the mean along and across (t, t^2, t^3 each), then numbers of the spread along and across.
pub const OUTPUTS: usize = 2 * (COEFFICIENTS + SPREAD);
/// Of the mean, an axis.
pub const COEFFICIENTS: usize = 3;
/// Of the spread, an axis: logarithms of the factors on the filter's sigma of position and of velocity, their
/// correlation and the logarithm of the root of the acceleration's density, all before they are squashed.
pub const SPREAD: usize = 4;
/// A coefficient of 1 is so far at the last step.
pub const COEFFICIENT_M: f64 = 0.1;
/// How much of the learned departure is believed. Real walkers depart less than drawn crowds teach: of 0, 0.35, 0.5,
/// 0.65 and 1, half gave recorded walkers it never saw the best blockages and the best spread of errors, and cost
/// ORCA's people nothing (`record/forecasts.txt` has what it gives now).
pub const BELIEVED: f64 = 0.5;
/// The filter's sigmas are changed by at most e to this.
pub const LOG_FACTOR_LIMIT: f64 = 3.0;
/// Keeps the covariance invertible.
pub const RHO_LIMIT: f64 = 0.95;
/// The acceleration's spectral density is [`ACCELERATION_PSD_M2PS3`] where the network says 0, and at most so many powers
/// of e away.
pub const LOG_DENSITY_LIMIT: f64 = 8.0;

/// The network as `umbracast train` made it; its card lies beside the file.
const SHIPPED: &[u8] = include_bytes!("../../models/residual.safetensors");

/// The network's weights. A clone shares them.
#[derive(Clone)]
pub struct Residual {
    network: Arc<Network>,
    believed: f64,
}

struct Network {
    first: Layer<INPUTS, UNITS>,
    second: Layer<UNITS, UNITS>,
    head: Layer<UNITS, OUTPUTS>,
    mirror: [f32; INPUTS],
}

impl Residual {
    /// The network that ships.
    ///
    /// # Errors
    /// As [`Residual::from_safetensors`].
    pub fn shipped() -> Result<Self, Error> {
        Self::from_safetensors(SHIPPED)
    }

    /// From the bytes of a safetensors file with PyTorch's tensors of f32: `first.weight` `[64, INPUTS]`,
    /// `second.weight` `[64, 64]`, `head.weight` `[OUTPUTS, 64]` and a `.bias` of each.
    ///
    /// # Errors
    /// A tensor that is missing, has another shape or kind, or holds a number that is not finite.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, Error> {
        let file = SafeTensors::deserialize(bytes).map_err(|e| Error::new(format!("weights: {e}")))?;
        let network = Network {
            first: Layer::read(&file, "first")?,
            second: Layer::read(&file, "second")?,
            head: Layer::read(&file, "head")?,
            mirror: mirror(),
        };
        Ok(Self { network: Arc::new(network), believed: BELIEVED })
    }

    /// The same network, of whose departure another share than [`BELIEVED`] is believed.
    #[must_use]
    pub fn believing(self, believed: f64) -> Self {
        Self { believed, ..self }
    }

    /// What the network says of a track. Who walks in a mirror is foreseen in the mirror: the mean of what it
    /// says of both.
    pub fn outputs(&self, seen: &Seen) -> [f32; OUTPUTS] {
        let network = &*self.network;
        let mirrored: [f32; INPUTS] = from_fn(|i| seen.inputs[i] * network.mirror[i]);
        let (one, other) = (network.outputs(&seen.inputs), network.outputs(&mirrored));
        let across = COEFFICIENTS..2 * COEFFICIENTS;
        from_fn(|i| 0.5 * if across.contains(&i) { one[i] - other[i] } else { one[i] + other[i] })
    }

    /// The forecast of `tracks[of]`.
    pub fn forecast(&self, tracks: &[Track], of: usize) -> Forecast {
        let Track { id, position_m, velocity_mps, .. } = tracks[of];
        let (steps, coupling) = self.steps(&see(tracks, of), position_m, velocity_mps);
        Forecast { track: id, steps, coupling }
    }

    /// Where somebody seen so, with this position and velocity, will be, and how the errors hang together.
    pub fn steps(
        &self,
        seen: &Seen,
        position_m: DVec2,
        velocity_mps: DVec2,
    ) -> ([Gaussian2; STEPS], Coupling) {
        let outputs = self.outputs(seen).map(f64::from);
        let axes = [seen.ahead, seen.ahead.perp()];
        let coupling = coupling(&outputs, seen, axes);
        let steps = from_fn(|i| {
            let ahead_s = (i + 1) as f64 * STEP_S;
            let mut step = constant_velocity::position_at(position_m, velocity_mps, &coupling, ahead_s);
            step.mean_m += self.believed * departure_m(&outputs, axes, (i + 1) as f64 / STEPS as f64);
            step
        });
        (steps, coupling)
    }
}

impl fmt::Debug for Residual {
    /// The widths, not thousands of numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Residual").field("inputs", &INPUTS).field("units", &UNITS).finish()
    }
}

/// How far the network says the mean lies from a constant velocity at a share of the last step's time.
fn departure_m(outputs: &[f64; OUTPUTS], axes: [DVec2; 2], share: f64) -> DVec2 {
    let along = |axis: usize| {
        let c = &outputs[axis * COEFFICIENTS..][..COEFFICIENTS];
        COEFFICIENT_M * share * (c[0] + share * (c[1] + share * c[2]))
    };
    axes[0] * along(0) + axes[1] * along(1)
}

/// Along and across, errors of position and velocity are the filter's by the network's factors, correlated as it
/// says; so is the acceleration that nobody can foresee.
fn coupling(outputs: &[f64; OUTPUTS], seen: &Seen, axes: [DVec2; 2]) -> Coupling {
    let mut coupling = Coupling { state: [[0.0; 4]; 4], acceleration_psd_m2ps3: [[0.0; 2]; 2] };
    for (axis, direction) in axes.into_iter().enumerate() {
        let spread = &outputs[2 * COEFFICIENTS + axis * SPREAD..][..SPREAD];
        let factor = |log: f64| log.clamp(-LOG_FACTOR_LIMIT, LOG_FACTOR_LIMIT).exp();
        let position_m = seen.sigmas[axis] * factor(spread[0]);
        let velocity_mps = seen.sigmas[2 + axis] * factor(spread[1]);
        let both = RHO_LIMIT * spread[2].tanh() * position_m * velocity_mps;
        let density =
            ACCELERATION_PSD_M2PS3 * (2.0 * spread[3]).clamp(-LOG_DENSITY_LIMIT, LOG_DENSITY_LIMIT).exp();
        let d = direction.to_array();
        for i in 0..2 {
            for j in 0..2 {
                let share = d[i] * d[j];
                coupling.state[i][j] += share * position_m * position_m;
                coupling.state[i][j + 2] += share * both;
                coupling.state[i + 2][j] += share * both;
                coupling.state[i + 2][j + 2] += share * velocity_mps * velocity_mps;
                coupling.acceleration_psd_m2ps3[i][j] += share * density;
            }
        }
    }
    coupling
}

impl Network {
    wide! {
        fn outputs(&self, inputs: &[f32; INPUTS]) -> [f32; OUTPUTS] = outputs_avx2 or outputs_portably
    }

    #[inline(always)]
    fn outputs_portably(&self, inputs: &[f32; INPUTS]) -> [f32; OUTPUTS] {
        // x sigmoid(x): smooth, and cheap enough.
        let bent = |x: f32| x * sigmoid_f32::<false>(x);
        let first = self.first.of(inputs).map(bent);
        let second = self.second.of(&first).map(bent);
        self.head.of(&second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forecast::inputs::tests::three_people;
    use safetensors::tensor::TensorView;
    use safetensors::{Dtype, serialize};

    #[test]
    fn the_forecast_turns_with_the_scene_and_has_a_mirror_image() {
        let network = Residual::shipped().unwrap();
        let plain = network.forecast(&three_people(|p| p), 0);
        let turn = |p: DVec2| DVec2::from_angle(2.0).rotate(p);
        let turned = network.forecast(&three_people(turn), 0);
        let mirrored = network.forecast(&three_people(|p| DVec2::new(p.x, -p.y)), 0);
        for ((plain, turned), mirrored) in plain.steps.iter().zip(&turned.steps).zip(&mirrored.steps) {
            assert!(turned.mean_m.abs_diff_eq(turn(plain.mean_m), 1e-4), "{turned:?} for {plain:?}");
            assert!(mirrored.mean_m.abs_diff_eq(DVec2::new(plain.mean_m.x, -plain.mean_m.y), 1e-4));
            assert!((turned.xx_m2 + turned.yy_m2 - plain.xx_m2 - plain.yy_m2).abs() < 1e-5);
            assert!((mirrored.xy_m2 + plain.xy_m2).abs() < 1e-5);
        }
    }

    #[test]
    fn the_spread_of_every_step_is_a_covariance_and_grows() {
        let forecast = Residual::shipped().unwrap().forecast(&three_people(|p| p), 0);
        let areas = forecast.steps.map(|step| step.xx_m2 * step.yy_m2 - step.xy_m2 * step.xy_m2);
        assert!(areas[0] > 0.0 && areas.is_sorted(), "{areas:?}");
    }

    #[test]
    fn a_network_that_says_nothing_leaves_constant_velocity() {
        let tensors = [("first", UNITS, INPUTS), ("second", UNITS, UNITS), ("head", OUTPUTS, UNITS)];
        let zeros = vec![0; 4 * UNITS * UNITS.max(INPUTS)];
        let file = |head_rows: usize| {
            let views = tensors.iter().flat_map(|&(name, rows, columns)| {
                let rows = if name == "head" { head_rows } else { rows };
                let view = |shape: Vec<usize>| {
                    let bytes = 4 * shape.iter().product::<usize>();
                    TensorView::new(Dtype::F32, shape, &zeros[..bytes]).unwrap()
                };
                [
                    (format!("{name}.weight"), view(vec![rows, columns])),
                    (format!("{name}.bias"), view(vec![rows])),
                ]
            });
            serialize(views, None).unwrap()
        };
        let tracks = three_people(|p| p);
        let found = Residual::from_safetensors(&file(OUTPUTS)).unwrap().forecast(&tracks, 0);
        let expected = constant_velocity::forecast(&tracks[0]);
        for (found, expected) in found.steps.iter().zip(&expected.steps) {
            assert!(found.mean_m.abs_diff_eq(expected.mean_m, 1e-9));
            assert!(
                (found.xx_m2 - expected.xx_m2).abs() < 1e-9 && (found.yy_m2 - expected.yy_m2).abs() < 1e-9
            );
        }
        let message = Residual::from_safetensors(&file(5)).unwrap_err().to_string();
        let expected = format!("weights: head.weight: expected f32 of shape [{OUTPUTS}, {UNITS}], found F32");
        assert!(message.starts_with(&expected), "{message}");
    }
}
