//! The tracker on made-up detections: noise, misses, false ones, crossings, pairs.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use umbracast::config::TrackConfig;
use umbracast::detect::Detection;
use umbracast::geometry::{Aabb, DVec2, DVec3, Obb, Pose};
use umbracast::lidar::{Cloud, Fan, Frame, SECTORS, Scan, View, Views};
use umbracast::track::numbers::MotionModel;
use umbracast::track::{MixtureTracker, Numbers, Track, Tracker};
use umbracast::{Config, Mode, Site};

/// What a detection tells of its error: one sigma of an axis.
const NOISE_M: f64 = 0.06;

/// People who walk straight on: where from, and how fast.
type Walkers = [(DVec2, DVec2)];

/// A frame of one sensor high above the middle, whose beams are not known: everybody is in sight.
fn frame(index: u64) -> Frame {
    let site_from_sensor = Pose { translation_m: DVec3::new(0.0, 0.0, 30.0), ..Pose::IDENTITY };
    let scan = Scan { sensor: 0, site_from_sensor, cloud: Cloud::Unorganised(Vec::new()) };
    Frame { index, time_ns: (index as i64 + 1) * 100_000_000, scans: vec![scan] }
}

/// What all sensors of the default hall look at in a full turn of 32 beams each.
fn full_turn(index: u64) -> Views {
    let elevations_rad =
        (0..32).map(|beam| (f64::from(beam) * 1.333 - 30.67_f64).to_radians()).collect::<Vec<_>>();
    let views = open_site().sensors.into_iter().enumerate().map(|(sensor, hung)| View {
        sensor,
        site_from_sensor: hung.site_from_sensor(),
        fan: Some(Fan { elevations_rad: elevations_rad.clone(), columns: [24; SECTORS] }),
    });
    Views { time_ns: frame(index).time_ns, of_scans: views.collect() }
}

fn detection(position_m: DVec2, time_ns: i64) -> Detection {
    let aabb = Aabb {
        min_m: (position_m - DVec2::splat(0.25)).extend(0.1),
        max_m: (position_m + DVec2::splat(0.25)).extend(1.7),
    };
    let obb = Obb::from_aabb(&aabb);
    let covariance_m2 = Some([[NOISE_M * NOISE_M, 0.0], [0.0, NOISE_M * NOISE_M]]);
    Detection {
        position_m,
        covariance_m2,
        z_m: 0.9,
        time_ns,
        points: 30,
        gait: None,
        reaches: Vec::new(),
        bands: Default::default(),
        overhead: None,
        facing: None,
        full_body: true,
        top_m: 1.7,
        top_diagonal_m: 0.2,
        aabb,
        obb,
    }
}

/// The site without anything that could hide somebody.
fn open_site() -> Site {
    let mut site = Config::for_mode(Mode::Default).site;
    (site.pillars, site.furniture) = (Vec::new(), Vec::new());
    site
}

/// What the sensors give: positions at times within the frame, with noise, misses and false detections.
struct World<'a> {
    walkers: &'a Walkers,
    noise_m: f64,
    miss: f64,
    false_per_frame: usize,
    rng: Pcg64,
}

impl World<'_> {
    fn at(&self, person: usize, time_ns: i64) -> DVec2 {
        let (start, velocity) = self.walkers[person];
        start + velocity * (time_ns as f64 * 1e-9)
    }

    fn detections(&mut self, frame: &Frame) -> Vec<Detection> {
        let noise = Normal::new(0.0, self.noise_m).unwrap();
        let mut all = Vec::new();
        for person in 0..self.walkers.len() {
            if !self.rng.random_bool(self.miss) {
                let time_ns = frame.time_ns - self.rng.random_range(0..100_000_000);
                let error = DVec2::new(noise.sample(&mut self.rng), noise.sample(&mut self.rng));
                all.push(detection(self.at(person, time_ns) + error, time_ns));
            }
        }
        for _ in 0..self.false_per_frame {
            let place = DVec2::new(self.rng.random_range(-9.0..9.0), self.rng.random_range(-9.0..9.0));
            all.push(detection(place, frame.time_ns - 50_000_000));
        }
        all
    }
}

