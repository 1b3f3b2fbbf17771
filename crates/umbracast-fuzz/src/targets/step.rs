//! Frames that no sensor gives, through all stages.

use std::sync::LazyLock;

use umbracast::forecast::Weights;
use umbracast::lidar::{Assembler, Cloud, Frame, RangeImage, Scan, SensorPoint};
use umbracast::pipeline::{Outcome, Pipeline};
use umbracast::track::Track;
use umbracast::{Config, Health, Mode, STEP_NS};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::Scene;

use super::{Target, settings};
use crate::given::Given;

/// Any frames give finite results of bounded number. The first byte of the input chooses the mode and whether the empty hall
/// was learned; what follows is a list of changes to the frames of a simulated scene, of [`CHANGE_BYTES`] each.
pub const STEP: Target = Target { name: "step", corpus: changes, check: steps };

/// Frames that an input changes, and that are stepped through.
pub const FRAMES: usize = 6;
/// Frame, scan, kind, place and value.
const CHANGE_BYTES: usize = 13;
/// More changes of one input are left out.
const CHANGES_MAX: usize = 64;
/// Of the simulated columns one in so many is kept, so that a step takes a fraction of a millisecond.
const COLUMNS_APART: usize = 12;
/// Of the clouds of messages one in so many of those that are left.
const CLOUD_COLUMNS_APART: usize = 40;
/// Nobody sends more scans of one frame.
const SCANS_MAX: usize = 8;
/// What the background lets through at most.
const FOREGROUND_MAX: usize = 40_000;

/// A scene, and the pipelines that have not seen it.
struct Stage {
    frames: Vec<Frame>,
    pipelines: Vec<Pipeline>,
}

static STAGE: LazyLock<Stage> = LazyLock::new(|| {
    let config = Config::default();
    let scene = Scene::new(strolling(Preset::Mixed, 3, 5.0, 7, 2), &config.site, 7)
        .expect("sensors that are simulated");
    let frames = framed(scene, &config);
    let nobody = strolling(Preset::Mixed, 0, 5.0, 7, 1);
    let empty = framed(Scene::new(nobody, &config.site, 8).expect("the same sensors"), &config);
    let weights = Weights::from_safetensors(&settings::small_lstm()).expect("weights of ours");
    let pipeline = |(mode, knows): (Mode, bool)| {
        let mut pipeline = Pipeline::new(&Config::for_mode(mode), Some(&weights)).expect("a mode");
        empty.iter().filter(|_| knows).for_each(|frame| pipeline.learn_empty(frame));
        pipeline
    };
    let modes = [(Mode::Default, true), (Mode::Default, false), (Mode::Hdl, true), (Mode::Paper, true)];
    Stage { frames, pipelines: modes.into_iter().map(pipeline).collect() }
});

/// The first frames of a scene, thinned.
fn framed(mut scene: Scene, config: &Config) -> Vec<Frame> {
    let mut assembler = Assembler::new(&config.site).expect("the default site");
    for _ in 0..FRAMES {
        let packets = scene.next_frame().map(|frame| frame.packets).unwrap_or_default();
        let of_sensors =
            packets.iter().enumerate().flat_map(|(sensor, all)| all.iter().map(move |p| (sensor, p)));
        let mut in_time: Vec<_> = of_sensors.collect();
        in_time.sort_by_key(|(_, packet)| packet.time_ns);
        in_time.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut Health::default()));
    }
    assembler.finish();
    let frames = std::iter::from_fn(|| assembler.pop());
    let thin = |frame: Frame| Frame {
        scans: frame.scans.iter().map(|scan| thinned(scan, COLUMNS_APART)).collect(),
        ..frame
    };
    frames.map(thin).collect()
}

/// One column in `apart`.
fn thinned(scan: &Scan, apart: usize) -> Scan {
    let Cloud::Organised(image) = &scan.cloud else { return scan.clone() };
    let beams = image.beams.len();
    let kept = RangeImage {
        beams: image.beams.clone(),
        columns: image.columns.iter().step_by(apart).copied().collect(),
        range_m: image.range_m.chunks(beams).step_by(apart).flatten().copied().collect(),
        reflectivity: image.reflectivity.chunks(beams).step_by(apart).flatten().copied().collect(),
    };
    Scan { cloud: Cloud::Organised(kept), ..scan.clone() }
}

/// A scan of few points.
pub(super) fn narrowed(scan: &Scan) -> Scan {
    thinned(scan, CLOUD_COLUMNS_APART)
}

/// A frame as it should be.
pub(super) fn frame() -> &'static Frame {
    &STAGE.frames[0]
}

/// What comes of the whole scene.
pub(super) fn outcome() -> Outcome {
    let mut pipeline = STAGE.pipelines[0].clone();
    for frame in &STAGE.frames {
        pipeline.step(frame);
    }
    pipeline
        .step(&Frame { time_ns: (FRAMES as i64 + 1) * STEP_NS, ..STAGE.frames[FRAMES - 1].clone() })
        .clone()
}

