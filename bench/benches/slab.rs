//! The slab test compared with parry's, on the same thousand segments from an access point to people and the boxes of
//! others.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use parry3d_f64::bounding_volume::Aabb as ParryAabb;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use umbracast::geometry::slab::hit_aabb;
use umbracast::geometry::{Aabb, DVec3};

const AP_M: DVec3 = DVec3::new(12.0, 0.0, 3.0);

/// People stand on a grid of a metre. The box of one is asked about the segment to somebody a metre behind him, or to anybody.
fn cases() -> Vec<(Aabb, DVec3)> {
    let place = |i: u32| DVec3::new(f64::from(i % 25) - 12.0, f64::from(i / 25) * 0.5 - 10.0, 0.0);
    let case = |i: u32| {
        let box_m = place(i);
        let behind_m = box_m + (box_m - AP_M).with_z(0.0).normalize();
        let foot_m = if i.is_multiple_of(2) { behind_m } else { place((i * 7 + 3) % 1000) };
        let to_m = foot_m + DVec3::new(0.2, 0.1, 0.9);
        let half_m = DVec3::new(0.25, 0.25, 0.0);
        (Aabb { min_m: box_m - half_m, max_m: box_m + half_m + DVec3::new(0.0, 0.0, 1.75) }, to_m)
    };
    (0..1000).map(case).collect()
}

fn slab(criterion: &mut Criterion) {
    let ours = cases();
    let vector = |v: DVec3| Vector::new(v.x, v.y, v.z);
    let theirs: Vec<(ParryAabb, Ray)> = ours
        .iter()
        .map(|(aabb, to_m)| {
            let ray = Ray::new(vector(AP_M), vector(*to_m - AP_M));
            (ParryAabb::new(vector(aabb.min_m), vector(aabb.max_m)), ray)
        })
        .collect();
    let our_hits = || ours.iter().filter(|(aabb, to_m)| hit_aabb(aabb, AP_M, *to_m).is_some()).count();
    let their_hits =
        || theirs.iter().filter(|(aabb, ray)| aabb.cast_local_ray(ray, 1.0, true).is_some()).count();
    assert_eq!(our_hits(), their_hits(), "both find the same");
    assert!(our_hits() > 20, "{} of 1000 are hit", our_hits());
    criterion.bench_function("slab/umbracast", |bencher| bencher.iter(|| black_box(our_hits())));
    criterion.bench_function("slab/parry3d", |bencher| bencher.iter(|| black_box(their_hits())));
}

criterion_group!(benches, slab);
criterion_main!(benches);
