//! The paper's LSTM: embedding 64, hidden 512, a bivariate Gaussian a step (Eq. (1) to (3)).
//!
//! One network, run for each person alone. It reads nine displacements of the observation window, in metres a frame,
//! and then runs eight steps more, each with the displacement that the step before predicted.

use std::fmt;
use std::sync::Arc;

use safetensors::SafeTensors;

use super::Gaussian2;
use super::lstm_cell::{self, GROUP, GroupState, LANES, PackedCell};
use crate::geometry::DVec2;
use crate::tensors::tensor;
use crate::track::OBSERVED;
use crate::{Error, STEPS};

/// Displacements of the observation window.
pub const OBSERVED_DISPLACEMENTS: usize = OBSERVED - 1;
/// Numbers the head gives: mu_x, mu_y, sigma_x, sigma_y, rho, the last three before they are squashed.
pub const HEAD: usize = 5;
/// The smallest standard deviation of a displacement. Half of ORCA's windows are exactly straight: without a
/// floor their likelihood has no bound.
pub const SIGMA_FLOOR_M: f32 = 0.001;
/// Displacements at 10 Hz are about this long, so that the head starts near the right spread.
pub const SIGMA_SCALE_M: f32 = 0.1;
/// No network of people's walks has more hidden units; the paper's has 512.
const UNITS_MAX: usize = 1 << 16;
/// Keeps the covariance invertible.
pub const RHO_LIMIT: f32 = 0.95;

/// The network's weights, packed once for the forward pass. A clone shares them.
///
/// ```
/// use umbracast::{Config, Mode, forecast::Weights, pipeline::Pipeline};
///
/// let weights = Weights::from_safetensors(&std::fs::read("models/paper_lstm.safetensors")?)?;
/// assert!(Pipeline::new(&Config::for_mode(Mode::Paper), Some(&weights)).is_ok());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Weights {
    network: Arc<Network>,
}

struct Network {
    /// Per unit of the embedding: weights of x and y, bias.
    embedding: Vec<[f32; 3]>,
    cell: PackedCell,
    /// Per hidden unit: its weight in each output.
    head: Vec<[f32; HEAD]>,
    head_bias: [f32; HEAD],
}

impl Weights {
    /// From the bytes of a safetensors file with PyTorch's tensors of f32: `emb.weight` `[E, 2]`, `emb.bias` `[E]`,
    /// `enc.weight_ih` `[4 H, E]`, `enc.weight_hh` `[4 H, H]`, `enc.bias_ih` and `enc.bias_hh` `[4 H]`, `dec.weight`
    /// `[5, H]`, `dec.bias` `[5]`; gates in the order i f g o. The paper has E = 64 and H = 512.
    ///
    /// ```
    /// use umbracast::forecast::Weights;
    ///
    /// assert!(Weights::from_safetensors(b"no tensors").unwrap_err().to_string().starts_with("weights: "));
    /// ```
    ///
    /// # Errors
    /// A tensor that is missing, has another shape or kind, or holds a number that is not finite.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, Error> {
        let file = SafeTensors::deserialize(bytes).map_err(|e| Error::new(format!("weights: {e}")))?;
        let rows_of = |name| file.tensor(name).ok().and_then(|t| t.shape().first().copied());
        let columns_of = |name| file.tensor(name).ok().and_then(|t| t.shape().get(1).copied());
        let embedded = rows_of("emb.weight").unwrap_or(64);
        let units = columns_of("enc.weight_hh").unwrap_or(512);
        if units == 0 || units % LANES != 0 || units > UNITS_MAX {
            return Err(Error::new(format!(
                "weights: enc.weight_hh: expected a multiple of {LANES} hidden units up to {UNITS_MAX}, found {units}"
            )));
        }
        let [emb_weight, emb_bias] =
            [tensor(&file, "emb.weight", &[embedded, 2])?, tensor(&file, "emb.bias", &[embedded])?];
        let weight_ih = tensor(&file, "enc.weight_ih", &[4 * units, embedded])?;
        let weight_hh = tensor(&file, "enc.weight_hh", &[4 * units, units])?;
        let bias_ih = tensor(&file, "enc.bias_ih", &[4 * units])?;
        let bias_hh = tensor(&file, "enc.bias_hh", &[4 * units])?;
        let [dec_weight, dec_bias] =
            [tensor(&file, "dec.weight", &[HEAD, units])?, tensor(&file, "dec.bias", &[HEAD])?];

