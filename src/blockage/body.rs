//! The model of a body that a ray meets: a stack of elliptic slices with two arms that swing, in a few numbers. A box
//! to the top of the head scores far lower (the report's ladder), because above the shoulders there is only a head.
//!
//! All sizes are shares of the standing height ([`BodyModel`]); nothing here knows the simulator's meshes.

use super::body_model::{Arms, BodyModel, Slice};
use crate::gait::{self, FOREMOST_RAD, LEFTMOST_RAD, sway_share};
use crate::geometry::{DVec2, DVec3};

/// Gaits are known up to here: 2 m/s.
const FASTEST_HZ: f64 = 2.0;

/// How one body stands or walks at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// Ground point of the axis.
    pub position_m: DVec2,
    /// Unit vector of the heading.
    pub ahead: DVec2,
    /// Standing height.
    pub height_m: f64,
    /// Factor on every half axis and radius: 1 for a usual body.
    pub width_scale: f64,
    /// 0 standing.
    pub speed_mps: f64,
    /// Since the right heel touched the floor; a stride is a full turn.
    pub phase_rad: f64,
    /// Factors on the swing of the arms, right and left: 0 for arms that hang still.
    pub arm_swing: [f64; 2],
}

impl Posture {
    /// Of a usual body that stands still.
    pub fn standing(position_m: DVec2, ahead: DVec2, height_m: f64) -> Self {
        Self {
            position_m,
            ahead,
            height_m,
            width_scale: 1.0,
            speed_mps: 0.0,
            phase_rad: 0.0,
            arm_swing: [0.0; 2],
        }
    }

    fn relative_speed_hz(&self) -> f64 {
        relative_speed_hz(self.speed_mps, self.height_m)
    }
}

/// Speed over the height of the hips.
pub(super) fn relative_speed_hz(speed_mps: f64, height_m: f64) -> f64 {
    gait::relative_speed_hz(speed_mps, height_m).min(FASTEST_HZ)
}

/// True when the segment meets the body, which stands at z = 0; touching counts. Tests hold stage 3, which asks many samples at a time,
/// to this.
pub fn blocks(body: &BodyModel, posture: &Posture, start_m: DVec3, end_m: DVec3) -> bool {
    let local = |v: DVec3| {
        let from_axis = v.truncate() - posture.position_m;
        DVec3::new(posture.ahead.dot(from_axis), posture.ahead.perp_dot(from_axis), v.z)
    };
    let (start, end) = (local(start_m), local(end_m));
    let (h, speed_hz) = (posture.height_m, posture.relative_speed_hz());
    let along_m = end.truncate() - start.truncate();
    let along_m2 = along_m.length_squared().max(f64::MIN_POSITIVE);
    let nearest = (-start.truncate().dot(along_m) / along_m2).clamp(0.0, 1.0);
    let nearest_m = (start.truncate() + along_m * nearest).length();
    let reach_m = reach_m(body, posture);
    if nearest_m > reach_m {
        return false;
    }
    // The lowest point of the ray where it is over the body.
    let within = reach_m / along_m2.sqrt();
    let z_at = |share: f64| start.z + share.clamp(0.0, 1.0) * (end.z - start.z);
    let lowest_m = z_at(nearest - within).min(z_at(nearest + within));
    if lowest_m > h {
        return false;
    }
    // The trunk rides over the foot that stands, once a stride, and goes ahead and back with every step.
    let share = sway_share(speed_hz) * h;
    let left_m = body.sway_left * share * (posture.phase_rad - LEFTMOST_RAD).cos();
    let ahead_m = body.sway_ahead * share * (2.0 * (posture.phase_rad - FOREMOST_RAD)).cos();
    let mut bottom_m = 0.0;
    for slice in &body.slices {
        let top_m = slice.top * h;
        let cylinder = EllipticCylinder {
            center_m: DVec2::new(slice.ahead * h + ahead_m, slice.left * h + left_m),
            ahead: DVec2::X,
            half_depth_m: slice.half_depth * h * posture.width_scale,
            half_width_m: slice.half_width * h * posture.width_scale,
            bottom_m,
            top_m,
        };
        bottom_m = top_m;
        let far = nearest_m > slice_reach(body, slice, posture.width_scale) * h;
        if !far && top_m >= lowest_m && cylinder.hit(start, end).is_some() {
            return true;
        }
    }
    let arms = &body.arms;
    if lowest_m > (arms.shoulder_up + arms.upper_radius * posture.width_scale) * h {
        return false;
    }
    let sway = DVec3::new(ahead_m, left_m, 0.0);
    arm_blocks(arms, posture, speed_hz, -1.0, start - sway, end - sway)
        || arm_blocks(arms, posture, speed_hz, 1.0, start - sway, end - sway)
}

