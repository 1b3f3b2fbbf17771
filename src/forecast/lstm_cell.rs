//! One LSTM step for several people at once, on weights packed for streaming.
//!
//! A step reads all 4.7 MB of weights, so they are laid out in the order in which they are read: blocks of
//! [`LANES`] units, in each the gates whose sums are in registers at once, row by row of the input. People go in groups of
//! [`GROUP`], whose sums stay in registers while the weights stream by.

use crate::elementary::{multiply_add_f32, sigmoid_f32, tanh_f32};

/// Units of a block: one AVX-512 register, two of AVX2.
pub(super) const LANES: usize = 16;
/// People a block serves at once.
pub(super) const GROUP: usize = 5;
/// Input, forget, cell, output: PyTorch's order.
const GATES: usize = 4;

/// Aligned, so that no register is read from two lines of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Lanes([f32; LANES]);

/// An LSTM layer's weights.
pub(super) struct PackedCell {
    /// Inputs before the hidden state.
    pub inputs: usize,
    /// Hidden units, a multiple of [`LANES`].
    pub units: usize,
    /// Gates whose sums are in registers at a time: one or all.
    at_once: usize,
    /// Per block of [`LANES`] units, and there per gates at once: one row of these for each input, then for each hidden unit.
    blocks: Vec<Lanes>,
    /// Per block: both biases added.
    biases: Vec<[Lanes; GATES]>,
}

impl PackedCell {
    /// From `weight_ih` [4 units, inputs], `weight_hh` [4 units, units] and the summed `bias` [4 units], rows in
    /// the gates' order i f g o. `at_once`: [`gates_at_once`] of the processor.
    pub fn pack(
        at_once: usize,
        inputs: usize,
        units: usize,
        weight_ih: &[f32],
        weight_hh: &[f32],
        bias: &[f32],
    ) -> Self {
        let (mut blocks, mut biases) = (Vec::new(), Vec::new());
        for block in 0..units / LANES {
            let lanes = |gate: usize, of: &dyn Fn(usize) -> f32| {
                Lanes(std::array::from_fn(|lane| of(gate * units + block * LANES + lane)))
            };
            biases.push(std::array::from_fn(|gate| lanes(gate, &|row| bias[row])));
            for first in (0..GATES).step_by(at_once) {
                let gates = || first..first + at_once;
                for k in 0..inputs {
                    blocks.extend(gates().map(|gate| lanes(gate, &|row| weight_ih[row * inputs + k])));
                }
                for k in 0..units {
                    blocks.extend(gates().map(|gate| lanes(gate, &|row| weight_hh[row * units + k])));
                }
            }
        }
        Self { inputs, units, at_once, blocks, biases }
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
            cell: vec![[Lanes([0.0; LANES]); GROUP]; cell.units / LANES],
        }
    }
}

/// As many gates' sums as this processor's registers hold.
pub(super) fn gates_at_once() -> usize {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx512f") {
        return GATES;
    }
    1
}

/// Eq. (1b): every group's hidden state after its input, in place. `first`: the states are zero still, so that eight of
/// nine weights are not read.
pub(super) fn step(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    #[cfg(target_arch = "x86_64")]
    if cell.at_once == GATES && is_x86_feature_detected!("avx512f") {
        // SAFETY: `step_avx512` needs nothing but the feature that the line above has found, and what it includes.
        unsafe { step_avx512(cell, groups, first) };
        return;
    } else if cell.at_once == 1 && is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: `step_avx2` needs nothing but the two features that the line above has found.
        unsafe { step_avx2(cell, groups, first) };
        return;
    }
    if cell.at_once == GATES {
        step_with::<false, GATES>(cell, groups, first);
    } else {
        step_with::<false, 1>(cell, groups, first);
    }
}

/// With registers of sixteen lanes and all gates at once, 5 x 4 sums, 4 weights and 1 input fill 25 of 32 of them: 1.5 ms for ten
/// people.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn step_avx512(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    step_with::<true, GATES>(cell, groups, first);
}

/// With registers of eight lanes and one gate after another, 5 x 2 sums, 2 weights and 1 input fill 13 of 16 of them: 4.2 ms on a
/// processor that has no wider ones (4.7 where the gates' weights lay side by side).
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn step_avx2(cell: &PackedCell, groups: &mut [GroupState], first: bool) {
    step_with::<true, 1>(cell, groups, first);
}

/// `FUSED`: multiply and add in one rounding, where the processor can. `AT_ONCE`: so many gates' sums are in registers at a time.
#[inline(always)]
fn step_with<const FUSED: bool, const AT_ONCE: usize>(
    cell: &PackedCell,
    groups: &mut [GroupState],
    first: bool,
) {
    let all_rows = cell.inputs + cell.units;
    let rows = if first { cell.inputs } else { all_rows };
    for (block, (weights, biases)) in cell.blocks.chunks_exact(GATES * all_rows).zip(&cell.biases).enumerate()
    {
        let weights = weights.as_chunks::<AT_ONCE>().0.chunks_exact(all_rows);
        let of_gates = weights.zip(biases.as_chunks::<AT_ONCE>().0);
        for group in groups.iter_mut() {
            let mut sums = [[Lanes([0.0; LANES]); GROUP]; GATES];
            for ((weights, biases), sums) in of_gates.clone().zip(sums.as_chunks_mut::<AT_ONCE>().0) {
                *sums = weighted_sums::<FUSED, AT_ONCE>(&weights[..rows], &group.rows[..rows], biases);
            }
            let next_hidden = &mut group.next_hidden[block * LANES..][..LANES];
            update::<FUSED>(&sums, &mut group.cell[block], next_hidden);
        }
    }
    for group in groups {
        group.rows[cell.inputs..].copy_from_slice(&group.next_hidden);
    }
}