        let bias: Vec<f32> = bias_ih.iter().zip(&bias_hh).map(|(ih, hh)| ih + hh).collect();
        let network = Network {
            embedding: emb_weight.chunks_exact(2).zip(&emb_bias).map(|(w, &b)| [w[0], w[1], b]).collect(),
            cell: PackedCell::pack(
                lstm_cell::gates_at_once(),
                embedded,
                units,
                &weight_ih,
                &weight_hh,
                &bias,
            ),
            head: (0..units).map(|k| std::array::from_fn(|row| dec_weight[row * units + k])).collect(),
            head_bias: std::array::from_fn(|row| dec_bias[row]),
        };
        Ok(Self { network: Arc::new(network) })
    }

    /// The Gaussian of each of the next displacements of every person. `observed_m` has the displacements of the
    /// observation window, oldest first; `next` says for a person (by place in `observed_m`) and a Gaussian which
    /// displacement the next step is fed with.
    #[doc(hidden)] // `Forecaster` calls it, and the score of a training.
    pub fn roll_out(
        &self,
        observed_m: &[[DVec2; OBSERVED_DISPLACEMENTS]],
        mut next: impl FnMut(usize, &Gaussian2) -> DVec2,
    ) -> Vec<[Gaussian2; STEPS]> {
        let network = &*self.network;
        let mut groups = vec![GroupState::zero(&network.cell); observed_m.len().div_ceil(GROUP)];
        let mut foreseen = vec![[Gaussian2::default(); STEPS]; observed_m.len()];
        let mut fed_m = vec![DVec2::ZERO; observed_m.len()];
        for frame in 0..OBSERVED_DISPLACEMENTS + STEPS - 1 {
            if frame < OBSERVED_DISPLACEMENTS {
                fed_m.iter_mut().zip(observed_m).for_each(|(fed, observed)| *fed = observed[frame]);
            }
            network.step(&fed_m, &mut groups, frame == 0);
            let Some(ahead) = (frame + 1).checked_sub(OBSERVED_DISPLACEMENTS) else { continue };
            for (person, (steps, fed)) in foreseen.iter_mut().zip(&mut fed_m).enumerate() {
                steps[ahead] = network.head(&groups[person / GROUP], person % GROUP);
                *fed = next(person, &steps[ahead]);
            }
        }
        foreseen
    }
}

impl fmt::Debug for Weights {
    /// The widths, not a million numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PackedCell { inputs, units, .. } = self.network.cell;
        f.debug_struct("Weights").field("embedded", &inputs).field("units", &units).finish()
    }
}

impl Network {
    /// Eq. (1a): e = ReLU(W_emb dx), then Eq. (1b): h = LSTM(h, e; W_enc).
    fn step(&self, displacements_m: &[DVec2], groups: &mut [GroupState], first: bool) {
        for (group, displacements) in groups.iter_mut().zip(displacements_m.chunks(GROUP)) {
            for (row, &[weight_x, weight_y, bias]) in group.rows.iter_mut().zip(&self.embedding) {
                for (value, displacement) in row.iter_mut().zip(displacements) {
                    let [x, y] = displacement.as_vec2().to_array();
                    *value = (weight_x * x + weight_y * y + bias).max(0.0);
                }
            }
        }
        lstm_cell::step(&self.cell, groups, first);
    }

    /// Eq. (2): [mu, sigma, rho] = W_dec h, as a Gaussian of the next displacement. The paper does not say how
    /// sigma is kept positive and rho within -1 and 1: sigma = floor + scale softplus(.), rho = limit tanh(.).
    fn head(&self, group: &GroupState, person: usize) -> Gaussian2 {
        let mut raw = self.head_bias;
        for (weights, hidden) in self.head.iter().zip(&group.rows[self.cell.inputs..]) {
            for (sum, weight) in raw.iter_mut().zip(weights) {
                *sum += weight * hidden[person];
            }
        }
        let [mu_x, mu_y, raw_x, raw_y, raw_rho] = raw.map(f64::from);
        let (sigma_x, sigma_y) = (sigma_m(raw_x), sigma_m(raw_y));
        let rho = f64::from(RHO_LIMIT) * raw_rho.tanh();
        Gaussian2 {
            mean_m: DVec2::new(mu_x, mu_y),
            xx_m2: sigma_x * sigma_x,
            xy_m2: rho * sigma_x * sigma_y,
            yy_m2: sigma_y * sigma_y,
        }
    }
}