/// How many columns of an organised scan.
pub(super) fn columns(scan: &Scan) -> usize {
    match &scan.cloud {
        Cloud::Organised(image) => image.columns.len(),
        Cloud::Unorganised(_) => 0,
    }
}

/// No change in every mode, and one of every kind.
fn changes() -> Vec<Vec<u8>> {
    let one_of_each = (0..KINDS).flat_map(|kind| {
        [&[kind % 6, kind % 2, kind][..], &(u16::from(kind) * 40).to_le_bytes(), &2.5_f64.to_le_bytes()]
            .concat()
    });
    let of_kind = |kind: u8| [&[1, 0, kind][..], &[0; 10]].concat();
    let mut all: Vec<Vec<u8>> = (0..4).map(|mode| vec![mode]).collect();
    // Points of a scan that has lost its beams.
    all.push([vec![0], of_kind(19), of_kind(8)].concat());
    all.push(std::iter::once(1).chain(one_of_each).collect());
    all.extend((0..KINDS).map(|kind| {
        let value = f64::from(f32::from_bits(0x40a0_0000)).to_le_bytes();
        [&[kind % 4, 2, 1, kind][..], &300_u16.to_le_bytes(), &value].concat()
    }));
    all
}

fn steps(input: &[u8]) -> bool {
    let Some((mode, mut changes)) = input.split_first() else { return false };
    let mut frames = STAGE.frames.clone();
    for _ in 0..CHANGES_MAX {
        let Some((now, rest)) = changes.split_at_checked(CHANGE_BYTES) else { break };
        change(&mut frames, Given(now));
        changes = rest;
    }
    let mut pipeline = STAGE.pipelines[usize::from(mode % 4)].clone();
    let mut seen = 0;
    for frame in &frames {
        let outcome = pipeline.step(frame);
        check(outcome);
        seen += outcome.foreground.len();
    }
    seen > 0
}

/// Kinds of changes.
const KINDS: u8 = 21;

/// One change, as its bytes say.
fn change(frames: &mut [Frame], mut given: Given) {
    let (f, s, kind) = (usize::from(given.u8()) % FRAMES, usize::from(given.u8()), given.u8() % KINDS);
    let at = usize::from(given.u16());
    let value = given.0;
    let (real, whole) = (Given(value).f64(), Given(value).i64());
    let frame = &mut frames[f];
    match kind {
        0 => frame.time_ns = whole,
        1 => frames[f..].iter_mut().for_each(|frame| frame.time_ns = frame.time_ns.saturating_add(whole)),
        2 => frame.index = whole as u64,
        _ => {
            let scans = frame.scans.len().max(1);
            let Some(scan) = frame.scans.get_mut(s % scans) else { return };
            match kind {
                3 => drop(frame.scans.remove(s % scans)),
                4 => {
                    let again = scan.clone();
                    frame.scans.push(again);
                    frame.scans.truncate(SCANS_MAX);
                }
                5 => scan.sensor = if at == usize::from(u16::MAX) { usize::MAX } else { at },
                6 => scan.site_from_sensor.translation_m[at % 3] = real,
                7 => scan.site_from_sensor.rotation.col_mut(at % 3)[at / 3 % 3] = real,
                8 => scan.cloud = Cloud::Unorganised(points(scan)),
                _ => change_cloud(&mut scan.cloud, kind, at, value),
            }
        }
    }
}

fn change_cloud(cloud: &mut Cloud, kind: u8, at: usize, value: &[u8]) {
    let (real, small, whole) = (Given(value).f64(), Given(value).f32(), Given(value).i64());
    match cloud {
        Cloud::Unorganised(points) => {
            let points_there = points.len().max(1);
            let Some(point) = points.get_mut(at % points_there) else { return };
            match kind % 4 {
                0 => point.position_m[at / 7 % 3] = small,
                1 => point.time_ns = whole,
                2 => point.reflectivity = small,
                _ => points.truncate(at),
            }
        }
        Cloud::Organised(image) => {
            let rays = image.range_m.len().max(1);
            let columns = image.columns.len().max(1);
            let column = image.columns.get_mut(at % columns);
            match kind {
                9 => image.range_m.iter_mut().skip(at % rays).take(1).for_each(|range_m| *range_m = small),
                10 => {
                    let count = usize::from(u16::from_le_bytes([value[4], value[5]]));
                    image.range_m.iter_mut().skip(at % rays).take(count).for_each(|range_m| *range_m = small);
                }
                11 => image.range_m.iter_mut().for_each(|range_m| *range_m *= small),
                12 => column.into_iter().for_each(|column| column.time_ns = whole),
                13 => column.into_iter().for_each(|column| column.azimuth_cdeg = small),
                14 => column.into_iter().for_each(|column| column.azimuth_rate_cdeg_per_ns = small),
                15 => image
                    .columns
                    .iter_mut()
                    .for_each(|column| column.time_ns = column.time_ns.saturating_add(whole)),
                16 => image.range_m.truncate(at),
                17 => image.columns.truncate(at),
                18 => image.reflectivity.truncate(at),
                19 => image.beams = image.beams.iter().take(at % 40).copied().collect(),
                _ => {
                    let mut beams = image.beams.to_vec();
                    let beams_there = beams.len().max(1);
                    if let Some(beam) = beams.get_mut(at % beams_there) {
                        match at / 64 % 4 {
                            0 => beam.elevation_rad = real,
                            1 => beam.direction[at % 3] = real,
                            2 => beam.origin_m[at % 3] = real,
                            _ => (beam.ring, beam.turned_ns) = (whole as u16, whole as u32),
                        }
                    }
                    image.beams = beams.into();
                }
            }
        }
    }
}

