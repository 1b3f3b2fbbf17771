//! A rigid motion in plan view, named for what it maps: `site_from_level`.

use umbracast::geometry::DVec2;

/// A turn about the vertical and a shift.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Plan {
    /// Counter-clockwise from above.
    pub yaw_rad: f64,
    /// Of the source frame's origin in the target frame, metres.
    pub at_m: DVec2,
}

impl Plan {
    /// A point taken from the source to the target frame.
    pub fn point(&self, p: DVec2) -> DVec2 {
        self.direction(p) + self.at_m
    }

    /// A direction taken from the source to the target frame.
    pub fn direction(&self, v: DVec2) -> DVec2 {
        DVec2::from_angle(self.yaw_rad).rotate(v)
    }

    /// This motion after another.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { yaw_rad: wrapped(self.yaw_rad + first.yaw_rad), at_m: self.point(first.at_m) }
    }

    /// The motion back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let back = Self { yaw_rad: -self.yaw_rad, at_m: DVec2::ZERO };
        Self { at_m: -back.direction(self.at_m), ..back }
    }

    /// The motion that takes each second point nearest to its first one, by least squares over weights; `None` for
    /// points without extent.
    pub fn aligning(pairs_m: &[(DVec2, DVec2, f64)]) -> Option<Self> {
        let total: f64 = pairs_m.iter().map(|(.., weight)| weight).sum();
        let middle = |of: fn(&(DVec2, DVec2, f64)) -> DVec2| {
            pairs_m.iter().map(|pair| of(pair) * pair.2).sum::<DVec2>() / total
        };
        let (to_m, from_m) = (middle(|pair| pair.0), middle(|pair| pair.1));
        let (mut cos, mut sin) = (0.0, 0.0);
        for (to, from, weight) in pairs_m {
            let (to, from) = (*to - to_m, *from - from_m);
            cos += weight * to.dot(from);
            sin += weight * from.perp_dot(to);
        }
        if pairs_m.len() < 2 || cos.hypot(sin) <= 1e-9 {
            return None;
        }
        let turn = Self { yaw_rad: sin.atan2(cos), at_m: DVec2::ZERO };
        Some(Self { at_m: to_m - turn.direction(from_m), ..turn })
    }
}

/// An angle between -pi and pi.
pub fn wrapped(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle_rad - turn * (angle_rad / turn).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moved_points_tell_how_they_were_moved() {
        let plan = Plan { yaw_rad: 2.8, at_m: DVec2::new(3.0, -7.0) };
        let points = [DVec2::new(1.0, 0.0), DVec2::new(-4.0, 2.0), DVec2::new(0.5, 6.0)];
        let pairs: Vec<_> = points.iter().map(|&p| (plan.point(p), p, 1.0)).collect();
        let found = Plan::aligning(&pairs).unwrap();
        assert!(
            wrapped(found.yaw_rad - 2.8).abs() < 1e-12 && found.at_m.distance(plan.at_m) < 1e-12,
            "{found:?}"
        );
        let back = plan.inverse().after(&plan);
        assert!(back.yaw_rad.abs() < 1e-12 && back.at_m.length() < 1e-12);
        assert_eq!(Plan::aligning(&[(DVec2::X, DVec2::Y, 1.0)]), None);
    }
}
