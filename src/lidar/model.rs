//! Sensor models: the beams of a column and how they fire. Elevations and firing times are the manuals'. The z
//! offsets, by which beams miss the sensor's origin, are those of the manufacturer's calibration files: the VLP-16
//! manual rounds them to 0.1 mm, in an HDL-32E and a VLP-16 they come to 28.97 and 41.91 mm x tan(-elevation).

use std::sync::Arc;

use crate::Error;
use crate::geometry::DVec3;
use crate::site::sensor_model;

/// One laser.
///
/// ```
/// let lowest = umbracast::lidar::Model::hdl_32e().beams[0];
/// assert_eq!((lowest.ring, lowest.elevation_rad.to_degrees().round()), (0, -31.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Above the horizon of the sensor, radians.
    pub elevation_rad: f64,
    /// Sine and cosine of the elevation: clouds have 100,000 points a frame.
    pub elevation_sin_cos: (f64, f64),
    /// Its origin above the sensor's origin, metres.
    pub z_offset_m: f64,
    /// When it fires after the column's first beam.
    pub fire_offset_ns: u32,
    /// Its place from the lowest beam, 0, to the highest.
    pub ring: u16,
}

impl Beam {
    /// A point at `range_m` in the sensor's frame: x ahead at azimuth 0, azimuth clockwise from above.
    ///
    /// ```
    /// let beam = umbracast::lidar::Model::hdl_32e().beams[15]; // level
    /// let ahead_m = beam.point_m(0_f64.sin_cos(), 8.0);
    /// assert_eq!(ahead_m.to_array(), [8.0, 0.0, 0.0]);
    /// ```
    pub fn point_m(&self, azimuth_sin_cos: (f64, f64), range_m: f64) -> DVec3 {
        let ((sin_el, cos_el), (sin_az, cos_az)) = (self.elevation_sin_cos, azimuth_sin_cos);
        DVec3::new(range_m * cos_el * cos_az, -range_m * cos_el * sin_az, range_m * sin_el + self.z_offset_m)
    }
}

/// A spinning sensor.
///
/// ```
/// let model = umbracast::lidar::Model::vlp_16();
/// assert_eq!((model.name, model.beams.len()), ("vlp-16", 16));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its name in a site file.
    pub name: &'static str,
    /// The beams of a column in firing order.
    pub beams: Arc<[Beam]>,
    /// From one column to the next.
    pub column_period_ns: f64,
    /// Factory byte of its packets.
    pub product_id: u8,
    /// Columns in one block of a packet.
    pub columns_per_block: usize,
}

impl Model {
    /// The model named in a site file.
    ///
    /// ```
    /// use umbracast::lidar::Model;
    ///
    /// assert_eq!(Model::by_name("HDL-32E")?, Model::hdl_32e());
    /// assert!(Model::by_name("camera").is_err());
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    ///
    /// # Errors
    /// A name that is not known, with those that are.
    pub fn by_name(name: &str) -> Result<Self, Error> {
        match sensor_model(name) {
            Some("hdl-32e") => Ok(Self::hdl_32e()),
            Some("vlp-16") => Ok(Self::vlp_16()),
            _ => Err(Error::new(format!("sensor model: expected hdl-32e or vlp-16, found {name:?}"))),
        }
    }

    /// Velodyne HDL-32E.
    ///
    /// ```
    /// assert_eq!(umbracast::lidar::Model::hdl_32e().beams.len(), 32);
    /// ```
    pub fn hdl_32e() -> Self {
        const ELEVATION_DEG: [f64; 32] = [
            -30.67, -9.33, -29.33, -8.00, -28.00, -6.67, -26.67, -5.33, -25.33, -4.00, -24.00, -2.67, -22.67,
            -1.33, -21.33, 0.00, -20.00, 1.33, -18.67, 2.67, -17.33, 4.00, -16.00, 5.33, -14.67, 6.67,
            -13.33, 8.00, -12.00, 9.33, -10.67, 10.67,
        ];
        const Z_OFFSET_MM: [f64; 32] = [
            17.17, 4.76, 16.27, 4.07, 15.40, 3.38, 14.54, 2.70, 13.71, 2.02, 12.89, 1.35, 12.09, 0.67, 11.31,
            0.00, 10.54, -0.67, 9.78, -1.35, 9.04, -2.02, 8.30, -2.70, 7.58, -3.38, 6.86, -4.07, 6.15, -4.76,
            5.45, -5.45,
        ];
        Self {
            name: "hdl-32e",
            beams: beams(&ELEVATION_DEG, &Z_OFFSET_MM, 1152),
            column_period_ns: 46_080.0,
            product_id: 0x21,
            columns_per_block: 1,
        }
    }

