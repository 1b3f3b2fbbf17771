//! True and false positives and negatives, and the scores computed from them.

use serde::{Deserialize, Serialize};
use umbracast::geometry::DVec2;

/// True and false, positive and negative.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Blocked and said so.
    pub true_positive: u64,
    /// In sight, said blocked.
    pub false_positive: u64,
    /// Blocked, said in sight.
    pub false_negative: u64,
    /// In sight and said so.
    pub true_negative: u64,
}

impl Counts {
    /// Adds one instance.
    pub fn count(&mut self, truth: bool, said: bool) {
        *match (truth, said) {
            (true, true) => &mut self.true_positive,
            (false, true) => &mut self.false_positive,
            (true, false) => &mut self.false_negative,
            (false, false) => &mut self.true_negative,
        } += 1;
    }

    /// Instances.
    pub fn total(&self) -> u64 {
        self.true_positive + self.false_positive + self.false_negative + self.true_negative
    }

    /// Share of instances that were blocked.
    pub fn base_rate(&self) -> Option<f64> {
        ratio(self.true_positive + self.false_negative, self.total())
    }

    /// Share of instances said rightly.
    pub fn accuracy(&self) -> Option<f64> {
        ratio(self.true_positive + self.true_negative, self.total())
    }

    /// Of those said blocked, the share that was. `None` when none was said.
    pub fn precision(&self) -> Option<f64> {
        ratio(self.true_positive, self.true_positive + self.false_positive)
    }

    /// Of those blocked, the share that was said. `None` when none was blocked.
    pub fn recall(&self) -> Option<f64> {
        ratio(self.true_positive, self.true_positive + self.false_negative)
    }

    /// Harmonic mean of precision and recall, 2 TP / (2 TP + FP + FN).
    pub fn f1(&self) -> Option<f64> {
        ratio(2 * self.true_positive, 2 * self.true_positive + self.false_positive + self.false_negative)
    }
}

/// A quotient, or `None` over nothing.
pub fn ratio(numerator: u64, denominator: u64) -> Option<f64> {
    (denominator > 0).then(|| numerator as f64 / denominator as f64)
}

/// The squared length of an error in standard deviations of its covariance (xx, xy, yy), and the covariance's
/// determinant; nothing where it is not positive definite.
pub(crate) fn squared_mahalanobis([xx, xy, yy]: [f64; 3], d: DVec2) -> Option<(f64, f64)> {
    let determinant = xx * yy - xy * xy;
    let squared = || (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / determinant;
    (xx > 0.0 && determinant > 0.0).then(|| (squared(), determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-9)
    }

    #[test]
    fn counts_of_a_confusion_matrix_by_hand() {
        let counts = Counts { true_positive: 6, false_positive: 2, false_negative: 3, true_negative: 9 };
        assert!(close(counts.base_rate(), 9.0 / 20.0));
        assert!(close(counts.accuracy(), 15.0 / 20.0));
        assert!(close(counts.precision(), 6.0 / 8.0));
        assert!(close(counts.recall(), 6.0 / 9.0));
        assert!(close(counts.f1(), 12.0 / 17.0));
    }
}
