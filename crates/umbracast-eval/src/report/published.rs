//! What the paper prints, to stand beside our figures.

/// Accuracy, precision and recall at w = 3 (section V).
pub const AT_300_MS: [(&str, f64); 3] = [("accuracy", 0.87), ("precision", 0.78), ("recall", 0.79)];
/// F1 at w = 3, which follows from the two and is not printed.
pub const F1_AT_300_MS: f64 = 0.785;
/// Where F1 settles from w = 8 (section V, the figure).
pub const F1_FROM_800_MS: f64 = 0.815;
/// Share of blocked windows at w = 3, which follows from the three figures (0.28 to 0.32 with rounding).
pub const BASE_RATE_AT_300_MS: f64 = 0.30;
/// Table I: displacement error at steps 1..=9, metres.
pub const DISPLACEMENT_M: [f64; 9] = [0.22, 0.27, 0.34, 0.42, 0.51, 0.61, 0.72, 0.83, 0.96];