fn world(walkers: &Walkers, seed: u64) -> World<'_> {
    World { walkers, noise_m: 0.05, miss: 0.0, false_per_frame: 0, rng: Pcg64::seed_from_u64(seed) }
}

/// Confirmed tracks of every frame.
fn follow(config: &TrackConfig, mut world: World, frames: u64) -> Vec<Vec<Track>> {
    let mut tracker = Tracker::new(config, &open_site());
    each_frame(&mut world, frames, |frame, detections, tracks| {
        tracker.update(&Views::of(frame), detections, tracks)
    })
}

fn follow_with(mut tracker: MixtureTracker, mut world: World, frames: u64) -> Vec<Vec<Track>> {
    each_frame(&mut world, frames, |frame, detections, tracks| {
        tracker.update(&Views::of(frame), detections, tracks)
    })
}

fn each_frame(
    world: &mut World,
    frames: u64,
    mut update: impl FnMut(&Frame, &[Detection], &mut Vec<Track>),
) -> Vec<Vec<Track>> {
    let mut tracks = Vec::new();
    (0..frames)
        .map(|index| {
            let frame = frame(index);
            update(&frame, &world.detections(&frame), &mut tracks);
            tracks.iter().filter(|t| t.confirmed).cloned().collect()
        })
        .collect()
}

fn nearest(tracks: &[Track], position_m: DVec2) -> &Track {
    let distance = |t: &&Track| t.position_m.distance(position_m);
    tracks.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
}

const CROSSING: [(DVec2, DVec2); 2] =
    [(DVec2::new(-5.0, -0.3), DVec2::new(1.0, 0.06)), (DVec2::new(5.0, 0.3), DVec2::new(-1.0, -0.06))];
const PAIR: [(DVec2, DVec2); 2] =
    [(DVec2::new(-5.0, 0.0), DVec2::new(1.2, 0.0)), (DVec2::new(-5.0, 0.5), DVec2::new(1.2, 0.0))];

#[test]
fn one_walker_keeps_one_track_through_noise_misses_and_false_detections() {
    let config = Config::for_mode(Mode::Default).track;
    let walkers = [(DVec2::new(-6.0, 2.0), DVec2::new(1.2, -0.3))];
    let world = World { miss: 0.1, false_per_frame: 1, ..world(&walkers, 1) };
    let all = follow(&config, world, 100);
    let mut ids = Vec::new();
    for (index, tracks) in all.iter().enumerate().skip(3) {
        let truth = walkers[0].0 + walkers[0].1 * (0.1 * (index + 1) as f64);
        let track = nearest(tracks, truth);
        assert!(track.position_m.distance(truth) < 0.3, "frame {index}: {}", track.position_m);
        ids.push(track.id);
    }
    ids.dedup();
    assert_eq!(ids.len(), 1, "identities in turn: {ids:?}");
    let false_tracks: usize = all.iter().map(|tracks| tracks.len().saturating_sub(1)).sum();
    assert!(false_tracks <= 5, "{false_tracks} frames with a track of nobody");
}

#[test]
fn people_who_pass_each_other_keep_their_tracks() {
    for mode in [Mode::Paper, Mode::Default] {
        let config = Config::for_mode(mode).track;
        for seed in 0..10 {
            let all = follow(&config, world(&CROSSING, seed), 100);
            let (first, last) = (&all[20], &all[99]);
            for (start, velocity) in CROSSING {
                let before = nearest(first, start + velocity * 2.1).id;
                let after = nearest(last, start + velocity * 10.0).id;
                assert_eq!(before, after, "{} seed {seed}", mode.name());
            }
        }
    }
}

