//! Normal equations of a robust least-squares fit, and how well they determine each unknown.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

/// A residual this many times its standard deviation weighs half.
const HALF_WEIGHT: f64 = 2.5;
/// Information that holds an unknown where it is.
const HELD: f64 = 1e12;

/// Sums over all residuals.
#[derive(Debug)]
pub struct Normal {
    /// Information.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Information whose errors are each their own.
    independent: DMatrix<f64>,
    /// Gradients of residuals that err together.
    together: BTreeMap<[usize; 4], DVector<f64>>,
}

impl Normal {
    /// Of so many unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(unknowns, unknowns),
            gradient: DVector::zeros(unknowns),
            independent: DMatrix::zeros(unknowns, unknowns),
            together: BTreeMap::new(),
        }
    }

    /// A residual in standard deviations with its derivatives (unknown, slope), weighed by `weight`. Those of one `group`
    /// err together; those without one each for itself.
    pub fn add(&mut self, residual: f64, slopes: &[(usize, f64)], weight: f64, group: Option<[usize; 4]>) {
        let mut own = group
            .map(|group| self.together.entry(group).or_insert_with(|| DVector::zeros(self.gradient.len())));
        for &(i, a) in slopes {
            self.gradient[i] += weight * a * residual;
            if let Some(own) = &mut own {
                own[i] += weight * a * residual;
            }
            for &(j, b) in slopes {
                self.matrix[(i, j)] += weight * a * b;
                if group.is_none() {
                    self.independent[(i, j)] += weight * a * b;
                }
            }
        }
    }

    /// An unknown that is not fitted but held at zero, though it may be off by `sigma`: what the others owe to it is in their
    /// covariance (a consider parameter, Schmidt 1966).
    pub fn consider(&mut self, unknown: usize, sigma: f64) {
        self.matrix[(unknown, unknown)] += HELD;
        self.independent[(unknown, unknown)] += HELD * HELD * sigma * sigma;
    }

    /// What to add to the unknowns; `None` where the data leave some of them open.
    pub fn step(&self) -> Option<DVector<f64>> {
        Some(-self.matrix.clone().cholesky()?.solve(&self.gradient))
    }

    /// Covariance of the unknowns: H^-1 M H^-1 with M the spread of the gradients as it is, group by group (the sandwich of
    /// Huber and White). A walker's errors at one moment and at the next are much the same, so H^-1 alone would promise
    /// too much. The fit lies nearer to its few groups than the truth does, so their spread counts for G / (G - 1) of it.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let mut middle = self.independent.clone();
        let groups = self.together.len() as f64;
        let few = if groups > 1.0 { groups / (groups - 1.0) } else { 1.0 };
        for gradient in self.together.values() {
            middle += few * gradient * gradient.transpose();
        }
        let inverse = self.matrix.clone().cholesky()?.inverse();
        Some(&inverse * middle * &inverse)
    }
}

/// Weight of residuals with this sum of squares (Cauchy).
pub fn robust(squared: f64) -> f64 {
    1.0 / (1.0 + squared / (HALF_WEIGHT * HALF_WEIGHT))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mean of numbers that come in groups of equal ones is known as well as the groups are many.
    #[test]
    fn what_errs_together_counts_once() {
        let mut normal = Normal::new(1);
        for k in 0..400 {
            let group = k / 10;
            let value = if group % 2 == 0 { 1.0 } else { -1.0 };
            normal.add(0.0 - value, &[(0, 1.0)], 1.0, Some([group, 0, 0, 0]));
        }
        assert!(normal.step().unwrap()[0].abs() < 1e-12);
        let sigma = normal.covariance().unwrap()[(0, 0)].sqrt();
        assert!((sigma - 1.0 / 39.0_f64.sqrt()).abs() < 1e-9, "{sigma}");
    }
}
