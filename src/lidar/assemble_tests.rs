//! Tests of the assembler: two sensors that turn in step, with one thing wrong in each test.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::Config;
use crate::lidar::packet::{columns_per_packet, encode};
use crate::site::TimeSource;

const MS: i64 = 1_000_000;

/// Packets of one HDL-32E from `start_ns` on, for `length_ns`, all ranges 5 m, received 1 ms after.
fn packets(start_ns: i64, length_ns: i64) -> Vec<Packet> {
    packets_of(&Model::hdl_32e(), start_ns, length_ns)
}

/// The same of any model.
fn packets_of(model: &Model, start_ns: i64, length_ns: i64) -> Vec<Packet> {
    let per_packet = columns_per_packet(model);
    let count = (length_ns as f64 / (per_packet as f64 * model.column_period_ns)) as usize;
    (0..count)
        .map(|p| {
            let columns: Vec<_> = (p * per_packet..(p + 1) * per_packet)
                .map(|c| {
                    let after_ns = c as f64 * model.column_period_ns;
                    Column {
                        time_ns: start_ns + after_ns.round() as i64,
                        azimuth_cdeg: (after_ns * 36_000.0 / 1e8 % 36_000.0) as f32,
                        azimuth_rate_cdeg_per_ns: 36_000.0 / 1e8,
                    }
                })
                .collect();
            let returns = per_packet * model.beams.len();
            encode(model, &columns, &vec![5.0; returns], &vec![7; returns], columns[0].time_ns + MS)
        })
        .collect()
}

/// The packets of both sensors in turn.
fn both(east: Vec<Packet>, west: Vec<Packet>) -> Vec<(usize, Packet)> {
    let mut all: Vec<_> = east.into_iter().map(|p| (0, p)).chain(west.into_iter().map(|p| (1, p))).collect();
    all.sort_by_key(|(_, packet)| packet.time_ns);
    all
}

fn assemble(packets: &[(usize, Packet)]) -> (Vec<Frame>, Health) {
    assemble_by(TimeSource::Sensor, packets)
}

/// The same with another clock of both sensors.
fn assemble_by(time: TimeSource, packets: &[(usize, Packet)]) -> (Vec<Frame>, Health) {
    let mut site = Config::default().site;
    site.sensors.iter_mut().for_each(|sensor| sensor.time = time);
    let mut assembler = Assembler::new(&site).unwrap();
    let mut health = Health::default();
    let mut frames = Vec::new();
    for (sensor, packet) in packets {
        assembler.push(*sensor, packet, &mut health);
        frames.extend(std::iter::from_fn(|| assembler.pop()));
        assert!(assembler.open.len() <= 3, "memory must not grow");
    }
    assembler.finish();
    frames.extend(std::iter::from_fn(|| assembler.pop()));
    (frames, health)
}

fn columns_of(frame: &Frame) -> Vec<(usize, usize)> {
    let columns = |scan: &Scan| match &scan.cloud {
        Cloud::Organised(image) => {
            assert_eq!(image.range_m.len(), image.columns.len() * image.beams.len());
            assert_eq!(image.reflectivity.len(), image.range_m.len());
            assert!(image.columns.is_sorted_by_key(|c| c.time_ns));
            image.columns.len()
        }
        Cloud::Unorganised(_) => panic!("packets give organised clouds"),
    };
    frame.scans.iter().map(|scan| (scan.sensor, columns(scan))).collect()
}

fn assert_whole(frame: &Frame) {
    let columns = columns_of(frame);
    assert_eq!(columns.iter().map(|c| c.0).collect::<Vec<_>>(), [0, 1], "frame {}", frame.index);
    assert!(columns.iter().all(|c| (2169..=2171).contains(&c.1)), "frame {}: {columns:?}", frame.index);
}

#[test]
fn frames_cover_whole_tenths_of_a_second_in_order() {
    let (frames, health) = assemble(&both(packets(0, 1000 * MS), packets(0, 1000 * MS)));
    assert!(health.is_clean(), "{health:?}");
    assert_eq!(frames.len(), 10);
    for (k, frame) in frames.iter().enumerate() {
        assert_eq!((frame.index, frame.time_ns), (k as u64, (k as i64 + 1) * STEP_NS));
        if k < 9 {
            assert_whole(frame);
        }
        for scan in &frame.scans {
            let Cloud::Organised(image) = &scan.cloud else { panic!() };
            let inside = frame.time_ns - STEP_NS..frame.time_ns;
            assert!(image.columns.iter().all(|c| inside.contains(&c.time_ns)));
        }
    }
}

