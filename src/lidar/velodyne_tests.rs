//! Tests of Velodyne packets; those of all models stand in `packet_tests.rs`.

use super::*;
use crate::Health;
use crate::lidar::Packet;
use crate::lidar::packet::encode;
use crate::lidar::packet::tests::{Decoded, decode_all, encoded, example};

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

#[test]
fn a_position_packet_is_passed_over() {
    let packet = Packet { time_ns: 0, payload: vec![0x55; POSITION_BYTES] };
    let mut health = Health::default();
    let got: Decoded = decode_all(&Model::vlp_16(), &packet, &mut health);
    assert!(got.0.is_empty() && health.is_clean());
}

#[test]
fn offsets_follow_from_one_length_in_each_model() {
    for (model, arm_m) in [(Model::hdl_32e(), 0.028_97), (Model::vlp_16(), 0.041_91)] {
        for beam in model.beams.iter() {
            let expected_m = -arm_m * beam.elevation_rad.tan();
            assert!((beam.origin_m.z - expected_m).abs() < 2e-5, "{} {beam:?}", model.name);
        }
    }
}
