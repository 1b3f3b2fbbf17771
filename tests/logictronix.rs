//! Real people in front of a real VLP-16, with labels: 26 and 24 frames, no empty scan.
//!
//! The data is not part of the repository: `UMBRACAST_DATA` says where it lies.

#[path = "real_data/mod.rs"]
mod real_data;

use std::path::Path;

use umbracast::config::{Config, Mode};
use umbracast::detect::{Background, Clusterer, Detection, Measurer};
use umbracast::geometry::{DVec2, Pose};
use umbracast::lidar::{Cloud, Scan, SensorPoint};
use umbracast::{Frame, Health};

use real_data::real_data;

/// The sensor stands this high above the ground.
const SITE: &str = r#"
[site]
name = "logictronix"
pillars = []
furniture = []
[site.hall]
length_m = 120.0
width_m = 120.0
height_m = 10.0
[[site.sensors]]
name = "vlp16"
model = "points"
position_m = [0.0, 0.0, 1.2]
rotation_deg = { yaw = 0.0, pitch = 0.0, roll = 0.0 }
rate_hz = 10.0
cut_deg = 180.0
range_min_m = 0.4
range_max_m = 100.0
range_noise_m = 0.02
"#;

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

fn labels(folder: &Path, frame: u64) -> Vec<DVec2> {
    let text = std::fs::read_to_string(folder.join("labels.csv")).unwrap();
    text.lines()
        .filter_map(|line| line.strip_prefix(&format!("{frame}.pcd,")))
        .map(|line| {
            let numbers: Vec<f64> = line.split(',').map(|n| n.parse().unwrap()).collect();
            DVec2::new(numbers[1], numbers[2])
        })
        .collect()
}

#[test]
fn people_are_found_without_an_empty_scan() {
    let Some(folder) = real_data("logictronix_vlp16") else { return };
    let config = Config::with_overlay(Mode::Default, SITE, "site").unwrap();
    let (mut found, mut people, mut detected) = (0, 0, 0);
    for run in [70..=95_u64, 117..=140] {
        let mut background = Background::new(&config.detect, &config.site);
        let mut clusterer = Clusterer::new(&config.detect, &config.site);
        let mut measurer = Measurer::new(&config.detect, &config.site);
        let (mut points, mut clusters, mut detections) = (Vec::new(), Vec::new(), Vec::<Detection>::new());
        for index in run {
            let time_ns = index as i64 * 100_000_000;
            let site_from_sensor: Pose = config.site.sensors[0].site_from_sensor();
            let cloud = Cloud::Unorganised(cloud(&folder.join(format!("pcd/{index}.pcd")), time_ns));
            let frame = Frame { index, time_ns, scans: vec![Scan { sensor: 0, site_from_sensor, cloud }] };
            background.foreground(&frame, &[], &mut Health::default(), &mut points);
            clusterer.clusters(&points, &[], &mut clusters);
            measurer.detections(&points, &clusters, &[], &mut detections);
            let labels = labels(&folder, index);
            let hits = labels
                .iter()
                .filter(|label| detections.iter().any(|d| d.position_m.distance(**label) < 0.5))
                .count();
            people += labels.len();
            found += hits;
            // Somebody who is not labelled stands and moves beside the sensor.
            detections.retain(|d| d.position_m.length() > 2.0);
            detected += detections.len();
        }
    }
    let (recall, precision) =
        (f64::from(found as u32) / f64::from(people as u32), f64::from(found as u32) / detected as f64);
    println!("recall {recall:.3} precision {precision:.3}");
    assert!(recall >= 0.93 && precision >= 0.98, "recall {recall:.3}, precision {precision:.3}");
}
