//! Files other than tables: recordings, trajectories, motion captures, captures and clouds.

use std::fs;

use tempfile::TempDir;
use umbracast::Config;
use umbracast::lidar::{Model, Packet};
use umbracast_io::motion as motion_text;
use umbracast_io::pcap::{DATA_PORT, Datagram, PcapReader, PcapWriter};
use umbracast_io::pcd::{PcdCloud, PcdEncoding, PcdField, PcdKind, read_pcd, write_pcd};
use umbracast_io::recording::{Entry, RecordingReader, RecordingWriter};
use umbracast_io::rows::PeopleRow;
use umbracast_io::trajectories::{Options, middle_m, parse};

use super::{Target, packets};

/// A recording gives messages that stand in it, or an error; it holds no more bytes than its file.
pub const MCAP: Target = Target { name: "mcap", corpus: recordings, check: recording };
/// A file of recorded people gives finite samples in order of time, or an error.
pub const CSV: Target = Target { name: "csv", corpus: csv, check: people };
/// The same.
pub const NDJSON: Target = Target { name: "ndjson", corpus: ndjson, check: people };
/// The same.
pub const PETRACK: Target = Target { name: "petrack", corpus: petrack, check: people };
/// A motion capture gives a finite place of every joint in every frame, or an error.
pub const BVH: Target = Target { name: "bvh", corpus: motions, check: motion };
/// A capture gives datagrams that stand in it, or an error.
pub const PCAP: Target = Target { name: "pcap", corpus: captures, check: capture };
/// A cloud has as many values as it says, and gives finite points, or an error.
pub const PCD: Target = Target { name: "pcd", corpus: clouds, check: cloud };

thread_local! {
    /// For readers that want a file.
    static FOLDER: TempDir = tempfile::tempdir().expect("a folder for files of this thread");
}

/// Calls `read` with the folder of this thread, in which the file `name` holds these bytes.
pub(super) fn in_file<T>(name: &str, bytes: &[u8], read: impl FnOnce(&std::path::Path) -> T) -> T {
    FOLDER.with(|folder| {
        fs::write(folder.path().join(name), bytes).expect("the folder can be written to");
        read(folder.path())
    })
}

fn recordings() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    let made = |models: [&str; 2], live: bool| {
        let mut config = Config::default();
        for (sensor, model) in config.site.sensors.iter_mut().zip(models) {
            sensor.model = model.to_owned();
        }
        let text = config.to_toml();
        let mut writer = match live {
            true => RecordingWriter::create_live(&path, &text, &config.site, 0),
            false => RecordingWriter::create(&path, &text, &config.site, false),
        }
        .expect("the folder can be written to");
        for k in 0..3_u32 {
            let time_ns = i64::from(k) * umbracast::STEP_NS;
            let packets = models.map(|model| {
                let model = Model::by_name(model).expect("a model of the table");
                vec![packets::whole(&model, time_ns); 2]
            });
            writer.write_packets(time_ns, &packets).expect("writes");
            writer.write_truth(time_ns, k.into(), &[PeopleRow::default()], &[]).expect("writes");
        }
        writer.finish().expect("writes");
        fs::read(&path).expect("it was written")
    };
    let whole = made(["hdl-32e", "hdl-32e"], false);
    // As a recorder leaves it that was killed.
    let cut = whole[..whole.len() * 2 / 3].to_vec();
    vec![whole, cut, made(["xt32", "vlp-16"], true)]
}

fn recording(bytes: &[u8]) -> bool {
    in_file("input.mcap", bytes, |folder| {
        let Ok(mut reader) = RecordingReader::open(&folder.join("input.mcap")) else { return false };
        let (mut entries, mut held) = (0, 0);
        while let Ok(Some(entry)) = reader.next_entry() {
            entries += 1;
            held += match entry {
                Entry::Config(text) => text.len(),
                Entry::Packets(_, packets) => packets.iter().map(|packet| packet.payload.len()).sum(),
                Entry::Cloud(_, message) | Entry::Other(_, _, message) => message.len(),
            };
        }
        assert!(held <= bytes.len(), "{held} bytes out of {}", bytes.len());
        entries > 0
    })
}

fn csv() -> Vec<Vec<u8>> {
    let rows =
        (0..25).map(|k| format!("{:.1},{},{:.2},0.5,1.7\n", f64::from(k) * 0.1, k % 2, f64::from(k) * 0.1));
    let pedpy = (0..25)
        .map(|k| format!("{},1,{:.2},0.5,1.7,{:.1}\n", 2 * k, f64::from(k) * 0.1, f64::from(k) * 0.08));
    [
        rows.fold("t_s,id,x_m,y_m,height_m\n".to_owned(), |text, row| text + &row),
        pedpy.fold("# framerate: 25\nframe,id,x/m,y/m,z/m,t/s\n".to_owned(), |text, row| text + &row),
    ]
    .map(String::into_bytes)
    .to_vec()
}

fn ndjson() -> Vec<Vec<u8>> {
    let track = |k: i32| {
        let x_m = f64::from(k) * 0.1;
        format!("{{\"track\": {{\"f\": {}, \"p\": 1, \"x\": {x_m:.2}, \"y\": 0.5}}}}\n", 10 * k)
    };
    let scene = "{\"scene\": {\"id\": 0, \"p\": 1, \"s\": 0, \"e\": 240, \"fps\": 2.5}}\n".to_owned();
    vec![(0..25).map(track).fold(scene, |text, row| text + &row).into_bytes()]
}

