//! Every setting of the runtime. The defaults are in `config/default.toml`, embedded here. `config/paper.toml` holds
//! what differs in the mode `paper`, and `config/hdl.toml` what differs from that in `hdl`. A user's file replaces
//! values of the mode.

mod mechanism;
mod detect;
mod track;
mod forecast;
mod blockage;
mod missing;
mod overlay;
mod check_hall;
mod check_site;
mod check;

use serde::{Deserialize, Serialize};

pub use blockage::{BlockageConfig, BlockageMethod, BoxKind};
pub use detect::{BackgroundMethod, ClusterMethod, DetectConfig, PositionMethod};
pub use forecast::{ForecastConfig, ForecastMethod, Rollout};
pub use mechanism::Mechanism;
pub use track::{TrackConfig, TrackMethod};

use crate::{Error, Site};

/// The commented defaults, as text.
pub const DEFAULT_TOML: &str = include_str!("../../config/default.toml");
const PAPER_TOML: &str = include_str!("../../config/paper.toml");
const HDL_TOML: &str = include_str!("../../config/hdl.toml");

/// Whose method runs. A mode is a set of values, never a branch.
///
/// ```
/// use umbracast::{Config, Mode, config::TrackMethod};
///
/// assert_eq!(Config::for_mode(Mode::Paper).track.method, TrackMethod::Paper);
/// assert_eq!("hdl".parse::<Mode>()?, Mode::Hdl);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Stage 1 as the adapted code ships it, the paper's stages 2 and 3.
    Hdl,
    /// The authors' method as they describe it.
    Paper,
    /// The best we have.
    Default,
}

impl Mode {
    /// All three, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Hdl, Self::Paper, Self::Default];

    /// Its name in files and on the command line.
    ///
    /// ```
    /// assert_eq!(umbracast::Mode::ALL.map(|mode| mode.name()), ["hdl", "paper", "default"]);
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Hdl => "hdl",
            Self::Paper => "paper",
            Self::Default => "default",
        }
    }
}

impl std::str::FromStr for Mode {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL
            .into_iter()
            .find(|mode| mode.name() == name)
            .ok_or_else(|| Error::new(format!("mode: expected hdl, paper or default, found {name:?}")))
    }
}

/// Everything the pipeline is told before it starts.
///
/// ```
/// let mut config = umbracast::Config::default();
/// config.blockage.samples = 256;
/// assert!(config.to_toml().contains("samples = 256"));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Which mode the values come from.
    pub mode: Mode,
    /// Where everything stands.
    pub site: Site,
    /// Stage 1, from points to detections.
    pub detect: DetectConfig,
    /// Stage 1, from detections to tracks.
    pub track: TrackConfig,
    /// Stage 2.
    pub forecast: ForecastConfig,
    /// Stage 3.
    pub blockage: BlockageConfig,
}

impl Config {
    /// The values of a mode on the default site.
    ///
    /// ```
    /// use umbracast::{Config, Mode};
    ///
    /// assert_eq!(Config::for_mode(Mode::Default), Config::default());
    /// assert_ne!(Config::for_mode(Mode::Hdl).detect, Config::default().detect);
    /// ```
    pub fn for_mode(mode: Mode) -> Self {
        Self::with_overlay(mode, "", "").expect("the embedded files are proven by a test")
    }

    /// The values of a mode with a user's file laid over them. `text` is the file's content, `file` its name
    /// for messages.
    ///
    /// ```
    /// use umbracast::{Config, Mode};
    ///
    /// let config = Config::with_overlay(Mode::Default, "[blockage]\nsamples = 64", "mine.toml")?;
    /// assert_eq!((config.blockage.samples, config.site), (64, Config::default().site));
    /// let error = Config::with_overlay(Mode::Default, "[blockage]\nsamples = true", "mine.toml").unwrap_err();
    /// assert!(error.to_string().starts_with("mine.toml:2:11: blockage.samples: expected a whole number"), "{error}");
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// Text that is not TOML, a key that does not exist, a value of the wrong kind: with file, line, what was
    /// expected and what was found. A value that cannot work, or a file of another mode.
    pub fn with_overlay(mode: Mode, text: &str, file: &str) -> Result<Self, Error> {
        let mut layers = vec![("config/default.toml", DEFAULT_TOML)];
        match mode {
            Mode::Hdl => layers.extend([("config/paper.toml", PAPER_TOML), ("config/hdl.toml", HDL_TOML)]),
            Mode::Paper => layers.push(("config/paper.toml", PAPER_TOML)),
            Mode::Default => {}
        }
        layers.push((file, text));
        let config: Self = overlay::parse(&layers)?;
        if config.mode != mode {
            let (asked, found) = (mode.name(), config.mode.name());
            return Err(Error::new(format!("{file}: mode: expected {asked}, found a file of mode {found}")));
        }
        config.check().map_err(|error| error.within(file))?;
        Ok(config)
    }

