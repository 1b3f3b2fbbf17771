//! Checks whether the sensors agree on where people are.

use super::{Cluster, Point};
use crate::geometry::DVec2;

/// Where a sensor hangs elsewhere by degrees, what it alone sees of somebody lies so far beside what another one sees.
const BESIDE_M: f64 = 1.2;

/// How many clusters have the points of one sensor alone and, within 1.2 m, another one of another sensor alone. Of
/// people whom both see there are few, who hide each other; of most where one of the sensors hangs elsewhere than the
/// site says, for everybody is there twice then.
///
/// ```
/// use umbracast::{detect::{Point, doubled}, geometry::DVec3};
///
/// let at = |x_m: f64, sensor: u16| Point { position_m: DVec3::new(x_m, 0.0, 1.0), time_ns: 0, sensor };
/// let points = [at(0.0, 0), at(0.4, 1), at(5.0, 0)];
/// assert_eq!(doubled(&points, &[vec![0], vec![1], vec![2]]), 2);
/// assert_eq!(doubled(&points, &[vec![0, 1], vec![2]]), 0);
/// ```
pub fn doubled(points: &[Point], clusters: &[Cluster]) -> usize {
    let of = |cluster: &Cluster| -> Option<(u16, DVec2)> {
        let sensor = points[*cluster.first()? as usize].sensor;
        let own = || cluster.iter().map(|&i| &points[i as usize]);
        let mean_m = own().map(|p| p.position_m.truncate()).sum::<DVec2>() / cluster.len() as f64;
        own().all(|p| p.sensor == sensor).then_some((sensor, mean_m))
    };
    let alone: Vec<(u16, DVec2)> = clusters.iter().filter_map(of).collect();
    let beside = |(sensor, at_m): &(u16, DVec2)| {
        alone.iter().any(|(other, its_m)| other != sensor && its_m.distance(*at_m) < BESIDE_M)
    };
    alone.iter().filter(|one| beside(one)).count()
}
