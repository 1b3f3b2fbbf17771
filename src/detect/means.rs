//! k-means of a cluster in plan view, with its number of parts.

use super::memory::{Memory, PEOPLE_OF_CLUSTER};
use super::part::Part;
use crate::geometry::{DVec2, DVec3};

/// Passes of k-means; it settles in three or four.
pub(super) const PASSES: usize = 10;

/// What k-means makes of a cluster, where that is worth it.
pub(super) fn people_if(
    moved_m: &[DVec3],
    cluster: &[u32],
    begin_m: impl IntoIterator<Item = DVec2>,
    memory: &mut Memory,
    is_worth_it: impl Fn(&[Part]) -> bool,
) -> Option<Vec<Part>> {
    let people = means(moved_m, cluster, begin_m, memory)?;
    if !is_worth_it(&people) {
        memory.give_parts(people);
        return None;
    }
    Some(people)
}

/// k-means of the cluster from these means; `None` with fewer than two, or when one of them loses all its points.
pub(super) fn means(
    moved_m: &[DVec3],
    cluster: &[u32],
    begin_m: impl IntoIterator<Item = DVec2>,
    memory: &mut Memory,
) -> Option<Vec<Part>> {
    let mut means_m = memory.places.take(PEOPLE_OF_CLUSTER);
    means_m.extend(begin_m);
    let parts = settle(moved_m, cluster, &mut means_m, &mut memory.sums).then(|| {
        let mut parts = memory.parts.take(PEOPLE_OF_CLUSTER);
        parts.extend(means_m.iter().map(|_| Part::new(&[], memory.take_points())));
        cluster.iter().for_each(|&i| parts[nearest(&means_m, moved_m[i as usize])].points.push(i));
        parts.iter_mut().for_each(|part| part.look(moved_m));
        parts
    });
    memory.places.give(means_m);
    parts
}

/// Moves means until they are those of the points nearest to them; false with fewer than two, or when one loses all points.
fn settle(moved_m: &[DVec3], cluster: &[u32], means_m: &mut [DVec2], sums: &mut Vec<(DVec2, f64)>) -> bool {
    if means_m.len() < 2 {
        return false;
    }
    for _ in 0..PASSES {
        sums.clear();
        sums.resize(means_m.len(), (DVec2::ZERO, 0.0));
        for point_m in cluster.iter().map(|&i| moved_m[i as usize]) {
            let sum = &mut sums[nearest(means_m, point_m)];
            sum.0 += point_m.truncate();
            sum.1 += 1.0;
        }
        let mut moved = false;
        for (mean_m, (sum_m, points)) in means_m.iter_mut().zip(&*sums) {
            let last_m = std::mem::replace(mean_m, sum_m / points);
            moved |= last_m != *mean_m;
        }
        if means_m.iter().any(|mean_m| mean_m.is_nan()) {
            return false;
        }
        if !moved {
            break;
        }
    }
    true
}

fn nearest(means_m: &[DVec2], point_m: DVec3) -> usize {
    let off_m2 = means_m.iter().map(|mean_m| mean_m.distance_squared(point_m.truncate())).enumerate();
    off_m2.min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(mean, _)| mean)
}

/// The means of the parts, those of the longest replaced by two, half a step to either side of its middle.
pub(super) fn one_more(moved_m: &[DVec3], parts: &[Part]) -> impl Iterator<Item = DVec2> {
    let axes_m = parts.iter().map(|part| part.axis_m(moved_m)).enumerate();
    let longest = axes_m.max_by(|(_, a), (_, b)| a.length().total_cmp(&b.length()));
    let ends_m = longest.map(|(k, axis_m)| (k, parts[k].ends_m(axis_m)));
    let mean_m = move |(k, part): (usize, &Part)| match ends_m {
        Some((longest, [less_m, _])) if longest == k => less_m,
        _ => part.mean_m(),
    };
    parts.iter().enumerate().map(mean_m).chain(ends_m.map(|(_, [_, more_m])| more_m))
}
