//! Any text as a sensor's own file must give a model whose packets fit into a datagram, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast::Config;
use umbracast::lidar::Model;

fuzz_target!(|input: (u8, String)| {
    let mut sensor = Config::default().site.sensors[0].clone();
    sensor.model = ["os0-128", "os1-32", "xt32", "hdl-32e"][usize::from(input.0) % 4].to_owned();
    sensor.calibration = Some(input.1);
    if let Ok(model) = Model::of_sensor(&sensor) {
        assert!(model.packet_bytes() <= 65_507 && model.column_period_ns > 0.0);
        assert!(model.beams.iter().all(|beam| beam.direction.is_finite() && beam.origin_m.is_finite()));
    }
});
