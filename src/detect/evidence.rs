//! Is it one person more?

use super::Point;
use crate::geometry::DVec2;

/// Farthest apart that the middles of the two halves of one body are seen.
const HALVES_M: f64 = 0.42;

/// Splits a cluster in two as long as that is likelier than one person; parts go to `parts`.
pub fn split(points: &[Point], cluster: Vec<u32>, points_min: usize, parts: &mut Vec<Vec<u32>>) {
    if cluster.len() >= 2 * points_min {
        let (a, b, apart_m) = halves(points, &cluster);
        if apart_m > HALVES_M && a.len() >= points_min && b.len() >= points_min {
            split(points, a, points_min, parts);
            split(points, b, points_min, parts);
            return;
        }
    }
    parts.push(cluster);
}

/// Two-means from the ends of the longest axis.
fn halves(points: &[Point], cluster: &[u32]) -> (Vec<u32>, Vec<u32>, f64) {
    let at = |i: u32| points[i as usize].position_m.truncate();
    let n = cluster.len() as f64;
    let mean: DVec2 = cluster.iter().map(|&i| at(i)).sum::<DVec2>() / n;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for &i in cluster {
        let d = at(i) - mean;
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    let axis = DVec2::from_angle(0.5 * f64::atan2(2.0 * xy, xx - yy));
    let (mut p, mut q) = (mean - axis, mean + axis);
    for _ in 0..10 {
        let mut sums = [(DVec2::ZERO, 0.0); 2];
        for &i in cluster {
            let side = usize::from(at(i).distance_squared(q) < at(i).distance_squared(p));
            sums[side].0 += at(i);
            sums[side].1 += 1.0;
        }
        if sums[0].1 == 0.0 || sums[1].1 == 0.0 {
            break;
        }
        (p, q) = (sums[0].0 / sums[0].1, sums[1].0 / sums[1].1);
    }
    let (a, b) = cluster.iter().partition(|&&i| at(i).distance_squared(p) <= at(i).distance_squared(q));
    (a, b, p.distance(q))
}
