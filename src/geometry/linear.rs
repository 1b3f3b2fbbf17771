//! Small systems of equations.

/// Solves a symmetric system; `None` where it is not positive definite.
pub(crate) fn cholesky<const N: usize>(mut a: [[f64; N]; N], mut x: [f64; N]) -> Option<[f64; N]> {
    for i in 0..N {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            let left = a[i][j] - sum;
            if i == j && left <= 0.0 {
                return None;
            }
            a[i][j] = if i == j { left.sqrt() } else { left / a[j][j] };
        }
        x[i] = (x[i] - (0..i).map(|k| a[i][k] * x[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..N).rev() {
        x[i] = (x[i] - (i + 1..N).map(|k| a[k][i] * x[k]).sum::<f64>()) / a[i][i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::cholesky;

    #[test]
    fn a_system_is_solved_and_one_that_is_not_positive_definite_is_not() {
        let matrix = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let x = cholesky(matrix, [1.0, -2.0, 0.25]).unwrap();
        for (row, right) in matrix.iter().zip([1.0, -2.0, 0.25]) {
            assert!((row.iter().zip(&x).map(|(a, x)| a * x).sum::<f64>() - right).abs() < 1e-12);
        }
        assert_eq!(cholesky([[1.0, 2.0], [2.0, 1.0]], [1.0, 1.0]), None);
    }
}
