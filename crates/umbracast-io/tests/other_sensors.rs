//! Captures of an Ouster and recordings of an XT32, point by point as other decoders have them: the manufacturer's
//! library (`ouster-sdk` 1.0.1) and tier4/nebula. The data lie where UMBRACAST_DATA points.

mod bag;
#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use std::collections::HashMap;

use umbracast::geometry::DVec3;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Assembler, Cloud, Model, Packet, RangeImage, udp_port};
use umbracast::site::{Sensor, Site};
use umbracast::{Config, Health};
use umbracast_io::cdr::Decoder;
use umbracast_io::pcap::PcapReader;
use umbracast_io::pcd::read_pcd;

use bag::sqlite_blobs;
use real_data::real_data;

fn site(model: &str, calibration: String) -> Site {
    let mut site = Config::default().site;
    site.sensors.truncate(1);
    let sensor = &mut site.sensors[0];
    (sensor.model, sensor.calibration) = (model.to_owned(), Some(calibration));
    (sensor.range_min_m, sensor.range_max_m) = (0.0, 300.0);
    site
}

fn decoded(sensor: &Sensor, packets: &[Packet]) -> RangeImage {
    let model = Model::of_sensor(sensor).unwrap();
    let beams = model.beams.clone();
    let mut image = RangeImage { beams, columns: Vec::new(), range_m: Vec::new(), reflectivity: Vec::new() };
    let mut health = Health::default();
    for packet in packets {
        decode(&model, packet, &mut health, |column, range_m, reflectivity| {
            image.columns.push(column);
            image.range_m.extend_from_slice(range_m);
            image.reflectivity.extend_from_slice(reflectivity);
        });
    }
    assert!(health.is_clean(), "{health:?}");
    image
}

/// The columns that came out of the assembler.
fn assembled(site: &Site, packets: &[Packet]) -> usize {
    let (mut assembler, mut health) = (Assembler::new(site).unwrap(), Health::default());
    packets.iter().for_each(|packet| assembler.push(0, packet, &mut health));
    assembler.finish();
    assert!(health.is_clean(), "{health:?}");
    let scans = std::iter::from_fn(|| assembler.pop()).flat_map(|frame| frame.scans);
    let columns = scans.map(|scan| match scan.cloud {
        Cloud::Organised(image) => image.columns.len(),
        Cloud::Unorganised(_) => 0,
    });
    columns.sum()
}

#[test]
fn ouster_captures_point_by_point() {
    for (name, model, packet_count, columns_of_first, points_of_first) in [
        ("OS-0-128-U1_v2.3.0_1024x10", "os0-128", 64, 1024, 97_299),
        ("OS-1-128_767798045_1024x10_20230712_120049", "os1-128", 8, 128, 16_373),
    ] {
        let Some(capture) = real_data(&format!("ouster/{name}.pcap")) else { return };
        let file = |ending: &str| {
            std::fs::read_to_string(capture.with_file_name(format!("{name}{ending}"))).unwrap()
        };
        let site = site(model, file(".json"));
        let sensor = &site.sensors[0];
        let bytes = std::fs::read(&capture).unwrap();
        let all: Vec<_> = PcapReader::new(bytes.as_slice(), name).unwrap().collect();
        let of_port = all.iter().filter(|datagram| Some(datagram.port) == udp_port(sensor));
        let packets: Vec<Packet> =
            of_port.map(|d| Packet { time_ns: d.time_ns, payload: d.payload.clone() }).collect();
        assert_eq!(packets.len(), packet_count);
        let image = decoded(sensor, &packets);
        let beams = image.beams.len();
        assert_eq!(assembled(&site, &packets), image.columns.len());
        // The capture is one scan.
        assert_eq!(image.columns.len(), columns_of_first);
        assert_eq!(image.range_m.iter().filter(|&&range_m| range_m > 0.0).count(), points_of_first);

        let by_time: HashMap<i64, usize> =
            image.columns.iter().enumerate().map(|(c, column)| (column.time_ns, c)).collect();
        let (mut rows, mut farthest_m) = (0, 0.0_f64);
        for line in file("_points.csv").lines().skip(1) {
            let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
            let time_ns: i64 = line.split(',').nth(3).unwrap().parse().unwrap();
            let (row, number) = (values[1] as usize, values[2]);
            let c = by_time[&time_ns];
            // Columns count from behind.
            let azimuth_cdeg = (18_000.0 + number * 36_000.0 / 1024.0) % 36_000.0;
            assert_eq!(f64::from(image.columns[c].azimuth_cdeg), azimuth_cdeg, "{name}: {line}");
            assert_eq!(usize::from(image.beams[row].ring), beams - 1 - row, "rows come from above");
            let range_m = f64::from(image.range_m[c * beams + row]);
            assert!((range_m - values[4] * 1e-3).abs() < 1e-5, "{name}: {range_m} m, {line}");
            let off_m = (image.point_m(c, row, range_m) - DVec3::from_slice(&values[5..8])).length();
            farthest_m = farthest_m.max(off_m);
            rows += 1;
        }
        assert_eq!(rows, 3000);
        // The answer is given in whole micrometres, and 100 m as f32 are off by up to 4.
        assert!(farthest_m < 1e-5, "{name}: {farthest_m} m from the answer");
    }
}