    /// Velodyne VLP-16.
    ///
    /// ```
    /// assert_eq!(umbracast::lidar::Model::vlp_16().columns_per_block, 2);
    /// ```
    pub fn vlp_16() -> Self {
        const ELEVATION_DEG: [f64; 16] =
            [-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0];
        const Z_OFFSET_MM: [f64; 16] = [
            11.23, -0.73, 9.68, -2.20, 8.15, -3.67, 6.64, -5.15, 5.15, -6.64, 3.67, -8.15, 2.20, -9.68, 0.73,
            -11.23,
        ];
        Self {
            name: "vlp-16",
            beams: beams(&ELEVATION_DEG, &Z_OFFSET_MM, 2304),
            column_period_ns: 55_296.0,
            product_id: 0x22,
            columns_per_block: 2,
        }
    }
}

fn beams(elevation_deg: &[f64], z_offset_mm: &[f64], fire_period_ns: u32) -> Arc<[Beam]> {
    let ring = |own: f64| elevation_deg.iter().filter(|&&other| other < own).count() as u16;
    elevation_deg
        .iter()
        .zip(z_offset_mm)
        .enumerate()
        .map(|(i, (&elevation, &z))| Beam {
            elevation_rad: elevation.to_radians(),
            elevation_sin_cos: elevation.to_radians().sin_cos(),
            z_offset_m: z * 1e-3,
            fire_offset_ns: i as u32 * fire_period_ns,
            ring: ring(elevation),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_follow_from_one_length_in_each_model() {
        for (model, arm_m) in [(Model::hdl_32e(), 0.028_97), (Model::vlp_16(), 0.041_91)] {
            for beam in model.beams.iter() {
                let expected_m = -arm_m * beam.elevation_rad.tan();
                assert!((beam.z_offset_m - expected_m).abs() < 2e-5, "{} {beam:?}", model.name);
            }
        }
    }

    #[test]
    fn a_model_is_known_with_or_without_capitals_and_dashes() {
        for (written, name) in [("VLP-16", "vlp-16"), ("vlp16", "vlp-16"), ("HDL-32E", "hdl-32e")] {
            assert_eq!(Model::by_name(written).unwrap().name, name);
        }
        let message = Model::by_name("hdl-64").unwrap_err().to_string();
        assert_eq!(message, "sensor model: expected hdl-32e or vlp-16, found \"hdl-64\"");
        assert!(Model::by_name("points").is_err(), "a sensor known only by its clouds sends no packets");
    }

    #[test]
    fn rings_count_from_the_lowest_beam() {
        let model = Model::hdl_32e();
        let mut beams = model.beams.to_vec();
        beams.sort_by_key(|beam| beam.ring);
        assert!(beams.iter().map(|beam| beam.ring).eq(0..32));
        assert!(beams.is_sorted_by(|a, b| a.elevation_rad < b.elevation_rad));
    }

    #[test]
    fn azimuth_turns_clockwise_from_ahead() {
        let beam = Model::vlp_16().beams[15];
        let right = beam.point_m(90_f64.to_radians().sin_cos(), 2.0);
        let elevation_rad = 15_f64.to_radians();
        let expected = DVec3::new(0.0, -2.0 * elevation_rad.cos(), 2.0 * elevation_rad.sin() - 0.011_23);
        assert!((right - expected).length() < 1e-12, "{right}");
    }
}