#[test]
fn a_pair_half_a_metre_apart_is_two_tracks_in_default_and_one_in_hdl() {
    for (mode, expected) in [(Mode::Default, 2), (Mode::Hdl, 1)] {
        let config = Config::for_mode(mode).track;
        for seed in 0..10 {
            let all = follow(&config, world(&PAIR, seed), 50);
            assert_eq!(all[49].len(), expected, "{} seed {seed}", mode.name());
        }
    }
}

#[test]
fn two_tracks_on_the_halves_of_one_body_become_one() {
    // They meet at 0.135 m/s: nearer than two trunks can stand from 3.7 s on.
    let ahead = DVec2::new(1.0, 0.0);
    let halves = [(DVec2::new(-5.0, 0.0), ahead), (DVec2::new(-5.0, 0.8), ahead - DVec2::new(0.0, 0.135))];
    let config = Config::for_mode(Mode::Default).track;
    for seed in 0..10 {
        let all = follow(&config, World { noise_m: 0.01, ..world(&halves, seed) }, 46);
        assert_eq!((all[35].len(), all[45].len()), (2, 1), "seed {seed}");
    }
}

#[test]
fn who_is_out_of_sight_for_long_is_not_told_but_known_again() {
    let config = Config::for_mode(Mode::Default).track;
    let mut tracker = Tracker::new(&config, &open_site());
    let mut tracks = Vec::new();
    let mut told = Vec::new();
    for index in 0..53 {
        let hidden = (20..48).contains(&index);
        let mut frame = frame(index);
        let seen = detection(DVec2::new(0.1 * index as f64, 0.0), frame.time_ns);
        if hidden {
            frame.scans.clear(); // the sensor is silent, so nobody can be seen
        }
        let seen = if hidden { &[][..] } else { std::slice::from_ref(&seen) };
        tracker.update(&Views::of(&frame), seen, &mut tracks);
        told.push(tracks[..].iter().map(|track| (track.id, track.confirmed)).collect::<Vec<_>>());
    }
    assert_eq!(told[22], [(0, true)]);
    assert_eq!(told[47], [(0, false)]);
    assert_eq!(told[52], [(0, true)]);
}

#[test]
fn pieces_of_a_person_keep_a_track_and_start_none() {
    let config = Config::for_mode(Mode::Default).track;
    let followed = |first_piece: u64| {
        let mut tracker = Tracker::new(&config, &open_site());
        let mut tracks = Vec::new();
        for index in 0..30 {
            let frame = frame(index);
            let seen = detection(DVec2::new(0.1 * index as f64, 0.0), frame.time_ns);
            let piece = Detection { full_body: index < first_piece, ..seen };
            tracker.update(&Views::of(&frame), &[piece], &mut tracks);
        }
        tracks.into_iter().filter(|track| track.confirmed).collect::<Vec<_>>()
    };
    let [kept] = &followed(10)[..] else { panic!("expected one track") };
    assert!(kept.position_m.distance(DVec2::new(2.9, 0.0)) < 0.1, "{}", kept.position_m);
    assert_eq!(followed(0), []);
}

/// How many are told of in each of 30 frames in which `seen` is found at a time.
fn told(seen: impl Fn(u64, i64) -> Vec<Detection>) -> Vec<usize> {
    told_in(|k| Views::of(&frame(k)), seen)
}

/// The same in 30 frames of what sensors see.
fn told_in(views: impl Fn(u64) -> Views, seen: impl Fn(u64, i64) -> Vec<Detection>) -> Vec<usize> {
    let mut tracker = Tracker::new(&Config::for_mode(Mode::Default).track, &open_site());
    let mut tracks = Vec::new();
    let after = |k: u64| {
        let views = views(k);
        tracker.update(&views, &seen(k, views.time_ns), &mut tracks);
        tracks.iter().filter(|track| track.confirmed).count()
    };
    (0..30).map(after).collect()
}

