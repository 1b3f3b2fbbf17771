//! Which device does which person carry? Told by the power that access points hear, beside the truth: after a blind start, and after
//! the ids of people who passed each other were swapped.
//!
//! ```sh
//! cargo run --release -p umbracast-network --example bindings -- 130000 4 20
//! ```
//!
//! First seed, scenes, people.

use std::error::Error;

use rayon::prelude::*;
use umbracast::lidar::Assembler;
use umbracast::radio::{Binder, Binding};
use umbracast::site::{AccessPoint, Radio};
use umbracast::track::Track;
use umbracast::{Config, Health, Mode, Pipeline};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_network::reports;
use umbracast_network::truth::{Air, Counted, TICK_NS, Traces, TruthModel};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

const PLACES_M: [[f64; 3]; 4] = [[14.0, 0.0, 2.0], [0.0, 14.0, 3.0], [-14.0, 0.0, 3.0], [0.0, -14.0, 3.0]];
const SECONDS: u64 = 40;
const RADIUS_M: f64 = 12.5;
/// Devices have names that say nothing.
const FIRST_DEVICE: u64 = 7000;
/// Seconds after the start at which a binding is asked.
const ASKED_S: [f64; 5] = [1.0, 2.0, 5.0, 10.0, 30.0];
/// From here on those who come this near to each other are swapped, once each; asked so long after.
const SWAPS_FROM_S: f64 = 12.0;
const NEAR_M: f64 = 0.8;
const AFTER_SWAP_S: f64 = 10.0;
/// A track is a person's where it is no farther from him.
const SAME_M: f64 = 0.5;

/// How often it was right, and how often somebody was followed whose device could have been found.
#[derive(Clone, Copy, Default)]
struct Share(usize, usize);

