//! Recordings to columns: x, y, z and the time of every point, in its sensor's frame. One is what `umbracast simulate --clouds`
//! writes, 150 MB, and its clouds (`sensor_msgs/PointCloud2`) are read: packets and truth stand between them, and a reader
//! passes over those. The other, without clouds, is read from its packets (`velodyne_msgs/VelodyneScan`). Both were read
//! before, so the disk counts for neither side.

use std::path::{Path, PathBuf};

use umbracast::lidar::{Assembler, Cloud};
use umbracast::{Config, Health, Site};
use umbracast_eval::run::chain;
use umbracast_eval::score::scene::{SceneTruth, note_truth};
use umbracast_io::clouds::azimuths;
use umbracast_io::input::Given;
use umbracast_io::point_cloud;
use umbracast_io::recording::{Entry, RecordingReader, RecordingWriter};
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

use crate::exchange::{Answer, times, write_f64};

/// That of every simulated hall of the benchmarks.
const SEED: u64 = 100_000;
/// Tenths of a second: two HDL-32E give 3.5 MB in each with clouds, and 0.43 MB without.
const FRAMES_OF_CLOUDS: usize = 43;
const FRAMES_OF_PACKETS: usize = 100;
const TRIES: usize = 5;

/// A table of points, column by column.
#[derive(Default)]
struct Columns {
    x_m: Vec<f32>,
    y_m: Vec<f32>,
    z_m: Vec<f32>,
    time_ns: Vec<i64>,
}

pub fn row(folder: &Path) -> Answer {
    let config = Config::default();
    let sensor = &config.site.sensors[0];
    write_f64(folder, "range", &[2], &[sensor.range_min_m, sensor.range_max_m]);
    let mut answer = Answer::default();
    let clouds = record(folder, "clouds", &config, FRAMES_OF_CLOUDS);
    case(&mut answer, "clouds", || clouds_of(&clouds));
    let packets = record(folder, "packets", &config, FRAMES_OF_PACKETS);
    case(&mut answer, "packets", || packets_of(&packets, &config.site));
    answer
}

fn case(answer: &mut Answer, name: &str, read: impl Fn() -> Columns) {
    let mut columns = Columns::default();
    let ms = times(TRIES, || (), |()| columns = read());
    let sum = |column: &[f32]| column.iter().map(|&m| f64::from(m)).sum::<f64>();
    let time_s = columns.time_ns.iter().map(|&ns| 1e-9 * ns as f64).sum::<f64>();
    let found = [
        ("points", columns.x_m.len() as f64),
        ("sum of x, m", sum(&columns.x_m)),
        ("sum of y, m", sum(&columns.y_m)),
        ("sum of z, m", sum(&columns.z_m)),
        ("sum of times, s", time_s),
    ];
    answer.case(name, &ms, &found);
}

/// Ten walkers in the default hall, `NAME.mcap`. Clouds are written where the name says so.
fn record(folder: &Path, name: &str, config: &Config, frames: usize) -> PathBuf {
    let (path, site, with_clouds) = (folder.join(format!("{name}.mcap")), &config.site, name == "clouds");
    let crowd = circle_crossing(Preset::Orca03, 10, 12.5, SEED);
    let mut scene = Scene::new(crowd, site, SEED).expect("the default site is simulated");
    let mut assembler = Assembler::new(site).expect("the default site is assembled");
    let mut writer =
        RecordingWriter::create(&path, &config.to_toml(), site, with_clouds).expect("a new file");
    for frame in std::iter::from_fn(|| scene.next_frame()).take(frames) {
        let mut truth = SceneTruth::default();
        note_truth(0, &frame, &mut truth);
        writer.write_packets(frame.time_ns, &frame.packets).expect("room for packets");
        chain::push(&mut assembler, &frame.packets, &mut Health::default());
        while let Some(frame) = assembler.pop() {
            writer.write_clouds(&frame).expect("room for clouds");
        }
        let told = writer.write_truth(frame.time_ns, frame.index, &truth.people, &truth.links);
        told.expect("room for the truth");
    }
    writer.finish().expect("room for the index");
    path
}

fn clouds_of(path: &Path) -> Columns {
    let mut columns = Columns::default();
    let mut reader = RecordingReader::open(path).expect("the recording is there");
    while let Some(entry) = reader.next_entry().expect("the recording is one") {
        let Entry::Cloud(_, message) = entry else { continue };
        let cloud = point_cloud::read(&message).expect("the message is a cloud");
        let points = cloud.points.iter();
        columns.x_m.extend(points.clone().map(|point| point.position_m[0]));
        columns.y_m.extend(points.clone().map(|point| point.position_m[1]));
        columns.z_m.extend(points.clone().map(|point| point.position_m[2]));
        columns.time_ns.extend(points.map(|point| point.time_ns));
    }
    columns
}

/// By way of frames, as everything that follows people takes them.
fn packets_of(path: &Path, site: &Site) -> Columns {
    let given = Given::of(&[path.to_owned()]).expect("the recording is there");
    let inputs = given.of_site(site, &[]).expect("the recording is of the site");
    let mut columns = Columns::default();
    let lost = inputs.scenes[0].frames(site, &mut Health::default(), |frame| {
        for scan in &frame.scans {
            let Cloud::Organised(image) = &scan.cloud else { continue };
            for c in 0..image.columns.len() {
                for b in 0..image.beams.len() {
                    let range_m = image.range_m[c * image.beams.len() + b];
                    if range_m > 0.0 {
                        let at_m = image.tabled_point_m(azimuths(), c, b, range_m.into()).as_vec3();
                        columns.x_m.push(at_m.x);
                        columns.y_m.push(at_m.y);
                        columns.z_m.push(at_m.z);
                        columns.time_ns.push(image.time_ns(c, b));
                    }
                }
            }
        }
        Ok(())
    });
    assert_eq!(lost.expect("the recording has packets"), None, "the recording is whole");
    columns
}