/// Packets of `pandar_msgs/PandarScan`: a stamp, 1500 bytes and how many of them count.
fn pandar_packets(message: &[u8]) -> Option<Vec<Packet>> {
    let mut d = Decoder::new(message)?;
    d.time()?;
    d.string()?;
    let count = d.u32()?;
    let packet = |_| {
        let (time_ns, data, size) = (d.time()?, d.array(1500)?, d.u32()?);
        Some(Packet { time_ns, payload: data.get(..size as usize)?.to_vec() })
    };
    (0..count).map(packet).collect()
}

#[test]
fn xt32_point_by_point() {
    let Some(folder) = real_data("hesai_xt32") else { return };
    let bag = std::fs::read(folder.join("1673400677802009732_0.db3")).unwrap();
    let site = site("xt32", std::fs::read_to_string(folder.join("PandarXT32.csv")).unwrap());
    let sensor = &site.sensors[0];
    let messages = sqlite_blobs(&bag, "messages");
    let packets: Vec<Packet> = messages.iter().flat_map(|m| pandar_packets(m).expect("a scan")).collect();
    assert_eq!((messages.len(), packets.len()), (4, 2000));

    // Each firing comes twice: its last return and its strongest. The other decoder gives both, but one of two that are
    // the same. Told that there is one return a firing, ours gives every block.
    const RETURN_MODE_AT: usize = 1062;
    assert!(packets.iter().all(|packet| packet.payload[RETURN_MODE_AT] == 0x39));
    let single = packets.iter().cloned().map(|mut packet| {
        packet.payload[RETURN_MODE_AT] = 0x37;
        packet
    });
    let every = decoded(sensor, &single.collect::<Vec<_>>());
    let stronger = decoded(sensor, &packets);
    assert_eq!((every.columns.len(), stronger.columns.len()), (16_000, 8000));
    assert_eq!(assembled(&site, &packets), 8000);

    // The other decoder's scan begins and ends where a beam, with its offset, looks along azimuth 0: in the fourth
    // revolution from the first. A few points of the columns beside that azimuth are the neighbouring scan's.
    let mut ours = Vec::new();
    let mut revolution = 0;
    for firing in 0..8000 {
        let azimuth_cdeg = f64::from(every.columns[2 * firing].azimuth_cdeg);
        revolution +=
            usize::from(firing > 0 && azimuth_cdeg < f64::from(every.columns[2 * firing - 1].azimuth_cdeg));
        for b in 0..32 {
            let looks_cdeg = azimuth_cdeg + f64::from(every.beams[b].azimuth_offset_cdeg);
            let scan = revolution as f64 + (looks_cdeg / 36_000.0).floor();
            let pair = [2 * firing, 2 * firing + 1].map(|c| (c, every.range_m[c * 32 + b]));
            let same = pair[0].1 == pair[1].1;
            for (c, range_m) in pair.into_iter().skip(usize::from(same)).filter(|(_, range_m)| *range_m > 0.0)
            {
                if scan == 3.0 {
                    ours.push((every.point_m(c, b, f64::from(range_m)), b));
                }
            }
            // Of the two the more reflecting is kept.
            let kept = stronger.range_m[firing * 32 + b];
            let brightest = pair.map(|(c, range_m)| (range_m > 0.0, every.reflectivity[c * 32 + b]));
            let expected = if brightest[0] > brightest[1] { pair[0].1 } else { pair[1].1 };
            assert_eq!(kept, expected);
        }
    }
    let answer = read_pcd(&std::fs::read(folder.join("1673400678101968885.pcd")).unwrap(), "answer").unwrap();
    let field = |name: &str| &answer.field(name).unwrap().values;
    // Its x axis points to the right of azimuth 0, its y axis along it.
    let theirs: Vec<DVec3> = (0..answer.width * answer.height)
        .map(|p| DVec3::new(field("y")[p], -field("x")[p], field("z")[p]))
        .collect();
    assert_eq!((ours.len(), theirs.len()), (63_021, 63_021));

    // One of ours for each of theirs, and no other within a millimetre that is nearer.
    let cell = |p: DVec3| (p * 100.0).floor().as_ivec3();
    let mut cells: HashMap<_, Vec<usize>> = HashMap::new();
    for (i, (point_m, _)) in ours.iter().enumerate() {
        cells.entry(cell(*point_m)).or_default().push(i);
    }
    let (mut taken, mut farthest_m) = (vec![false; ours.len()], 0.0_f64);
    for &point_m in &theirs {
        let around = (0..27).map(|k| cell(point_m) + glam::IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
        let near = around.filter_map(|cell| cells.get(&cell)).flatten().filter(|&&i| !taken[i]);
        let nearest = near.min_by(|&&a, &&b| {
            (ours[a].0 - point_m).length_squared().total_cmp(&(ours[b].0 - point_m).length_squared())
        });
        let &nearest = nearest.unwrap_or_else(|| panic!("no point of ours near {point_m}"));
        taken[nearest] = true;
        farthest_m = farthest_m.max((ours[nearest].0 - point_m).length());
    }
    assert!(taken.iter().all(|&taken| taken));
    assert!(farthest_m < 1e-5, "{farthest_m} m from the answer");
}
