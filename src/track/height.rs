//! How tall a person is, from the highest point of each detection.
//!
//! Beams are up to half a metre apart on a body, so the highest point of one frame lies anywhere between the top
//! of the head and a gap below it; while the person walks, the beams sweep over the head.

use super::remembered::{Remembered, Words};

/// Lowest height of an adult that is thought of, metres.
const ADULT_M: f64 = 1.30;
/// From one height to the next, metres.
const STEP_M: f64 = 0.01;
/// Heights below an adult's that are thought of: down to 0.85 m, a child of two.
const LOWER: usize = 45;
/// Heights that are thought of: up to 2.20 m.
const CELLS: usize = LOWER + 91;
/// Children's heights lie evenly up to here, metres: twelve years.
const CHILD_MAX_M: f64 = 1.50;
/// Error of a highest point, metres: range noise, hair, the bob of the walk.
const TOP_SIGMA_M: f64 = 0.025;
/// Chance of a highest point that says nothing (an arm raised, a bag, another body's point).
const OUTLIER: f64 = 0.05;
/// Frames that follow each other say nearly the same: each counts as this share of one.
const NEW_IN_A_FRAME: f64 = 0.2;
/// The lowest tops of a gap hardly occur, for of all columns and sensors that meet a head the highest point counts:
/// so much of a gap is left, measured on tuning scenes. A whole one makes everybody 3 cm too tall.
const GAP_SHARE: f64 = 0.85;
/// The gap taken where it is not known how beams fall, metres.
const GAP_UNKNOWN_M: f64 = 0.4;

/// A distribution over heights.
#[derive(Debug, Clone)]
pub(super) struct Height {
    log_p: [f64; CELLS],
    /// The first cell where an adult is likelier than a child.
    adults: usize,
    mean_m: f64,
    sigma_m: f64,
}

impl Remembered for Height {
    fn visit(&mut self, words: &mut impl Words) {
        words.f64s(&mut self.log_p);
        let mut adults = self.adults as u64;
        words.word(&mut adults);
        self.adults = (adults as usize).min(CELLS);
        words.f64(&mut self.mean_m);
        words.f64(&mut self.sigma_m);
    }
}

impl Height {
    /// An adult, or with chance `children_share` a child, of whom `adult_mean_m` and `adult_sigma_m` say nothing.
    pub(super) fn new(adult_mean_m: f64, adult_sigma_m: f64, children_share: f64) -> Self {
        // Relative to the density of adults at their mean.
        let density = std::f64::consts::TAU.sqrt() * adult_sigma_m / (CHILD_MAX_M - height_m(0));
        let child = (children_share / (1.0 - children_share) * density).ln();
        let adult = |i: usize| -0.5 * ((height_m(i) - adult_mean_m) / adult_sigma_m).powi(2);
        let is_child = |i: usize| i < LOWER || height_m(i) < CHILD_MAX_M && adult(i) < child;
        let log_p = std::array::from_fn(|i| if is_child(i) { child } else { adult(i) });
        let adults = (0..CELLS).find(|&i| !is_child(i)).unwrap_or(0);
        Self { log_p, adults, mean_m: adult_mean_m, sigma_m: adult_sigma_m }
    }

    pub(super) fn mean_m(&self) -> f64 {
        self.mean_m
    }

    pub(super) fn sigma_m(&self) -> f64 {
        self.sigma_m
    }

    /// Takes the highest point of a frame, where so many beams meet a metre of upright head.
    pub(super) fn see(&mut self, top_m: f64, beams_per_m: f64) {
        let gap_m = if beams_per_m > 0.0 { GAP_SHARE / beams_per_m } else { GAP_UNKNOWN_M };
        let mut p: [f64; CELLS] = std::array::from_fn(|i| {
            // Even between a gap below the top of the head and the top, softened by the point's error.
            let below_m = height_m(i) - top_m;
            let even = rise(below_m / TOP_SIGMA_M) - rise((below_m - gap_m) / TOP_SIGMA_M);
            (1.0 - OUTLIER) * even / gap_m + OUTLIER
        });
        if beams_per_m <= 0.0 {
            // Where no beam meets the head, an adult looks as low as a child: which of them it is stays open.
            let (children, adults) = p.split_at_mut(self.adults);
            let weights = self.log_p[self.adults..].iter().map(|log_p| log_p.exp());
            let (sum, weighted) =
                weights.zip(adults).fold((0.0, 0.0), |(sum, all), (w, p)| (sum + w, all + w * *p));
            if sum > 0.0 {
                children.fill(weighted / sum);
            }
        }
        for (log_p, p) in self.log_p.iter_mut().zip(&p) {
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
    ADULT_M + STEP_M * (cell as f64 - LOWER as f64)
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
        let mut height = Height::new(1.72, 0.09, 0.1);
        height.see(1.50, 1.0 / 0.3);
        assert!((height.mean_m() - 1.70).abs() < 0.05, "{}", height.mean_m());
        for frame in 0..100 {
            height.see(1.85 - 0.3 * f64::from(frame * 7 % 20) / 20.0, 1.0 / 0.3);
        }
        assert!((height.mean_m() - 1.85).abs() < 0.03, "{}", height.mean_m());
    }

    #[test]
    fn a_child_is_no_short_adult_and_one_whose_head_no_beam_meets_no_child() {
        let (mut child, mut hidden) = (Height::new(1.72, 0.09, 0.1), Height::new(1.72, 0.09, 0.1));
        for frame in 0..30 {
            let top_m = 1.10 - 0.2 * f64::from(frame * 7 % 20) / 20.0;
            child.see(top_m, 1.0 / 0.2);
            hidden.see(top_m, 0.0);
        }
        assert!((child.mean_m() - 1.10).abs() < 0.03, "{}", child.mean_m());
        assert!(hidden.mean_m() > 1.4, "{}", hidden.mean_m());
    }

    #[test]
    fn one_raised_arm_does_not_make_a_giant() {
        let mut height = Height::new(1.72, 0.09, 0.1);
        (0..50).for_each(|frame| height.see(1.45 + 0.01 * f64::from(frame % 20), 1.0 / 0.2));
        let before_m = height.mean_m();
        height.see(2.1, 1.0 / 0.2);
        assert!((height.mean_m() - before_m).abs() < 0.02, "{before_m} to {}", height.mean_m());
    }
}
