//! Adam (Kingma and Ba, 2015, Algorithm 1), written by hand: a dozen lines. The framework that has it needs five
//! hundred packages.

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// Running moments of every weight.
#[derive(Debug, Clone)]
pub struct Adam {
    /// Of the gradients.
    first: Vec<f64>,
    /// Of their squares.
    second: Vec<f64>,
    /// Updates so far.
    updates: i32,
}

impl Adam {
    /// Before the first update of so many weights.
    pub fn new(weights: usize) -> Self {
        Self { first: vec![0.0; weights], second: vec![0.0; weights], updates: 0 }
    }

    /// Updates so far.
    pub fn updates(&self) -> i32 {
        self.updates
    }

    /// One step of the weights against their gradient, both in one order.
    pub fn update<'a>(
        &mut self,
        weights: impl Iterator<Item = &'a mut f64>,
        gradient: impl Iterator<Item = f64>,
        rate: f64,
    ) {
        self.updates += 1;
        let (early_1, early_2) = (1.0 - BETA_1.powi(self.updates), 1.0 - BETA_2.powi(self.updates));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((weight, slope), (first, second)) in weights.zip(gradient).zip(moments) {
            *first += (1.0 - BETA_1) * (slope - *first);
            *second += (1.0 - BETA_2) * (slope * slope - *second);
            *weight -= rate * (*first / early_1) / ((*second / early_2).sqrt() + EPSILON);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_updates_are_those_worked_out_by_hand() {
        // Slopes 1, -2 and 0.5: m = 0.1, -0.11, -0.049 and v = 0.001, 0.004999, 0.005244001.
        let (mut adam, mut weight, mut expected) = (Adam::new(1), [1.0], 1.0);
        let moments = [(1.0, 0.1, 0.001), (-2.0, -0.11, 0.004_999), (0.5, -0.049, 0.005_244_001)];
        for (update, (slope, m, v)) in (1..).zip(moments) {
            adam.update(weight.iter_mut(), [slope].into_iter(), 0.1);
            let early = |beta: f64| 1.0 - beta.powi(update);
            expected -= 0.1 * (m / early(0.9)) / ((v / early(0.999)).sqrt() + 1e-8);
            assert!((weight[0] - expected).abs() < 1e-12, "update {update}: {weight:?}, expected {expected}");
        }
    }
}
