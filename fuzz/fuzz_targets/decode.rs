//! Any payload gives finite columns in order of time, or a count.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast::Health;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Model, Packet};

fuzz_target!(|input: (i64, Vec<u8>)| {
    let packet = Packet { time_ns: input.0, payload: input.1 };
    for model in [Model::hdl_32e(), Model::vlp_16()] {
        let mut health = Health::default();
        let mut last_ns = i64::MIN;
        decode(&model, &packet, &mut health, |column, range_m, reflectivity| {
            assert_eq!((range_m.len(), reflectivity.len()), (model.beams.len(), model.beams.len()));
            assert!((0.0..=36_000.0).contains(&column.azimuth_cdeg));
            assert!(range_m.iter().all(|r| (0.0..=131.07).contains(r)));
            assert!(column.time_ns > last_ns);
            last_ns = column.time_ns;
        });
        assert_eq!(last_ns == i64::MIN, !health.is_clean());
    }
});
