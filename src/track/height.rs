//! How tall a person is, from the highest point of each detection.
//!
//! Beams are up to half a metre apart on a body, so the highest point of one frame lies anywhere between the top
//! of the head and a gap below it; while the person walks, the beams sweep over the head.

use super::remembered::{Remembered, Words};
use crate::elementary::{exp, ln, wide};

/// Mean standing height of adults in shoes.
pub(super) const HEIGHT_MEAN_M: f64 = 1.72;
/// Lowest height of an adult that is thought of, metres.
const ADULT_M: f64 = 1.30;
/// Cells that are added up side by side: no cell may be left over.
const LANES: usize = 8;
const _: () = assert!(CELLS.is_multiple_of(LANES));
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
/// No height is less likely than this, so that a track which was another body's for long finds its height within some seconds.
const LEAST_LOG_P: f64 = -25.0;
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
        let density = std::f64::consts::TAU.sqrt() * adult_sigma_m / (CHILD_MAX_M - HEIGHTS_M[0]);
        let child = (children_share / (1.0 - children_share) * density).ln();
        let adult = |i: usize| -0.5 * ((HEIGHTS_M[i] - adult_mean_m) / adult_sigma_m).powi(2);
        let is_child = |i: usize| i < LOWER || HEIGHTS_M[i] < CHILD_MAX_M && adult(i) < child;
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

    wide! {
        /// Takes the highest point of a frame, where so many beams meet a metre of upright head.
        pub(super) fn see(&mut self, top_m: f64, beams_per_m: f64) = see_avx2 or see_portably
    }

    #[inline(always)]
    fn see_portably(&mut self, top_m: f64, beams_per_m: f64) {
        let gap_m = if beams_per_m > 0.0 { GAP_SHARE / beams_per_m } else { GAP_UNKNOWN_M };
        let mut p = [0.0; CELLS];
        let (across, density) = (steepness(gap_m), (1.0 - OUTLIER) / gap_m);
        for i in 0..CELLS {
            // Even between a gap below the top of the head and the top, softened by the point's error: with the logistic
            // curve, which lies within 0.01 of a normal distribution's, 1 / (1 + below) - 1 / (1 + below across).
            let below = steepness(top_m - HEIGHTS_M[i]);
            let farther = below * across;
            p[i] = density * (farther - below) / ((1.0 + below) * (1.0 + farther)) + OUTLIER;
        }
        if beams_per_m <= 0.0 {
            // Where no beam meets the head, an adult looks as low as a child: which of them it is stays open.
            let (children, adults) = p.split_at_mut(self.adults);
            let weights = self.log_p[self.adults..].iter().map(|log_p| exp(*log_p));
            let (sum, weighted) =
                weights.zip(adults).fold((0.0, 0.0), |(sum, all), (w, p)| (sum + w, all + w * *p));
            if sum > 0.0 {
                children.fill(weighted / sum);
            }
        }
        for i in 0..CELLS {
            self.log_p[i] += NEW_IN_A_FRAME * ln(p[i]);
        }
        let mut most = [f64::NEG_INFINITY; LANES];
        for log_p in self.log_p.as_chunks::<LANES>().0 {
            for k in 0..LANES {
                most[k] = if log_p[k] > most[k] { log_p[k] } else { most[k] };
            }
        }
        let most = most.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let mut sums = [[0.0; LANES]; 3];
        for (log_p, height_m) in
            self.log_p.as_chunks_mut::<LANES>().0.iter_mut().zip(HEIGHTS_M.as_chunks::<LANES>().0)
        {
            for k in 0..LANES {
                let below = log_p[k] - most;
                log_p[k] = if below > LEAST_LOG_P { below } else { LEAST_LOG_P };
                let p = exp(log_p[k]);
                sums[0][k] += p;
                sums[1][k] += p * height_m[k];
                sums[2][k] += p * height_m[k] * height_m[k];
            }
        }
        let [sum, weighted, squares] = sums.map(|lanes| lanes.into_iter().sum::<f64>());
        self.mean_m = weighted / sum;
        self.sigma_m = (squares / sum - self.mean_m.powi(2)).max(0.0).sqrt();
    }
}

/// Of each cell.
const HEIGHTS_M: [f64; CELLS] = {
    let (mut heights_m, mut cell) = ([0.0; CELLS], 0);
    while cell < CELLS {
        heights_m[cell] = ADULT_M + STEP_M * (cell as f64 - LOWER as f64);
        cell += 1;
    }
    heights_m
};

/// By how much the odds of a logistic curve over points' errors change within a distance, within what products of two can
/// hold.
#[inline(always)]
fn steepness(m: f64) -> f64 {
    const MOST: f64 = 300.0;
    let powers = m * (1.702 / TOP_SIGMA_M);
    exp(if powers < MOST { powers } else { MOST })
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

    /// A track that followed a pram for a minute, and was given its owner in a crowd, called him 1.02 m tall for good.
    #[test]
    fn a_height_that_was_sure_changes_its_mind_within_seconds() {
        let mut height = Height::new(1.72, 0.09, 0.1);
        let sweep = |height: &mut Height, top_m: f64, frames: u32| {
            (0..frames)
                .for_each(|frame| height.see(top_m - 0.2 * f64::from(frame * 7 % 20) / 20.0, 1.0 / 0.2));
        };
        sweep(&mut height, 1.05, 600);
        assert!((height.mean_m() - 1.05).abs() < 0.03, "{}", height.mean_m());
        sweep(&mut height, 1.75, 60);
        assert!((height.mean_m() - 1.75).abs() < 0.05, "{}", height.mean_m());
    }
}