/// The points of a scan, as a driver gives them.
fn points(scan: &Scan) -> Vec<SensorPoint> {
    let Cloud::Organised(image) = &scan.cloud else { return Vec::new() };
    let (beams, most) = (image.beams.len().max(1), image.beams.len() * image.columns.len());
    let rays = image.range_m.iter().take(most).enumerate().filter(|(_, range_m)| **range_m > 0.0);
    let point = |(ray, range_m): (usize, &f32)| {
        let (c, b) = (ray / beams, ray % beams);
        let position_m = image.point_m(c, b, f64::from(*range_m)).as_vec3().to_array();
        SensorPoint { position_m, time_ns: image.columns[c].time_ns, reflectivity: 10.0 }
    };
    rays.map(point).collect()
}

/// What the target promises.
fn check(outcome: &Outcome) {
    let Outcome { foreground, clusters, detections, tracks, forecasts, blockages, losses, decisions, .. } =
        outcome;
    assert!(foreground.len() <= FOREGROUND_MAX, "{} points", foreground.len());
    assert!(foreground.iter().all(|point| point.position_m.is_finite()));
    assert!(clusters.iter().flatten().all(|point| (*point as usize) < foreground.len()));
    assert!(detections.len() <= clusters.len(), "{} of {}", detections.len(), clusters.len());
    for detection in detections {
        assert!(detection.position_m.is_finite() && detection.obb.half_m.is_finite(), "{detection:?}");
        assert!(detection.aabb.min_m.is_finite() && detection.aabb.max_m.is_finite(), "{detection:?}");
        assert!(
            detection.covariance_m2.is_none_or(|c| c.as_flattened().iter().all(|v| v.is_finite())),
            "{detection:?}"
        );
    }
    assert!(tracks.iter().all(is_finite), "{tracks:?}");
    assert_eq!(forecasts.len(), tracks.len());
    for forecast in forecasts {
        let finite = |step: &umbracast::forecast::Gaussian2| {
            step.mean_m.is_finite() && [step.xx_m2, step.xy_m2, step.yy_m2].iter().all(|v| v.is_finite())
        };
        assert!(forecast.steps.iter().all(finite), "{forecast:?}");
    }
    for blockage in blockages {
        assert!(blockage.p.iter().chain([&blockage.p_now]).all(|p| (0.0..=1.0).contains(p)), "{blockage:?}");
        for chance in [blockage.own, blockage.hall, blockage.any].into_iter().flatten() {
            assert!(chance.p.iter().chain([&chance.p_now]).all(|p| (0.0..=1.0).contains(p)), "{blockage:?}");
        }
    }
    for loss in losses {
        assert!(loss.steps_db.as_flattened().iter().chain(&loss.now_db).all(|db| db.is_finite()), "{loss:?}");
        assert!(loss.p_out.iter().chain([&loss.p_out_now]).all(|p| (0.0..=1.0).contains(p)), "{loss:?}");
    }
    assert!(
        decisions.iter().all(|d| d.saved_s.is_finite() && (0.0..=1.0).contains(&d.p_out)),
        "{decisions:?}"
    );
}

/// Whether every number of a track is one.
pub(super) fn is_finite(track: &Track) -> bool {
    let angles = [track.heading_rad, track.heading_sigma_rad, track.gait.phase_rad, track.gait.concentration];
    let sizes = [track.height_m, track.height_sigma_m, track.width_scale, track.width_scale_sigma];
    track.position_m.is_finite()
        && track.velocity_mps.is_finite()
        && track.gait.hand_swing.iter().chain(&track.gait.hand_swing_sigma).all(|value| value.is_finite())
        && track.covariance.as_flattened().iter().chain(&angles).chain(&sizes).all(|value| value.is_finite())
        && track.aabb.min_m.is_finite()
        && track.aabb.max_m.is_finite()
        && track.obb.center_m.is_finite()
}
