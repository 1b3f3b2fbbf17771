//! What power that is heard adds to what LiDARs foresee: links blocked by any cause, now and within each window, told with and
//! without the reports of access points, beside the truth.
//!
//! ```sh
//! cargo run --release -p umbracast-network --example heard -- 132900 4 10
//! ```
//!
//! First seed, scenes, people. Whose a device is has to be found out from a blind start.

use std::error::Error;

use rayon::prelude::*;
use umbracast::blockage::Blockage;
use umbracast::lidar::Assembler;
use umbracast::site::{AccessPoint, Radio, Ue};
use umbracast::track::Track;
use umbracast::{Config, Health, Mode, Pipeline, STEPS};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_eval::score::bootstrap::Pooled;
use umbracast_eval::score::counts::Counts;
use umbracast_network::reports;
use umbracast_network::truth::{Air, Counted, Traces, TruthModel};
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::scene::{Scene, SceneFrame};
use umbracast_sim::sensor::Sensors;

const PLACES_M: [[f64; 3]; 4] = [[14.0, 0.0, 2.0], [0.0, 14.0, 3.0], [-14.0, 0.0, 3.0], [0.0, -14.0, 3.0]];
const SECONDS: u64 = 40;
const RADIUS_M: f64 = 12.5;
const IN_HAND: Ue = Ue { forward_m: 0.3, left_m: -0.2, height_share: 0.6, spread_m: 0.1 };
/// A track is a person's where it is no farther from him.
const SAME_M: f64 = 0.5;
/// Told now, and within so many steps.
const WINDOWS: [usize; 4] = [0, 1, 3, 9];
/// Probabilities are compared with how often they come true in so many equal parts.
const PARTS: usize = 10;

/// Instances of one window: what came of those told with a probability of each part, and of those not blocked now alone.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    parts: [(f64, f64, f64); PARTS],
    all: Counts,
    onset: Counts,
}

impl Window {
    fn note(&mut self, p: f64, comes: bool, is_blocked: bool) {
        let (number, sum, came) = &mut self.parts[((p * PARTS as f64) as usize).min(PARTS - 1)];
        (*number, *sum, *came) = (*number + 1.0, *sum + p, *came + f64::from(u8::from(comes)));
        self.all.count(comes, p >= 0.5);
        if !is_blocked {
            self.onset.count(comes, p >= 0.5);
        }
    }

    fn plus(mut self, other: &Self) -> Self {
        for (a, b) in self.parts.iter_mut().zip(&other.parts) {
            *a = (a.0 + b.0, a.1 + b.1, a.2 + b.2);
        }
        (self.all, self.onset) = (self.all.plus(&other.all, 1), self.onset.plus(&other.onset, 1));
        self
    }

    fn ece(&self) -> f64 {
        let all: f64 = self.parts.iter().map(|part| part.0).sum();
        self.parts.iter().map(|(_, sum, came)| (sum - came).abs()).sum::<f64>() / all.max(1.0)
    }
}

fn f1(counts: Counts) -> f64 {
    counts.f1().unwrap_or_default()
}

/// By whether reports were heard, and by window.
type Scored = [[Window; WINDOWS.len()]; 2];

fn main() -> Result<(), Box<dyn Error>> {
    let number = |n: usize, usual: u64| std::env::args().nth(n).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (first, scenes, people) = (number(1, 132_900), number(2, 4), number(3, 10) as usize);
    println!(
        "{scenes} scenes of {people} people who stroll for {SECONDS} s, seeds from {first}, four access points, devices in hands that move. Reports every \
         20 ms in steps of 1 dB, 100 ms late, of devices that nobody has named. Blocked by any cause; differences with 95 % intervals."
    );
    println!(
        "carrier      truth     within      F1 without  with  more             onset without  with  more             ECE without  with"
    );
    for carrier_ghz in [28.0, 140.0] {
        for model in [TruthModel::ModelB, TruthModel::Edges] {
            let seeds: Vec<u64> = (first..first + scenes).collect();
            let scored: Vec<Scored> = seeds
                .par_iter()
                .map(|&seed| scene(people, seed, carrier_ghz, model))
                .collect::<Result<_, _>>()?;
            for (at, window) in WINDOWS.iter().enumerate() {
                let of = |heard: usize| {
                    scored.iter().fold(Window::default(), |sum, scene| sum.plus(&scene[heard][at]))
                };
                let [without, with] = [of(0), of(1)];
                let more = |pick: fn(&Window) -> Counts| {
                    let more: Vec<f64> =
                        scored.iter().map(|s| f1(pick(&s[1][at])) - f1(pick(&s[0][at]))).collect();
                    let mean = more.iter().sum::<f64>() / more.len() as f64;
                    let squares: f64 = more.iter().map(|m| (m - mean).powi(2)).sum();
                    let half = 1.96 * (squares / (more.len().max(2) - 1) as f64 / more.len() as f64).sqrt();
                    let all = f1(pick(&with)) - f1(pick(&without));
                    format!("{all:+.3} +- {half:.3}")
                };
                let onset = match window {
                    0 => format!("{:>13}  {:>4}  {:>15}", "-", "-", "-"),
                    _ => format!(
                        "{:>13.3} {:>5.3}  {:>15}",
                        f1(without.onset),
                        f1(with.onset),
                        more(|c| c.onset)
                    ),
                };
                println!(
                    "{carrier_ghz:>3} GHz      {:9} {:>6} ms {:>12.3} {:>5.3}  {:>15} {onset} {:>12.3} {:>5.3}",
                    model.name(),
                    100 * window,
                    f1(without.all),
                    f1(with.all),
                    more(|c| c.all),
                    without.ece(),
                    with.ece(),
                );
            }
        }
    }
    Ok(())
}