#[test]
fn a_capture_counts_from_the_tenth_of_a_second_it_starts_in() {
    let start_ns = 1_700_000_000_030 * MS;
    let (frames, _) = assemble(&both(packets(start_ns, 200 * MS), packets(start_ns, 200 * MS)));
    assert_eq!((frames[0].index, frames[0].time_ns), (0, 1_700_000_000_100 * MS));
    assert_whole(&frames[1]);
}

#[test]
fn a_frame_closes_as_soon_as_every_sensor_is_past_its_end() {
    let mut assembler = Assembler::new(&Config::default().site).unwrap();
    let mut health = Health::default();
    let closed_at_ns =
        both(packets(0, 300 * MS), packets(0, 300 * MS)).iter().find_map(|(sensor, packet)| {
            assembler.push(*sensor, packet, &mut health);
            assembler.pop().map(|_| packet.time_ns - MS)
        });
    let closed_at_ns = closed_at_ns.unwrap();
    assert!((99 * MS..101 * MS).contains(&closed_at_ns), "{closed_at_ns}");
}

/// For each frame of a single sensor, whether a packet with some of it closed it; and what was counted.
fn closed_by_their_own(packets: &[Packet]) -> (Vec<bool>, Health) {
    let mut site = Config::default().site;
    site.sensors.truncate(1);
    let (mut assembler, mut health) = (Assembler::new(&site).unwrap(), Health::default());
    let mut own = Vec::new();
    for packet in packets {
        assembler.push(0, packet, &mut health);
        own.extend(assembler.pop().map(|_| assembler.closed_by_its_own()));
    }
    (own, health)
}

#[test]
fn a_whole_frame_waits_for_no_packet_of_the_next() {
    let (own, health) = closed_by_their_own(&packets(0, 3000 * MS));
    assert!(own.len() > 28 && own.iter().all(|own| *own), "{own:?}");
    assert!(health.is_clean(), "{health:?}");
}

#[test]
fn a_frame_whose_last_packet_is_lost_closes_with_the_next_one() {
    let mut packets = packets(0, 300 * MS);
    packets.retain(|p| !(99 * MS..101 * MS).contains(&p.time_ns));
    let (own, health) = closed_by_their_own(&packets);
    assert_eq!(own, [false, true], "{health:?}");
}

#[test]
fn a_lost_sensor_delays_one_frame_is_counted_and_comes_back() {
    let mut west = packets(0, 1000 * MS);
    west.retain(|p| !(300 * MS..600 * MS).contains(&p.time_ns));
    let all = both(packets(0, 1000 * MS), west);
    let (frames, health) = assemble(&all);
    assert_eq!(frames.len(), 10);
    assert_eq!(columns_of(&frames[4]).len(), 1);
    assert_whole(&frames[7]);
    assert_eq!(health.sensors_missing, 2, "{health:?}");

    // Once known as lost it is not waited for.
    let mut assembler = Assembler::new(&Config::default().site).unwrap();
    for (sensor, packet) in all.iter().take_while(|(_, p)| p.time_ns < 510 * MS) {
        assembler.push(*sensor, packet, &mut Health::default());
    }
    let last = std::iter::from_fn(|| assembler.pop()).last().unwrap();
    assert_eq!(last.index, 4);
}

#[test]
fn packets_that_overtake_one_another_are_put_in_order() {
    let in_order = both(packets(0, 400 * MS), packets(0, 400 * MS));
    let mut shuffled = in_order.clone();
    // Not at the end of a frame: it closes with the first packet past it.
    for few in
        shuffled.chunks_exact_mut(4).filter(|p| (5 * MS..95 * MS).contains(&(p[0].1.time_ns % STEP_NS)))
    {
        few.reverse();
    }
    let (frames, health) = assemble(&shuffled);
    assert_eq!(health.packets_late, 0);
    assert_eq!(frames, assemble(&in_order).0);
}

#[test]
fn a_packet_of_a_closed_frame_is_late() {
    let mut all = both(packets(0, 400 * MS), packets(0, 400 * MS));
    let packet = all.remove(100);
    all.insert(400, packet);
    let (frames, health) = assemble(&all);
    assert_eq!(health.packets_late, 1, "{health:?}");
    assert_eq!(columns_of(&frames[0]).iter().map(|c| c.1).sum::<usize>(), 2 * 2171 - 12);
}

