//! Writes the clouds of one topic of a recording as a folder of PCD files: `0000.pcd`, `0001.pcd` ...
//!
//! `cargo run --release -p umbracast-io --example clouds_to_pcd RECORDING.mcap TOPIC FOLDER`
//!
//! The files are what PCL's and Open3D's tools write at their widest: unorganised, ASCII, numbers of 8 bytes.

use std::error::Error;
use std::fs;
use std::path::Path;

use umbracast::lidar::SensorPoint;
use umbracast_io::pcd::{PcdCloud, PcdEncoding, PcdField, PcdKind, write_pcd};
use umbracast_io::point_cloud;
use umbracast_io::recording::{Entry, RecordingReader};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [recording, topic, folder] = &words[..] else {
        return Err("expected RECORDING TOPIC FOLDER".into());
    };
    fs::create_dir_all(folder)?;
    let mut reader = RecordingReader::open(Path::new(recording))?;
    let mut written = 0;
    while let Some(entry) = reader.next_entry()? {
        let Entry::Cloud(of, message) = entry else { continue };
        let Some(cloud) = point_cloud::read(&message).filter(|_| of == *topic) else { continue };
        let file = Path::new(folder).join(format!("{written:04}.pcd"));
        fs::write(file, write_pcd(&unorganised(&cloud.points), PcdEncoding::Ascii))?;
        written += 1;
    }
    println!("{written} clouds of {topic} in {folder}");
    Ok(())
}

fn unorganised(points: &[SensorPoint]) -> PcdCloud {
    let field = |name: &str, value: &dyn Fn(&SensorPoint) -> f32| PcdField {
        name: name.to_owned(),
        kind: PcdKind::F64,
        count: 1,
        values: points.iter().map(|point| f64::from(value(point))).collect(),
    };
    PcdCloud {
        width: points.len(),
        height: 1,
        viewpoint: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        fields: vec![
            field("x", &|p| p.position_m[0]),
            field("y", &|p| p.position_m[1]),
            field("z", &|p| p.position_m[2]),
            field("intensity", &|p| p.reflectivity),
        ],
    }
}
