//! Files that other programs wrote (`testdata/recordings/make.py`), and the errors of a build that cannot read them.

use std::path::{Path, PathBuf};

use umbracast::Error;
use umbracast_io::point_cloud;
use umbracast_io::recording::{Entry, RecordingReader};
use umbracast_io::rows::MatchRow;
use umbracast_io::tables;

fn testdata(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(path)
}

fn entries(path: &Path) -> Result<Vec<Entry>, Error> {
    let mut reader = RecordingReader::open(path)?;
    let mut entries = Vec::new();
    while let Some(entry) = reader.next_entry()? {
        entries.push(entry);
    }
    assert_eq!(reader.lost(), None);
    Ok(entries)
}

/// What `make.py` says that it writes.
fn assert_is_the_recording(entries: &[Entry]) {
    let (mut clouds, mut scans) = (0, 0);
    for entry in entries {
        match entry {
            Entry::Cloud(topic, message) => {
                let cloud = point_cloud::read(message).expect("a cloud");
                assert_eq!((topic.as_str(), cloud.points.len(), cloud.dropped), ("/lidar/points", 39, 1));
                assert_eq!(cloud.points[0].position_m, [clouds as f32 + 1.0, 0.0, 0.5]);
                let start_ns = 1_700_000_000_000_000_000 + clouds * 100_000_000;
                assert_eq!((cloud.stamp_ns, cloud.points[38].time_ns), (start_ns, start_ns + 39_000_000));
                clouds += 1;
            }
            Entry::Packets(sensor, packets) => {
                assert_eq!((sensor.as_str(), packets.len()), ("lidar_east", 2));
                assert!(packets.iter().all(|packet| packet.payload == vec![scans; 1206]));
                scans += 1;
            }
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((clouds, scans), (3, 3));
}

/// What a build with the feature reads; what one without it says holds these words.
fn read_or_told<T>(read: Result<T, Error>, with_feature: bool, words: &[&str]) -> Option<T> {
    match read {
        Ok(_) if !with_feature => panic!("read without the feature"),
        Ok(value) => Some(value),
        Err(error) => {
            let told = error.to_string();
            assert!(!with_feature && words.iter().all(|word| told.contains(word)), "{words:?}: {told}");
            None
        }
    }
}

#[test]
fn sqlite_storage_of_rosbag2() {
    let words = ["clouds.db3", "--features db3", "rosbags-convert", "ros2 bag convert"];
    let read = read_or_told(entries(&testdata("recordings/clouds.db3")), cfg!(feature = "db3"), &words);
    read.iter().for_each(|entries| assert_is_the_recording(entries));
}

#[test]
fn mcap_with_zstd() {
    let words = ["clouds.mcap", "zstd", "--features compression", "mcap decompress"];
    let compression = cfg!(feature = "compression");
    let read = read_or_told(entries(&testdata("recordings/clouds.mcap")), compression, &words);
    read.iter().for_each(|entries| assert_is_the_recording(entries));
}

#[test]
fn a_table_of_polars() {
    let row = |scene, frame, time_ns, person, track| MatchRow { scene, frame, time_ns, person, track };
    let expected = [row(0, 7, 800_000_000, 1, 3), row(0, 7, 800_000_000, 2, 4), row(1, 0, 100_000_000, 0, 0)];
    let words = ["matches.parquet", "zstd", "--features compression", "compression=\"snappy\""];
    let rows = tables::read::<MatchRow>(&testdata("tables"), &[]);
    let read = read_or_told(rows, cfg!(feature = "compression"), &words);
    read.iter().for_each(|rows| assert_eq!(rows[..], expected));
}

/// A bag is the recording that it was made of.
#[cfg(feature = "db3")]
#[test]
fn what_rosbags_makes_of_a_recording() {
    use std::io::Write;
    use std::process::Command;
    use umbracast::lidar::Packet;
    use umbracast_io::recording::RecordingWriter;
    use umbracast_io::rows::PeopleRow;

    let folder = tempfile::tempdir().expect("a folder");
    let (recording, bag) = (folder.path().join("a.mcap"), folder.path().join("bag"));
    let config = umbracast::Config::default();
    let mut writer =
        RecordingWriter::create(&recording, &config.to_toml(), &config.site, false).expect("creates");
    for k in 1..20 {
        let packets = |n: usize| vec![Packet { time_ns: k, payload: vec![k as u8; 1206] }; n];
        writer.write_packets(k, &[packets(40), packets(2)]).expect("writes");
        writer.write_truth(k, k as u64, &[PeopleRow::default()], &[]).expect("writes");
    }
    writer.finish().expect("finishes");
    let python = std::env::var("UMBRACAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let convert = "from rosbags.convert.cli import main; main()";
    let output = Command::new(&python)
        .args(["-c", convert, "--src"])
        .arg(&recording)
        .arg("--dst")
        .arg(&bag)
        .args(["--dst-storage", "sqlite3"])
        .output();
    let converted = match output {
        Ok(output) if output.status.success() => bag.join("bag.db3"),
        Ok(output) if !String::from_utf8_lossy(&output.stderr).contains("ModuleNotFoundError") => {
            panic!("{}", String::from_utf8_lossy(&output.stderr))
        }
        _ => {
            let _ = writeln!(std::io::stderr(), "skipped: {python} has no rosbags to convert with");
            return;
        }
    };
    let (recorded, read) = (entries(&recording).expect("reads"), entries(&converted).expect("reads"));
    assert_eq!(read.len(), recorded.len());
    // Messages of one time may change places.
    assert!(recorded.iter().all(|entry| read.contains(entry)));
}