/// No part of such a body is farther from its axis.
fn reach_m(body: &BodyModel, posture: &Posture) -> f64 {
    let (arms, width_scale, [right, left]) = (&body.arms, posture.width_scale, posture.arm_swing);
    let swing = right.abs().max(left.abs()) * posture.relative_speed_hz();
    let hand_ahead = swing * (arms.hand_ahead + arms.hand_swing).abs();
    let out = arms.hand_out.max(arms.elbow_out).max(arms.shoulder_out);
    let radius = arms.upper_radius.max(arms.fore_radius) * width_scale;
    let arms_reach = (hand_ahead * hand_ahead + out * out).sqrt() + radius + body.sway_left + body.sway_ahead;
    posture.height_m
        * body.slices.iter().fold(arms_reach, |far, slice| far.max(slice_reach(body, slice, width_scale)))
}

/// The same of a slice, as a share of the height.
fn slice_reach(body: &BodyModel, slice: &Slice, width_scale: f64) -> f64 {
    slice.half_depth.max(slice.half_width) * width_scale
        + slice.ahead.abs()
        + slice.left.abs()
        + body.sway_left
        + body.sway_ahead
}

/// An arm of two rods; `side` is 1 on the left. It swings against the leg of its side, and farther ahead than back
/// because the elbow bends.
fn arm_blocks(arms: &Arms, posture: &Posture, speed_hz: f64, side: f64, start: DVec3, end: DVec3) -> bool {
    let h = posture.height_m;
    let wave = side * posture.phase_rad.cos();
    let swing = posture.arm_swing[usize::from(side > 0.0)] * speed_hz;
    let elbow_ahead = swing * arms.elbow_swing * wave;
    let hand_ahead = swing * (arms.hand_ahead + arms.hand_swing * wave);
    let at = |ahead: f64, out: f64, up: f64| DVec3::new(ahead, side * out, up) * h;
    let shoulder = at(0.0, arms.shoulder_out, arms.shoulder_up);
    let elbow = at(elbow_ahead, arms.elbow_out, arms.elbow_up);
    let hand = at(hand_ahead, arms.hand_out, arms.hand_up);
    let touches = |a: DVec3, b: DVec3, radius: f64| {
        distance2_of_segments(start, end, a, b) <= (radius * h * posture.width_scale).powi(2)
    };
    touches(shoulder, elbow, arms.upper_radius) || touches(elbow, hand, arms.fore_radius)
}

