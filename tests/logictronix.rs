//! Real people in front of a real VLP-16, with labels: two stretches of 26 and 24 frames, no empty scan. Scored as a user gets
//! them: confirmed tracks, one to one with the labels.
//!
//! The data is not part of the repository: `UMBRACAST_DATA` says where it lies.

#[path = "real_data/mod.rs"]
mod real_data;

use std::collections::BTreeSet;
use std::path::Path;

use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Cloud, Frame, Scan, SensorPoint};
use umbracast::track::association::{FORBIDDEN, optimal};
use umbracast::{Config, Mode, Pipeline};

use real_data::real_data;

const SITE: &str = include_str!("../config/sites/logictronix.toml");
/// A track farther from the middle of a label's box is not that person's.
const GATE_M: f64 = 0.5;
/// A track is confirmed by the third frame of a person who is seen in each.
const UNCONFIRMED: u64 = 2;

fn cloud(file: &Path, time_ns: i64) -> Vec<SensorPoint> {
    let bytes = std::fs::read(file).unwrap();
    let header = b"DATA binary\n";
    let start = bytes.windows(header.len()).position(|w| w == header).unwrap() + header.len();
    let float = |chunk: &[u8], i: usize| f32::from_le_bytes(chunk[4 * i..4 * i + 4].try_into().unwrap());
    bytes[start..]
        .chunks_exact(16)
        .map(|c| SensorPoint {
            position_m: [float(c, 0), float(c, 1), float(c, 2)],
            time_ns,
            reflectivity: float(c, 3),
        })
        .collect()
}

/// Middles of the boxes of a frame, on the floor of the site.
fn labels(text: &str, frame: u64, site_from_sensor: &Pose) -> Vec<DVec2> {
    text.lines()
        .filter_map(|line| line.strip_prefix(&format!("{frame}.pcd,")))
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
            site_from_sensor.point(DVec3::new(numbers[1], numbers[2], numbers[3])).truncate()
        })
        .collect()
}

#[test]
fn labelled_people_are_followed_without_an_empty_scan_from_the_third_frame_on() {
    let Some(folder) = real_data("logictronix_vlp16") else { return };
    let config = Config::with_overlay(Mode::Default, SITE, "logictronix.toml").unwrap();
    let site_from_sensor = config.site.sensors[0].site_from_sensor();
    let text = std::fs::read_to_string(folder.join("labels.csv")).unwrap();
    for (frames, people) in [(70..=95_u64, 1), (117..=140, 2)] {
        let mut pipeline = Pipeline::new(&config, None).unwrap();
        let (first, mut missed, mut falsely, mut ids) = (*frames.start(), 0, 0, BTreeSet::new());
        for index in frames.clone() {
            let time_ns = index as i64 * umbracast::STEP_NS;
            let cloud = Cloud::Unorganised(cloud(&folder.join(format!("pcd/{index}.pcd")), time_ns));
            let scans = vec![Scan { sensor: 0, site_from_sensor, cloud }];
            let outcome = pipeline.step(&Frame { index, time_ns, scans });
            let tracks: Vec<_> = outcome
                .tracks
                .iter()
                .filter(|track| track.confirmed && config.site.hall.contains(track.position_m))
                .collect();
            let labels = labels(&text, index, &site_from_sensor);
            assert_eq!(labels.len(), people, "frame {index}");
            let cost = |label: usize, track: usize| {
                let apart_m = labels[label].distance(tracks[track].position_m);
                if apart_m <= GATE_M { apart_m - 1.0 } else { FORBIDDEN }
            };
            let found: Vec<usize> = optimal(labels.len(), tracks.len(), cost).into_iter().flatten().collect();
            ids.extend(found.iter().map(|&track| tracks[track].id));
            falsely += tracks.len() - found.len();
            missed += if index - first < UNCONFIRMED { 0 } else { labels.len() - found.len() };
        }
        assert_eq!(
            (missed, falsely, ids.len()),
            (0, 0, people),
            "frames {frames:?}: missed from the third frame on, false, and identities"
        );
    }
}
