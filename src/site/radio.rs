//! The radio of an access point.

use serde::{Deserialize, Serialize};

/// What an access point sends, and when its link is out. Every key has a default; an access point without a section has no dB.
///
/// ```
/// use umbracast::{Config, Mode, site::LossModel};
///
/// let file = "[[site.access_points]]\nname = \"post\"\nposition_m = [14.0, 0.0, 2.0]\nradio = { carrier_ghz = 60.0 }";
/// let radio = Config::with_overlay(Mode::Default, file, "hall.toml")?.site.access_points[0].radio.unwrap();
/// assert_eq!((radio.carrier_ghz, radio.margin_db, radio.loss_model), (60.0, 10.0, LossModel::Kirchhoff));
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Radio {
    /// Carrier frequency.
    pub carrier_ghz: f64,
    /// How many dB more than in sight a link can lose before it is out.
    pub margin_db: f64,
    /// What a body costs.
    pub loss_model: LossModel,
    /// Whether the spread of real fades about a model belongs to the answer: bodies differ, and no geometry foresees by how
    /// much.
    pub fade_spread: bool,
    /// Bandwidth.
    pub bandwidth_mhz: f64,
    /// Radiated power with the gain of the beam (EIRP).
    pub transmit_dbm: f64,
    /// Noise figure of the device.
    pub noise_figure_db: f64,
}

impl Default for Radio {
    fn default() -> Self {
        Self {
            carrier_ghz: 28.0,
            margin_db: 10.0,
            loss_model: LossModel::Kirchhoff,
            fade_spread: true,
            bandwidth_mhz: 100.0,
            transmit_dbm: 40.0,
            noise_figure_db: 9.0,
        }
    }
}

/// Speed of light, metres a second.
const LIGHT_MPS: f64 = 299_792_458.0;

impl Radio {
    /// The carrier's wavelength.
    ///
    /// ```
    /// let wavelength_m = umbracast::site::Radio::default().wavelength_m();
    /// assert!((wavelength_m - 0.010_707).abs() < 1e-6);
    /// ```
    pub fn wavelength_m(&self) -> f64 {
        LIGHT_MPS / (self.carrier_ghz * 1e9)
    }

    /// Power that an isotropic antenna receives at the end of a free link so long: Friis' equation.
    ///
    /// ```
    /// let received_dbm = umbracast::site::Radio::default().received_dbm(10.0);
    /// assert!((received_dbm + 41.4).abs() < 0.1, "{received_dbm}");
    /// ```
    pub fn received_dbm(&self, distance_m: f64) -> f64 {
        let free_space_db = 20.0 * (4.0 * std::f64::consts::PI * distance_m / self.wavelength_m()).log10();
        self.transmit_dbm - free_space_db
    }

    /// Signal to noise of a free link so long: noise of -174 dBm in each hertz.
    ///
    /// ```
    /// let snr_db = umbracast::site::Radio::default().snr_db(10.0);
    /// assert!((snr_db - 43.6).abs() < 0.1, "{snr_db}");
    /// ```
    pub fn snr_db(&self, distance_m: f64) -> f64 {
        let noise_dbm = -174.0 + 10.0 * (self.bandwidth_mhz * 1e6).log10() + self.noise_figure_db;
        self.received_dbm(distance_m) - noise_dbm
    }
}

/// What a body costs a path.
///
/// ```
/// use umbracast::site::LossModel;
///
/// assert_eq!(umbracast::site::Radio::default().loss_model, LossModel::Kirchhoff);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossModel {
    /// Kirchhoff's integral over trunk and head, as wide as they show from the access point.
    Kirchhoff,
    /// 3GPP TR 38.901, model B: a human, 0.3 m wide and 1.7 m high.
    ModelB,
    /// The same with the adult of its sensing channel (7.9): 0.5 m and 1.75 m.
    ModelBAdult,
    /// The same formula for trunk and head, as wide as they show.
    ModelBBody,
    /// Two knife edges as wide as the trunk shows, as powers.
    KnifeEdges,
    /// ITU-R P.526-16, 5.1: both sides and the top of a screen as wide as the trunk shows, as powers.
    ThreeEdges,
}
