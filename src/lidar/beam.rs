//! One laser of a sensor: its start and direction in the frame of the turning head.

use crate::geometry::DVec3;

/// One laser, in the frame of the head: x along the azimuth that the head has when the laser fires, y to the left, z
/// up. A sensor's frame is the head's at azimuth 0; azimuth counts clockwise from above.
///
/// ```
/// let lowest = umbracast::lidar::Model::hdl_32e().beams[0];
/// assert_eq!((lowest.ring, lowest.elevation_rad.to_degrees().round()), (0, -31.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Above the horizon of the sensor, radians.
    pub elevation_rad: f64,
    /// How far it looks to the right of the head's azimuth, hundredths of a degree.
    pub azimuth_offset_cdeg: f32,
    /// Where its range is counted from, metres.
    pub origin_m: DVec3,
    /// Where it looks, of length 1.
    pub direction: DVec3,
    /// When it fires after the column's first beam.
    pub fire_offset_ns: u32,
    /// How long the head has turned on since the column's azimuth: `fire_offset_ns`, or 0 where the manufacturer counts
    /// all beams of a column from one azimuth.
    pub turned_ns: u32,
    /// True where the manufacturer's decoder rounds the head's azimuth to whole hundredths of a degree.
    pub whole_cdeg: bool,
    /// Its place from the lowest beam, 0, to the highest.
    pub ring: u16,
}

impl Beam {
    /// A point at `range_m` in the sensor's frame, of a head at an azimuth with this sine and cosine.
    ///
    /// ```
    /// let beam = umbracast::lidar::Model::hdl_32e().beams[15]; // level
    /// let ahead_m = beam.point_m(0_f64.sin_cos(), 8.0);
    /// assert_eq!(ahead_m.to_array(), [8.0, 0.0, 0.0]);
    /// ```
    #[inline]
    pub fn point_m(&self, head_sin_cos: (f64, f64), range_m: f64) -> DVec3 {
        turned(head_sin_cos, self.origin_m + range_m * self.direction)
    }

    /// The same as a ray: where it starts and where it looks, in the sensor's frame.
    ///
    /// ```
    /// let beam = umbracast::lidar::Model::hdl_32e().beams[15]; // level
    /// let (origin_m, direction) = beam.ray(90_f64.to_radians().sin_cos());
    /// assert!(origin_m.length() < 1e-9 && (direction.y + 1.0).abs() < 1e-9);
    /// ```
    #[inline]
    pub fn ray(&self, head_sin_cos: (f64, f64)) -> (DVec3, DVec3) {
        (turned(head_sin_cos, self.origin_m), turned(head_sin_cos, self.direction))
    }
}

/// From the head's frame to the sensor's.
#[inline(always)]
pub(super) fn turned((sin, cos): (f64, f64), v: DVec3) -> DVec3 {
    DVec3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z)
}

/// What a laser is made of: `elevation_deg` up, `azimuth_offset_deg` to the right of the head's azimuth, from
/// `origin_m` in the head's frame. The rest is as a sensor has it that fires all at once; rings are for [`ranked`].
pub(super) fn beam(elevation_deg: f64, azimuth_offset_deg: f64, origin_m: DVec3) -> Beam {
    let (up, flat) = elevation_deg.to_radians().sin_cos();
    let (right, ahead) = azimuth_offset_deg.to_radians().sin_cos();
    Beam {
        elevation_rad: elevation_deg.to_radians(),
        azimuth_offset_cdeg: (azimuth_offset_deg * 100.0) as f32,
        origin_m,
        direction: DVec3::new(flat * ahead, -(flat * right), up),
        fire_offset_ns: 0,
        turned_ns: 0,
        whole_cdeg: false,
        ring: 0,
    }
}

/// The same beams with their places from the lowest to the highest; of two at one elevation the first is lower.
pub(super) fn ranked(mut beams: Vec<Beam>) -> std::sync::Arc<[Beam]> {
    let mut from_below: Vec<usize> = (0..beams.len()).collect();
    from_below.sort_by(|&a, &b| beams[a].elevation_rad.total_cmp(&beams[b].elevation_rad));
    for (ring, b) in from_below.into_iter().enumerate() {
        beams[b].ring = ring as u16;
    }
    beams.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_turns_clockwise_from_ahead() {
        let right = beam(15.0, 0.0, DVec3::Z * -0.011_23).point_m(90_f64.to_radians().sin_cos(), 2.0);
        let elevation_rad = 15_f64.to_radians();
        let expected = DVec3::new(0.0, -2.0 * elevation_rad.cos(), 2.0 * elevation_rad.sin() - 0.011_23);
        assert!((right - expected).length() < 1e-12, "{right}");
    }

    #[test]
    fn an_offset_is_a_head_that_has_turned_further_but_for_the_origin() {
        let arm_m = DVec3::new(0.027, 0.0, 0.036);
        let (aside, ahead) = (beam(10.0, 7.0, arm_m), beam(10.0, 0.0, DVec3::Z * 0.036));
        let seen = aside.point_m(30_f64.to_radians().sin_cos(), 5.0);
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let expected = ahead.point_m(37_f64.to_radians().sin_cos(), 5.0) + DVec3::new(cos, -sin, 0.0) * 0.027;
        assert!((seen - expected).length() < 1e-12, "{seen}");
    }

    #[test]
    fn rings_count_from_the_lowest_beam() {
        let beams = ranked([3.0, -1.0, 8.0, 0.5].map(|deg| beam(deg, 0.0, DVec3::ZERO)).to_vec());
        assert_eq!(beams.iter().map(|beam| beam.ring).collect::<Vec<_>>(), [2, 0, 3, 1]);
    }
}
