//! Haselich's split-merge as hdl_people_tracking adapted it: DP-means, then a merge where no gap is seen (facts
//! and values: koide3/hdl_people_tracking at 2d12516). Depends on the order of the points, as the original does.

use crate::geometry::DVec2;

/// A point farther than this from every centroid starts a new cluster.
const LAMBDA_M: f64 = 0.45;
/// Most passes.
const PASSES: u32 = 128;
/// Clusters whose means are farther apart are not merged.
const MERGE_M: f64 = 0.8;

/// What the gap test of the merge takes for a cluster's mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MergeMean {
    /// The sum of the points, never divided: the adapted code's bug, which keeps it from ever merging.
    Sum,
    /// The mean, as published.
    Mean,
}

/// Labels of the points after DP-means: a point farther than [`LAMBDA_M`] from every centroid starts a new one, at
/// most one a pass; until no label changes or all passes are done.
pub fn split(points_m: &[DVec2]) -> Vec<usize> {
    let mut labels = vec![0; points_m.len()];
    let mut centroids_m = vec![DVec2::ZERO];
    for _ in 0..PASSES {
        centroids_m = means(points_m, &labels, centroids_m.len());
        let (mut changed, mut grown) = (false, false);
        for (&p, label) in points_m.iter().zip(&mut labels) {
            let mut nearest = (centroids_m[0].distance_squared(p), 0);
            for (j, c) in centroids_m.iter().enumerate().skip(1) {
                let d = c.distance_squared(p);
                if d < nearest.0 {
                    nearest = (d, j);
                }
            }
            if !grown && nearest.0 > LAMBDA_M * LAMBDA_M {
                grown = true;
                nearest.1 = centroids_m.len();
                centroids_m.push(p);
            }
            changed |= *label != nearest.1;
            *label = nearest.1;
        }
        if !changed {
            break;
        }
    }
    labels
}

/// Means of the labelled points; an empty label's is the origin, as in the original.
fn means(points_m: &[DVec2], labels: &[usize], n: usize) -> Vec<DVec2> {
    let mut sums = vec![(DVec2::ZERO, 0_u32); n];
    for (p, &label) in points_m.iter().zip(labels) {
        sums[label].0 += *p;
        sums[label].1 += 1;
    }
    sums.iter().map(|&(sum, n)| sum / f64::from(n.max(1))).collect()
}

/// For each part the one it is merged into, itself where it stays: two parts are merged when their "means" are
/// near and no gap lies between.
pub fn merge(parts: &[Vec<DVec2>], mean: MergeMean) -> Vec<usize> {
    let means_m: Vec<DVec2> = parts
        .iter()
        .map(|part| {
            let sum: DVec2 = part.iter().copied().sum();
            match mean {
                // The original never divides, so that "means" are nearly always far apart and nothing is merged.
                MergeMean::Sum => sum,
                MergeMean::Mean => sum / part.len() as f64,
            }
        })
        .collect();
    let mut into: Vec<usize> = (0..parts.len()).collect();
    for i in 0..parts.len() {
        for j in i + 1..parts.len() {
            let apart_m = means_m[i].distance(means_m[j]);
            if apart_m > MERGE_M || has_gap(means_m[i], means_m[j], &parts[i], &parts[j]) {
                continue;
            }
            if into[j] == j || means_m[into[j]].distance(means_m[j]) > apart_m {
                into[j] = i;
            }
        }
    }
    // A part is only merged into an earlier one, so chains end.
    (0..parts.len())
        .map(|mut part| {
            while into[part] != part {
                part = into[part];
            }
            part
        })
        .collect()
}

/// True when the middle quarter between the means holds less than 0.8 of a bin's average share of the points
/// between them.
fn has_gap(mean_a_m: DVec2, mean_b_m: DVec2, a: &[DVec2], b: &[DVec2]) -> bool {
    const BINS: usize = 8;
    const GAP: f64 = 0.8;
    let major = (mean_b_m - mean_a_m).normalize_or_zero();
    let (from, to) = (major.dot(mean_a_m), major.dot(mean_b_m));
    let mut histogram = [0_u32; BINS];
    for p in a.iter().chain(b) {
        // Truncated toward zero: a point just before the first mean falls into the first bin, as in the original.
        let bin = ((major.dot(*p) - from) / (to - from) * BINS as f64) as i64;
        if (0..BINS as i64).contains(&bin) {
            histogram[bin as usize] += 1;
        }
    }
    let average = f64::from(histogram.iter().sum::<u32>()) / BINS as f64;
    f64::from(histogram[3] + histogram[4]) < average * GAP
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(x: f64, y: f64) -> Vec<DVec2> {
        (0..24).map(|i| DVec2::new(x, y) + DVec2::from_angle(f64::from(i)) * 0.2).collect()
    }

    #[test]
    fn one_disc_stays_whole_and_two_come_apart() {
        assert!(split(&disc(3.0, 4.0)).iter().all(|&l| l == 0));
        let two = [disc(3.0, 4.0), disc(3.9, 4.0)].concat();
        let labels = split(&two);
        assert!(labels[..24].iter().all(|&l| l == labels[0]));
        assert!(labels[24..].iter().all(|&l| l == labels[24] && l != labels[0]));
    }

    #[test]
    fn the_undivided_sum_never_merges_where_the_mean_does() {
        let parts = [disc(3.0, 4.0), disc(3.3, 4.0)];
        assert_eq!(merge(&parts, MergeMean::Mean), [0, 0]);
        assert_eq!(merge(&parts, MergeMean::Sum), [0, 1]);
    }
}
