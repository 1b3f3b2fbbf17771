//! Refuses values of the right type that cannot work.

use super::blockage::BlockageConfig;
use super::detect::DetectConfig;
use super::forecast::ForecastConfig;
use super::mechanism::Mechanism;
use super::track::TrackConfig;
use crate::Error;

/// More samples than this take longer than a frame lasts, and more memory than is there.
const SAMPLES_MAX: usize = 16_384;

/// Refuses them with key, what was expected and what was found.
pub(super) fn stages(
    detect: &DetectConfig,
    track: &TrackConfig,
    forecast: &ForecastConfig,
    blockage: &BlockageConfig,
) -> Result<(), Error> {
    more_than_0("detect.highest_m", detect.highest_m)?;
    more_than_0("track.clutter_per_m2", track.clutter_per_m2)?;
    more_than_0("track.coast_max_s", track.coast_max_s)?;
    if !(0.0..10.0).contains(&detect.thin_m) {
        return Err(Error::new(format!("detect.thin_m: expected 0 to 10, found {}", detect.thin_m)));
    }
    if !(1..=SAMPLES_MAX).contains(&blockage.samples) {
        let found = blockage.samples;
        return Err(Error::new(format!("blockage.samples: expected 1 to {SAMPLES_MAX}, found {found}")));
    }
    if blockage.samples_min < 1 {
        return Err(Error::new("blockage.samples_min: expected 1 or more, found 0".to_owned()));
    }
    if !(blockage.threshold > 0.0 && blockage.threshold <= 1.0) {
        let found = blockage.threshold;
        return Err(Error::new(format!(
            "blockage.threshold: expected more than 0 and at most 1, found {found}"
        )));
    }
    for (stage, without) in [
        ("detect", &detect.without),
        ("track", &track.without),
        ("forecast", &forecast.without),
        ("blockage", &blockage.without),
    ] {
        if let Some(foreign) = without.iter().find(|mechanism| !mechanism.stages().contains(&stage)) {
            let own: Vec<&str> = Mechanism::ALL
                .iter()
                .filter(|mechanism| mechanism.stages().contains(&stage))
                .map(|mechanism| mechanism.name())
                .collect();
            let (own, found) = (own.join(", "), foreign.name());
            return Err(Error::new(format!("{stage}.without: expected {own}, found {found}")));
        }
    }
    Ok(())
}

fn more_than_0(key: &str, value: f64) -> Result<(), Error> {
    match value > 0.0 {
        true => Ok(()),
        false => Err(Error::new(format!("{key}: expected more than 0, found {value}"))),
    }
}