fn petrack() -> Vec<Vec<u8>> {
    let rows = (0..25).map(|k| format!("1 {k} {:.2} 0.5 1.7\n", f64::from(k) * 0.1));
    vec![
        rows.fold("# framerate: 10\n# id frame x/m y/m z/m\n".to_owned(), |text, row| text + &row)
            .into_bytes(),
    ]
}

fn people(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(people) = parse(text, Options::default(), "input") else { return false };
    for person in &people {
        assert!(person.samples.iter().flatten().all(|value| value.is_finite()), "{:?}", person.samples);
        assert!(person.samples.is_sorted_by(|a, b| a[0] < b[0]), "{:?}", person.samples);
        assert!(person.height_m.is_none_or(|height_m| (0.0..=3.0).contains(&height_m)));
    }
    assert!(!people.is_empty() && middle_m(&people).is_some());
    true
}

fn motions() -> Vec<Vec<u8>> {
    let arm = "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n \
               JOINT Elbow\n {\n OFFSET 0 2 0\n CHANNELS 3 Zrotation Xrotation Yrotation\n End Site\n {\n OFFSET 0 1 0\n }\n }\n}\n\
               MOTION\nFrames: 2\nFrame Time: 0.01\n0 1 0 0 0 0 0 0 0\n5 0 0 90 0 90 0 0 90\n";
    // A T-pose and two frames of joints' turns.
    let row = |turn: &str| format!("0,17,0{}\n", format!(",{turn},0,0").repeat(38));
    let rows = [row("0"), row("0.1"), row("-0.2")].concat();
    vec![arm.as_bytes().to_vec(), rows.into_bytes()]
}

fn motion(bytes: &[u8]) -> bool {
    let Some(motion) = std::str::from_utf8(bytes).ok().and_then(|text| motion_text::parse(text).ok()) else {
        return false;
    };
    assert!(motion.frame_s > 0.0 && motion.frame_s.is_finite());
    for frame in &motion.positions {
        assert_eq!(frame.len(), motion.joints.len());
        assert!(frame.iter().flatten().all(|place| place.is_finite()), "{frame:?}");
    }
    true
}

fn captures() -> Vec<Vec<u8>> {
    let mut writer = PcapWriter::new(Vec::new()).expect("memory can be written to");
    for model in ["hdl-32e", "xt32"] {
        let model = Model::by_name(model).expect("a model of the table");
        for k in 0..2 {
            let Packet { time_ns, payload } = packets::whole(&model, k * umbracast::STEP_NS);
            writer
                .write(&Datagram { time_ns, from: [192, 168, 1, 201], port: DATA_PORT, payload })
                .expect("writes");
        }
    }
    vec![writer.finish().expect("writes"), in_fragments()]
}

/// A datagram of 40 bytes in two fragments, big-endian, with microseconds.
fn in_fragments() -> Vec<u8> {
    let mut bytes = vec![0xa1, 0xb2, 0xc3, 0xd4, 0, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 1];
    let udp = [&[9, 64, 9, 64, 0, 48, 0, 0][..], &[7; 40]].concat();
    for (flags, part) in [([0x20, 0], &udp[..24]), ([0, 3], &udp[24..])] {
        let mut packet = [[2_u8; 12].as_slice(), &[8, 0, 0x45, 0, 0, 20 + part.len() as u8, 0, 1]].concat();
        packet.extend(flags);
        packet.extend([64, 17, 0, 0, 192, 168, 1, 201, 255, 255, 255, 255]);
        packet.extend(part);
        for field in [1, 0, packet.len() as u32, packet.len() as u32] {
            bytes.extend(field.to_be_bytes());
        }
        bytes.extend(packet);
    }
    bytes
}

fn capture(bytes: &[u8]) -> bool {
    let Ok(reader) = PcapReader::new(bytes, "input.pcap") else { return false };
    let (mut datagrams, mut held) = (0, 0);
    for datagram in reader {
        datagrams += 1;
        held += datagram.payload.len();
    }
    assert!(datagrams <= bytes.len() / 16 && held <= 16 * bytes.len(), "{held} bytes out of {}", bytes.len());
    datagrams > 0
}

fn clouds() -> Vec<Vec<u8>> {
    let field = |name: &str, kind, step: f64| PcdField {
        name: name.to_owned(),
        kind,
        count: 1,
        values: (0..64).map(|k| f64::from(k) * step).collect(),
    };
    let cloud = PcdCloud {
        width: 32,
        height: 2,
        viewpoint: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        fields: vec![
            field("x", PcdKind::F32, 0.5),
            field("y", PcdKind::F64, -0.25),
            field("z", PcdKind::F32, 0.01),
            field("intensity", PcdKind::U8, 1.0),
        ],
    };
    [PcdEncoding::Ascii, PcdEncoding::Binary, PcdEncoding::BinaryCompressed]
        .map(|encoding| write_pcd(&cloud, encoding))
        .to_vec()
}

fn cloud(bytes: &[u8]) -> bool {
    let Ok(cloud) = read_pcd(bytes, "input.pcd") else { return false };
    assert!(cloud.fields.iter().all(|field| field.values.len() == cloud.width * cloud.height * field.count));
    if let Ok((points, dropped)) = cloud.sensor_points(0) {
        assert_eq!(points.len() as u64 + dropped, (cloud.width * cloud.height) as u64);
        assert!(points.iter().flat_map(|point| point.position_m).all(f32::is_finite));
    }
    true
}