fn config(carrier_ghz: f64) -> Config {
    let mut config = Config::for_mode(Mode::Default);
    let place = |(i, position_m): (usize, [f64; 3])| AccessPoint {
        name: format!("ap{i}"),
        position_m,
        radio: Some(Radio { carrier_ghz, ..Radio::default() }),
    };
    config.site.access_points = PLACES_M.into_iter().enumerate().map(place).collect();
    config.site.ue = IN_HAND;
    config
}

fn scene(people: usize, seed: u64, carrier_ghz: f64, model: TruthModel) -> Result<Scored, String> {
    let config = config(carrier_ghz);
    let site = &config.site;
    let mut deaf = Pipeline::new(&config, None).map_err(|e| e.to_string())?;
    let empty = empty_frames(site, seed).map_err(|e| e.to_string())?;
    empty.iter().for_each(|frame| deaf.learn_empty(frame));
    let mut hears = deaf.clone();
    let sensors = Sensors::new(site, seed).map_err(|e| e.to_string())?;
    let walk = strolling(Preset::Orca03, people, RADIUS_M, seed, SECONDS);
    let mut scene = Scene::in_hall(walk, site, &sensors, seed);
    let counted = Counted { own_body: true, reflections_db: 0.0 };
    let ticks = (SECONDS * 100) as usize;
    let [traces] = &Traces::of_scene(site, scene.walkers(), ticks, &[Air::of(site, model)], counted)[..]
    else {
        return Err("one air has one truth".to_owned());
    };
    let device_of = |person: usize| (person as u64 * 7 + 3 + seed) % people as u64;
    let reports = reports::of_scene(site, traces, seed, device_of);
    let mut assembler = Assembler::new(site).map_err(|e| e.to_string())?;
    let (mut health, mut waiting) = (Health::default(), &reports[..]);
    let (mut truth, mut told) = (Vec::new(), Vec::new());
    while let Some(frame) = scene.next_frame() {
        push(&mut assembler, &frame.packets, &mut health);
        truth.push(blocked(&frame, people, site.access_points.len()));
        while let Some(frame) = assembler.pop() {
            hears.hear(reports::take_arrived(&mut waiting, frame.time_ns));
            let at = truth.iter().position(|(time_ns, _)| *time_ns == frame.time_ns);
            let both =
                [deaf.step(&frame), hears.step(&frame)].map(|o| (o.tracks.clone(), o.blockages.clone()));
            told.extend(at.map(|at| (at, both)));
        }
    }
    Ok(scored(&truth, &told, scene.walkers().len(), |tick, person| traces.place_m(tick, person)))
}

/// What everybody's links are at a frame: its time, and by access point and person whether any cause blocks it and where he is.
type Truth = (i64, Vec<Option<bool>>);

fn blocked(frame: &SceneFrame, people: usize, access_points: usize) -> Truth {
    let mut blocked = vec![None; people * access_points];
    for link in &frame.links {
        let any = link.blocked || link.static_blocked || link.self_blocked == Some(true);
        blocked[link.access_point * people + link.person as usize] = Some(any);
    }
    (frame.time_ns, blocked)
}

type Told = (usize, [(Vec<Track>, Vec<Blockage>); 2]);

fn scored(
    truth: &[Truth],
    told: &[Told],
    people: usize,
    place_m: impl Fn(usize, usize) -> umbracast::geometry::DVec2,
) -> Scored {
    let mut scored = Scored::default();
    for (at, both) in told {
        let Some(coming) = truth.get(*at..*at + STEPS + 1) else { continue };
        let tick = (truth[*at].0 / umbracast_network::truth::TICK_NS) as usize;
        for person in 0..people {
            let place_m = place_m(tick, person);
            for (scored, (tracks, blockages)) in scored.iter_mut().zip(both) {
                let near = tracks.iter().filter(|t| t.confirmed && t.position_m.distance(place_m) <= SAME_M);
                let off_m = |track: &&Track| track.position_m.distance(place_m);
                let Some(track) = near.min_by(|a, b| off_m(a).total_cmp(&off_m(b))) else { continue };
                for link in blockages.iter().filter(|link| link.track == track.id) {
                    let at = link.access_point * people + person;
                    let now = coming.iter().map(|(_, blocked)| blocked[at]).collect::<Option<Vec<bool>>>();
                    let (Some(blocked), Some(any)) = (now, link.any) else { continue };
                    for (counts, &window) in scored.iter_mut().zip(&WINDOWS) {
                        match window {
                            0 => counts.note(any.p_now, blocked[0], false),
                            _ => counts.note(
                                any.p[window - 1],
                                blocked[1..=window].contains(&true),
                                blocked[0],
                            ),
                        }
                    }
                }
            }
        }
    }
    scored
}
