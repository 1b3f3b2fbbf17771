//! People nobody knows: so many on a square metre, anywhere.

use umbracast::geometry::DVec3;

/// Mean width of a body seen from the side of a link, metres: between its depth and its breadth.
const WIDTH_M: f64 = 0.4;
/// The owner's own body is not in the way.
const OWN_M: f64 = 0.3;

/// A crowd without a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crowd {
    /// People on a square metre.
    pub density_per_m2: f64,
    /// How tall they are, metres.
    pub height_m: f64,
}

impl Crowd {
    /// The share of time in which nobody stands between two places, the second of them on somebody, above a floor at
    /// `floor_m`.
    ///
    /// Bodies are columns that stand anywhere with the same probability. The number of them on a strip is then Poisson's, and
    /// the strip is as long as the line runs below their heads (Gapeyenko et al., "Analysis of human-body blockage in urban
    /// millimeter-wave cellular communications", 2016, equation 4, for a line of constant slope).
    pub fn free(&self, from_m: DVec3, to_m: DVec3, floor_m: f64) -> f64 {
        let far_m = (from_m - to_m).truncate().length();
        let [high_m, low_m] = [from_m.z - floor_m, to_m.z - floor_m];
        let below = match high_m > low_m {
            true => ((self.height_m - low_m) / (high_m - low_m)).clamp(0.0, 1.0),
            false => 1.0,
        };
        let strip_m = (far_m * below - OWN_M).max(0.0);
        (-self.density_per_m2 * WIDTH_M * strip_m).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_high_access_point_is_blocked_less_and_nobody_blocks_in_an_empty_hall() {
        let phone_m = DVec3::new(10.0, 0.0, 0.9);
        let crowd = Crowd { density_per_m2: 0.1, height_m: 1.75 };
        let [low, high] = [2.0, 6.0].map(|z| crowd.free(DVec3::new(0.0, 0.0, z), phone_m, 0.0));
        assert!(0.5 < low && low < high && high < 1.0, "{low} {high}");
        // 10 m times 0.85 of 1.1 m below the heads, less the owner's own 0.3 m, on 0.4 m width.
        assert!((low - (-0.1 * 0.4 * (10.0 * 0.85 / 1.1 - 0.3_f64)).exp()).abs() < 1e-12);
        assert_eq!(Crowd { density_per_m2: 0.0, ..crowd }.free(DVec3::Z, phone_m, 0.0), 1.0);
    }
}
