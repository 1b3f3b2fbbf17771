//! Any bytes must be a list of possible people, or be refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast_io::objects;

fuzz_target!(|input: (i64, &[u8])| {
    let (time_ns, bytes) = input;
    let Some(list) = objects::read(bytes) else { return };
    let (found, none) = objects::detections(&list, time_ns);
    assert_eq!(found.len() + none as usize, list.objects.len());
    for detection in found {
        assert!(detection.position_m.is_finite() && detection.obb.half_m.is_finite());
        assert!(detection.aabb.min_m.is_finite() && detection.aabb.max_m.cmpge(detection.aabb.min_m).all());
        assert!(detection.covariance_m2.is_none_or(|c| c[0][0] > 0.0 && c[0][0].is_finite()));
    }
});
