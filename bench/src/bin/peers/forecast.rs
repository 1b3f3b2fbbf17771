//! The paper's LSTM, all people of a frame: nine observed displacements, then nine steps ahead.

use std::path::Path;

use umbracast::forecast::{Gaussian2, Weights};
use umbracast::geometry::DVec2;

use crate::exchange::{Answer, times, write_f32, write_f64};

/// The file that the peers read, too.
const WEIGHTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/paper_lstm.safetensors");
const OBSERVED: usize = 9;

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

/// Somebody walks along a bend, each at a pace and turn of their own.
fn displacements_m(person: usize) -> [DVec2; OBSERVED] {
    let turn = 0.02 * ((person % 7) as f64 - 3.0);
    let speed_m = 0.08 + 0.01 * (person % 5) as f64;
    std::array::from_fn(|k| DVec2::from_angle(person as f64 + turn * k as f64) * speed_m)
}