/// A clock that `calibrate` had found 50 ms ahead once made the first packets late, and the run end with 3.
#[test]
fn what_a_clock_put_right_brings_before_the_first_frame_is_not_late() {
    let mut site = Config::default().site;
    site.sensors[1].clock_offset_ms = 50.0;
    let mut assembler = Assembler::new(&site).unwrap();
    let mut health = Health::default();
    for (sensor, packet) in both(packets(0, 300 * MS), packets(49 * MS, 350 * MS)) {
        assembler.push(sensor, &packet, &mut health);
    }
    assert_eq!(health.packets_late, 0, "{health:?}");
}

#[test]
fn a_packet_that_comes_twice_counts_once() {
    let once = both(packets(0, 300 * MS), packets(0, 300 * MS));
    let twice: Vec<_> = once.iter().flat_map(|p| [p.clone(), p.clone()]).collect();
    let (frames, health) = assemble(&twice);
    assert_eq!(frames, assemble(&once).0);
    assert!(health.packets_duplicate > 1000, "{health:?}");
}

#[test]
fn a_clock_set_back_or_forward_costs_no_frame() {
    for jump_ns in [-10_000 * MS, 25_000 * MS] {
        let mut west = packets(60_000 * MS, 500 * MS);
        let mut after = packets(60_500 * MS + jump_ns, 500 * MS);
        after.iter_mut().for_each(|p| p.time_ns -= jump_ns);
        west.extend(after);
        let (frames, health) = assemble(&both(packets(60_000 * MS, 1000 * MS), west));
        assert_eq!(health.clock_jumps, 1, "{health:?}");
        assert_eq!(frames.len(), 10);
        frames[..9].iter().filter(|f| !(4..=5).contains(&f.index)).for_each(assert_whole);
    }
}

#[test]
fn all_clocks_set_back_leave_time_running_forward() {
    let mut all = both(packets(60_000 * MS, 500 * MS), packets(60_000 * MS, 500 * MS));
    all.extend(both(packets(50_000 * MS, 500 * MS), packets(50_000 * MS, 500 * MS)));
    let (frames, health) = assemble(&all);
    assert_eq!(health.clock_jumps, 2, "{health:?}");
    assert!(frames.is_sorted_by_key(|f| f.time_ns));
    assert!((9..=10).contains(&frames.len()));
    assert_whole(&frames[7]);
}

#[test]
fn one_broken_time_stamp_is_put_right() {
    let mut all = both(packets(0, 300 * MS), packets(0, 300 * MS));
    all[200].1.payload[1202] ^= 0x40;
    let (frames, health) = assemble(&all);
    assert_eq!(health.clock_jumps, 2, "there and back");
    assert_whole(&frames[0]);
}

#[test]
fn the_top_of_the_hour_is_no_jump() {
    let start_ns = 3_600_000 * MS - 250 * MS;
    let (frames, health) = assemble(&both(packets(start_ns, 500 * MS), packets(start_ns, 500 * MS)));
    assert!(health.is_clean(), "{health:?}");
    assert_eq!(frames.len(), 6, "half a frame, four whole ones, half a frame");
    frames[1..4].iter().for_each(assert_whole);
}

#[test]
fn a_silence_of_all_sensors_leaves_out_frames_and_is_counted() {
    let mut all = both(packets(0, 200 * MS), packets(0, 200 * MS));
    all.extend(both(packets(5000 * MS, 200 * MS), packets(5000 * MS, 200 * MS)));
    let (frames, health) = assemble(&all);
    assert_eq!(frames.iter().map(|f| f.index).collect::<Vec<_>>(), [0, 1, 50, 51]);
    assert_eq!((health.clock_jumps, health.sensors_missing), (1, 2 * 48));
}

#[test]
fn a_sensor_without_the_others_time_is_shifted_by_the_time_of_reception() {
    let mut west = packets(1_200_000 * MS, 500 * MS);
    west.iter_mut().for_each(|p| p.time_ns -= 1_200_000 * MS);
    let (frames, health) = assemble(&both(packets(0, 500 * MS), west));
    assert_eq!(health.clock_jumps, 1);
    frames[..4].iter().for_each(assert_whole);
}

/// Received up to this much later than they were sent.
fn delayed(mut packets: Vec<Packet>, most_ns: i64) -> Vec<Packet> {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut last_ns = 0;
    for packet in &mut packets {
        last_ns = (packet.time_ns + rng.random_range(0..most_ns)).max(last_ns);
        packet.time_ns = last_ns;
    }
    packets
}

