//! A rosbag2 recording of a VLP-16 against the points that another decoder (tier4/nebula) made of it: beam,
//! azimuth and distance, point by point. The data lie where UMBRACAST_DATA points.

mod bag;
#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use umbracast::Health;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Model, RangeImage};
use umbracast_io::messages::read_scan;
use umbracast_io::pcd::read_pcd;

use bag::sqlite_blobs;
use real_data::real_data;

/// Return types: both returns are one, the first is the strongest, the last is. The others are weaker returns.
const STRONGEST: [f64; 3] = [6.0, 9.0, 10.0];

#[test]
fn vlp_16_point_by_point() {
    let Some(folder) = real_data("nebula/vlp16") else { return };
    let bag = std::fs::read(folder.join("1673400471837873222/1673400471837873222_0.db3")).unwrap();
    let model = Model::vlp_16();
    let mut image = RangeImage {
        beams: model.beams.clone(),
        columns: Vec::new(),
        range_m: Vec::new(),
        reflectivity: Vec::new(),
    };
    let mut health = Health::default();
    let mut packets = 0;
    for message in sqlite_blobs(&bag, "messages") {
        for packet in read_scan(&message).expect("a whole VelodyneScan") {
            packets += 1;
            decode(&model, &packet, &mut health, |column, range_m, reflectivity| {
                image.columns.push(column);
                image.range_m.extend_from_slice(range_m);
                image.reflectivity.extend_from_slice(reflectivity);
            });
        }
    }
    assert!(health.is_clean(), "{health:?}");
    assert_eq!(packets, 3 * 151 + 150);

    // By ring: azimuth, azimuth of the block and of the next, range.
    let mut ours = vec![Vec::new(); 16];
    for (i, &range_m) in image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0) {
        let (c, b) = (i / 16, i % 16);
        let block = c - c % 2;
        let azimuths_cdeg = [
            image.azimuth_cdeg(c, b),
            image.azimuth_cdeg(block, 0),
            image.azimuth_cdeg((block + 2).min(image.columns.len() - 1), 0),
        ];
        ours[usize::from(model.beams[b].ring)].push((azimuths_cdeg, f64::from(range_m)));
    }
    let oracle = read_pcd(&std::fs::read(folder.join("1673400472138016708.pcd")).unwrap(), "oracle").unwrap();
    let value = |field: &str, p: usize| oracle.field(field).unwrap().values[p];
    assert_eq!(oracle.width * oracle.height, 14_831);
    let strongest: Vec<_> = (0..oracle.width)
        .filter(|&p| STRONGEST.contains(&value("return_type", p)))
        .map(|p| {
            (value("channel", p) as usize, value("azimuth", p).to_degrees() * 100.0, value("distance", p))
        })
        .collect();
    assert_eq!(strongest.len(), 14_643);

    // The recording holds two returns a firing. Where the other decoder takes the turn from the next block, that
    // one often has the same azimuth: it leaves the last pair of blocks of each packet (1 of 6) where its block
    // starts, and puts the first of a pair one pair further. All others must agree with ours within 1 mm, or the
    // 0.02 degrees between its turn, from block to block, and ours, over the packet.
    let mut found = [0; 3];
    for (ring, azimuth_cdeg, range_m) in strongest {
        let same_azimuth = |ours_cdeg: u32| {
            let apart = (azimuth_cdeg - f64::from(ours_cdeg)).rem_euclid(36_000.0);
            let apart_cdeg = apart.min(36_000.0 - apart);
            apart_cdeg < 2.01 || (apart_cdeg * 0.01).to_radians() * range_m < 1e-3
        };
        let same_range = |ours: &&([u32; 3], f64)| (ours.1 - range_m).abs() < 1e-3;
        let same: Vec<_> = ours[ring].iter().filter(same_range).collect();
        let kind = (0..3).find(|&kind| same.iter().any(|(azimuths, _)| same_azimuth(azimuths[kind])));
        found[kind
            .unwrap_or_else(|| panic!("ring {ring}, {azimuth_cdeg} cdeg, {range_m} m: no point of ours"))] +=
            1;
    }
    assert!(found[1] * 6 < 14_643 && found[2] < 100, "{found:?}");
}