    /// Refuses values that cannot work.
    fn check(&self) -> Result<(), Error> {
        check::stages(&self.detect, &self.track, &self.forecast, &self.blockage)?;
        check_site::check_site(&self.site)
    }

    /// The same with the text of every sensor's own file in its place (`calibration`). `read` gives the text of a file
    /// that `calibration_file` names; where the text stands in the configuration already, nothing is read.
    ///
    /// ```
    /// use umbracast::{Config, Error, Mode};
    ///
    /// let mut config = Config::default();
    /// config.site.sensors[0].model = "xt32".to_owned();
    /// config.site.sensors[0].calibration_file = Some("angles.csv".to_owned());
    /// let angles = |file: &str| {
    ///     assert_eq!(file, "angles.csv");
    ///     Ok((1..=32).map(|channel| format!("{channel},{},0.1\n", 16 - channel)).collect())
    /// };
    /// let config = config.with_calibrations(angles)?;
    /// assert!(config.site.sensors[0].calibration.as_deref().is_some_and(|text| text.starts_with("1,15,0.1")));
    /// # Ok::<(), Error>(())
    /// ```
    ///
    /// # Errors
    /// What `read` fails with, and a text that is no such file, with the sensor's name.
    pub fn with_calibrations(
        mut self,
        mut read: impl FnMut(&str) -> Result<String, Error>,
    ) -> Result<Self, Error> {
        for sensor in self.site.sensors.iter_mut().filter(|sensor| sensor.calibration.is_none()) {
            let Some(file) = &sensor.calibration_file else { continue };
            let key = format!("site.sensors.{}.calibration_file", sensor.name);
            sensor.calibration = Some(read(file).map_err(|e| e.within(key))?);
        }
        self.check()?;
        Ok(self)
    }

    /// The configuration that a run wrote beside its output: its mode is the one it names.
    ///
    /// ```
    /// use umbracast::{Config, Mode};
    ///
    /// let written = Config::for_mode(Mode::Paper).to_toml();
    /// assert_eq!(Config::of_run(&written, "config.toml")?.mode, Mode::Paper);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Config::with_overlay`].
    pub fn of_run(text: &str, file: &str) -> Result<Self, Error> {
        let named =
            |mode: &Mode| text.lines().any(|line| line.trim() == format!("mode = \"{}\"", mode.name()));
        Self::with_overlay(Mode::ALL.into_iter().find(named).unwrap_or(Mode::Default), text, file)
    }

    /// The site alone of a configuration that a run or a recording holds: the other settings come and go with
    /// versions, and a recording is of use to all of them.
    ///
    /// ```
    /// use umbracast::Config;
    ///
    /// let written = Config::default().to_toml();
    /// assert_eq!(Config::site_of_run(&written, "config.toml")?, Config::default().site);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Config::with_overlay`], of the site.
    pub fn site_of_run(text: &str, file: &str) -> Result<Site, Error> {
        let mut recorded: toml::Table =
            toml::from_str(text).map_err(|e| Error::new(e.to_string()).within(file))?;
        recorded.retain(|key, _| key == "site");
        Ok(Self::with_overlay(Mode::Default, &recorded.to_string(), file)?.site)
    }

    /// The same without a mechanism: by a plainer method where there is one, else with the mechanism named in the
    /// stages' `without`.
    ///
    /// ```
    /// use umbracast::{Config, config::{ForecastMethod, Mechanism}};
    ///
    /// let plain = Config::default().without(Mechanism::Residual);
    /// assert_eq!(plain.forecast.method, ForecastMethod::ConstantVelocity);
    /// ```
    #[must_use]
    pub fn without(&self, mechanism: Mechanism) -> Self {
        let mut config = self.clone();
        let Self { detect, track, forecast, blockage, .. } = &mut config;
        match mechanism {
            Mechanism::RangeModel => detect.background = BackgroundMethod::Voxels,
            Mechanism::CountTest => detect.clusters = ClusterMethod::Haselich,
            Mechanism::Pose => {
                detect.position = PositionMethod::ShiftedMean;
                track.without.push(mechanism);
            }
            Mechanism::Residual => forecast.method = ForecastMethod::ConstantVelocity,
            _ => {
                for stage in mechanism.stages() {
                    match *stage {
                        "detect" => detect.without.push(mechanism),
                        "track" => track.without.push(mechanism),
                        "forecast" => forecast.without.push(mechanism),
                        _ => blockage.without.push(mechanism),
                    }
                }
            }
        }
        config
    }

