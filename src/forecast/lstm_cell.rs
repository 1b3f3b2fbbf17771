//! One LSTM step for several people at once, on weights packed for streaming.
//!
//! A step reads all 4.7 MB of weights, so they are laid out in the order in which they are read: panels of
//! [`LANES`] gate columns, each row by row of the input. People go in groups of [`GROUP`], whose sums stay in
//! registers while a panel streams by.

use crate::elementary::{multiply_add_f32, sigmoid_f32, tanh_f32};

/// Gate columns of a panel: two AVX2 registers.
pub(super) const LANES: usize = 16;
/// People a panel serves at once: 5 x 2 sums, 2 weights and 1 input fill 13 of 16 registers.
pub(super) const GROUP: usize = 5;
/// Input, forget, cell, output: PyTorch's order.
const GATES: usize = 4;

type Lanes = [f32; LANES];

/// An LSTM layer's weights.
pub(super) struct PackedCell {
    /// Inputs before the hidden state.
    pub inputs: usize,
    /// Hidden units, a multiple of [`LANES`].
    pub units: usize,
    /// Per block of [`LANES`] units and gate: one row of lanes for each input, then for each hidden unit.
    panels: Vec<Lanes>,
    /// Per block and gate: both biases added.
    biases: Vec<Lanes>,
}

impl PackedCell {
    /// From `weight_ih` [4 units, inputs], `weight_hh` [4 units, units] and the summed `bias` [4 units], rows in
    /// the gates' order i f g o.
    pub fn pack(inputs: usize, units: usize, weight_ih: &[f32], weight_hh: &[f32], bias: &[f32]) -> Self {
        let (mut panels, mut biases) = (Vec::new(), Vec::new());
        for block in 0..units / LANES {
            for gate in 0..GATES {
                let row = |lane: usize| gate * units + block * LANES + lane;
                biases.push(std::array::from_fn(|lane| bias[row(lane)]));
                let column = |weights: &[f32], width: usize, k: usize| -> Lanes {
                    std::array::from_fn(|lane| weights[row(lane) * width + k])
                };
                panels.extend((0..inputs).map(|k| column(weight_ih, inputs, k)));
                panels.extend((0..units).map(|k| column(weight_hh, units, k)));
            }
        }
        Self { inputs, units, panels, biases }
    }
}

/// What a group of people carries from step to step.
#[derive(Debug, Clone)]
pub(super) struct GroupState {
    /// The step's input, then the hidden state: one row of people for each.
    pub rows: Vec<[f32; GROUP]>,
    /// Hidden state after the step, as `rows` has it before.
    next_hidden: Vec<[f32; GROUP]>,
    /// Cell state, per block of units and person.
    cell: Vec<[Lanes; GROUP]>,
}

impl GroupState {
    /// All zero, as the encoder starts.
    pub fn zero(cell: &PackedCell) -> Self {
        Self {
            rows: vec![[0.0; GROUP]; cell.inputs + cell.units],
            next_hidden: vec![[0.0; GROUP]; cell.units],
            cell: vec![[[0.0; LANES]; GROUP]; cell.units / LANES],
        }
    }
}

/// Eq. (1b): every group's hidden state after its input, in place. `first`: the states are zero still, so that eight of
/// nine weights are not read.
pub(super) fn step(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: `step_avx2` needs nothing but the two features that the line above has found.
        unsafe { step_avx2(cell, groups, first) };
        return;
    }
    step_with::<false>(cell, groups, first);
}

/// The same code with registers of eight lanes, multiply and add in one: 8 against 20 ms for ten people.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn step_avx2(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    step_with::<true>(cell, groups, first);
}

/// `FUSED`: multiply and add in one rounding, where the processor can.
#[inline(always)]
fn step_with<const FUSED: bool>(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    let panel_rows = cell.inputs + cell.units;
    let rows = if first { cell.inputs } else { panel_rows };
    let panels = cell.panels.chunks_exact(GATES * panel_rows);
    for (block, (panels, biases)) in panels.zip(cell.biases.chunks_exact(GATES)).enumerate() {
        for group in groups.iter_mut() {
            let mut gates = [[[0.0; LANES]; GROUP]; GATES];
            for ((gate, panel), bias) in gates.iter_mut().zip(panels.chunks_exact(panel_rows)).zip(biases) {
                *gate = weighted_sums::<FUSED>(panel, &group.rows[..rows], bias);
            }
            let next_hidden = &mut group.next_hidden[block * LANES..][..LANES];
            update::<FUSED>(&gates, &mut group.cell[block], next_hidden);
        }
    }
    for group in groups {
        group.rows[cell.inputs..].copy_from_slice(&group.next_hidden);
    }
}

/// One gate of [`LANES`] units for [`GROUP`] people, before its non-linearity.
#[inline(always)]
fn weighted_sums<const FUSED: bool>(panel: &[Lanes], rows: &[[f32; GROUP]], bias: &Lanes) -> [Lanes; GROUP] {
    let mut sums = [*bias; GROUP];
    for (weights, inputs) in panel.iter().zip(rows) {
        for person in 0..GROUP {
            for lane in 0..LANES {
                sums[person][lane] =
                    multiply_add_f32::<FUSED>(weights[lane], inputs[person], sums[person][lane]);
            }
        }
    }
    sums
}

/// c' = sigmoid(f) c + sigmoid(i) tanh(g), h' = sigmoid(o) tanh(c').
#[inline(always)]
fn update<const FUSED: bool>(
    gates: &[[Lanes; GROUP]; GATES],
    cell: &mut [Lanes; GROUP],
    next_hidden: &mut [[f32; GROUP]],
) {
    let [input, forget, candidate, output] = gates;
    for person in 0..GROUP {
        let mut hidden = [0.0; LANES];
        for lane in 0..LANES {
            let kept = sigmoid_f32::<FUSED>(forget[person][lane]) * cell[person][lane];
            let added =
                sigmoid_f32::<FUSED>(input[person][lane]) * tanh_f32::<FUSED>(candidate[person][lane]);
            cell[person][lane] = kept + added;
            hidden[lane] = sigmoid_f32::<FUSED>(output[person][lane]) * tanh_f32::<FUSED>(cell[person][lane]);
        }
        for lane in 0..LANES {
            next_hidden[lane][person] = hidden[lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_processor_agrees() {
        let (inputs, units) = (5, 2 * LANES);
        let values =
            |count: usize| -> Vec<f32> { (0..count).map(|i| (i as f32 * 0.7).sin() * 0.2).collect() };
        let cell = PackedCell::pack(
            inputs,
            units,
            &values(GATES * units * inputs),
            &values(GATES * units * units),
            &values(GATES * units),
        );
        let mut plain = vec![GroupState::zero(&cell); 2];
        plain[1].rows[..inputs].fill([1.0; GROUP]);
        let mut as_here = plain.clone();
        let mut all_read = plain.clone();
        for k in 0..17 {
            step_with::<false>(&cell, &mut plain, k == 0);
            step_with::<false>(&cell, &mut all_read, false);
            step(&cell, &mut as_here, k == 0);
        }
        assert!(plain.iter().zip(&all_read).all(|(a, b)| a.rows == b.rows), "zeros add nothing");
        for (plain, here) in plain.iter().zip(&as_here) {
            for (plain, here) in plain.rows.as_flattened().iter().zip(here.rows.as_flattened()) {
                assert!((plain - here).abs() < 1e-6, "{plain} and {here}");
            }
        }
    }
}