/// Somebody at a place along x who shows so many points.
fn somebody_at(x_m: f64, points: u32, time_ns: i64) -> Detection {
    Detection { points, ..detection(DVec2::new(x_m, 8.0), time_ns) }
}

#[test]
fn what_shows_beside_somebody_is_somebody_if_it_shows_legs_or_legs_cannot_be_seen() {
    let most = |beside_m: f64, lowest_m: f64, frames: std::ops::Range<u64>| {
        let seen = |k: u64, time_ns: i64| {
            let mut beside = somebody_at(beside_m, 12, time_ns);
            beside.aabb.min_m.z = lowest_m;
            let mut seen = vec![somebody_at(0.0, 100, time_ns), somebody_at(1.4, 100, time_ns)];
            seen.extend(frames.contains(&k).then_some(beside));
            seen
        };
        told(seen).into_iter().max().unwrap()
    };
    assert_eq!(most(0.7, 1.0, 10..15), 2, "half a second of a hand");
    assert_eq!(most(0.7, 1.0, 10..25), 3, "who has come out from behind, or cannot be seen below");
    assert_eq!(most(0.7, 0.1, 10..13), 3, "who stands on legs");
    assert_eq!(most(-1.2, 1.0, 10..13), 3, "out of an arm's reach");
}

#[test]
fn what_shows_no_legs_beside_somebody_where_they_would_be_seen_is_never_anybody() {
    let most = |lowest_m: f64| {
        let seen = |k: u64, time_ns: i64| {
            let mut beside = somebody_at(0.7, 12, time_ns);
            beside.aabb.min_m.z = lowest_m;
            let mut seen = vec![somebody_at(0.0, 100, time_ns)];
            seen.extend((k >= 5).then_some(beside));
            seen
        };
        told_in(full_turn, seen).into_iter().max().unwrap()
    };
    assert_eq!([most(1.0), most(0.1)], [1, 2]);
}

#[test]
fn who_shows_most_of_a_body_is_confirmed_in_two_frames_and_who_shows_less_in_five() {
    let confirmed_after = |points: u32| {
        let told = told_in(full_turn, |_, time_ns| vec![somebody_at(0.0, points, time_ns)]);
        1 + told.iter().position(|&people| people == 1).expect("somebody")
    };
    assert_eq!([confirmed_after(200), confirmed_after(12)], [2, 5]);
}

#[test]
fn what_somebody_pushes_is_nobody_and_a_child_ahead_is_somebody() {
    let at_last = |long_m: f64, ahead_m: f64| {
        let seen = |k: u64, time_ns: i64| {
            let at_m = DVec2::new(0.1 * k as f64, 8.0);
            let mut low = detection(at_m + DVec2::X * ahead_m, time_ns);
            (low.top_m, low.aabb.max_m.z) = (1.0, 1.0);
            low.aabb.max_m.x = low.aabb.min_m.x + long_m;
            low.aabb.max_m.y = low.aabb.min_m.y + 0.25;
            vec![detection(at_m, time_ns), low]
        };
        told(seen)[29]
    };
    assert_eq!(at_last(0.8, 0.9), 1, "a pram");
    assert_eq!(at_last(0.25, 0.9), 2, "a child");
    assert_eq!(at_last(0.8, 2.0), 2, "out of arms' reach");
}

/// A tracker and its tracks after so many frames of somebody who stands.
fn stood(frames: u64) -> (Tracker, Vec<Track>) {
    let mut tracker = Tracker::new(&Config::for_mode(Mode::Default).track, &open_site());
    let mut tracks = Vec::new();
    for index in 0..frames {
        let frame = frame(index);
        tracker.update(&Views::of(&frame), &[detection(DVec2::X, frame.time_ns)], &mut tracks);
    }
    (tracker, tracks)
}

#[test]
fn somebody_who_leaves_is_forgotten_within_half_a_second() {
    let (mut tracker, mut tracks) = stood(20);
    assert_eq!(tracks.len(), 1);
    for index in 20..25 {
        tracker.update(&Views::of(&frame(index)), &[], &mut tracks);
    }
    assert!(tracks.is_empty(), "{tracks:?}");
}