    /// The same as TOML text, as every run writes it beside its output.
    ///
    /// ```
    /// use umbracast::Config;
    ///
    /// let text = Config::default().to_toml();
    /// assert_eq!(Config::of_run(&text, "config.toml")?, Config::default());
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a configuration is plain data")
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::for_mode(Mode::Default)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_parses_and_survives_a_round_trip() {
        for mode in Mode::ALL {
            let config = Config::for_mode(mode);
            assert_eq!(config.mode, mode);
            assert_eq!(Config::of_run(&config.to_toml(), "config.toml").unwrap(), config);
        }
    }

    #[test]
    fn the_site_of_a_recording_outlives_settings_of_its_version() {
        let mut config = Config::default();
        config.site.name = "lab".to_owned();
        let text = config.to_toml().replace("[track]", "[track]\nforgotten_setting = 1.0");
        assert!(Config::of_run(&text, "config.toml").is_err());
        assert_eq!(Config::site_of_run(&text, "config.toml").unwrap(), config.site);
        let wrong = text.replace("height_m = 10.0", "height_m = \"high\"");
        let message = Config::site_of_run(&wrong, "config.toml").unwrap_err().to_string();
        assert!(message.contains("expected a number, found a string"), "{message}");
    }

    #[test]
    fn a_wrong_key_names_file_line_and_what_was_expected() {
        let text = "[site]\nname = \"lab\"\n[[site.sensors]]\nnome = \"x\"\n";
        let message = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap_err().to_string();
        assert!(message.starts_with("lab.toml:4:"), "{message}");
        assert!(message.contains("nome") && message.contains("position_m"), "{message}");
    }

    #[test]
    fn what_nodes_read_of_a_site_file_is_left_to_them_and_written_nowhere() {
        let file = "[network]\nuser = \"edge\"\n[site]\nname = \"lab\"\n";
        let config = Config::with_overlay(Mode::Default, file, "lab.toml").unwrap();
        assert!(config.site.name == "lab" && !config.to_toml().contains("network"));
    }

    #[test]
    fn a_file_of_another_mode_is_refused() {
        let text = Config::for_mode(Mode::Default).to_toml();
        let message = Config::with_overlay(Mode::Paper, &text, "config.toml").unwrap_err().to_string();
        assert!(message.contains("expected paper, found a file of mode default"), "{message}");
    }

    #[test]
    fn a_wrong_kind_names_file_line_expected_and_found() {
        let text = "[site.hall]\nlength_m = \"long\"\n";
        let message = Config::with_overlay(Mode::Default, text, "lab.toml").unwrap_err().to_string();
        assert!(message.starts_with("lab.toml:2:"), "{message}");
        assert!(message.contains("expected a number") && message.contains("found a string"), "{message}");
    }

    #[test]
    fn every_mechanism_leaves_something_out_and_is_named_in_files_as_in_tables() {
        let whole = Config::default();
        for mechanism in Mechanism::ALL {
            let without = whole.without(mechanism);
            assert_ne!(without, whole, "{mechanism:?}");
            assert_eq!(Config::of_run(&without.to_toml(), "config.toml").unwrap(), without);
            let named = toml::Value::try_from(mechanism).unwrap();
            assert_eq!(named.as_str(), Some(mechanism.name()));
        }
    }

    #[test]
    fn what_cannot_work_is_refused_with_its_key() {
        for (text, key) in [
            ("[detect]\nhighest_m = 0.0", "detect.highest_m"),
            ("[detect]\nthin_m = -1.0", "detect.thin_m"),
            ("[track]\ncoast_max_s = nan", "track.coast_max_s"),
            ("[track]\nwithout = [\"arms\"]", "track.without"),
            ("[blockage]\nsamples = 0", "blockage.samples"),
            ("[blockage]\nsamples_min = 0", "blockage.samples_min"),
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
        let message = config.check().unwrap_err().to_string();
        assert!(message.contains("site.sensors") && message.contains("twice"), "{message}");
        let mut config = Config::default();
        config.site.access_points[1].name = config.site.access_points[0].name.clone();
        assert!(config.check().unwrap_err().to_string().contains("site.access_points"));
    }
}
