//! A small network that looks at the points of one body.
//!
//! Each point goes through the same three layers. The largest and the mean of each number over all points (a PointNet: Qi et
//! al. 2017), with numbers of the whole body, go through three more. It was fitted on simulated returns by `umbracast train`.

use std::fmt;
use std::sync::Arc;

use safetensors::SafeTensors;

use super::pose_view::{OF_BODY, OF_POINT, PoseView};
use crate::Error;
use crate::elementary::wide;
use crate::tensors::{Layer, SEVERAL, WideLayer};

/// Units of the layers that each point goes through, then of those of the whole body; the last gives [`OUTPUTS`].
pub const POINT_UNITS: [usize; 3] = [32, 32, 64];
pub const BODY_UNITS: [usize; 2] = [256, 128];
/// What the layers of the whole body read.
pub const POOLED: usize = 2 * POINT_UNITS[2] + OF_BODY;
/// Numbers that it gives.
pub const OUTPUTS: usize = 14;

/// The network's weights. A clone shares them.
#[derive(Clone)]
pub struct PointNetwork(Arc<Layers>);

struct Layers {
    first: Layer<OF_POINT, { POINT_UNITS[0] }>,
    second: Layer<{ POINT_UNITS[0] }, { POINT_UNITS[1] }>,
    third: Layer<{ POINT_UNITS[1] }, { POINT_UNITS[2] }>,
    fourth: WideLayer<POOLED, { BODY_UNITS[0] }>,
    fifth: WideLayer<{ BODY_UNITS[0] }, { BODY_UNITS[1] }>,
    head: Layer<{ BODY_UNITS[1] }, OUTPUTS>,
}

impl PointNetwork {
    /// From the bytes of a safetensors file with PyTorch's tensors of f32: `points.0`, `points.1` and `points.2`, which each
    /// point goes through, then `body.0`, `body.1` and `body.2`, with a `.weight` and a `.bias` each.
    ///
    /// # Errors
    /// A tensor that is missing, has another shape or kind, or holds a number that is not finite.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, Error> {
        let file = SafeTensors::deserialize(bytes).map_err(|e| Error::new(format!("weights: {e}")))?;
        Ok(Self(Arc::new(Layers {
            first: Layer::read(&file, "points.0")?,
            second: Layer::read(&file, "points.1")?,
            third: Layer::read(&file, "points.2")?,
            fourth: WideLayer::read(&file, "body.0")?,
            fifth: WideLayer::read(&file, "body.1")?,
            head: Layer::read(&file, "body.2")?,
        })))
    }

    /// What the network says of each body. Who is seen in a mirror gets the same numbers.
    pub fn outputs(&self, views: &[PoseView]) -> impl Iterator<Item = [f64; OUTPUTS]> {
        views
            .chunks(SEVERAL)
            .flat_map(|views| self.0.outputs(views).into_iter().take(views.len()))
            .map(|outputs| outputs.map(f64::from))
    }
}

impl fmt::Debug for PointNetwork {
    /// The widths, not thousands of numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PointNetwork").field("points", &POINT_UNITS).field("body", &BODY_UNITS).finish()
    }
}

impl Layers {
    wide! {
        /// Of [`SEVERAL`] bodies at most; the others' numbers are nobody's.
        fn outputs(&self, views: &[PoseView]) -> [[f32; OUTPUTS]; SEVERAL] = outputs_avx2 or outputs_portably
    }

    #[inline(always)]
    fn outputs_portably(&self, views: &[PoseView]) -> [[f32; OUTPUTS]; SEVERAL] {
        let mut pooled = [[0.0; POOLED]; SEVERAL];
        // Loops in place of closures, which would be compiled for narrower registers.
        for (pooled, view) in pooled.iter_mut().zip(views) {
            *pooled = self.pooled(view);
        }
        let mut fourth = self.fourth.of(pooled.each_ref());
        for units in &mut fourth {
            *units = rectified(units);
        }
        let mut fifth = self.fifth.of(fourth.each_ref());
        for units in &mut fifth {
            *units = rectified(units);
        }
        let mut outputs = [[0.0; OUTPUTS]; SEVERAL];
        for (outputs, units) in outputs.iter_mut().zip(&fifth) {
            *outputs = self.head.of(units);
        }
        outputs
    }

    #[inline(always)]
    fn pooled(&self, view: &PoseView) -> [f32; POOLED] {
        const UNITS: usize = POINT_UNITS[2];
        let (mut largest, mut sums) = ([f32::MIN; UNITS], [0.0; UNITS]);
        for point in view.of_points() {
            let first = rectified(&self.first.of(point));
            let second = rectified(&self.second.of(&first));
            let third = self.third.of(&second);
            for u in 0..UNITS {
                largest[u] = if third[u] > largest[u] { third[u] } else { largest[u] };
                sums[u] += third[u];
            }
        }
        let share = 1.0 / view.of_points().len().max(1) as f32;
        let mut pooled = [0.0; POOLED];
        for u in 0..UNITS {
            (pooled[u], pooled[UNITS + u]) = (largest[u], share * sums[u]);
        }
        pooled[2 * UNITS..].copy_from_slice(&view.of_body);
        pooled
    }
}

/// A copy: changed in place, each register would be written under a mask, which takes some processors long.
#[inline(always)]
fn rectified<const N: usize>(units: &[f32; N]) -> [f32; N] {
    let mut rectified = [0.0; N];
    for (rectified, &unit) in rectified.iter_mut().zip(units) {
        *rectified = if unit > 0.0 { unit } else { 0.0 };
    }
    rectified
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_another_network_are_refused_with_what_was_expected() {
        let message = |bytes: &[u8]| PointNetwork::from_safetensors(bytes).unwrap_err().to_string();
        assert!(message(b"no tensors").starts_with("weights: "));
        let residual = include_bytes!("../../models/residual.safetensors");
        let found = message(residual);
        assert!(found.contains("points.0.weight: expected f32 of shape [32, 5]"), "{found}");
    }
}
