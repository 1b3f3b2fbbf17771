//! Values of the right kind that cannot work.

use super::{Config, Mechanism};
use crate::{Error, Site};

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
    site(&config.site)
}

/// Recordings, tables and links find sensors and access points by their names.
fn site(site: &Site) -> Result<(), Error> {
    if site.sensors.is_empty() {
        return Err(Error::new("site.sensors: expected one or more, found none"));
    }
    let sensors: Vec<&str> = site.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    let access_points: Vec<&str> = site.access_points.iter().map(|ap| ap.name.as_str()).collect();
    for (key, names) in [("site.sensors", sensors), ("site.access_points", access_points)] {
        if let Some((_, twice)) = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
            return Err(Error::new(format!("{key}: expected a name for each, found {twice:?} twice")));
        }
    }
    let hall = &site.hall;
    for (key, size_m) in [("length_m", hall.length_m), ("width_m", hall.width_m), ("height_m", hall.height_m)] {
        more_than_0(&format!("site.hall.{key}"), size_m)?;
    }
    for sensor in &site.sensors {
        more_than_0(&format!("site.sensors {}: rate_hz", sensor.name), sensor.rate_hz)?;
    }
    for pillar in &site.pillars {
        more_than_0("site.pillars: radius_m", pillar.radius_m)?;
    }
    let mut sizes_m = site.furniture.iter().flat_map(|furniture| furniture.size_m);
    sizes_m.try_for_each(|size_m| more_than_0("site.furniture: size_m", size_m))
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
            ("[[site.pillars]]\nposition_m = [1.0, 2.0]\nradius_m = -1.0", "site.pillars: radius_m"),
            (
                "[[site.furniture]]\nposition_m = [1.0, 2.0]\nsize_m = [1.0, 0.0, 1.0]\nyaw_deg = 0.0",
                "site.furniture: size_m",
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
