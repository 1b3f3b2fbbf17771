//! A rigid motion, named for what it maps: `site_from_sensor`.

use glam::{DMat3, DVec3};

/// A rotation and a translation. `site_from_sensor.point(p)` takes a point of the sensor's frame to the site's.
///
/// ```
/// use umbracast::geometry::{DVec3, Pose};
///
/// // A sensor 9 m high that looks 35 degrees down along x.
/// let site_from_sensor = Pose::from_yaw_pitch_roll_deg(DVec3::new(0.0, 0.0, 9.0), 0.0, 35.0, 0.0);
/// let hit_m = site_from_sensor.point(DVec3::new(10.0, 0.0, 0.0));
/// assert!((hit_m - DVec3::new(8.19, 0.0, 3.26)).length() < 0.01);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Columns are the source frame's axes, seen in the target frame.
    pub rotation: DMat3,
    /// The source frame's origin in the target frame, metres.
    pub translation_m: DVec3,
}

impl Pose {
    /// The motion that leaves every point where it is.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, translation_m: DVec3::ZERO };

    /// A pose from a file: yaw, pitch and roll in degrees, applied Z-Y'-X''. Positive pitch looks down (a
    /// positive turn about the y axis takes x towards -z).
    ///
    /// ```
    /// use umbracast::geometry::{DVec3, Pose};
    ///
    /// let facing_left = Pose::from_yaw_pitch_roll_deg(DVec3::ZERO, 90.0, 0.0, 0.0);
    /// assert!(facing_left.point(DVec3::X).abs_diff_eq(DVec3::Y, 1e-12));
    /// ```
    pub fn from_yaw_pitch_roll_deg(position_m: DVec3, yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> Self {
        let rotation = DMat3::from_rotation_z(yaw_deg.to_radians())
            * DMat3::from_rotation_y(pitch_deg.to_radians())
            * DMat3::from_rotation_x(roll_deg.to_radians());
        Self { rotation, translation_m: position_m }
    }

    /// A point taken from the source to the target frame.
    ///
    /// ```
    /// use umbracast::geometry::{DVec3, Pose};
    ///
    /// let raised = Pose { translation_m: DVec3::new(0.0, 0.0, 3.0), ..Pose::IDENTITY };
    /// assert_eq!(raised.point(DVec3::X), DVec3::new(1.0, 0.0, 3.0));
    /// ```
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation_m
    }

    /// A direction taken from the source to the target frame.
    ///
    /// ```
    /// use umbracast::geometry::{DVec3, Pose};
    ///
    /// let raised = Pose { translation_m: DVec3::new(0.0, 0.0, 3.0), ..Pose::IDENTITY };
    /// assert_eq!(raised.direction(DVec3::X), DVec3::X);
    /// ```
    #[inline]
    pub fn direction(&self, v: DVec3) -> DVec3 {
        self.rotation * v
    }

    /// This motion after another: `site_from_sensor.after(&sensor_from_body)` is `site_from_body`.
    ///
    /// ```
    /// use umbracast::geometry::{DVec3, Pose};
    ///
    /// let site_from_mast = Pose { translation_m: DVec3::new(5.0, 0.0, 0.0), ..Pose::IDENTITY };
    /// let mast_from_sensor = Pose { translation_m: DVec3::new(0.0, 0.0, 3.0), ..Pose::IDENTITY };
    /// let site_from_sensor = site_from_mast.after(&mast_from_sensor);
    /// assert_eq!(site_from_sensor.translation_m, DVec3::new(5.0, 0.0, 3.0));
    /// ```
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { rotation: self.rotation * first.rotation, translation_m: self.point(first.translation_m) }
    }

    /// The motion back. The rotation is orthogonal, so it is transposed, never inverted.
    ///
    /// ```
    /// use umbracast::geometry::{DVec3, Pose};
    ///
    /// let pose = Pose::from_yaw_pitch_roll_deg(DVec3::new(1.0, -2.0, 3.0), 170.0, 35.0, -5.0);
    /// let there_and_back = pose.inverse().point(pose.point(DVec3::X));
    /// assert!(there_and_back.abs_diff_eq(DVec3::X, 1e-12));
    /// ```
    #[must_use]
    #[inline]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation_m: -(rotation * self.translation_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positive_pitch_looks_down() {
        let pose = Pose::from_yaw_pitch_roll_deg(DVec3::new(0.0, 0.0, 9.0), 0.0, 35.0, 0.0);
        let ahead = pose.point(DVec3::X);
        assert!((ahead - DVec3::new(0.819_152, 0.0, 9.0 - 0.573_576)).length() < 1e-6, "{ahead}");
    }

    #[test]
    fn inverse_undoes() {
        let pose = Pose::from_yaw_pitch_roll_deg(DVec3::new(1.0, -2.0, 3.0), 170.0, 35.0, -5.0);
        let p = DVec3::new(0.3, 0.4, -0.5);
        assert!((pose.inverse().point(pose.point(p)) - p).length() < 1e-12);
        assert!((pose.inverse().after(&pose).point(p) - p).length() < 1e-12);
    }
}
