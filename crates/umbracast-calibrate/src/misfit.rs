//! Walls that are not where the site file has them.

use std::collections::BTreeSet;

use umbracast::geometry::DVec3;

use crate::hall::Outline;
use crate::plan::Plan;

/// How far from a wall of the file another one is looked for.
const FAR_M: f64 = 2.5;
/// A return within this of a surface is of it.
const ON_M: f64 = 0.12;
/// Half the thickness of a plane, and the step from one that is tried to the next.
const PLANE_M: f64 = 0.08;
const STEP_M: f64 = 0.04;
/// Nearer to a wall's end a return may be of the next wall.
const END_M: f64 = 0.3;
/// What is seen of a wall is counted in pieces of this length, of which so many are a wall,
const PIECE_M: f64 = 0.5;
const PIECES_MIN: usize = 5;
/// and less than this share of them is where the file has it.
const SHARE_ON: f64 = 0.35;

/// A wall of the site file that is seen elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Place among the hall's walls.
    pub wall: usize,
    /// How much farther in than the file says it is seen, metres; less than 0 is farther out.
    pub in_m: f64,
}

/// Walls that are seen parallel to where the file has them, and not there.
pub fn misfits(points_m: &[DVec3], outline: &Outline, plan: &Plan) -> Vec<Misfit> {
    let moved_m: Vec<DVec3> =
        points_m.iter().map(|point| plan.point(point.truncate()).extend(point.z)).collect();
    let of = |wall: usize| {
        let [from, to] = outline.wall(wall)?;
        let (along, length_m) = ((to - from).normalize_or_zero(), from.distance(to));
        let others = outline.without(&[wall]);
        let near = |point: &DVec3| {
            let off = point.truncate() - from;
            let (at_m, in_m) = (off.dot(along), off.dot(along.perp()));
            let is_its = (END_M..length_m - END_M).contains(&at_m) && in_m.abs() < FAR_M;
            let is_anothers = || others.foot(*point).is_some_and(|foot| foot.off_m.abs() < ON_M);
            (is_its && !is_anothers()).then_some(((at_m / PIECE_M) as usize, in_m))
        };
        let points: Vec<(usize, f64)> = moved_m.iter().filter_map(near).collect();
        let pieces = |middle_m: f64, half_m: f64| {
            let of = points.iter().filter(|(_, in_m)| (in_m - middle_m).abs() < half_m);
            of.map(|(piece, _)| *piece).collect::<BTreeSet<_>>().len()
        };
        let planes = (-(FAR_M / STEP_M) as i32..=(FAR_M / STEP_M) as i32).map(|k| STEP_M * f64::from(k));
        let (most, in_m) = planes
            .map(|in_m| (pieces(in_m, PLANE_M), in_m))
            .max_by(|a, b| a.0.cmp(&b.0).then(b.1.abs().total_cmp(&a.1.abs())))?;
        let on = pieces(0.0, ON_M);
        let its = || points.iter().map(|(_, at_m)| at_m).filter(|at_m| (*at_m - in_m).abs() < ON_M);
        let mean_m = its().sum::<f64>() / its().count().max(1) as f64;
        (most >= PIECES_MIN && in_m.abs() > ON_M && (on as f64) < SHARE_ON * most as f64)
            .then_some(Misfit { wall, in_m: mean_m })
    };
    (0..outline.walls()).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;
    use umbracast::geometry::DVec2;

    #[test]
    fn a_wall_half_a_metre_out_is_named_and_right_walls_are_not() {
        let outline = Outline::new(&Config::default().site);
        let still = Plan { yaw_rad: 0.0, at_m: DVec2::ZERO };
        let along = || (-33..=33).map(|k| f64::from(k) * 0.5);
        let room = |east_m: f64| -> Vec<DVec3> {
            let walls = along().flat_map(|t| {
                [DVec2::new(east_m, t), DVec2::new(-17.0, t), DVec2::new(t, 17.0), DVec2::new(t, -17.0)]
            });
            walls.map(|p| p.extend(4.0)).collect()
        };
        assert_eq!(misfits(&room(17.0), &outline, &still), []);
        for (east_m, in_m) in [(17.5, -0.5), (16.5, 0.5), (19.0, -2.0)] {
            let found = misfits(&room(east_m), &outline, &still);
            assert!(found.len() == 1 && (found[0].in_m - in_m).abs() < 0.02, "{east_m}: {found:?}");
        }
    }
}