#[test]
fn somebody_whom_no_sensor_sees_is_kept_for_three_seconds() {
    let (mut tracker, mut tracks) = stood(20);
    let blind = |index| Frame { scans: Vec::new(), ..frame(index) };
    for index in 20..50 {
        tracker.update(&Views::of(&blind(index)), &[], &mut tracks);
        assert_eq!(tracks.len(), 1, "frame {index}");
    }
    for index in 50..52 {
        tracker.update(&Views::of(&blind(index)), &[], &mut tracks);
    }
    assert!(tracks.is_empty());
}

#[test]
fn detections_that_come_without_scans_are_believed_and_missed() {
    let mut tracker = MixtureTracker::new(&Config::default().track, &open_site());
    let mut tracks = Vec::new();
    let mut tell = |k: u64, places_m: &[DVec2]| {
        let views = Views { of_scans: Vec::new(), ..full_turn(k) };
        let seen: Vec<_> = places_m.iter().map(|&place_m| detection(place_m, views.time_ns)).collect();
        tracker.update(&views, &seen, &mut tracks);
        tracks.clone()
    };
    let walker_m = |k: u64| DVec2::new(0.12 * k as f64, 0.0);
    let told: Vec<_> = (0..10).map(|k| tell(k, &[walker_m(k), DVec2::new(3.0, 3.0)])).collect();
    assert!(told[2..].iter().zip(2..).all(|(tracks, k)| tracks[0].position_m.distance(walker_m(k)) < 0.05));
    // Who is found no more, while others are, is gone.
    assert_eq!((10..20).map(|k| tell(k, &[walker_m(k)]).len()).last(), Some(1));
}

#[test]
fn frames_repeated_or_late_change_nothing() {
    let (mut tracker, mut tracks) = stood(10);
    let before = tracks.clone();
    for index in [9, 3] {
        let frame = frame(index);
        tracker.update(&Views::of(&frame), &[detection(DVec2::Y, frame.time_ns)], &mut tracks);
        assert_eq!(tracks, before);
    }
}

#[test]
fn the_order_of_detections_does_not_matter() {
    let walkers: Vec<(DVec2, DVec2)> =
        (0..12).map(|i| (DVec2::from_angle(f64::from(i)) * 4.0, -DVec2::from_angle(f64::from(i)))).collect();
    for mode in Mode::ALL {
        let config = Config::for_mode(mode).track;
        let (mut one, mut other) = (Tracker::new(&config, &open_site()), Tracker::new(&config, &open_site()));
        let (mut tracks, mut others) = (Vec::new(), Vec::new());
        let mut world = World { miss: 0.1, false_per_frame: 3, ..world(&walkers, 7) };
        for index in 0..80 {
            let frame = frame(index);
            let mut detections = world.detections(&frame);
            one.update(&Views::of(&frame), &detections, &mut tracks);
            detections.reverse();
            detections.rotate_left(index as usize % 5);
            other.update(&Views::of(&frame), &detections, &mut others);
            assert_eq!(tracks, others, "{} frame {index}", mode.name());
        }
    }
}

