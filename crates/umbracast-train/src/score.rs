//! The errors of a network's forecasts, computed as in the pipeline.

use umbracast::STEPS;
use umbracast::forecast::Weights;
use umbracast::geometry::DVec2;

use crate::windows::Window;

/// Windows forecast at once.
const BATCH: usize = 100;

/// Over windows, by step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scores {
    /// Mean distance between forecast and true position, metres.
    pub displacement_m: [f64; STEPS],
    /// The same of a walker who repeats the last observed displacement.
    pub repeated_m: [f64; STEPS],
    /// Share of true displacements within the ellipse that should hold 90 % of them.
    pub within_90: [f64; STEPS],
}

/// Scores a network by the mean of its Gaussians.
pub fn score(weights: &Weights, windows: &[Window]) -> Scores {
    let mut scores = Scores::default();
    let share = 1.0 / windows.len() as f64;
    for batch in windows.chunks(BATCH) {
        let observed: Vec<_> = batch.iter().map(|window| window.observed_m).collect();
        let foreseen = weights.roll_out(&observed, |_, displacement| displacement.mean_m);
        for (window, foreseen) in batch.iter().zip(&foreseen) {
            let (mut error, mut repeated) = (DVec2::ZERO, DVec2::ZERO);
            let last = window.observed_m[window.observed_m.len() - 1];
            for (i, (step, &coming)) in foreseen.iter().zip(&window.coming_m).enumerate() {
                error += step.mean_m - coming;
                repeated += last - coming;
                scores.displacement_m[i] += error.length() * share;
                scores.repeated_m[i] += repeated.length() * share;
                let d = step.mean_m - coming;
                let determinant = step.xx_m2 * step.yy_m2 - step.xy_m2 * step.xy_m2;
                let squared = (d.x * d.x * step.yy_m2 - 2.0 * d.x * d.y * step.xy_m2
                    + d.y * d.y * step.xx_m2)
                    / determinant;
                // Chi-square with two degrees of freedom: 90 % lie below 4.605.
                scores.within_90[i] += if squared < 4.605 { share } else { 0.0 };
            }
        }
    }
    scores
}
