//! Real captures through the codec and the assembler, against other decoders. The data lie outside the
//! repository, where UMBRACAST_DATA points; without it these tests say that they were skipped.

#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use std::path::PathBuf;

use umbracast::geometry::DVec3;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Assembler, Cloud, Model, Packet, RangeImage};
use umbracast::{Config, Health};
use umbracast_io::pcap::{DATA_PORT, Datagram, PcapReader};
use umbracast_io::pcd::read_pcd;

use real_data::real_data;

fn datagrams(path: &PathBuf) -> Vec<Datagram> {
    let bytes = std::fs::read(path).unwrap();
    let mut reader = PcapReader::new(bytes.as_slice(), "capture").unwrap();
    let all = reader.by_ref().collect();
    assert!(!reader.truncated());
    all
}

fn packets(datagrams: &[Datagram]) -> Vec<Packet> {
    let data = datagrams.iter().filter(|d| d.port == DATA_PORT);
    data.map(|d| Packet { time_ns: d.time_ns, payload: d.payload.clone() }).collect()
}

/// All columns of all packets, one after the other.
fn decoded(model: &Model, packets: &[Packet]) -> RangeImage {
    let mut image = RangeImage {
        beams: model.beams.clone(),
        columns: Vec::new(),
        range_m: Vec::new(),
        reflectivity: Vec::new(),
    };
    let mut health = Health::default();
    for packet in packets {
        decode(model, packet, &mut health, |column, range_m, reflectivity| {
            image.columns.push(column);
            image.range_m.extend_from_slice(range_m);
            image.reflectivity.extend_from_slice(reflectivity);
        });
    }
    assert!(health.is_clean(), "{health:?}");
    image
}

/// Column, beam and point of every return.
fn returns(image: &RangeImage) -> impl Iterator<Item = (usize, usize, DVec3)> {
    let beams = image.beams.len();
    let cells = image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0);
    cells.map(move |(i, &range_m)| {
        let (c, b) = (i / beams, i % beams);
        (c, b, image.point_m(c, b, f64::from(range_m)))
    })
}

fn revolutions(image: &RangeImage) -> f64 {
    let step = |c| (36_000 + image.azimuth_cdeg(c, 0) - image.azimuth_cdeg(c - 1, 0)) % 36_000;
    let turned_cdeg: u64 = (1..image.columns.len()).map(|c| u64::from(step(c))).sum();
    turned_cdeg as f64 / 36_000.0
}

#[test]
fn hdl_32e_ring_by_ring_as_another_decoder() {
    let Some(path) = real_data("hdl32e/hdl32_example.pcap") else { return };
    let datagrams = datagrams(&path);
    let packets = packets(&datagrams);
    assert_eq!((packets.len(), datagrams.iter().filter(|d| d.port == 8308).count()), (876, 100));
    let image = decoded(&Model::hdl_32e(), &packets);
    assert!((revolutions(&image) - 5.68).abs() < 0.01);

    // Where velodyne-decoder cuts: the packets of each of its scans.
    let packets_per_scan = [156, 155, 155, 155, 155, 100];
    let scans: Vec<_> = (0..6).flat_map(|scan| vec![scan; packets_per_scan[scan] * 12]).collect();
    let mut rings = vec![(0_u32, DVec3::ZERO); 6 * 32];
    for (c, b, point_m) in returns(&image) {
        let (points, sum_m) = &mut rings[scans[c] * 32 + usize::from(image.beams[b].ring)];
        *points += 1;
        *sum_m += point_m;
    }
    let points: Vec<u32> = rings.chunks(32).map(|scan| scan.iter().map(|ring| ring.0).sum()).collect();
    assert_eq!(points, [44_257, 44_193, 44_307, 44_665, 44_843, 29_792]);

    let fixture = include_str!("../../../testdata/lidar/hdl32_example_rings.csv");
    let rows: Vec<Vec<f64>> = fixture
        .lines()
        .filter(|line| line.starts_with(|first: char| first.is_ascii_digit()))
        .map(|line| line.split(',').map(|value| value.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), rings.len());
    for (row, (points, sum_m)) in rows.iter().zip(&rings) {
        assert_eq!(row[2], f64::from(*points), "scan {} ring {}", row[0], row[1]);
        let off_m = (DVec3::new(row[3], row[4], row[5]) - *sum_m).abs().max_element() / row[2];
        assert!(off_m < 1e-5, "scan {} ring {}: mean off by {off_m} m", row[0], row[1]);
    }
}

#[test]
fn hdl_32e_with_a_dead_beam() {
    let Some(path) = real_data("hdl32e/sample_velodyne_hdl32.pcap") else { return };
    let packets = packets(&datagrams(&path));
    let image = decoded(&Model::hdl_32e(), &packets);
    assert_eq!((packets.len(), returns(&image).count()), (500, 146_705));
    assert!((revolutions(&image) - 2.49).abs() < 0.01);
    let dead = returns(&image).filter(|(_, b, _)| image.beams[*b].elevation_rad == (-2.67_f64).to_radians());
    assert_eq!(dead.count(), 0);
}