/// When the first column of each sensor's scan fired.
fn first_columns_ns(frame: &Frame) -> Vec<i64> {
    let first = |scan: &Scan| match &scan.cloud {
        Cloud::Organised(image) => image.columns[0].time_ns,
        Cloud::Unorganised(_) => panic!("packets give organised clouds"),
    };
    frame.scans.iter().map(first).collect()
}

#[test]
fn clocks_that_nobody_set_are_put_right_by_the_time_of_arrival() {
    // West was switched on at another time, and its crystal runs 50 ppm too fast.
    let mut west = packets(1_200_000 * MS, 20_000 * MS);
    for packet in &mut west {
        let after_ns = packet.time_ns - 1_200_000 * MS;
        packet.time_ns = after_ns - after_ns / 20_000;
    }
    let all = both(delayed(packets(0, 20_000 * MS), 3 * MS), delayed(west, 3 * MS));
    let (frames, health) = assemble_by(TimeSource::Arrival, &all);
    assert!(health.is_clean(), "{health:?}");
    // The packets that came soonest show both clocks at the same time: columns of one instant stay together.
    for frame in &frames[20..195] {
        assert_whole(frame);
        let first_ns = first_columns_ns(frame);
        assert!((first_ns[0] - first_ns[1]).abs() < MS, "frame {}: {first_ns:?}", frame.index);
    }
}

#[test]
fn a_host_that_stands_still_makes_no_jump_of_the_time_of_arrival() {
    let mut all = both(packets(0, 3000 * MS), packets(0, 3000 * MS));
    for (_, packet) in all.iter_mut().filter(|(_, p)| (1000 * MS..1300 * MS).contains(&p.time_ns)) {
        packet.time_ns = 1300 * MS;
    }
    let (frames, health) = assemble_by(TimeSource::Arrival, &all);
    assert!(health.is_clean(), "{health:?}");
    frames[1..28].iter().for_each(assert_whole);
}

/// It was taken for a clock that was set: from then on the frames were older than they said, by as much as was lost, and a tracker
/// on another host had no use for them.
#[test]
fn a_host_that_stood_still_for_seconds_goes_on_in_time() {
    // What comes in two seconds finds room to wait, what comes in the third is lost.
    let stood_still = |mut all: Vec<(usize, Packet)>| {
        all.retain(|(_, p)| !(3000 * MS..4000 * MS).contains(&p.time_ns));
        for (_, packet) in all.iter_mut().filter(|(_, p)| (1000 * MS..3000 * MS).contains(&p.time_ns)) {
            packet.time_ns = 4000 * MS;
        }
        all
    };
    for west in [packets(0, 6000 * MS), Vec::new()] {
        let (frames, health) = assemble(&stood_still(both(packets(0, 6000 * MS), west)));
        let indices: Vec<u64> = frames.iter().map(|frame| frame.index).collect();
        assert_eq!((indices.first(), indices.last()), (Some(&0), Some(&59)), "{health:?}");
        assert!((30..40).filter(|index| indices.contains(index)).count() < 3, "{indices:?}");
        assert_eq!(health.clock_jumps, 1, "all time leaps");
    }
}

#[test]
fn sensors_that_share_a_clock_stay_together_when_it_is_set() {
    let of_sensor = |jump_ns: i64| {
        let before = packets(60_000 * MS, 500 * MS);
        let mut after = packets(60_500 * MS + jump_ns, 1000 * MS);
        after.iter_mut().for_each(|packet| packet.time_ns -= jump_ns);
        [before, after].concat()
    };
    let together = |time: TimeSource, jump_ns: i64| {
        let all = both(of_sensor(jump_ns), delayed(of_sensor(jump_ns), 3 * MS));
        let (frames, health) = assemble_by(time, &all);
        assert_eq!(health.clock_jumps, 2, "{health:?}");
        let last_ns = first_columns_ns(&frames[12]);
        last_ns[0] == last_ns[1]
    };
    for jump_ns in [-10_000 * MS, 25_000 * MS] {
        assert!(together(TimeSource::Ptp, jump_ns));
        assert!(!together(TimeSource::Sensor, jump_ns), "each by the time of reception, which differs");
    }
}

