//! A person's state on the floor as a Gaussian, and matrices of two rows.
#![allow(non_snake_case)]

use crate::geometry::DVec2;

/// A symmetric 2x2 matrix.
pub type Mat2 = [[f64; 2]; 2];
/// A symmetric 4x4 matrix over (x, y, vx, vy).
pub type Mat4 = [[f64; 4]; 4];

/// A Gaussian over (x, y, vx, vy), metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Mean.
    pub x: [f64; 4],
    /// Covariance.
    pub P: Mat4,
}

impl State {
    /// The position's mean.
    pub fn position_m(&self) -> DVec2 {
        DVec2::new(self.x[0], self.x[1])
    }

    /// The velocity's mean.
    pub fn velocity_mps(&self) -> DVec2 {
        DVec2::new(self.x[2], self.x[3])
    }

    /// The position's covariance.
    pub fn position_covariance(&self) -> Mat2 {
        [[self.P[0][0], self.P[0][1]], [self.P[1][0], self.P[1][1]]]
    }

    /// Variance of the velocity's direction, rad^2, of who moves: d(heading) = (v x dv) / |v|^2.
    pub fn heading_variance_rad2(&self) -> f64 {
        let (v, P) = (self.velocity_mps(), &self.P);
        let squared = v.length_squared();
        let across = P[3][3] * v.x * v.x - 2.0 * P[2][3] * v.x * v.y + P[2][2] * v.y * v.y;
        across / (squared * squared)
    }
}

/// Sum of two matrices.
pub fn plus(a: Mat2, b: Mat2) -> Mat2 {
    [[a[0][0] + b[0][0], a[0][1] + b[0][1]], [a[1][0] + b[1][0], a[1][1] + b[1][1]]]
}

/// A matrix times a number.
pub fn scaled(a: Mat2, by: f64) -> Mat2 {
    a.map(|row| row.map(|entry| by * entry))
}

/// The same variance along each axis.
pub fn round(variance: f64) -> Mat2 {
    [[variance, 0.0], [0.0, variance]]
}

/// Inverse and determinant of a positive definite matrix.
pub fn inverted(a: Mat2) -> (Mat2, f64) {
    let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    ([[a[1][1] / det, -a[0][1] / det], [-a[1][0] / det, a[0][0] / det]], det)
}

/// y' A y.
pub fn quadratic(a: Mat2, y: DVec2) -> f64 {
    a[0][0] * y.x * y.x + (a[0][1] + a[1][0]) * y.x * y.y + a[1][1] * y.y * y.y
}

/// One standard deviation along the longer axis of an ellipse.
pub fn largest_sigma(spread: Mat2) -> f64 {
    let (mean, half) = (0.5 * (spread[0][0] + spread[1][1]), 0.5 * (spread[0][0] - spread[1][1]));
    (mean + half.hypot(spread[0][1])).max(0.0).sqrt()
}
