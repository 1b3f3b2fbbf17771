//! Packets of sensors, and the frames that they make.

use std::sync::LazyLock;

use umbracast::lidar::packet::{columns_per_packet, decode, encode};
use umbracast::lidar::{Assembler, Column, Model, Packet, sensor_models};
use umbracast::{Config, Health, STEP_NS};

use super::Target;
use crate::given::Given;

/// A payload gives columns in order of time with ranges that the sensor can measure, or a count, never both. The first
/// byte of the input chooses the model, eight more are the time of reception, the rest is the payload.
pub const VELODYNE: Target = Target {
    name: "packets-velodyne",
    corpus: || whole_packets(&MODELS[0]),
    check: |input| packet(&MODELS[0], input),
};
/// The same.
pub const OUSTER: Target = Target {
    name: "packets-ouster",
    corpus: || whole_packets(&MODELS[1]),
    check: |input| packet(&MODELS[1], input),
};
/// The same.
pub const HESAI: Target = Target {
    name: "packets-hesai",
    corpus: || whole_packets(&MODELS[2]),
    check: |input| packet(&MODELS[2], input),
};
/// Packets of two sensors give frames in order of time, and what waits for a frame is bounded. The input is a list of
/// packets: sensor, time of reception, what is changed in a whole packet.
pub const ASSEMBLE: Target = Target { name: "assemble", corpus: streams, check: stream };

/// Beams of the Ousters that are damaged: with more, a packet says nothing else.
const FEW_BEAMS: &str = "32";
/// No sensor measures farther.
const FARTHEST_M: f32 = 1050.0;

/// Velodyne's, Ouster's, Hesai's.
static MODELS: LazyLock<[Vec<Model>; 3]> = LazyLock::new(|| {
    let models = |of: fn(&str) -> bool| {
        let names = sensor_models().filter(|name| *name != "points" && of(name));
        names.map(|name| Model::by_name(name).expect("a model of the table")).collect()
    };
    [
        models(|name| name.starts_with("hdl") || name.starts_with("vlp")),
        models(|name| name.starts_with("os") && name.ends_with(FEW_BEAMS)),
        models(|name| name.starts_with("xt")),
    ]
});

/// A packet whose first column fires at `time_ns`, turning at 10 Hz.
pub(super) fn whole(model: &Model, time_ns: i64) -> Packet {
    let cdeg_per_ns = 36_000.0 / STEP_NS as f64;
    let column = |c: usize| {
        let after_ns = c as f64 * model.column_period_ns;
        let since_start_ns = time_ns.rem_euclid(STEP_NS) as f64 + after_ns;
        Column {
            time_ns: time_ns + after_ns.round() as i64,
            azimuth_cdeg: (since_start_ns * cdeg_per_ns % 36_000.0) as f32,
            azimuth_rate_cdeg_per_ns: cdeg_per_ns as f32,
        }
    };
    let columns: Vec<Column> = (0..columns_per_packet(model)).map(column).collect();
    let rays = columns.len() * model.beams.len();
    let range_m: Vec<f32> = (0..rays).map(|ray| 1.0 + (ray * 37 % 8000) as f32 * 0.002).collect();
    let reflectivity: Vec<u8> = (0..rays).map(|ray| (ray * 11) as u8).collect();
    encode(model, &columns, &range_m, &reflectivity, time_ns)
}

fn whole_packets(models: &[Model]) -> Vec<Vec<u8>> {
    let input = |(number, model): (usize, &Model)| {
        let Packet { time_ns, payload } = whole(model, STEP_NS);
        [&[number as u8][..], &time_ns.to_le_bytes(), &payload].concat()
    };
    models.iter().enumerate().map(input).collect()
}

fn packet(models: &[Model], input: &[u8]) -> bool {
    let mut given = Given(input);
    let model = &models[usize::from(given.u8()) % models.len()];
    let packet = Packet { time_ns: given.i64(), payload: given.0.to_vec() };
    let (mut health, mut last_ns) = (Health::default(), None);
    decode(model, &packet, &mut health, |column, range_m, reflectivity| {
        assert_eq!((range_m.len(), reflectivity.len()), (model.beams.len(), model.beams.len()));
        assert!((0.0..=36_000.0).contains(&column.azimuth_cdeg), "{column:?}");
        assert!((0.0..1.0).contains(&column.azimuth_rate_cdeg_per_ns), "{column:?}");
        assert!(range_m.iter().all(|range_m| (0.0..=FARTHEST_M).contains(range_m)));
        assert!(last_ns.is_none_or(|last_ns| column.time_ns > last_ns), "{column:?}");
        last_ns = Some(column.time_ns);
    });
    assert!(last_ns.is_none() || health.is_clean());
    last_ns.is_some()
}

/// A whole revolution of few packets, and one that is out of order.
fn streams() -> Vec<Vec<u8>> {
    let packet = |k: i64| {
        let time_ns = k * STEP_NS / 8;
        [&[(k % 2) as u8][..], &time_ns.to_le_bytes(), &[0; 4]].concat()
    };
    let late = |k: i64| packet(if k % 5 == 4 { k - 3 } else { k });
    vec![(0..32).flat_map(packet).collect(), (0..32).flat_map(late).collect()]
}

fn stream(input: &[u8]) -> bool {
    let mut given = Given(input);
    let mut assembler = Assembler::new(&Config::default().site).expect("the default site");
    let model = &MODELS[0][0];
    let (mut health, mut last_ns, mut frames, mut columns, mut pushed) = (Health::default(), None, 0, 0, 0);
    let mut take = |assembler: &mut Assembler| {
        while let Some(frame) = assembler.pop() {
            assert!(
                last_ns.is_none_or(|last_ns| frame.time_ns > last_ns),
                "{} after {last_ns:?}",
                frame.time_ns
            );
            last_ns = Some(frame.time_ns);
            frames += 1;
            columns += frame.scans.iter().map(crate::targets::step::columns).sum::<usize>();
        }
    };
    while !given.is_over() {
        let (sensor, time_ns) = (given.u8(), given.i64());
        // A clock far from any is told by eight bytes, a time of ours by what the model makes of it.
        let sane_ns = time_ns.rem_euclid(1 << 40);
        let mut packet = whole(model, sane_ns);
        packet.time_ns = time_ns;
        let (at, value) = (usize::from(given.u16()), given.u16());
        if value != 0 {
            let at = at % (packet.payload.len() - 1);
            packet.payload[at..at + 2].copy_from_slice(&value.to_le_bytes());
        }
        pushed += columns_per_packet(model);
        assembler.push(usize::from(sensor % 3), &packet, &mut health);
        take(&mut assembler);
    }
    assembler.finish();
    take(&mut assembler);
    assert!(columns <= pushed, "{columns} columns of {pushed}");
    frames > 0
}