impl Share {
    fn note(&mut self, right: bool) {
        *self = Self(self.0 + usize::from(right), self.1 + 1);
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let number = |n: usize, usual: u64| std::env::args().nth(n).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (first, scenes, people) = (number(1, 130_000), number(2, 4), number(3, 20) as usize);
    println!(
        "{scenes} scenes of {people} people who stroll for {SECONDS} s, seeds from {first}, four access points at 28 GHz, truth by model B. \
         Reports every 20 ms in steps of 1 dB, 100 ms late."
    );
    let counts: Vec<(Vec<Share>, Share)> =
        (first..first + scenes).into_par_iter().map(|seed| scene(people, seed)).collect::<Result<_, _>>()?;
    let told = |name: &str, shares: &mut dyn Iterator<Item = Share>| {
        let sum = shares.fold(Share::default(), |a, b| Share(a.0 + b.0, a.1 + b.1));
        println!("{name:42} {:.3} of {}", sum.0 as f64 / sum.1.max(1) as f64, sum.1);
    };
    for (i, asked_s) in ASKED_S.iter().enumerate() {
        told(&format!("bound right {asked_s} s after a blind start"), &mut counts.iter().map(|c| c.0[i]));
    }
    told(&format!("bound right {AFTER_SWAP_S} s after a swap"), &mut counts.iter().map(|c| c.1));
    Ok(())
}

fn config() -> Config {
    let mut config = Config::for_mode(Mode::Default);
    let place = |(i, position_m): (usize, [f64; 3])| AccessPoint {
        name: format!("ap{i}"),
        position_m,
        radio: Some(Radio::default()),
    };
    config.site.access_points = PLACES_M.into_iter().enumerate().map(place).collect();
    config
}

/// Shares at the instants asked, and after swaps.
fn scene(people: usize, seed: u64) -> Result<(Vec<Share>, Share), String> {
    let config = config();
    let site = &config.site;
    let mut pipeline = Pipeline::new(&config, None).map_err(|e| e.to_string())?;
    let empty = empty_frames(site, seed).map_err(|e| e.to_string())?;
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    let sensors = Sensors::new(site, seed).map_err(|e| e.to_string())?;
    let mut scene =
        Scene::in_hall(strolling(Preset::Orca03, people, RADIUS_M, seed, SECONDS), site, &sensors, seed);
    let ticks = (SECONDS * 100) as usize;
    let airs = [Air::of(site, TruthModel::ModelB)];
    let counted = Counted { own_body: false, reflections_db: 0.0 };
    let [traces] = &Traces::of_scene(site, scene.walkers(), ticks, &airs, counted)[..] else {
        return Err("one air has one truth".to_owned());
    };
    let device_of = |person: usize| FIRST_DEVICE + (person * 7 + 3) as u64 % people as u64;
    let reports = reports::of_scene(site, traces, seed, device_of);
    let mut assembler = Assembler::new(site).map_err(|e| e.to_string())?;
    let (mut health, mut waiting) = (Health::default(), &reports[..]);
    // One network hears what LiDARs see; for the other, tracks are swapped.
    let [mut plain, mut swapped] = [Binder::new(site), Binder::new(site)];
    let (mut bindings, mut swaps) = (Vec::new(), Swaps::default());
    let (mut shares, mut after_swap) = (vec![Share::default(); ASKED_S.len()], Share::default());
    while let Some(frame) = scene.next_frame() {
        push(&mut assembler, &frame.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            let outcome = pipeline.step(&frame);
            let arrived = reports::take_arrived(&mut waiting, outcome.time_ns);
            [&mut plain, &mut swapped].iter_mut().for_each(|b| b.hear(arrived));
            let now_s = outcome.time_ns as f64 * 1e-9;
            let tick = ((outcome.time_ns / TICK_NS) as usize).min(ticks - 1);
            plain.bind(outcome.time_ns, &outcome.tracks, &outcome.losses, &mut bindings);
            for person in 0..people {
                let Some(track) = carrier(traces, tick, person, &outcome.tracks) else { continue };
                for (share, asked_s) in shares.iter_mut().zip(ASKED_S) {
                    if (now_s - asked_s).abs() < 0.05 {
                        share.note(bound(&bindings, device_of(person)) == Some(track));
                    }
                }
            }
            if now_s >= SWAPS_FROM_S {
                swaps.look(now_s, &outcome.tracks);
            }
            let mut tracks = outcome.tracks.clone();
            let mut losses = outcome.losses.clone();
            tracks.iter_mut().for_each(|track| track.id = swaps.now(track.id));
            losses.iter_mut().for_each(|loss| loss.track = swaps.now(loss.track));
            tracks.sort_by_key(|track| track.id);
            losses.sort_by_key(|loss| (loss.access_point, loss.track));
            swapped.bind(outcome.time_ns, &tracks, &losses, &mut bindings);
            for person in 0..people {
                let Some(track) = carrier(traces, tick, person, &outcome.tracks) else { continue };
                if swaps.since_s(track).is_some_and(|s| (now_s - s - AFTER_SWAP_S).abs() < 0.05) {
                    after_swap.note(bound(&bindings, device_of(person)) == Some(swaps.now(track)));
                }
            }
        }
    }
    Ok((shares, after_swap))
}

/// Ids that were exchanged, and when.
#[derive(Default)]
struct Swaps(Vec<(u64, u64, f64)>);

impl Swaps {
    /// Swaps who is near to each other and was not swapped yet.
    fn look(&mut self, now_s: f64, tracks: &[Track]) {
        for (i, a) in tracks.iter().enumerate() {
            for b in &tracks[i + 1..] {
                let near = a.position_m.distance(b.position_m) < NEAR_M && a.confirmed && b.confirmed;
                if near && self.since_s(a.id).is_none() && self.since_s(b.id).is_none() {
                    self.0.push((a.id, b.id, now_s));
                }
            }
        }
    }

    fn since_s(&self, track: u64) -> Option<f64> {
        self.0.iter().find(|(a, b, _)| *a == track || *b == track).map(|(_, _, s)| *s)
    }

    fn now(&self, track: u64) -> u64 {
        let other = |&(a, b, _): &(u64, u64, f64)| match track {
            _ if track == a => Some(b),
            _ if track == b => Some(a),
            _ => None,
        };
        self.0.iter().find_map(other).unwrap_or(track)
    }
}

/// The track that follows a person.
fn carrier(traces: &Traces, tick: usize, person: usize, tracks: &[Track]) -> Option<u64> {
    let place_m = traces.place_m(tick, person);
    let near = tracks.iter().filter(|track| track.confirmed).map(|t| (t.id, t.position_m.distance(place_m)));
    near.filter(|(_, m)| *m <= SAME_M).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(id, _)| id)
}

/// The likeliest track of a device.
fn bound(bindings: &[Binding], device: u64) -> Option<u64> {
    bindings.iter().find(|binding| binding.device == device).map(|binding| binding.track)
}
