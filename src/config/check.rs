//! Values of the right kind that cannot work.

use super::check_site::check_site;
use super::{Config, Mechanism};
use crate::Error;

/// More samples than this take longer than a frame lasts, and more memory than is there.
const SAMPLES_MAX: usize = 16_384;

/// Refuses them with key, what was expected and what was found.
pub(super) fn check(config: &Config) -> Result<(), Error> {
    let Config { detect, track, forecast, blockage, .. } = config;
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
    check_site(&config.site)
}

fn more_than_0(key: &str, value: f64) -> Result<(), Error> {
    match value > 0.0 {
        true => Ok(()),
        false => Err(Error::new(format!("{key}: expected more than 0, found {value}"))),
    }
}

#[cfg(test)]
mod tests {
    use crate::{Config, Mode};

    #[test]
    fn what_cannot_work_is_refused_with_its_key() {
        for (text, key) in [
            ("[detect]\nhighest_m = 0.0", "detect.highest_m"),
            ("[detect]\nthin_m = -1.0", "detect.thin_m"),
            ("[track]\ncoast_max_s = nan", "track.coast_max_s"),
            ("[track]\nwithout = [\"arms\"]", "track.without"),
            ("[blockage]\nsamples = 0", "blockage.samples"),
            ("[blockage]\nthreshold = 1.5", "blockage.threshold"),
            ("[site]\nsensors = []", "site.sensors"),
            ("[[site.pillars]]\nposition_m = [1.0, 2.0]\nradius_m = -1.0", "site.pillars[0].radius_m"),
            (
                "[[site.furniture]]\nposition_m = [1.0, 2.0]\nsize_m = [1.0, 0.0, 1.0]\nyaw_deg = 0.0",
                "site.furniture[0].size_m",
            ),
        ] {
            let message = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap_err().to_string();
            assert!(message.starts_with("lab.toml") && message.contains(key), "{message}");
        }
    }

    /// Two sensors of one name shared a topic, and each took the other's packets for its own repeated.
    #[test]
    fn two_sensors_of_one_name_are_refused() {
        let mut config = Config::default();
        config.site.sensors[1].name = config.site.sensors[0].name.clone();
        let message = super::check(&config).unwrap_err().to_string();
        assert!(message.contains("site.sensors") && message.contains("twice"), "{message}");
        let mut config = Config::default();
        config.site.access_points[1].name = config.site.access_points[0].name.clone();
        assert!(super::check(&config).unwrap_err().to_string().contains("site.access_points"));
    }
}
