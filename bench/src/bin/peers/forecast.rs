//! The paper's LSTM, all people of a frame: nine observed displacements, then nine steps ahead.

use std::path::Path;

use umbracast::forecast::{Gaussian2, Weights};
use umbracast::geometry::DVec2;

use crate::exchange::{Answer, times, write_f32, write_f64};

/// The file that the peers read, too.
const WEIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/paper_lstm.safetensors");
const OBSERVED: usize = 9;
/// The paper's widths, and the gates of a unit.
const EMBEDDED: usize = 64;
const UNITS: usize = 512;
const GATES: usize = 4;

/// Ours: the mean of each step is fed to the next, as in mode `paper`.
pub fn row(folder: &Path) -> Answer {
    let bytes = std::fs::read(WEIGHTS).expect("the weights are in the repository");
    let weights = Weights::from_safetensors(&bytes).expect("the weights can be read");
    let mut answer = Answer::default();
    for people in [10, 100] {
        let observed_m: Vec<[DVec2; OBSERVED]> = (0..people).map(displacements_m).collect();
        let flat: Vec<f32> = observed_m.iter().flatten().flat_map(|d| d.as_vec2().to_array()).collect();
        write_f32(folder, &format!("observed_{people}"), &[people, OBSERVED, 2], &flat);
        let roll_out = || weights.roll_out(&observed_m, |_, ahead| ahead.mean_m);
        let foreseen = roll_out();
        let numbers = |g: &Gaussian2| [g.mean_m.x, g.mean_m.y, g.xx_m2, g.xy_m2, g.yy_m2];
        let flat: Vec<f64> = foreseen.iter().flatten().flat_map(numbers).collect();
        write_f64(folder, &format!("foreseen_{people}"), &[people, umbracast::STEPS, 5], &flat);
        let way_m: f64 =
            foreseen.iter().flatten().map(|step| step.mean_m.length()).sum::<f64>() / people as f64;
        let ms = times(30, || (), |()| drop(std::hint::black_box(roll_out())));
        answer.case(&format!("{people} people"), &ms, &[("mean way, m", way_m)]);
    }
    answer
}

/// The multiply-adds of the same forecasts alone, as fast as one core can do them: operands stay in registers, and no sum waits for
/// another. No arithmetic in single precision takes less.
pub fn multiply_adds(_: &Path) -> Answer {
    let mut answer = Answer::default();
    for people in [10, 100] {
        // The first step's hidden state is zero, so that it reads its inputs alone.
        let rows = (OBSERVED + umbracast::STEPS - 1) * (EMBEDDED + UNITS) - UNITS;
        let ms = times(30, || (), |()| many_multiply_adds(people * rows * GATES * UNITS));
        answer.case(&format!("{people} people"), &ms, &[]);
    }
    answer
}

/// Lanes of a register side by side, and sums that do not wait for each other.
const LANES: usize = 16;
const SUMS: usize = 20;

#[cfg(target_arch = "x86_64")]
fn many_multiply_adds(count: usize) {
    use std::arch::x86_64::{_mm256_fmadd_ps, _mm256_set1_ps, _mm512_fmadd_ps, _mm512_set1_ps};
    /// A register's worth of each sum, over and over.
    macro_rules! chains {
        ($name:ident, $feature:literal, $set:ident, $multiply_add:ident, $sums:expr) => {
            #[target_feature(enable = $feature)]
            fn $name(rounds: usize) {
                let [factor, summand] = [0.7, 0.3].map(|value| $set(std::hint::black_box(value)));
                let mut sums = [$set(0.1); $sums];
                for _ in 0..rounds {
                    for sum in &mut sums {
                        *sum = $multiply_add(*sum, factor, summand);
                    }
                }
                std::hint::black_box(sums);
            }
        };
    }
    chains!(wide, "avx512f", _mm512_set1_ps, _mm512_fmadd_ps, SUMS);
    // There are sixteen registers, and two hold the operands.
    chains!(narrow, "avx2,fma", _mm256_set1_ps, _mm256_fmadd_ps, SUMS / 2);
    if is_x86_feature_detected!("avx512f") {
        // SAFETY: the processor has just said that it has what the function needs.
        unsafe { wide(count / (LANES * SUMS)) }
    } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: the processor has just said that it has both.
        unsafe { narrow(count / (LANES / 2 * SUMS / 2)) }
    } else {
        panic!("this processor does not multiply and add in one");
    }
}

/// The row is skipped, with this reason.
#[cfg(not(target_arch = "x86_64"))]
fn many_multiply_adds(_: usize) {
    panic!("written for x86-64 alone");
}

/// Somebody walks along a bend, each at a pace and turn of their own.
fn displacements_m(person: usize) -> [DVec2; OBSERVED] {
    let turn = 0.02 * ((person % 7) as f64 - 3.0);
    let speed_m = 0.08 + 0.01 * (person % 5) as f64;
    std::array::from_fn(|k| DVec2::from_angle(person as f64 + turn * k as f64) * speed_m)
}