/// Some gates of [`LANES`] units for [`GROUP`] people, before their non-linearity.
#[inline(always)]
fn weighted_sums<const FUSED: bool, const AT_ONCE: usize>(
    weights: &[[Lanes; AT_ONCE]],
    rows: &[[f32; GROUP]],
    biases: &[Lanes; AT_ONCE],
) -> [[Lanes; GROUP]; AT_ONCE] {
    let mut sums: [[Lanes; GROUP]; AT_ONCE] = std::array::from_fn(|gate| [biases[gate]; GROUP]);
    for (weights, inputs) in weights.iter().zip(rows) {
        // Written out, for in a loop round loops the compiler leaves the sums in memory.
        match (&mut sums[..], &weights[..]) {
            ([a, b, c, d], [of_a, of_b, of_c, of_d]) => {
                add::<FUSED>(a, of_a, inputs);
                add::<FUSED>(b, of_b, inputs);
                add::<FUSED>(c, of_c, inputs);
                add::<FUSED>(d, of_d, inputs);
            }
            (sums, weights) => {
                sums.iter_mut().zip(weights).for_each(|(sums, weights)| add::<FUSED>(sums, weights, inputs))
            }
        }
    }
    sums
}

#[inline(always)]
fn add<const FUSED: bool>(sums: &mut [Lanes; GROUP], weights: &Lanes, inputs: &[f32; GROUP]) {
    for person in 0..GROUP {
        for lane in 0..LANES {
            let sum = &mut sums[person].0[lane];
            *sum = multiply_add_f32::<FUSED>(weights.0[lane], inputs[person], *sum);
        }
    }
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
            let cell = &mut cell[person].0[lane];
            let kept = sigmoid_f32::<FUSED>(forget[person].0[lane]) * *cell;
            let added =
                sigmoid_f32::<FUSED>(input[person].0[lane]) * tanh_f32::<FUSED>(candidate[person].0[lane]);
            *cell = kept + added;
            hidden[lane] = sigmoid_f32::<FUSED>(output[person].0[lane]) * tanh_f32::<FUSED>(*cell);
        }
        for lane in 0..LANES {
            next_hidden[lane][person] = hidden[lane];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small_cell(at_once: usize) -> (PackedCell, Vec<GroupState>) {
        let (inputs, units) = (5, 2 * LANES);
        let values =
            |count: usize| -> Vec<f32> { (0..count).map(|i| (i as f32 * 0.7).sin() * 0.2).collect() };
        let cell = PackedCell::pack(
            at_once,
            inputs,
            units,
            &values(GATES * units * inputs),
            &values(GATES * units * units),
            &values(GATES * units),
        );
        let mut groups = vec![GroupState::zero(&cell); 2];
        groups[1].rows[..inputs].fill([1.0; GROUP]);
        (cell, groups)
    }

    #[test]
    fn every_processor_agrees() {
        let (cell, mut plain) = small_cell(1);
        let (cell_of_all, _) = small_cell(GATES);
        let [mut all_read, mut at_once, mut fused, mut as_here, mut all_as_here] =
            [(); 5].map(|()| plain.clone());
        for k in 0..17 {
            step_with::<false, 1>(&cell, &mut plain, k == 0);
            step_with::<false, 1>(&cell, &mut all_read, false);
            step_with::<false, GATES>(&cell_of_all, &mut at_once, k == 0);
            step_with::<true, 1>(&cell, &mut fused, k == 0);
            step(&cell, &mut as_here, k == 0);
            step(&cell_of_all, &mut all_as_here, k == 0);
        }
        let same = |a: &[GroupState], b: &[GroupState]| a.iter().zip(b).all(|(a, b)| a.rows == b.rows);
        assert!(same(&plain, &all_read), "zeros add nothing");
        assert!(same(&plain, &at_once), "however the weights are laid out");
        for here in [&as_here, &all_as_here] {
            assert!(same(here, &fused) || same(here, &plain), "the same bits, however wide the registers");
        }
        for (plain, fused) in plain.iter().zip(&fused) {
            for (plain, fused) in plain.rows.as_flattened().iter().zip(fused.rows.as_flattened()) {
                assert!((plain - fused).abs() < 1e-6, "{plain} and {fused}");
            }
        }
    }
    /// A processor with AVX-512 takes no other way.
    #[test]
    #[cfg(target_arch = "x86_64")]
    fn narrower_registers_give_the_same_bits() {
        if !is_x86_feature_detected!("avx2") || !is_x86_feature_detected!("fma") {
            return;
        }
        let ((cell, mut groups), (cell_as_here, mut as_here)) = (small_cell(1), small_cell(gates_at_once()));
        for k in 0..17 {
            // SAFETY: the processor has just said that it has both.
            unsafe { step_avx2(&cell, &mut groups, k == 0) };
            step(&cell_as_here, &mut as_here, k == 0);
        }
        assert!(groups.iter().zip(&as_here).all(|(a, b)| a.rows == b.rows));
    }
}