fn sigma_m(raw: f64) -> f64 {
    // softplus(x) = ln(1 + e^x), written so that e^x cannot overflow.
    let softplus = raw.max(0.0) + (-raw.abs()).exp().ln_1p();
    f64::from(SIGMA_FLOOR_M) + f64::from(SIGMA_SCALE_M) * softplus
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use safetensors::tensor::TensorView;
    use safetensors::{Dtype, serialize};

    type Tensors = Vec<(&'static str, Vec<usize>, Vec<f32>)>;

    /// Eight embedded, sixteen hidden, weights anyhow.
    fn small_tensors() -> Tensors {
        let shapes: [(&str, &[usize]); 8] = [
            ("emb.weight", &[8, 2]),
            ("emb.bias", &[8]),
            ("enc.weight_ih", &[64, 8]),
            ("enc.weight_hh", &[64, 16]),
            ("enc.bias_ih", &[64]),
            ("enc.bias_hh", &[64]),
            ("dec.weight", &[5, 16]),
            ("dec.bias", &[5]),
        ];
        let values = |count: usize| (0..count).map(|i| ((i * 37 % 101) as f32 - 50.0) * 0.006).collect();
        shapes.map(|(name, shape)| (name, shape.to_vec(), values(shape.iter().product()))).to_vec()
    }

    fn file(tensors: &Tensors) -> Vec<u8> {
        let bytes: Vec<Vec<u8>> =
            tensors.iter().map(|(_, _, v)| v.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
        let views = tensors.iter().zip(&bytes).map(|((name, shape, _), bytes)| {
            (*name, TensorView::new(Dtype::F32, shape.clone(), bytes).unwrap())
        });
        serialize(views, None).unwrap()
    }

    /// A weights file.
    pub(in crate::forecast) fn small_network() -> Vec<u8> {
        file(&small_tensors())
    }

    #[test]
    fn people_are_foreseen_alike_in_any_company() {
        let weights = Weights::from_safetensors(&small_network()).unwrap();
        let observed: Vec<_> = (0..13)
            .map(|person| {
                let angle = f64::from(person);
                [DVec2::new(0.1 * angle.cos(), 0.1 * angle.sin()); OBSERVED_DISPLACEMENTS]
            })
            .collect();
        let together = weights.roll_out(&observed, |_, displacement| displacement.mean_m);
        for (person, &observed) in observed.iter().enumerate() {
            let alone = weights.roll_out(&[observed], |_, displacement| displacement.mean_m);
            assert_eq!(alone[0], together[person]);
        }
    }

    #[test]
    fn a_wrong_tensor_is_named_with_what_was_expected_and_found() {
        let refused = |change: &dyn Fn(&mut Tensors)| {
            let mut tensors = small_tensors();
            change(&mut tensors);
            Weights::from_safetensors(&file(&tensors)).unwrap_err().to_string()
        };
        let message = refused(&|tensors| tensors[6] = ("dec.weight", vec![4, 16], vec![0.0; 64]));
        assert_eq!(message, "weights: dec.weight: expected f32 of shape [5, 16], found F32 of shape [4, 16]");
        let message = refused(&|tensors| drop(tensors.remove(2)));
        assert_eq!(message, "weights: enc.weight_ih: expected f32 of shape [64, 8], found no such tensor");
        let message = refused(&|tensors| tensors[7].2[3] = f32::NAN);
        assert_eq!(message, "weights: dec.bias: expected f32 of shape [5], found NaN at place 3");
        let message = refused(&|tensors| tensors[3] = ("enc.weight_hh", vec![40, 10], vec![0.0; 400]));
        assert!(
            message.contains("expected a multiple of 16 hidden units up to 65536, found 10"),
            "{message}"
        );
        assert!(Weights::from_safetensors(b"not a file").is_err());
    }

    /// Four times 2^62 units were none, and the shapes of empty tensors fitted.
    #[test]
    fn a_shape_without_values_is_no_number_of_units() {
        let mut tensors = small_tensors();
        tensors[3] = ("enc.weight_hh", vec![0, 1 << 62], Vec::new());
        let message = Weights::from_safetensors(&file(&tensors)).unwrap_err().to_string();
        assert!(message.contains("hidden units up to 65536, found 4611686018427387904"), "{message}");
    }
}
