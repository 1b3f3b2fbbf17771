//! What a ray meets: an upright body made of two elliptic cylinders, a trunk up to the shoulders and a head.
//! One box to the top of the head does far worse (the report's ladder): above the shoulders there is only a head.

use crate::geometry::{DVec2, DVec3};

/// The sizes of a body, shares of its height where they scale with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySize {
    /// Trunk front to back, metres.
    pub trunk_depth_m: f64,
    /// Trunk with hanging arms side to side, metres.
    pub trunk_width_m: f64,
    /// Top of the shoulders, share of the standing height. The trunk's cylinder reaches down to the floor.
    pub shoulder_share: f64,
    /// Head, metres.
    pub head_diameter_m: f64,
}

/// An upright cylinder with an elliptic base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticCylinder {
    /// Its axis on the floor.
    pub center_m: DVec2,
    /// Unit vector along the half depth.
    pub ahead: DVec2,
    /// Half axis along `ahead`, metres.
    pub half_depth_m: f64,
    /// Half axis across, metres.
    pub half_width_m: f64,
    /// Lower end above the floor.
    pub bottom_m: f64,
    /// Upper end above the floor.
    pub top_m: f64,
}

impl EllipticCylinder {
    /// Where along the segment the cylinder is first met, a fraction from 0 to 1; touching counts.
    pub fn hit(&self, start_m: DVec3, end_m: DVec3) -> Option<f64> {
        // In the space where the base is the unit circle: |s + t d|^2 = 1.
        let scaled = |v: DVec2| {
            DVec2::new(self.ahead.dot(v) / self.half_depth_m, self.ahead.perp_dot(v) / self.half_width_m)
        };
        let s = scaled(start_m.truncate() - self.center_m);
        let d = scaled((end_m - start_m).truncate());
        let (a, b, c) = (d.length_squared(), s.dot(d), s.length_squared() - 1.0);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        if a == 0.0 {
            if c > 0.0 {
                return None;
            }
        } else {
            let discriminant = b * b - a * c;
            if discriminant < 0.0 {
                return None;
            }
            let root = discriminant.sqrt();
            enter = enter.max((-b - root) / a);
            leave = leave.min((-b + root) / a);
        }
        let dz = end_m.z - start_m.z;
        if dz == 0.0 {
            if start_m.z < self.bottom_m || start_m.z > self.top_m {
                return None;
            }
        } else {
            let (t0, t1) = ((self.bottom_m - start_m.z) / dz, (self.top_m - start_m.z) / dz);
            enter = enter.max(t0.min(t1));
            leave = leave.min(t0.max(t1));
        }
        (enter <= leave).then_some(enter)
    }
}

/// Trunk and head of one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UprightBody {
    /// From the floor to the shoulders, arms included.
    pub trunk: EllipticCylinder,
    /// From the shoulders to the vertex.
    pub head: EllipticCylinder,
}

impl UprightBody {
    /// A body that stands at `position_m`, looks along `ahead` (unit) and is `height_m` tall.
    pub fn new(size: &BodySize, position_m: DVec2, ahead: DVec2, height_m: f64) -> Self {
        let shoulder_m = size.shoulder_share * height_m;
        let part = |depth_m: f64, width_m: f64, bottom_m: f64, top_m: f64| EllipticCylinder {
            center_m: position_m,
            ahead,
            half_depth_m: 0.5 * depth_m,
            half_width_m: 0.5 * width_m,
            bottom_m,
            top_m,
        };
        Self {
            trunk: part(size.trunk_depth_m, size.trunk_width_m, 0.0, shoulder_m),
            head: part(size.head_diameter_m, size.head_diameter_m, shoulder_m, height_m),
        }
    }

    /// Where along the segment the body is first met, a fraction from 0 to 1.
    pub fn hit(&self, start_m: DVec3, end_m: DVec3) -> Option<f64> {
        match (self.trunk.hit(start_m, end_m), self.head.hit(start_m, end_m)) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: BodySize =
        BodySize { trunk_depth_m: 0.26, trunk_width_m: 0.56, shoulder_share: 0.82, head_diameter_m: 0.2 };

    fn blocked(offset_y_m: f64, height_m: f64) -> bool {
        let body = UprightBody::new(&SIZE, DVec2::new(5.0, 0.0), DVec2::X, 1.75);
        let start = DVec3::new(0.0, offset_y_m, height_m);
        body.hit(start, start + DVec3::new(10.0, 0.0, 0.0)).is_some()
    }

    #[test]
    fn trunk_is_as_wide_as_it_says_and_ends_at_the_shoulders() {
        assert!(blocked(0.279, 1.0) && !blocked(0.281, 1.0));
        assert!(blocked(0.279, 1.434) && !blocked(0.279, 1.436));
    }

    #[test]
    fn above_the_shoulders_there_is_only_a_head() {
        assert!(blocked(0.099, 1.6) && !blocked(0.101, 1.6));
        assert!(!blocked(0.0, 1.751));
    }

    #[test]
    fn a_turned_body_shows_its_depth() {
        let body = UprightBody::new(&SIZE, DVec2::new(5.0, 0.0), DVec2::Y, 1.75);
        let ray = |y: f64| (DVec3::new(0.0, y, 1.0), DVec3::new(10.0, y, 1.0));
        let (start, end) = ray(0.129);
        assert!(body.hit(start, end).is_some());
        let (start, end) = ray(0.131);
        assert!(body.hit(start, end).is_none());
    }

    #[test]
    fn a_vertical_ray_and_one_that_ends_before_the_body() {
        let body = UprightBody::new(&SIZE, DVec2::new(5.0, 0.0), DVec2::X, 1.75);
        assert_eq!(body.hit(DVec3::new(5.0, 0.05, 3.0), DVec3::new(5.0, 0.05, 0.0)), Some(1.25 / 3.0));
        assert_eq!(body.hit(DVec3::new(0.0, 0.0, 1.0), DVec3::new(4.8, 0.0, 1.0)), None);
    }
}
