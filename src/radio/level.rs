//! How loud a device is heard in sight: what antennas and hands add to what distance says.

/// By how much a device is heard louder than its distance says, dB: mean and variance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub(super) mean_db: f64,
    pub(super) variance: f64,
}

/// Standard deviation of a report in sight, dB: noise, steps of 1 dB, and small fades (IMMERSE: 0.45 to 0.7).
const REPORT_DB: f64 = 1.2;
/// A report is worth nothing with this probability, and may then be anywhere within so many dB.
const STRAY: f64 = 0.02;
const STRAY_DB: f64 = 60.0;

impl Level {
    /// Nothing was heard yet. Devices differ by 5 dB (one standard deviation) about Friis' equation, for nobody knows the gains of
    /// their antennas and of hands.
    pub(super) const UNKNOWN: Self = Self { mean_db: 0.0, variance: 25.0 };

    /// Mean and variance of several levels, each with its share.
    pub(super) fn mixed(parts: impl Iterator<Item = (f64, Self)> + Clone) -> Self {
        let sum: f64 = parts.clone().map(|(p, _)| p).sum();
        if sum <= f64::MIN_POSITIVE {
            return Self::UNKNOWN;
        }
        let mean_db = parts.clone().map(|(p, level)| p * level.mean_db).sum::<f64>() / sum;
        let square = |(p, level): (f64, Self)| p * (level.variance + (level.mean_db - mean_db).powi(2));
        Self { mean_db, variance: parts.map(square).sum::<f64>() / sum }
    }

    /// The likelihood of a power, 1/dB. The level learns from it, as a Kalman filter does, as far as the power is no stray.
    pub(super) fn weigh<const N: usize>(&mut self, power_dbm: f64, expected: &[(f64, f64, f64); N]) -> f64 {
        let mut parts = [(0.0, 0.0, 0.0); N];
        for (part, &(share, dbm, spread_db)) in parts.iter_mut().zip(expected) {
            let noise = REPORT_DB * REPORT_DB + spread_db * spread_db;
            let (off_db, variance) = (power_dbm - dbm - self.mean_db, self.variance + noise);
            let density =
                (-0.5 * off_db * off_db / variance).exp() / (std::f64::consts::TAU * variance).sqrt();
            *part = ((1.0 - STRAY) * share * density, off_db, noise);
        }
        let fits: f64 = parts.iter().map(|part| part.0).sum();
        let likelihood = fits + STRAY / STRAY_DB;
        if fits > 0.0 {
            let off_db = parts.iter().map(|(w, off_db, _)| w * off_db).sum::<f64>() / fits;
            let noise =
                parts.iter().map(|(w, off, noise)| w * (noise + (off - off_db).powi(2))).sum::<f64>() / fits;
            let gain = self.variance / (self.variance + noise) * fits / likelihood;
            self.mean_db += gain * off_db;
            self.variance *= 1.0 - gain;
        }
        likelihood
    }
}
