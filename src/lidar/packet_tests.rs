//! Tests of the packet codec: what every model promises.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::lidar::sensor_models;

/// Columns, ranges and reflectivities.
pub type Decoded = (Vec<Column>, Vec<f32>, Vec<u8>);

/// All that a packet holds.
pub fn decode_all(model: &Model, packet: &Packet, health: &mut Health) -> Decoded {
    let mut all = (Vec::new(), Vec::new(), Vec::new());
    decode(model, packet, health, |column, range_m, reflectivity| {
        all.0.push(column);
        all.1.extend_from_slice(range_m);
        all.2.extend_from_slice(reflectivity);
    });
    all
}

/// A full packet that starts at `time_ns` and `azimuth_cdeg` and turns at 10 Hz, with ranges that every format holds.
pub fn example(model: &Model, time_ns: i64, azimuth_cdeg: f64) -> Decoded {
    let rate = 36_000.0 / 1e8;
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let columns: Vec<_> = (0..columns_per_packet(model))
        .map(|c| Column {
            time_ns: time_ns + (c as f64 * model.column_period_ns).round() as i64,
            azimuth_cdeg: ((azimuth_cdeg + c as f64 * model.column_period_ns * rate) % 36_000.0) as f32,
            azimuth_rate_cdeg_per_ns: rate as f32,
        })
        .collect();
    let returns = columns.len() * model.beams.len();
    let range_m = (0..returns).map(|_| random.random_range(1..=16_000_u16) as f32 * 0.008).collect();
    let reflectivity = (0..returns).map(|_| random.random()).collect();
    (columns, range_m, reflectivity)
}

/// The packet of an example.
pub fn encoded(model: &Model, (columns, range_m, reflectivity): &Decoded, received_ns: i64) -> Packet {
    encode(model, columns, range_m, reflectivity, received_ns)
}

fn models() -> impl Iterator<Item = Model> {
    sensor_models().filter(|name| *name != "points").map(|name| Model::by_name(name).unwrap())
}

#[test]
fn what_is_encoded_is_decoded() {
    for model in models() {
        // A multiple of what any column spans, at an azimuth where every model has a column.
        let sent = example(&model, 7_200_000_123_000, 35_437.5);
        let packet = encoded(&model, &sent, 7_200_000_900_000);
        assert_eq!(packet.payload.len(), model.packet_bytes());
        let mut health = Health::default();
        let got = decode_all(&model, &packet, &mut health);
        assert!(health.is_clean(), "{model:?}");
        assert!(got.1.iter().zip(&sent.1).all(|(got, sent)| (got - sent).abs() < 1e-5), "{model:?}");
        assert_eq!(got.2, sent.2);
        assert_eq!(got.0.len(), sent.0.len());
        for (got, sent) in got.0.iter().zip(&sent.0) {
            assert_eq!(got.time_ns, sent.time_ns, "{model:?}");
            let off = (got.azimuth_cdeg - sent.azimuth_cdeg + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
            assert!(off.abs() <= 0.6, "{model:?}: azimuth off by {off} hundredths of a degree");
            assert!((got.azimuth_rate_cdeg_per_ns / sent.azimuth_rate_cdeg_per_ns - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn encoding_again_gives_the_same_bytes() {
    for model in models() {
        let packet = encoded(&model, &example(&model, 5_000_000, 17_991.0), 0);
        let again = encoded(&model, &decode_all(&model, &packet, &mut Health::default()), 0);
        assert_eq!(packet, again, "{model:?}");
    }
}

/// The property of the fuzz target `decode`, over seeded random and mutated packets.
#[test]
fn any_bytes_give_finite_columns_or_a_count() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for model in models() {
        let whole = encoded(&model, &example(&model, 1_000_000, 0.0), 0);
        for round in 0..3000 {
            let mut packet =
                Packet { time_ns: random.random::<i64>() >> random.random_range(0..64), payload: Vec::new() };
            if round % 4 == 0 {
                packet.payload.resize(random.random_range(0..3000), 0);
                random.fill_bytes(&mut packet.payload);
            } else {
                packet.payload.clone_from(&whole.payload);
                for _ in 0..random.random_range(1..20) {
                    // As often among the first bytes, where most of the words are that are no ranges.
                    let until = if random.random() { 64 } else { packet.payload.len() };
                    let i = random.random_range(0..until);
                    packet.payload[i] = random.random();
                }
            }
            let mut health = Health::default();
            let (columns, range_m, _) = decode_all(&model, &packet, &mut health);
            assert!(columns.is_empty() || health.is_clean());
            assert!(columns.iter().all(|c| (0.0..=36_000.0).contains(&c.azimuth_cdeg)));
            assert!(columns.iter().all(|c| (0.0..1.0).contains(&c.azimuth_rate_cdeg_per_ns)));
            assert!(columns.is_sorted_by(|a, b| a.time_ns < b.time_ns));
            assert!(range_m.iter().all(|r| (0.0..=1050.0).contains(r)));
        }
    }
}