#[test]
fn vlp_16_captures() {
    let Some(path) = real_data("vlp16/sample_velodyne_vlp16_gps.pcap") else { return };
    let datagrams = datagrams(&path);
    let packets = packets(&datagrams);
    assert_eq!((packets.len(), datagrams.iter().filter(|d| d.port == 8308).count()), (293, 57));
    let image = decoded(&Model::vlp_16(), &packets);
    assert!((revolutions(&image) - 3.88).abs() < 0.01, "{}", revolutions(&image));
    assert_eq!(returns(&image).count(), 73_486, "velodyne-decoder 3.1.0 gives as many");

    let Some(path) = real_data("vlp16/recording.bin") else { return };
    let bytes = std::fs::read(path).unwrap();
    let payloads = bytes.chunks(1206).map(|payload| Packet { time_ns: 0, payload: payload.to_vec() });
    let packets: Vec<_> = payloads.collect();
    let image = decoded(&Model::vlp_16(), &packets);
    assert_eq!(packets.len(), 1000);
    assert!((revolutions(&image) - 13.2).abs() < 0.1, "{}", revolutions(&image));
    let count = returns(&image).count();
    assert!((202_500..203_500).contains(&count), "{count}");
    let seconds = (image.columns.last().unwrap().time_ns - image.columns[0].time_ns) as f64 * 1e-9;
    assert!((seconds - 1.326).abs() < 0.002, "{seconds}");
}

#[test]
fn captures_pass_the_assembler_without_loss() {
    for (model, path, columns) in [
        ("hdl-32e", "hdl32e/hdl32_example.pcap", 876 * 12),
        ("hdl-32e", "hdl32e/sample_velodyne_hdl32.pcap", 500 * 12),
        ("vlp-16", "vlp16/sample_velodyne_vlp16_gps.pcap", 293 * 24),
    ] {
        let Some(path) = real_data(path) else { return };
        let mut site = Config::default().site;
        site.sensors.truncate(1);
        site.sensors[0].model = model.to_owned();
        (site.sensors[0].range_min_m, site.sensors[0].range_max_m) = (0.0, 200.0);
        let mut assembler = Assembler::new(&site).unwrap();
        let mut health = Health::default();
        for packet in packets(&datagrams(&path)) {
            assembler.push(0, &packet, &mut health);
        }
        assembler.finish();
        let frames: Vec<_> = std::iter::from_fn(|| assembler.pop()).collect();
        assert!(health.is_clean(), "{health:?}");
        let found: usize = frames
            .iter()
            .flat_map(|frame| &frame.scans)
            .map(|scan| match &scan.cloud {
                Cloud::Organised(image) => image.columns.len(),
                Cloud::Unorganised(_) => 0,
            })
            .sum();
        assert_eq!(found, columns);
        assert!(frames.iter().enumerate().all(|(k, frame)| frame.index == k as u64));
    }
}

#[test]
fn beam_tables_are_the_calibration_files() {
    for (model, path, repeats) in [
        (Model::hdl_32e(), "hdl32e/velodyne_default_calib_HDL-32.xml", 1),
        (Model::vlp_16(), "vlp16/velodyne_default_calib_VLP-16.xml", 2),
    ] {
        let Some(path) = real_data(path) else { return };
        let xml = std::fs::read_to_string(path).unwrap();
        let found = xml.split("<vertCorrection_>").skip(1).map(|rest| {
            let (degrees, _) = rest.split_once('<').unwrap();
            degrees.parse::<f64>().unwrap()
        });
        let found: Vec<f64> = found.take(model.beams.len() * repeats).collect();
        let expected: Vec<f64> = model.beams.iter().map(|beam| beam.elevation_rad.to_degrees()).collect();
        for (found, expected) in found.iter().zip(expected.repeat(repeats)) {
            assert!((found - expected).abs() < 1e-5, "{}: {found} {expected}", model.name);
        }
    }
}

#[test]
fn all_logictronix_clouds_are_read() {
    let Some(folder) = real_data("logictronix_vlp16/pcd") else { return };
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert_eq!(files.len(), 50);
    for file in files {
        let cloud = read_pcd(&std::fs::read(&file).unwrap(), &file.display().to_string()).unwrap();
        let (points, dropped) = cloud.sensor_points(0).unwrap();
        assert!((12_300..12_600).contains(&points.len()) && dropped == 0, "{}", file.display());
        assert!(points.iter().all(|p| (0.0..=255.0).contains(&p.reflectivity)));
    }
}
