//! Hours of people before simulated sensors, as fast as it goes: `cargo run --release --manifest-path bench/Cargo.toml --bin soak
//! -- [HOURS]`. Twenty people stroll, cross, stop, meet and walk in pairs, some with bags and telephones, and others come after a
//! minute or so; in every second hour a chair stands where none was; in the first minute of each hour one sensor is silent. A row
//! an hour says whether memory, time, tracks and numbers stay what they were in the first.

use umbracast::lidar::{Assembler, Packet};
use umbracast::site::Furniture;
use umbracast::{Config, Health, STEP_NS, Site};
use umbracast_bench::simulated::walking;
use umbracast_bench::{pipeline, timed};
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::{Crowd, Preset, circle_crossing, strolling};
use umbracast_sim::scene::{PersonTruth, Scene};
use umbracast_sim::sensor::Sensors;

const PEOPLE: usize = 20;
const RADIUS_M: f64 = 11.0;
const SEED: u64 = 100_000;
const HOUR_NS: i64 = 3_600_000_000_000;
const MINUTE_NS: i64 = 60_000_000_000;
/// A track is somebody's within this, and nobody's beyond that.
const NEAR_M: f64 = 0.5;
const FAR_M: f64 = 1.0;

/// What an hour was like.
#[derive(Default)]
struct Hour {
    frames: u64,
    step_ms: Vec<f64>,
    people: usize,
    followed: usize,
    ghosts: usize,
    first_id: u64,
    last_id: u64,
}

fn main() {
    let hours: i64 = std::env::args().nth(1).map_or(24, |hours| hours.parse().expect("hours"));
    let config = Config::default();
    let halls = [config.site.clone(), with_a_chair(config.site.clone())];
    let sensors =
        halls.each_ref().map(|site| Sensors::new(site, SEED).expect("the default site is simulated"));
    let shares =
        [("bag", 0.2), ("phone", 0.2)].map(|(kind, share)| (kind.parse::<Kind>().expect("a kind"), share));
    let bodies = Bodies::new(shares.to_vec(), []).expect("shares of less than all");
    // No frame of theirs: the empty hall alone.
    let empty = walking(&config.site, crowd(0), 0).expect("the default site is simulated").empty;
    let mut pipeline = pipeline(&config, None, &empty, &[]).expect("the defaults work");
    let mut assembler = Assembler::new(&config.site).expect("the default site is simulated");

    println!("{PEOPLE} people, two HDL-32E; resident memory at the end of the hour, with the simulator's");
    println!("hour  frames    MiB  median, ms   99 %, ms  people  followed  nobody's, s  numbers given");
    let (mut begin_ns, mut leg, mut hour) = (0, 0, Hour::default());
    let mut health = Health::default();
    let mut truth: Vec<(i64, Vec<PersonTruth>)> = Vec::new();
    for number in 0..hours {
        while begin_ns < (number + 1) * HOUR_NS {
            let hall = (number % 2) as usize;
            let crowd = crowd(leg);
            let end_ns = begin_ns + crowd.duration_ns / STEP_NS * STEP_NS;
            let crowd = Crowd { duration_ns: end_ns, ..crowd.later(begin_ns) };
            let mut scene = Scene::in_hall(crowd, &halls[hall], &sensors[hall], SEED + leg)
                .with_bodies(&bodies)
                .starting_at((begin_ns / STEP_NS) as u64);
            while let Some(mut frame) = scene.next_frame() {
                let silent = frame.time_ns - number * HOUR_NS < MINUTE_NS;
                let of_sensors = frame.packets.iter_mut().enumerate().skip(usize::from(silent));
                let mut packets: Vec<(usize, Packet)> = of_sensors
                    .flat_map(|(sensor, packets)| packets.drain(..).map(move |p| (sensor, p)))
                    .collect();
                packets.sort_by_key(|(_, packet)| packet.time_ns);
                packets.iter().for_each(|(sensor, packet)| assembler.push(*sensor, packet, &mut health));
                truth.push((frame.time_ns, frame.people));
                while let Some(seen) = assembler.pop() {
                    let mut outcome = None;
                    let took = timed(|| outcome = Some(pipeline.step(&seen)));
                    hour.step_ms.push(1e3 * took.as_secs_f64());
                    truth.retain(|(time_ns, _)| *time_ns >= seen.time_ns);
                    let people = truth.iter().find(|(time_ns, _)| *time_ns == seen.time_ns);
                    if let (Some(outcome), Some((_, people))) = (outcome, people) {
                        hour.count(outcome, people);
                    }
                }
            }
            (begin_ns, leg) = (end_ns, leg + 1);
        }
        hour.tell(number);
        hour = Hour { first_id: hour.last_id, last_id: hour.last_id, ..Hour::default() };
    }
}

impl Hour {
    fn count(&mut self, outcome: &umbracast::Outcome, people: &[PersonTruth]) {
        let places_m: Vec<_> =
            outcome.tracks.iter().filter(|track| track.confirmed).map(|track| track.position_m).collect();
        let apart = |person: &PersonTruth, near_m: f64| {
            places_m.iter().any(|place_m| place_m.distance(person.state.position_m) < near_m)
        };
        let walking = people.iter().filter(|person| !person.arrived);
        self.frames += 1;
        self.people += walking.clone().count();
        self.followed += walking.filter(|person| apart(person, NEAR_M)).count();
        let somebodys = |place_m: &&umbracast::geometry::DVec2| {
            people.iter().any(|person| person.state.position_m.distance(**place_m) < FAR_M)
        };
        self.ghosts += places_m.len() - places_m.iter().filter(somebodys).count();
        self.last_id = outcome.tracks.iter().map(|track| track.id).fold(self.last_id, u64::max);
    }

    fn tell(&mut self, number: i64) {
        self.step_ms.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let last = self.step_ms.len().saturating_sub(1);
            self.step_ms.get((self.step_ms.len() as f64 * share) as usize).or(self.step_ms.get(last)).copied()
        };
        let [median_ms, p99_ms] = [0.5, 0.99].map(|share| quantile(share).unwrap_or(f64::NAN));
        println!(
            "{:4} {:7} {:6.1} {median_ms:11.2} {p99_ms:10.2} {:7.1} {:9.4} {:12.1} {:14}",
            number + 1,
            self.frames,
            resident_mib(),
            self.people as f64 / self.frames.max(1) as f64,
            self.followed as f64 / self.people.max(1) as f64,
            0.1 * self.ghosts as f64,
            self.last_id - self.first_id,
        );
    }
}

/// A minute or so of other people.
fn crowd(leg: u64) -> Crowd {
    let crossing = |preset| circle_crossing(preset, PEOPLE, RADIUS_M, SEED + leg);
    match leg % 4 {
        0 => strolling(Preset::Orca03, PEOPLE, RADIUS_M, SEED + leg, 90),
        1 => crossing(Preset::Natural),
        2 => crossing(Preset::Mixed),
        _ => crossing(Preset::Pairs),
    }
}

/// Nobody told the program of it.
fn with_a_chair(mut site: Site) -> Site {
    let chair = Furniture { position_m: [13.0, -5.0], size_m: [0.5, 0.5, 0.9], yaw_deg: 20.0 };
    site.furniture.push(chair);
    site
}

/// What the process holds.
fn resident_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|kb| kb.trim().trim_end_matches(" kB").trim().parse::<f64>().ok())
        .map_or(f64::NAN, |kb| kb / 1024.0)
}
