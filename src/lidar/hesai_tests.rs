//! Tests of the XT32's packets.

use super::*;

#[test]
fn a_date_is_the_seconds_it_came_from() {
    for (seconds, date) in [
        (0, [70, 1, 1, 0, 0, 0]),
        (951_782_400, [100, 2, 29, 0, 0, 0]),
        (1_673_400_677, [123, 1, 11, 1, 31, 17]),
        (4_107_542_399, [200, 2, 28, 23, 59, 59]),
    ] {
        assert_eq!((date_of(seconds), seconds_of(date)), (date, Some(seconds)));
    }
    for day in (-25_000..60_000).step_by(13) {
        let seconds = day * DAY_S + 12_345;
        assert_eq!(seconds_of(date_of(seconds)), Some(seconds), "{:?}", date_of(seconds));
    }
    for wrong in [[70, 0, 1, 0, 0, 0], [70, 13, 1, 0, 0, 0], [70, 1, 0, 0, 0, 0], [70, 1, 1, 24, 0, 0]] {
        assert_eq!(seconds_of(wrong), None);
    }
}

#[test]
fn an_angle_file_gives_the_channels_their_angles_and_a_broken_one_a_line() {
    let lines =
        |n: usize| (1..=n).map(|c| format!("{c},{:.3},-0.{c:03}\r\n", 16.25 - c as f64)).collect::<String>();
    let read = angles(&format!("Channel,Elevation,Azimuth\r\n{}\n", lines(32))).unwrap();
    assert_eq!((read.len(), read[0], read[31]), (32, (15.25, -0.001), (-15.75, -0.032)));
    assert_eq!(angles(&lines(32)).unwrap(), read, "without titles");
    let message = |text: &str| angles(text).unwrap_err().to_string();
    assert_eq!(message("Channel,Elevation,Azimuth\n"), "expected an angle file of 32 channels, found 0");
    assert_eq!(message(&lines(31)), "expected an angle file of 32 channels, found 31");
    assert!(message(&lines(33)).starts_with("line 33: expected channel 33 of 32"));
    assert!(message("1,15.0,0.1\n3,13.0,0.1").starts_with("line 2: expected channel 2 of 32"));
    assert!(message("1,95.0,0.1").contains("found \"1,95.0,0.1\""));
    assert!(message("1,nan,0.1").starts_with("line 1: expected"));
}

#[test]
fn of_two_returns_the_more_reflecting_is_given_four_firings_a_packet() {
    let model = Model::by_name("xt32").unwrap();
    let column = |c: i64| Column {
        time_ns: 1_673_400_677_000_000_000 + c * FIRING_NS,
        azimuth_cdeg: (100 + c / 2 * 18) as f32,
        azimuth_rate_cdeg_per_ns: 3.6e-4,
    };
    let columns: Vec<Column> = (0..8).map(column).collect();
    let cells = |even: (f32, u8), odd: (f32, u8)| [[even; 32], [odd; 32]].concat();
    let pairs = [
        cells((4.0, 3), (8.0, 9)),
        cells((4.0, 9), (8.0, 3)),
        cells((4.0, 7), (8.0, 7)),
        cells((0.0, 0), (8.0, 0)),
    ];
    let (range_m, reflectivity): (Vec<f32>, Vec<u8>) = pairs.concat().into_iter().unzip();
    let mut payload = Xt32.encode(&model, &columns, &range_m, &reflectivity);
    payload[TAIL_AT + 10] = 0x39;
    let mut found = Vec::new();
    let mut sink = |column: Column, range_m: &[f32], _: &[u8]| found.push((column.time_ns, range_m[5]));
    Xt32.decode(&model, 0, &payload, &mut sink).unwrap();
    let (times, ranges): (Vec<i64>, Vec<f32>) = found.into_iter().unzip();
    assert_eq!(ranges, [8.0, 4.0, 8.0, 8.0]);
    // The last of four firings ends where the last of eight does.
    let last_ns = columns[7].time_ns;
    assert_eq!(times, [3, 2, 1, 0].map(|before| last_ns - before * FIRING_NS));
}

#[test]
fn the_last_firing_comes_with_the_packet_s_time() {
    let model = Model::by_name("xt32").unwrap();
    let column = Column { time_ns: 0, azimuth_cdeg: 0.0, azimuth_rate_cdeg_per_ns: 3.6e-4 };
    let mut payload = Xt32.encode(&model, &[column], &[1.0; 32], &[1; 32]);
    payload[TAIL_AT + 13..TAIL_AT + 19].copy_from_slice(&[123, 1, 11, 1, 31, 17]);
    payload[TAIL_AT + 19..TAIL_AT + 23].copy_from_slice(&250_000_u32.to_le_bytes());
    payload.truncate(TAIL_AT + TAIL_BYTES);
    let mut times = Vec::new();
    let mut sink = |column: Column, _: &[f32], _: &[u8]| times.push(column.time_ns);
    Xt32.decode(&model, 0, &payload, &mut sink).expect("old firmware numbers no packets");
    assert_eq!((times.len(), times[7]), (8, 1_673_400_677_250_006_000));
}