/// The normalised squared error of (x, y, vx, vy) has mean 4 if the covariance is honest.
#[test]
fn the_covariance_is_honest_about_noise_of_the_size_it_is_told() {
    // One model and a walker who keeps to it: nothing but the filter's own account is tested.
    let model = MotionModel { acceleration_psd_m2ps3: 1e-6, share: 1.0, standing_mps: None };
    let numbers = Numbers {
        noise_floor_m: 0.05,
        noise_share: 0.0,
        lasting_share: 0.0,
        sway_m: [0.0; 2],
        motion_models: vec![model],
        ..Numbers::new(&Config::default().track)
    };
    let walkers = [(DVec2::new(-6.0, 2.0), DVec2::new(1.2, -0.3))];
    let (mut sum, mut n) = (0.0, 0);
    for seed in 0..200 {
        let tracker = MixtureTracker::with_numbers(numbers.clone(), &open_site());
        let all = follow_with(tracker, world(&walkers, seed), 30);
        let track = nearest(&all[29], DVec2::ZERO);
        let truth = walkers[0].0 + walkers[0].1 * 3.0;
        let (p, v) = (track.position_m - truth, track.velocity_mps - walkers[0].1);
        sum += squared_mahalanobis(&track.covariance, [p.x, p.y, v.x, v.y]);
        n += 1;
    }
    // Chi-square with 4 n degrees of freedom: its mean over n is 4 with a spread of sqrt(8 / n).
    let (mean, spread) = (sum / f64::from(n), (8.0 / f64::from(n)).sqrt());
    assert!((mean - 4.0).abs() < 1.96 * spread, "mean {mean}, band 4 +- {}", 1.96 * spread);
}

/// A body that sways 2 cm to each side, 0.92 times a second as somebody 1.75 m tall does at 1.4 m/s.
#[test]
fn the_sway_of_a_walking_body_is_not_taken_for_turns() {
    let swaying = Numbers { noise_share: 0.05, ..Numbers::new(&Config::default().track) };
    let rigid = Numbers { sway_m: [0.0; 2], noise_share: 0.2, ..swaying.clone() };
    let worst_mps = |numbers: Numbers| {
        let mut tracker = MixtureTracker::with_numbers(numbers, &open_site());
        let mut tracks = Vec::new();
        let mut worst_mps: f64 = 0.0;
        for index in 0..80 {
            let frame = frame(index);
            let t_s = frame.time_ns as f64 * 1e-9;
            let sway_m = 0.02 * (std::f64::consts::TAU * 0.92 * t_s).sin();
            let at_m = DVec2::new(1.4 * t_s - 6.0, sway_m);
            tracker.update(&Views::of(&frame), &[detection(at_m, frame.time_ns)], &mut tracks);
            if index > 40 {
                worst_mps = worst_mps.max(tracks[0].velocity_mps.y.abs());
            }
        }
        worst_mps
    };
    let (followed, rigid) = (worst_mps(swaying), worst_mps(rigid));
    assert!(followed < 0.015 && followed < 0.5 * rigid, "{followed} and {rigid} m/s");
}

#[test]
fn the_heading_is_open_until_somebody_walks_and_again_with_the_time_one_stands() {
    let config = Config::for_mode(Mode::Default).track;
    let mut tracker = Tracker::new(&config, &open_site());
    let (mut tracks, mut sigmas_rad) = (Vec::new(), Vec::new());
    for index in 0..90 {
        let frame = frame(index);
        let walked_m = 0.12 * index.clamp(20, 60) as f64;
        let seen = detection(DVec2::new(walked_m - 4.0, 0.0), frame.time_ns);
        tracker.update(&Views::of(&frame), &[seen], &mut tracks);
        sigmas_rad.push(tracks[0].heading_sigma_rad);
    }
    assert!(sigmas_rad[15] > 1.0, "standing from the start: {}", sigmas_rad[15]);
    assert!(sigmas_rad[59] < 0.1, "walking: {}", sigmas_rad[59]);
    assert!(sigmas_rad[89] > 0.8, "stood for 3 s: {}", sigmas_rad[89]);
}

/// e' P^-1 e by elimination.
fn squared_mahalanobis(covariance: &[[f64; 4]; 4], error: [f64; 4]) -> f64 {
    let (mut a, mut e) = (*covariance, error);
    for i in 0..4 {
        for j in i + 1..4 {
            let factor = a[j][i] / a[i][i];
            for k in i..4 {
                a[j][k] -= factor * a[i][k];
            }
            e[j] -= factor * e[i];
        }
    }
    (0..4).map(|i| e[i] * e[i] / a[i][i]).sum()
}
