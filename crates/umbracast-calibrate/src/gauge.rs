//! The frame as a whole: people and floor leave all sensors together free to move in plan view. Walls fix them.

use nalgebra::{Matrix3, Vector3};
use umbracast::geometry::{DVec2, DVec3};

use crate::hall::{Foot, Outline};
use crate::plan::Plan;

/// Trials: how far all sensors may be turned against the site file, and from trial to trial, degrees.
const TURN_MAX_DEG: i32 = 45;
const TURN_STEP_DEG: i32 = 3;
/// A return is taken for that of the nearest surface within this, round after round, metres.
const GATES_M: [f64; 14] = [4.0, 4.0, 3.0, 3.0, 2.0, 2.0, 1.5, 1.0, 0.7, 0.5, 0.4, 0.3, 0.3, 0.3];
/// A return this near is of the surface.
const ON_M: f64 = 0.12;
/// The hall is the site file's when such a share of the upright surfaces is.
const SHARE_MIN: f64 = 0.4;
/// A surface with fewer returns does not count; more tell no more.
const RETURNS: f64 = 30.0;
/// One standard deviation of a surface.
const SURFACE_M: f64 = 0.03;
/// Walls hold the frame when they hold it this well in every direction, metres; a turn counts at this arm.
const HELD_M: f64 = 0.1;
const ARM_M: f64 = 5.0;

/// The motion of the whole frame that brings upright returns onto the hall's surfaces; `points_m` are where the site file
/// would have them. `None` where the hall is not to be seen, or one wall of it alone.
pub fn by_walls(points_m: &[DVec3], outline: &Outline) -> Option<Plan> {
    let middle_m = points_m.iter().map(|p| p.truncate()).sum::<DVec2>() / points_m.len().max(1) as f64;
    let trial = |deg: i32| {
        let turn = Plan { yaw_rad: f64::from(deg).to_radians(), at_m: DVec2::ZERO };
        let start = Plan { at_m: middle_m - turn.point(middle_m), ..turn };
        let plan = fitted(points_m, outline, start)?;
        let on: f64 =
            feet(points_m, outline, &plan, ON_M).map(|(_, foot)| 1.0 - (foot.off_m / ON_M).powi(2)).sum();
        Some((on, deg.abs(), plan))
    };
    let trials = (-TURN_MAX_DEG..=TURN_MAX_DEG).step_by(TURN_STEP_DEG as usize).filter_map(trial);
    // A hall that looks the same from two sides is taken as the site file has it.
    let (.., plan) = trials.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    let on = feet(points_m, outline, &plan, ON_M).count() as f64;
    (on >= SHARE_MIN * points_m.len() as f64 && is_held(points_m, outline, &plan)).then_some(plan)
}

fn feet<'a>(
    points_m: &'a [DVec3],
    outline: &'a Outline,
    plan: &'a Plan,
    gate_m: f64,
) -> impl Iterator<Item = (DVec2, Foot)> + 'a {
    points_m.iter().filter_map(move |point| {
        let moved_m = plan.point(point.truncate());
        let foot = outline.foot(moved_m.extend(point.z))?;
        (foot.off_m.abs() < gate_m).then_some((moved_m, foot))
    })
}

/// Slopes of a surface's distance by x, y and the turn about `about_m`, at the arm.
fn slopes(at_m: DVec2, foot: &Foot, about_m: DVec2) -> Vector3<f64> {
    Vector3::new(foot.normal.x, foot.normal.y, foot.normal.dot((at_m - about_m).perp()) / ARM_M)
}

fn fitted(points_m: &[DVec3], outline: &Outline, start: Plan) -> Option<Plan> {
    let mut plan = start;
    for gate_m in GATES_M {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (at_m, foot) in feet(points_m, outline, &plan, gate_m) {
            let (row, weight) = (slopes(at_m, &foot, plan.at_m), 1.0 / (1.0 + (foot.off_m / 0.3).powi(2)));
            matrix += row * row.transpose() * weight;
            right -= row * foot.off_m * weight;
        }
        let step = matrix.cholesky()?.solve(&right);
        plan.at_m += DVec2::new(step[0], step[1]);
        plan.yaw_rad += step[2] / ARM_M;
    }
    Some(plan)
}

fn is_held(points_m: &[DVec3], outline: &Outline, plan: &Plan) -> bool {
    let on: Vec<_> = feet(points_m, outline, plan, ON_M).collect();
    let about_m = on.iter().map(|(at_m, _)| *at_m).sum::<DVec2>() / on.len().max(1) as f64;
    let mut information = Matrix3::zeros();
    for surface in 0..outline.len() {
        let own = || on.iter().filter(|(_, foot)| foot.surface == surface);
        let count = own().count() as f64;
        if count >= RETURNS {
            for (at_m, foot) in own() {
                let row = slopes(*at_m, foot, about_m) / SURFACE_M;
                information += row * row.transpose() / count;
            }
        }
    }
    information.symmetric_eigenvalues().min() >= 1.0 / (HELD_M * HELD_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    /// Points every half metre along the walls of the default hall; only one wall's where asked for.
    fn walls(one: bool) -> Vec<DVec3> {
        let along = (-33..=33).map(|k| f64::from(k) * 0.5);
        let of = |t: f64| match one {
            true => vec![DVec2::new(17.0, t)],
            false => {
                vec![DVec2::new(17.0, t), DVec2::new(-17.0, t), DVec2::new(t, 17.0), DVec2::new(t, -17.0)]
            }
        };
        along.flat_map(of).map(|p| p.extend(4.0)).collect()
    }

    #[test]
    fn walls_hold_a_frame_that_is_turned_and_shifted() {
        let outline = Outline::new(&Config::default().site);
        let off = Plan { yaw_rad: 0.4, at_m: DVec2::new(1.3, -0.8) };
        let seen: Vec<DVec3> =
            walls(false).iter().map(|p| off.inverse().point(p.truncate()).extend(p.z)).collect();
        let found = by_walls(&seen, &outline).unwrap();
        assert!((found.yaw_rad - 0.4).abs() < 1e-3 && found.at_m.distance(off.at_m) < 0.01, "{found:?}");
    }

    #[test]
    fn one_wall_holds_no_frame() {
        assert_eq!(by_walls(&walls(true), &Outline::new(&Config::default().site)), None);
        assert_eq!(by_walls(&[], &Outline::new(&Config::default().site)), None);
    }
}