/// Square of the smallest distance between the segments p and q.
fn distance2_of_segments(p_start: DVec3, p_end: DVec3, q_start: DVec3, q_end: DVec3) -> f64 {
    let (d, e, r) = (p_end - p_start, q_end - q_start, p_start - q_start);
    let (a, b, c) = (d.dot(d).max(f64::MIN_POSITIVE), d.dot(e), e.dot(e).max(f64::MIN_POSITIVE));
    let (f, g) = (d.dot(r), e.dot(r));
    let parallel = a * c - b * b;
    let on_p = if parallel > 0.0 { ((b * g - c * f) / parallel).clamp(0.0, 1.0) } else { 0.0 };
    let on_q = ((b * on_p + g) / c).clamp(0.0, 1.0);
    let on_p = ((b * on_q - f) / a).clamp(0.0, 1.0);
    (r + d * on_p - e * on_q).length_squared()
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn body() -> BodyModel {
        BodyModel::shipped()
    }

    fn posture(phase_rad: f64) -> Posture {
        let standing = Posture::standing(DVec2::new(5.0, 0.0), DVec2::X, 1.75);
        // His hands swing freely: the usual swing is of everybody, hands in pockets among them.
        Posture { speed_mps: 1.0, arm_swing: [1.5; 2], phase_rad, ..standing }
    }

    /// A level ray across the body, `ahead_m` before its axis.
    fn blocked_across(posture: &Posture, ahead_m: f64, height_m: f64) -> bool {
        let x_m = posture.position_m.x + ahead_m;
        blocks(&body(), posture, DVec3::new(x_m, -3.0, height_m), DVec3::new(x_m, 3.0, height_m))
    }

    /// A level ray along the way, `left_m` beside the axis.
    fn blocked_along(posture: &Posture, left_m: f64, height_m: f64) -> bool {
        blocks(&body(), posture, DVec3::new(0.0, left_m, height_m), DVec3::new(10.0, left_m, height_m))
    }

    #[test]
    fn above_the_shoulders_there_is_only_a_head() {
        let standing = Posture { speed_mps: 0.0, ..posture(0.0) };
        assert!(blocked_along(&standing, 0.2, 1.3) && !blocked_along(&standing, 0.2, 1.6));
        assert!(blocked_along(&standing, 0.0, 1.7) && !blocked_along(&standing, 0.0, 1.76));
    }

    #[test]
    fn hands_of_a_walker_are_ahead_of_him_once_a_stride_each_and_of_a_standing_one_never() {
        let reaches = |posture: &Posture| blocked_across(posture, 0.35, 0.44 * 1.75);
        let phases = (0..16).map(|k| f64::from(k) * PI / 8.0);
        let ahead: Vec<bool> = phases.map(|phase| reaches(&posture(phase))).collect();
        assert!(ahead[0] && ahead[8] && !ahead[4] && !ahead[12], "{ahead:?}");
        assert!(!reaches(&Posture { speed_mps: 0.0, ..posture(0.0) }));
        assert!(!reaches(&Posture { arm_swing: [0.0; 2], ..posture(0.0) }));
    }

    #[test]
    fn the_trunk_rides_over_the_foot_that_stands() {
        // The right foot stands in the first half of the stride, the left one in the second.
        let side = |phase: f64, left_m: f64| blocked_along(&posture(phase), left_m, 0.90 * 1.75);
        assert!(side(1.7 * PI, 0.09) && !side(0.7 * PI, 0.09) && side(0.7 * PI, -0.09));
    }

    #[test]
    fn a_ray_that_ends_before_the_body_or_passes_above_it_is_clear() {
        let standing = Posture { speed_mps: 0.0, ..posture(0.0) };
        let clear = |start: DVec3, end: DVec3| !blocks(&body(), &standing, start, end);
        assert!(clear(DVec3::new(0.0, 0.0, 1.0), DVec3::new(4.8, 0.0, 1.0)));
        assert!(clear(DVec3::new(0.0, 0.0, 2.0), DVec3::new(10.0, 0.0, 1.8)));
        assert!(!clear(DVec3::new(5.0, 0.0, 3.0), DVec3::new(5.0, 0.0, 0.1)), "straight down");
    }

    #[test]
    fn distance_of_segments_against_many_points_on_both() {
        let at = |i: u32| f64::from(i) / 200.0;
        let p = [DVec3::new(0.0, 0.0, 0.0), DVec3::new(1.0, 0.5, 0.2)];
        for q in [
            [DVec3::new(0.2, 0.9, 0.1), DVec3::new(0.9, -0.4, 1.0)],
            [DVec3::new(2.0, 1.0, 0.0), DVec3::new(3.0, 1.5, 0.2)],
            [DVec3::new(-1.0, 0.3, 0.0), DVec3::new(-0.4, 0.3, 0.5)],
        ] {
            let points = (0..=200).flat_map(|i| (0..=200).map(move |j| (i, j)));
            let nearest = points
                .map(|(i, j)| p[0].lerp(p[1], at(i)).distance_squared(q[0].lerp(q[1], at(j))))
                .fold(f64::INFINITY, f64::min);
            let found = distance2_of_segments(p[0], p[1], q[0], q[1]);
            assert!((found - nearest).abs() < 1e-3 && found <= nearest + 1e-12, "{found}, {nearest}");
        }
    }
}
