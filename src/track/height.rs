//! How tall a person is, from the highest point of each detection.
//!
//! Beams are up to half a metre apart on a body, so the highest point of one frame lies anywhere between the top
//! of the head and a gap below it; while the person walks, the beams sweep over the head.

/// Lowest height that is thought of, metres.
const LOWEST_M: f64 = 1.30;
/// From one height to the next, metres.
const STEP_M: f64 = 0.01;
/// Heights that are thought of: up to 2.20 m.
const CELLS: usize = 91;
/// Error of a highest point, metres: range noise, hair, the bob of the walk.
const TOP_SIGMA_M: f64 = 0.025;
/// Chance of a highest point that says nothing (an arm raised, a bag, another body's point).
const OUTLIER: f64 = 0.05;
/// Frames that follow each other say nearly the same: each counts as this share of one.
const NEW_IN_A_FRAME: f64 = 0.2;
/// The gap taken where it is not known how beams fall, metres.
const GAP_UNKNOWN_M: f64 = 0.4;

/// A distribution over heights.
#[derive(Debug, Clone)]
pub(super) struct Height {
    log_p: [f64; CELLS],
    mean_m: f64,
    sigma_m: f64,
}

impl Height {
    pub(super) fn new(mean_m: f64, sigma_m: f64) -> Self {
        let log_p = std::array::from_fn(|i| -0.5 * ((height_m(i) - mean_m) / sigma_m).powi(2));
        Self { log_p, mean_m, sigma_m }
    }

    pub(super) fn mean_m(&self) -> f64 {
        self.mean_m
    }

    pub(super) fn sigma_m(&self) -> f64 {
        self.sigma_m
    }

    /// Takes the highest point of a frame, where so many beams meet a metre of upright head.
    pub(super) fn see(&mut self, top_m: f64, beams_per_m: f64) {
        let gap_m = if beams_per_m > 0.0 { 1.0 / beams_per_m } else { GAP_UNKNOWN_M };
        for (i, log_p) in self.log_p.iter_mut().enumerate() {
            // Even between a gap below the top of the head and the top, softened by the point's error.
            let below_m = height_m(i) - top_m;
            let even = rise(below_m / TOP_SIGMA_M) - rise((below_m - gap_m) / TOP_SIGMA_M);
            let p = (1.0 - OUTLIER) * even / gap_m + OUTLIER;
            *log_p += NEW_IN_A_FRAME * p.ln();
        }
        let most = self.log_p.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut weighted, mut squares) = (0.0, 0.0, 0.0);
        for (i, log_p) in self.log_p.iter_mut().enumerate() {
            *log_p -= most;
            let p = log_p.exp();
            sum += p;
            weighted += p * height_m(i);
            squares += p * height_m(i).powi(2);
        }
        self.mean_m = weighted / sum;
        self.sigma_m = (squares / sum - self.mean_m.powi(2)).max(0.0).sqrt();
    }
}

fn height_m(cell: usize) -> f64 {
    LOWEST_M + STEP_M * cell as f64
}

/// From 0 to 1 as a normal distribution's does, by the logistic curve that lies within 0.01 of it.
fn rise(sigmas: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * sigmas).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tops_that_sweep_over_a_gap_tell_the_height_and_one_alone_little() {
        let mut height = Height::new(1.72, 0.09);
        height.see(1.50, 1.0 / 0.3);
        assert!((height.mean_m() - 1.70).abs() < 0.05, "{}", height.mean_m());
        for frame in 0..100 {
            height.see(1.85 - 0.3 * f64::from(frame * 7 % 20) / 20.0, 1.0 / 0.3);
        }
        assert!((height.mean_m() - 1.85).abs() < 0.03, "{}", height.mean_m());
    }

    #[test]
    fn one_raised_arm_does_not_make_a_giant() {
        let mut height = Height::new(1.72, 0.09);
        (0..50).for_each(|frame| height.see(1.45 + 0.01 * f64::from(frame % 20), 1.0 / 0.2));
        let before_m = height.mean_m();
        height.see(2.1, 1.0 / 0.2);
        assert!((height.mean_m() - before_m).abs() < 0.02, "{before_m} to {}", height.mean_m());
    }
}