#[test]
fn ranges_beyond_the_sensors_limits_are_dropped_and_counted() {
    let model = Model::hdl_32e();
    let column = Column { time_ns: 0, azimuth_cdeg: 0.0, azimuth_rate_cdeg_per_ns: 0.0 };
    let mut range_m = [5.0; 32];
    range_m[..3].copy_from_slice(&[0.4, 60.0, 0.0]);
    let packet = encode(&model, &[column], &range_m, &[1; 32], 0);
    let (frames, health) = assemble(&[(0, packet)]);
    assert_eq!(health.points_invalid, 2);
    let Cloud::Organised(image) = &frames[0].scans[0].cloud else { panic!() };
    assert_eq!(image.range_m[..4], [0.0, 0.0, 0.0, 5.0]);
}

#[test]
fn an_unknown_sensor_is_counted_and_an_unknown_model_refused() {
    let mut site = Config::default().site;
    let mut health = Health::default();
    Assembler::new(&site).unwrap().push(7, &packets(0, MS)[0], &mut health);
    assert_eq!(health.packets_not_understood, 1);
    site.sensors[1].model = "hdl-64".into();
    let message = Assembler::new(&site).unwrap_err().to_string();
    assert!(
        message.starts_with("sensor \"lidar_west\": sensor model: expected one of hdl-32e,"),
        "{message}"
    );
}

/// An Ouster counts nanoseconds since it was switched on, an XT32 tells the date, an HDL-32E the time in the hour.
#[test]
fn sensors_of_several_families_give_frames_whatever_their_clocks_say() {
    let received_ns = 1_700_000_000_000 * MS;
    let (os0, xt32) = (Model::by_name("os0-32").unwrap(), Model::by_name("xt32").unwrap());
    let at = |model: &Model, own_ns: i64| {
        let mut packets = packets_of(model, own_ns, 500 * MS);
        packets.iter_mut().for_each(|packet| packet.time_ns += received_ns - own_ns);
        packets
    };
    for (names, own_ns, jumps) in [
        (["hdl-32e", "os0-32"], [received_ns, 1_462_562 * MS], 1),
        (["os0-32", "hdl-32e"], [1_462_562 * MS, received_ns], 1),
        (["os0-32", "os0-32"], [77 * MS, 99_000 * MS], 1),
        (["xt32", "os0-32"], [received_ns, received_ns], 0),
        (["os0-32", "xt32"], [77 * MS, 946_684_800_000 * MS], 1),
    ] {
        let mut site = Config::default().site;
        let sent = [0, 1].map(|s| {
            site.sensors[s].model = names[s].to_owned();
            match names[s] {
                "os0-32" => at(&os0, own_ns[s]),
                "xt32" => at(&xt32, own_ns[s]),
                _ => at(&Model::hdl_32e(), own_ns[s]),
            }
        });
        let [first, second] = sent;
        let (mut assembler, mut health) = (Assembler::new(&site).unwrap(), Health::default());
        let mut frames = Vec::new();
        for (sensor, packet) in both(first, second) {
            assembler.push(sensor, &packet, &mut health);
            frames.extend(std::iter::from_fn(|| assembler.pop()));
        }
        assert_eq!(health, Health { clock_jumps: jumps, ..Health::default() }, "{names:?}");
        assert!(frames.len() >= 4, "{names:?}: {} frames", frames.len());
        for frame in &frames[1..4] {
            for (sensor, columns) in columns_of(frame) {
                let whole = match names[sensor] {
                    "os0-32" => 1023..=1025,
                    "xt32" => 1999..=2001,
                    _ => 2169..=2171,
                };
                assert!(whole.contains(&columns), "{names:?}: {columns} columns of sensor {sensor}");
            }
            assert_eq!(frame.scans.len(), 2, "{names:?}");
        }
    }
}

/// Time stamps, times of reception and order at random: no panic, frames in order, memory bounded.
#[test]
fn broken_input_is_survived() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let mut all = both(packets(0, 600 * MS), packets(0, 600 * MS));
    for (sensor, packet) in &mut all {
        match random.random_range(0..20) {
            0 => packet.time_ns = random.random::<i64>() >> random.random_range(0..64),
            1 => packet.payload[1200..1204].copy_from_slice(&random.random::<[u8; 4]>()),
            2 => packet.payload[random.random_range(0..1206)] = random.random(),
            3 => *sensor = 2 - *sensor,
            _ => {}
        }
    }
    let (frames, health) = assemble(&all);
    assert!(frames.is_sorted_by(|a, b| a.index < b.index && a.time_ns < b.time_ns));
    assert!(health.clock_jumps > 0);
    let columns: usize = frames.iter().flat_map(columns_of).map(|c| c.1).sum();
    assert!(columns > all.len() * 12 / 2, "{columns} columns of {} packets", all.len());
}
