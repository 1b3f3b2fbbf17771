//! Tests of the packet codec.

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

type Decoded = (Vec<Column>, Vec<f32>, Vec<u8>);

fn decode_all(model: &Model, packet: &Packet, health: &mut Health) -> Decoded {
    let mut all = (Vec::new(), Vec::new(), Vec::new());
    decode(model, packet, health, |column, range_m, reflectivity| {
        all.0.push(column);
        all.1.extend_from_slice(range_m);
        all.2.extend_from_slice(reflectivity);
    });
    all
}

/// A full packet that starts at `time_ns` and `azimuth_cdeg` and turns at 10 Hz, with ranges of whole units.
fn example(model: &Model, time_ns: i64, azimuth_cdeg: f64) -> Decoded {
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
    let range_m = (0..returns).map(|_| f32::from(random.random_range(1..=u16::MAX)) * RANGE_UNIT_M).collect();
    let reflectivity = (0..returns).map(|_| random.random()).collect();
    (columns, range_m, reflectivity)
}

fn encoded(model: &Model, (columns, range_m, reflectivity): &Decoded, received_ns: i64) -> Packet {
    encode(model, columns, range_m, reflectivity, received_ns)
}

#[test]
fn what_is_encoded_is_decoded() {
    for model in [Model::hdl_32e(), Model::vlp_16()] {
        let sent = example(&model, 7_200_000_123_000, 35_950.0);
        let packet = encoded(&model, &sent, 7_200_000_900_000);
        assert_eq!(packet.payload.len(), PAYLOAD_BYTES);
        let mut health = Health::default();
        let got = decode_all(&model, &packet, &mut health);
        assert!(health.is_clean());
        assert_eq!((&got.1, &got.2), (&sent.1, &sent.2));
        assert_eq!(got.0.len(), sent.0.len());
        for (got, sent) in got.0.iter().zip(&sent.0) {
            assert_eq!(got.time_ns, sent.time_ns);
            let off = (got.azimuth_cdeg - sent.azimuth_cdeg + 18_000.0).rem_euclid(36_000.0) - 18_000.0;
            assert!(off.abs() <= 0.6, "azimuth off by {off} hundredths of a degree");
            assert!((got.azimuth_rate_cdeg_per_ns / sent.azimuth_rate_cdeg_per_ns - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn encoding_again_gives_the_same_bytes() {
    for model in [Model::hdl_32e(), Model::vlp_16()] {
        let packet = encoded(&model, &example(&model, 5_000_000, 17_991.0), 0);
        let again = encoded(&model, &decode_all(&model, &packet, &mut Health::default()), 0);
        assert_eq!(packet, again);
    }
}

#[test]
fn fewer_columns_are_filled_up_without_returns() {
    let model = Model::vlp_16();
    let (columns, range_m, reflectivity) = example(&model, 0, 100.0);
    let packet = encode(&model, &columns[..5], &range_m[..80], &reflectivity[..80], 0);
    let got = decode_all(&model, &packet, &mut Health::default());
    assert_eq!(got.0.len(), 24);
    assert_eq!(got.1[..80], range_m[..80]);
    assert!(got.1[80..].iter().all(|&range_m| range_m == 0.0));
    assert!((got.0[23].azimuth_cdeg - columns[23].azimuth_cdeg).abs() <= 1.0);
}

#[test]
fn a_range_that_the_format_cannot_hold_is_no_return() {
    let model = Model::hdl_32e();
    let (columns, _, _) = example(&model, 0, 0.0);
    let mut range_m = vec![5.0; 32];
    range_m[..4].copy_from_slice(&[f32::NAN, -1.0, 131.08, f32::INFINITY]);
    let packet = encode(&model, &columns[..1], &range_m, &[9; 32], 0);
    let got = decode_all(&model, &packet, &mut Health::default());
    assert_eq!(got.1[..5], [0.0, 0.0, 0.0, 0.0, 5.0]);
}

#[test]
fn the_hour_is_the_one_nearest_to_reception() {
    let model = Model::hdl_32e();
    let first_time_ns = |sent_ns, received_ns| {
        let packet = encoded(&model, &example(&model, sent_ns, 0.0), received_ns);
        decode_all(&model, &packet, &mut Health::default()).0[0].time_ns
    };
    let hour = 474_000 * HOUR_NS;
    assert_eq!(
        first_time_ns(hour - 1000, hour + 500_000),
        hour - 1000,
        "sent before, received after the hour"
    );
    assert_eq!(first_time_ns(hour + 1000, hour - 500_000), hour + 1000, "a host clock that is late");
    assert_eq!(first_time_ns(1000, -5), 1000);
}

#[test]
fn of_two_returns_the_more_reflecting_is_given() {
    let model = Model::hdl_32e();
    let (columns, ..) = example(&model, 0, 0.0);
    let pairs: Vec<_> = (0..12).map(|c| columns[c / 2]).collect();
    // Beam by beam: the odd block's is stronger, the even block's, both are the same, there is but one.
    let even = [(20.0, 5), (20.0, 9), (10.0, 7), (10.0, 7)];
    let odd = [(10.0, 8), (10.0, 3), (10.0, 7), (0.0, 0)];
    let block = |values: [(f32, u8); 4]| values.repeat(8);
    let returns = [block(even), block(odd)].concat().repeat(6);
    let (range_m, reflectivity): (Vec<_>, Vec<_>) = returns.into_iter().unzip();
    let mut packet = encode(&model, &pairs, &range_m, &reflectivity, 0);
    packet.payload[1204] = DUAL;
    let mut health = Health::default();
    let got = decode_all(&model, &packet, &mut health);
    assert!(health.is_clean());
    assert_eq!((got.0.len(), got.0[5].time_ns), (6, 5 * 46_080));
    assert_eq!((&got.1[..4], &got.2[..4]), (&[10.0, 20.0, 10.0, 10.0][..], &[8, 9, 7, 7][..]));
    assert!((got.0[0].azimuth_rate_cdeg_per_ns / columns[0].azimuth_rate_cdeg_per_ns - 1.0).abs() < 0.02);
}

#[test]
fn what_is_not_understood_is_counted() {
    let model = Model::hdl_32e();
    let packet = encoded(&model, &example(&model, 0, 0.0), 0);
    let broken = |change: fn(&mut Packet)| {
        let mut packet = packet.clone();
        change(&mut packet);
        let mut health = Health::default();
        assert!(decode_all(&model, &packet, &mut health).0.is_empty());
        (health.packets_wrong_size, health.packets_not_understood)
    };
    assert_eq!(broken(|p| p.payload.truncate(1205)), (1, 0), "a cut payload");
    assert_eq!(broken(|p| p.payload.push(0)), (1, 0), "a long payload");
    assert_eq!(broken(|p| p.payload[300] = 0xdd), (0, 1), "a block's flag");
    assert_eq!(broken(|p| p.payload[403] = 0xff), (0, 1), "an azimuth of more than a turn");
    assert_eq!(broken(|p| p.payload[1203] = 0xff), (0, 1), "a time past the hour");
    assert_eq!(broken(|p| p.payload[1204] = 0x36), (0, 1), "a return mode");
    assert_eq!(broken(|p| p.payload[1204] = DUAL), (0, 1), "two returns with azimuths that differ");
    assert_eq!(broken(|p| p.payload[1205] = 0x22), (0, 1), "another sensor");
    assert_eq!(broken(|p| p.time_ns = i64::MIN), (0, 1), "a time of reception out of this world");
}

/// The property of the fuzz target `decode`, over seeded random and mutated packets.
#[test]
fn any_bytes_give_finite_columns_or_a_count() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    for model in [Model::hdl_32e(), Model::vlp_16()] {
        let whole = encoded(&model, &example(&model, 1_000_000, 0.0), 0);
        for round in 0..20_000 {
            let mut packet =
                Packet { time_ns: random.random::<i64>() >> random.random_range(0..64), payload: Vec::new() };
            if round % 4 == 0 {
                packet.payload.resize(random.random_range(0..3000), 0);
                random.fill_bytes(&mut packet.payload);
            } else {
                packet.payload.clone_from(&whole.payload);
                for _ in 0..random.random_range(1..20) {
                    let i = random.random_range(0..PAYLOAD_BYTES);
                    packet.payload[i] = random.random();
                }
            }
            let mut health = Health::default();
            let (columns, range_m, _) = decode_all(&model, &packet, &mut health);
            assert_eq!(columns.is_empty(), !health.is_clean());
            assert!(columns.iter().all(|c| (0.0..=36_000.0).contains(&c.azimuth_cdeg)));
            assert!(columns.iter().all(|c| (0.0..1.0).contains(&c.azimuth_rate_cdeg_per_ns)));
            assert!(columns.is_sorted_by_key(|c| c.time_ns));
            assert!(range_m.iter().all(|r| (0.0..=131.07).contains(r)));
        }
    }
}
