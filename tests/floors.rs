//! Floors that slope or have a step: people on them are detected and measured, and links predicted, as on a level
//! floor.

use umbracast::blockage::Blockage;
use umbracast::config::{BlockageMethod, Config, Mode};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Packet};
use umbracast::pipeline::Outcome;
use umbracast::site::Floor;
use umbracast::{Health, Pipeline, STEP_NS, Site};
use umbracast_sim::crowd::{Crowd, Preset, strolling};
use umbracast_sim::scene::{PersonTruth, Scene};

const SEED: u64 = 200_700;
const LIFT_M: f64 = 0.6;

/// What a pipeline makes of a crowd in a hall, frame by frame, with the truth.
fn watched(hall: &Site, config: &Config, crowd: Crowd) -> Vec<(Outcome, Vec<PersonTruth>)> {
    let mut pipeline = Pipeline::new(config, None).unwrap();
    let (mut assembler, mut health) = (Assembler::new(&config.site).unwrap(), Health::default());
    let mut push = |assembler: &mut Assembler, packets: Vec<Vec<Packet>>| {
        let of =
            |(sensor, packets): (usize, Vec<Packet>)| packets.into_iter().map(move |packet| (sensor, packet));
        let mut all: Vec<(usize, Packet)> = packets.into_iter().enumerate().flat_map(of).collect();
        all.sort_by_key(|(_, packet)| packet.time_ns);
        all.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
    };
    for packets in Scene::empty(hall, SEED, 20).unwrap() {
        push(&mut assembler, packets);
        std::iter::from_fn(|| assembler.pop()).for_each(|frame| pipeline.learn_empty(&frame));
    }
    let mut assembler = Assembler::new(&config.site).unwrap();
    let mut scene = Scene::new(crowd, hall, SEED).unwrap();
    let (mut truths, mut seen) = (Vec::new(), Vec::new());
    while let Some(frame) = scene.next_frame() {
        truths.push(frame.people);
        push(&mut assembler, frame.packets);
        while let Some(frame) = assembler.pop() {
            let truth = truths[(frame.time_ns / STEP_NS - 1) as usize].clone();
            seen.push((pipeline.step(&frame).clone(), truth));
        }
    }
    seen
}

fn ramp() -> Config {
    Config::with_overlay(Mode::Default, include_str!("../config/sites/ramp.toml"), "ramp.toml").unwrap()
}

/// The same hall with everything so much higher.
fn lifted(mut site: Site) -> Site {
    let [least, most] = site.hall.bounds_m().map(|corner| corner * 1.1);
    let outline_m = vec![least.to_array(), [most.x, least.y], most.to_array(), [least.x, most.y]];
    site.hall.floors = vec![Floor { outline_m, height_m: LIFT_M, slope: [0.0; 2] }];
    site.hall.height_m += LIFT_M;
    site.sensors.iter_mut().for_each(|sensor| sensor.position_m[2] += LIFT_M);
    site.access_points.iter_mut().for_each(|ap| ap.position_m[2] += LIFT_M);
    site
}

fn links(outcome: &Outcome) -> Vec<(usize, u64, f64)> {
    let of = |link: &Blockage| (link.access_point, link.track, link.p[2]);
    outcome.blockages.iter().map(of).collect()
}

#[test]
fn a_hall_that_is_lifted_gives_the_same_people_and_links() {
    for method in [BlockageMethod::Probability, BlockageMethod::Algorithm1] {
        let mut config = Config::default();
        config.blockage.method = method;
        // A device in the hand, so that the owner's body is asked as well.
        (config.site.ue.forward_m, config.site.ue.left_m) = (0.3, -0.2);
        let crowd = || strolling(Preset::Orca03, 8, 8.0, SEED, 3);
        let below = watched(&config.site, &config, crowd());
        config.site = lifted(config.site);
        let above = watched(&config.site, &config, crowd());
        assert!(below.len() == above.len() && below.len() > 27, "{} frames", below.len());
        let mut blocked = 0;
        for ((below, _), (above, _)) in below.iter().zip(&above) {
            assert_eq!(below.tracks.len(), above.tracks.len());
            for (b, a) in below.tracks.iter().zip(&above.tracks) {
                let apart_m = b.position_m.distance(a.position_m);
                assert!(apart_m < 0.02 && (b.height_m - a.height_m).abs() < 0.02, "{apart_m} m");
                assert!((a.aabb.min_m.z - b.aabb.min_m.z - LIFT_M).abs() < 1e-9, "{:?}", a.aabb);
            }
            let pairs = links(below).into_iter().zip(links(above));
            let unlike = pairs.clone().filter(|(b, a)| (b.2 - a.2).abs() > 0.1).count();
            assert!(unlike <= 1, "{unlike} links differ");
            blocked += pairs.filter(|(_, a)| a.2 > 0.5).count();
        }
        assert!(blocked > 10, "{blocked} blocked links were compared");
    }
}

/// How many of the people in the last frames have a track that is as tall as they are, and how many tracks nobody has.
fn found(seen: &[(Outcome, Vec<PersonTruth>)], ramp: &Site) -> (f64, usize, f64) {
    let (mut all, mut of_who_is_there, mut tracks, mut height_errors_m) = (0, 0, 0, Vec::new());
    let steps_about = |at: DVec2| {
        let near =
            [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].map(|way| ramp.hall.floor_m(at + way * 0.7));
        near.iter().any(|m| (m - ramp.hall.floor_m(at)).abs() > 0.1)
    };
    for (outcome, people) in seen.iter().skip(20) {
        for person in people.iter().filter(|p| !steps_about(p.state.position_m)) {
            let track = outcome
                .tracks
                .iter()
                .find(|t| t.confirmed && t.position_m.distance(person.state.position_m) < 0.4);
            all += 1;
            of_who_is_there += usize::from(track.is_some());
            height_errors_m.extend(track.map(|track| (track.height_m - person.state.height_m).abs()));
        }
        tracks += outcome.tracks.iter().filter(|t| t.confirmed).count().saturating_sub(people.len());
    }
    let mean_m = height_errors_m.iter().sum::<f64>() / height_errors_m.len().max(1) as f64;
    (of_who_is_there as f64 / f64::from(all), tracks, mean_m)
}

#[test]
fn people_on_a_ramp_and_a_platform_are_followed_as_tall_as_they_are() {
    let told = ramp();
    let mut untold = told.clone();
    untold.site.hall.floors.clear();
    let crowd = || strolling(Preset::Orca03, 8, 10.0, SEED, 6);
    let [told, untold] =
        [&told, &untold].map(|config| found(&watched(&told.site, config, crowd()), &told.site));
    assert!(told.0 > 0.98 && told.1 == 0 && told.2 < 0.08, "{told:?}");
    assert!(untold.2 > told.2 + 0.05, "a pipeline that is not told thinks them taller: {untold:?}");
}
