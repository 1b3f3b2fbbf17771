//! Any payload gives finite columns in order of time, or a count, whatever sensor it is taken for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast::Health;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Model, Packet, sensor_models};

// The first byte chooses the model; the payload is cut or filled up to its packet's length where the second is even.
fuzz_target!(|input: (u8, u8, i64, Vec<u8>)| {
    let (model, whole, time_ns, mut payload) = input;
    let names: Vec<&str> = sensor_models().filter(|name| *name != "points").collect();
    let model = Model::by_name(names[usize::from(model) % names.len()]).expect("a model of the table");
    if whole % 2 == 0 {
        payload.resize(model.packet_bytes(), 0);
    }
    let packet = Packet { time_ns, payload };
    let mut health = Health::default();
    let mut last_ns = i64::MIN;
    decode(&model, &packet, &mut health, |column, range_m, reflectivity| {
        assert_eq!((range_m.len(), reflectivity.len()), (model.beams.len(), model.beams.len()));
        assert!((0.0..=36_000.0).contains(&column.azimuth_cdeg));
        assert!(range_m.iter().all(|r| (0.0..=1050.0).contains(r)));
        assert!(column.time_ns > last_ns);
        last_ns = column.time_ns;
    });
    assert!(last_ns == i64::MIN || health.is_clean());
});
