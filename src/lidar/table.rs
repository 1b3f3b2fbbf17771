//! The table of sensor models: their names, and the function that builds each from a site file. Angles and firing
//! times are in the family's file or in the sensor's own.

use super::model::{Setting, letters};
use super::{Model, hesai, ouster, velodyne};
use crate::Error;
use crate::site::Sensor;

/// A model's name in a site file, the UDP port its packets go to unless told otherwise, and what makes it.
type Row = (&'static str, u16, fn(&Setting) -> Result<Model, Error>);

/// Every model that sends packets.
const MODELS: [Row; 12] = [
    ("hdl-32e", velodyne::UDP_PORT, velodyne::hdl_32e),
    ("vlp-16", velodyne::UDP_PORT, velodyne::vlp_16),
    ("os0-128", ouster::UDP_PORT, ouster::model),
    ("os0-64", ouster::UDP_PORT, ouster::model),
    ("os0-32", ouster::UDP_PORT, ouster::model),
    ("os1-128", ouster::UDP_PORT, ouster::model),
    ("os1-64", ouster::UDP_PORT, ouster::model),
    ("os1-32", ouster::UDP_PORT, ouster::model),
    ("os2-128", ouster::UDP_PORT, ouster::model),
    ("os2-64", ouster::UDP_PORT, ouster::model),
    ("os2-32", ouster::UDP_PORT, ouster::model),
    ("xt32", hesai::UDP_PORT, hesai::xt32),
];

/// The model of a sensor that is known only by its clouds.
const POINTS: &str = "points";

impl Model {
    /// The model of a name, as it is delivered and at ten revolutions a second.
    ///
    /// ```
    /// use umbracast::lidar::Model;
    ///
    /// assert_eq!(Model::by_name("HDL-32E")?.beams, Model::hdl_32e().beams);
    /// assert!(Model::by_name("camera").is_err());
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// A name that is not known, with those that are.
    pub fn by_name(name: &str) -> Result<Self, Error> {
        Self::make(name, 10.0, None)
    }

    /// The model of a sensor of a site, with the angles of its own file where there is one.
    ///
    /// ```
    /// use umbracast::{Config, lidar::Model};
    ///
    /// let mut sensor = Config::default().site.sensors[0].clone();
    /// sensor.model = "xt32".to_owned();
    /// let text: String = (1..=32).map(|c| format!("{c},{},0.05\n", 16 - c)).collect();
    /// sensor.calibration = Some(format!("Channel,Elevation,Azimuth\n{text}"));
    /// assert_eq!(Model::of_sensor(&sensor)?.beams[0].azimuth_offset_cdeg, 5.0);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// A name that is not known; a file of the sensor that is not understood, or is another sensor's.
    pub fn of_sensor(sensor: &Sensor) -> Result<Self, Error> {
        Self::make(&sensor.model, sensor.rate_hz, sensor.calibration.as_deref())
    }

    fn make(name: &str, rate_hz: f64, calibration: Option<&str>) -> Result<Self, Error> {
        let (name, _, make) = row(name).ok_or_else(|| {
            let known = MODELS.map(|(name, ..)| name).join(", ");
            Error::new(format!("sensor model: expected one of {known}, found {name:?}"))
        })?;
        make(&Setting { name, rate_hz, calibration })
    }

    /// Velodyne HDL-32E.
    ///
    /// ```
    /// assert_eq!(umbracast::lidar::Model::hdl_32e().beams.len(), 32);
    /// ```
    pub fn hdl_32e() -> Self {
        Self::by_name("hdl-32e").expect("it needs no file")
    }

    /// Velodyne VLP-16.
    ///
    /// ```
    /// assert_eq!(umbracast::lidar::Model::vlp_16().column_period_ns, 55_296.0);
    /// ```
    pub fn vlp_16() -> Self {
        Self::by_name("vlp-16").expect("it needs no file")
    }
}

/// The models that a site file may name; of `points` only clouds are known.
///
/// ```
/// assert!(umbracast::lidar::sensor_models().any(|name| name == "points"));
/// ```
pub fn sensor_models() -> impl Iterator<Item = &'static str> {
    MODELS.into_iter().map(|(name, ..)| name).chain([POINTS])
}

/// The model of that name, with or without capitals and dashes: `vlp-16` of `VLP-16` and `vlp16`.
///
/// ```
/// use umbracast::lidar::sensor_model;
///
/// assert_eq!(sensor_model("VLP16"), Some("vlp-16"));
/// assert_eq!(sensor_model("OS-0-128"), Some("os0-128"));
/// assert_eq!(sensor_model("camera"), None);
/// ```
pub fn sensor_model(name: &str) -> Option<&'static str> {
    sensor_models().find(|model| letters(model) == letters(name))
}

/// The UDP port that a sensor's packets go to: the one its site file names, or its model's; none for a sensor that is
/// known by its clouds.
///
/// ```
/// use umbracast::{Config, lidar::udp_port};
///
/// let mut sensor = Config::default().site.sensors[0].clone();
/// assert_eq!(udp_port(&sensor), Some(2368));
/// sensor.model = "os1-64".to_owned();
/// assert_eq!(udp_port(&sensor), Some(7502));
/// sensor.udp_port = Some(7000);
/// assert_eq!(udp_port(&sensor), Some(7000));
/// ```
pub fn udp_port(sensor: &Sensor) -> Option<u16> {
    let (_, port, _) = row(&sensor.model)?;
    Some(sensor.udp_port.unwrap_or(port))
}

fn row(name: &str) -> Option<Row> {
    MODELS.into_iter().find(|(known, ..)| letters(known) == letters(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_is_known_with_or_without_capitals_and_dashes() {
        let written =
            [("VLP-16", "vlp-16"), ("vlp16", "vlp-16"), ("HDL-32E", "hdl-32e"), ("OS-1-64", "os1-64")];
        for (written, name) in written {
            assert_eq!(Model::by_name(written).unwrap().name, name);
        }
        let message = Model::by_name("hdl-64").unwrap_err().to_string();
        assert!(message.starts_with("sensor model: expected one of hdl-32e, vlp-16, os0-128,"), "{message}");
        assert!(message.ends_with("found \"hdl-64\""), "{message}");
        assert!(Model::by_name("points").is_err(), "a sensor known only by its clouds sends no packets");
    }

    #[test]
    fn every_model_is_made_as_it_is_delivered() {
        for (name, ..) in MODELS {
            let model = Model::by_name(name).unwrap();
            let mut rings: Vec<u16> = model.beams.iter().map(|beam| beam.ring).collect();
            rings.sort_unstable();
            assert!(rings.iter().copied().eq(0..model.beams.len() as u16), "{name}");
            assert!(model.beams.iter().all(|b| (b.direction.length() - 1.0).abs() < 1e-12), "{name}");
            assert!(name.ends_with(&model.beams.len().to_string()) || name == "hdl-32e", "{name}");
        }
    }
}
