//! Values of the right kind that cannot work.

use super::Config;
use crate::{Error, Site};

/// Refuses them with key, what was expected and what was found.
pub(super) fn check(config: &Config) -> Result<(), Error> {
    let (track, detect, blockage) = (&config.track, &config.detect, &config.blockage);
    if track.acceleration_m2ps3.is_empty() || track.acceleration_m2ps3.len() != track.model_share.len() {
        return Err(Error::new(format!(
            "track: expected one acceleration_m2ps3 and one model_share for each motion model, found {} and {}",
            track.acceleration_m2ps3.len(),
            track.model_share.len()
        )));
    }
    let positive = [
        ("detect.cluster.radius_m", detect.cluster.radius_m),
        ("detect.background.voxel_m", detect.background.voxel_m),
        ("detect.background.azimuth_bin_deg", detect.background.azimuth_bin_deg),
        ("detect.split.lambda_m", detect.split.lambda_m),
        ("track.model_dwell_s", track.model_dwell_s),
        ("track.sway_lasts_s", track.sway_lasts_s),
        ("track.swing_m2", track.swing_m2),
        ("track.swing_noise_m2", track.swing_noise_m2),
        ("track.noise_floor_m", track.noise_floor_m),
        ("track.height_sigma_m", track.height_sigma_m),
        ("track.box_average_s", track.box_average_s),
        ("site.hall.length_m", config.site.hall.length_m),
        ("site.hall.width_m", config.site.hall.width_m),
        ("site.hall.height_m", config.site.hall.height_m),
    ];
    positive.into_iter().try_for_each(|(key, value)| more_than_0(key, value))?;
    if !(0.0..1.0).contains(&track.children_share) {
        return Err(Error::new(format!(
            "track.children_share: expected 0 or more and less than 1, found {}",
            track.children_share
        )));
    }
    let mut bottom = 0.0;
    for slice in &blockage.body.slices {
        if !(slice.top > bottom && slice.half_depth > 0.0 && slice.half_width > 0.0) {
            return Err(Error::new(format!(
                "blockage.body.slices: expected half axes above 0 and a top above {bottom}, found {slice:?}"
            )));
        }
        bottom = slice.top;
    }
    if blockage.samples == 0 {
        return Err(Error::new("blockage.samples: expected 1 or more, found 0"));
    }
    if let Some(t) = blockage.threshold.windows(2).find(|t| t[1] > t[0]) {
        return Err(Error::new(format!(
            "blockage.threshold: expected values that do not rise with the window (a link blocked within 600 ms \
             is blocked within 900 ms), found {} after {}",
            t[1], t[0]
        )));
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
            ("[track]\nmodel_share = [1.0]", "model_share"),
            ("[detect.cluster]\nradius_m = 0.0", "detect.cluster.radius_m"),
            ("[track]\nheight_sigma_m = nan", "track.height_sigma_m"),
            ("[track]\nchildren_share = 1.0", "track.children_share"),
            ("[blockage]\nsamples = 0", "blockage.samples"),
            (
                "[blockage.body]\nslices = [{ top = 0.0, half_depth = 0.1, half_width = 0.1, ahead = 0.0 }]",
                "blockage.body.slices",
            ),
            ("[blockage]\nthreshold = [0.4, 0.4, 0.4, 0.4, 0.4, 0.4, 0.4, 0.4, 0.5]", "blockage.threshold"),
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
