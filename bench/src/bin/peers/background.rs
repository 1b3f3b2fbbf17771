//! From a frame to people: background, then clusters as well, then detections. As the beams of known sensors, or as
//! a cloud of points of which nothing more is known.

use std::path::Path;

use umbracast::Config;
use umbracast::geometry::{DVec2, DVec3, Pose};
use umbracast::lidar::{Cloud, Frame, SensorPoint};
use umbracast_bench::Stages;
use umbracast_bench::simulated::crossing;
use umbracast_sim::scene::SceneFrame;

use crate::exchange::{Answer, times, write_f32, write_f64};

const PEOPLE: [usize; 2] = [10, 100];
/// The last of these is measured: everybody is followed by then, and on the way to the middle.
const FRAMES: usize = 61;
const TRIES: usize = 40;
/// Who has a cluster so near is found.
const NEAR_M: f64 = 0.5;

/// Frames of beams by columns.
pub fn organised(folder: &Path) -> Answer {
    row(folder, &Config::default(), |_| ())
}

/// The same points of sensors whose beams nobody knows.
pub fn unorganised(folder: &Path) -> Answer {
    let mut config = Config::default();
    config.site.sensors.iter_mut().for_each(|sensor| sensor.model = "points".to_owned());
    row(folder, &config, disorganise)
}

fn row(folder: &Path, config: &Config, taken_as: impl Fn(&mut Frame)) -> Answer {
    let mut answer = Answer::default();
    for people in PEOPLE {
        let mut hall =
            crossing(&Config::default().site, people, 12.5, FRAMES).expect("the default site is simulated");
        hall.empty.iter_mut().chain(&mut hall.frames).for_each(&taken_as);
        let (before, frame) = (&hall.frames[..FRAMES - 1], &hall.frames[FRAMES - 1]);
        write(folder, people, &hall.empty, frame, &hall.truth[FRAMES - 1]);
        let mut stages = Stages::new(config, &hall.empty).expect("the defaults work");
        before.iter().for_each(|frame| stages.step(frame));
        stages.expect(frame);
        // Each try begins from a copy, for the stages remember.
        let ms = |until: &[fn(&mut Stages, &Frame)]| {
            times(TRIES, || stages.clone(), |stages| until.iter().for_each(|stage| stage(stages, frame)))
        };
        let all: [fn(&mut Stages, &Frame); 3] =
            [Stages::foreground, |stages, _| stages.clusters(), |stages, _| stages.detections()];
        let [background_ms, clusters_ms, detections_ms] = [1, 2, 3].map(|stages| ms(&all[..stages]));
        all.iter().for_each(|stage| stage(&mut stages, frame));
        let middle = |cluster: &Vec<u32>| {
            let sum: DVec3 = cluster.iter().map(|&i| stages.foreground[i as usize].position_m).sum();
            sum.truncate() / cluster.len() as f64
        };
        let truth = &hall.truth[FRAMES - 1];
        let clusters: Vec<DVec2> = stages.clusters.iter().map(middle).collect();
        let detections: Vec<DVec2> = stages.detections.iter().map(|detection| detection.position_m).collect();
        let points = [("points", stages.foreground.len() as f64)];
        answer.case(&format!("{people} people, background"), &background_ms, &points);
        answer.case(&format!("{people} people, clusters"), &clusters_ms, &found(truth, &clusters));
        answer.case(&format!("{people} people, detections"), &detections_ms, &found(truth, &detections));
    }
    answer
}

/// How many there are, and how many people have one near.
fn found(truth: &SceneFrame, places_m: &[DVec2]) -> [(&'static str, f64); 2] {
    let near = |at_m: DVec2| places_m.iter().any(|place_m| place_m.distance(at_m) < NEAR_M);
    let people = truth.people.iter().filter(|person| near(person.state.position_m)).count();
    [("people", people as f64), ("groups", places_m.len() as f64)]
}

/// Takes from every scan what only a known sensor tells.
fn disorganise(frame: &mut Frame) {
    for scan in &mut frame.scans {
        if let Cloud::Organised(image) = &scan.cloud {
            let beams = image.beams.len();
            let returns = image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0);
            let point = |(i, &range_m): (usize, &f32)| SensorPoint {
                position_m: image.point_m(i / beams, i % beams, f64::from(range_m)).as_vec3().to_array(),
                time_ns: image.time_ns(i / beams, i % beams),
                reflectivity: f32::from(image.reflectivity[i]),
            };
            scan.cloud = Cloud::Unorganised(returns.map(point).collect());
        }
    }
}

/// The points of the empty hall and of the frame as a driver gives them, in each sensor's frame, and where people are.
fn write(folder: &Path, people: usize, empty: &[Frame], frame: &Frame, truth: &SceneFrame) {
    let points = |frame: &Frame, sensor: usize| {
        let mut frame = frame.clone();
        disorganise(&mut frame);
        match &frame.scans[sensor].cloud {
            Cloud::Unorganised(points) => {
                points.iter().flat_map(|point| point.position_m).collect::<Vec<f32>>()
            }
            Cloud::Organised(_) => Vec::new(),
        }
    };
    for (sensor, scan) in frame.scans.iter().enumerate() {
        let whole = |name: &str, coordinates: &[f32]| {
            write_f32(folder, &format!("{name}_{sensor}"), &[coordinates.len() / 3, 3], coordinates);
        };
        whole(&format!("cloud_{people}"), &points(frame, sensor));
        whole("empty", &empty.iter().flat_map(|frame| points(frame, sensor)).collect::<Vec<f32>>());
        write_f32(folder, &format!("site_from_sensor_{sensor}"), &[4, 4], &matrix(&scan.site_from_sensor));
    }
    let places_m: Vec<f64> =
        truth.people.iter().flat_map(|person| person.state.position_m.to_array()).collect();
    write_f64(folder, &format!("truth_{people}"), &[truth.people.len(), 2], &places_m);
}

/// Row after row.
fn matrix(pose: &Pose) -> [f32; 16] {
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| pose.direction(axis).as_vec3());
    let t = pose.point(DVec3::ZERO).as_vec3();
    [x.x, y.x, z.x, t.x, x.y, y.y, z.y, t.y, x.z, y.z, z.z, t.z, 0.0, 0.0, 0.0, 1.0]
}
