//! Messages with numbers that cannot be, from whoever may write: nobody else may lose anything for them, `fleet` names the sender, and
//! nodes end when they are asked to.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::detect::Point;
use umbracast::geometry::DVec3;
use umbracast::lidar::View;
use umbracast::{Config, Error};
use umbracast_io::nodes::Foreground;
use umbracast_live::HostClock;
use umbracast_node::hall::{Hall, Outlet, Urgency};
use umbracast_node::keys::Keys;
use umbracast_node::network::Network;

use super::{Bench, FAILS_AFTER, PLACES, Seen, account, clock, look, shell};

const FOR: Duration = Duration::from_secs(3);
const SECOND_NS: i64 = 1_000_000_000;
/// Whoever is asked to end has ended after this long.
const ENDS_S: f64 = 2.0;
/// Names of the default site, which the halls of these runs are.
const EAST: &str = "lidar_east";

/// What is sent.
#[derive(Clone, Copy)]
enum Lie {
    /// Foreground of a sensor: so many points so far away, so far ahead of now, so often a second.
    Points { count: usize, at_m: f64, ahead_ns: i64, hz: u64 },
    /// One list of so many people, so far ahead.
    List { people: usize, ahead_ns: i64 },
}

const DAY_NS: i64 = 86_400 * SECOND_NS;

/// What lies; what `fleet` says of it; whether it is among the few.
#[rustfmt::skip]
const CASES: [(&str, Lie, &str, bool); 9] = [
    ("three messages of two points at 1e12 m", Lie::Points { count: 2, at_m: 1e12, ahead_ns: 0, hz: 1 }, "points out of the sensor's reach", false),
    ("100 points at 1e9 m, 200 times a second", Lie::Points { count: 100, at_m: 1e9, ahead_ns: 0, hz: 200 }, "points out of the sensor's reach", true),
    ("a front end's clock 1 s ahead", Lie::Points { count: 1, at_m: 5.0, ahead_ns: SECOND_NS, hz: 10 }, "ahead of the hall's", false),
    ("a front end's clock 5 s ahead", Lie::Points { count: 1, at_m: 5.0, ahead_ns: 5 * SECOND_NS, hz: 10 }, "ahead of the hall's", false),
    ("a front end's clock an hour ahead", Lie::Points { count: 1, at_m: 5.0, ahead_ns: 3600 * SECOND_NS, hz: 10 }, "ahead of the hall's", false),
    ("a front end's clock an hour behind", Lie::Points { count: 1, at_m: 5.0, ahead_ns: -3600 * SECOND_NS, hz: 10 }, "behind the hall's", false),
    ("an empty list of objects, a day ahead", Lie::List { people: 0, ahead_ns: DAY_NS }, "objects/forger", true),
    ("a list of ten, 5 s ahead", Lie::List { people: 10, ahead_ns: 5 * SECOND_NS }, "objects/forger", false),
    ("one list of 4096 people", Lie::List { people: 4096, ahead_ns: 0 }, "objects/forger", false),
];

impl Bench {
    /// A row for each case, with the recording played while it happens; an error in a short run where one is not as it must be.
    pub fn forged(&self, recording: &str) -> Result<(), Error> {
        for (what, lie, word, _) in CASES.into_iter().filter(|case| case.3 || !self.short) {
            let (seen, well) = self.lies(recording, lie, word)?;
            println!("{what:44} {:40} {seen}", "no frame lost, fleet names the sender");
            self.expect(well, what, &format!("no frame lost, and in fleet: {word}"));
        }
        Ok(())
    }

    fn lies(&self, recording: &str, lie: Lie, word: &str) -> Result<(String, bool), Error> {
        let empty = format!("{}/empty.mcap", self.path("sim"));
        let [(_, edge), (_, server), (_, radio)] = PLACES;
        let cast = format!("forecast,cast --listen tcp/{radio}:7447 --connect tcp/{server}:7447");
        let _cast = self.node("radio", &cast)?;
        let track = self.node("server", &format!("track --listen tcp/{server}:7447"))?;
        let mut fronts = Vec::new();
        for (name, port, listens) in [(EAST, 2368, 7447), ("lidar_west", 2369, 7448)] {
            let words = format!(
                "sensor --sensors {name} --port {port} --empty {empty} --listen tcp/{edge}:{listens} --connect \
                 tcp/{server}:7447"
            );
            fronts.push(self.node("edge", &words)?);
        }
        let watch = Arc::<Mutex<Vec<Seen>>>::default();
        let _looking = look(&watch, &[format!("tcp/{radio}:7447")])?;
        sleep(Duration::from_secs(1));
        let mut replay = self.replay(recording)?;
        sleep(FAILS_AFTER);
        let begun = clock();
        let forger = Forger::new(&[format!("tcp/{server}:7447")])?;
        let fleet = format!("{} fleet --connect tcp/{server}:7447 || true", self.command.display());
        let asked = std::thread::spawn(move || {
            sleep(Duration::from_secs(1));
            shell(&fleet)
        });
        forger.send(lie);
        let restored = clock();
        let said = asked.join().map_err(|_| Error::new("fleet: a panic"))??;
        replay.0.wait().map_err(|e| Error::new(e.to_string()))?;
        let ending = clock();
        track.stop()?;
        let ends_s = ending.elapsed().as_secs_f64();
        let seen = std::mem::take(&mut *watch.lock().unwrap_or_else(PoisonError::into_inner));
        let row = account(seen, begun, restored);
        let well = row.is_well(2.0) && row.lost == 0 && row.renumbered <= self.renumbered_anyway();
        let named = said.contains(word);
        let told = if named { "named" } else { "not named" };
        Ok((format!("{row}  {told}, ends after {ends_s:.1} s"), well && named && ends_s < ENDS_S))
    }
}

/// Somebody on an open network.
struct Forger {
    hall: Hall,
    foreground: Outlet,
    objects: Outlet,
    clock: HostClock,
}

impl Forger {
    fn new(connect: &[String]) -> Result<Self, Error> {
        let network = Network { connect: connect.to_vec(), ..Network::default() };
        let keys = Keys::new("lab");
        let hall = Hall::new(network.open()?, keys.clone());
        let foreground = hall.outlet(&keys.foreground(EAST), Urgency::Points)?;
        let objects = hall.outlet(&keys.of("objects/forger"), Urgency::Rest)?;
        // What is published before the others are known reaches nobody.
        sleep(Duration::from_millis(500));
        Ok(Self { hall, foreground, objects, clock: HostClock::start() })
    }

    fn send(&self, lie: Lie) {
        let _open = &self.hall;
        match lie {
            Lie::List { people, ahead_ns } => {
                let of = |i: usize| {
                    let [x, y] = [i % 64, i / 64].map(|k| k as f64 * 0.3 - 9.0);
                    format!(r#"{{ "position_m": [{x}, {y}], "size_m": [0.5, 0.5, 1.7] }}"#)
                };
                let list: Vec<String> = (0..people).map(of).collect();
                let time_ns = self.clock.now_ns() + ahead_ns;
                self.objects.put_bytes(
                    format!(r#"{{ "time_ns": {time_ns}, "objects": [{}] }}"#, list.join(",")).into_bytes(),
                );
                sleep(FOR);
            }
            Lie::Points { count, at_m, ahead_ns, hz } => {
                for _ in 0..FOR.as_secs() * hz {
                    self.foreground.put(&mut self.message(count, at_m, ahead_ns));
                    sleep(Duration::from_secs_f64(1.0 / hz as f64));
                }
            }
        }
    }

    fn message(&self, count: usize, at_m: f64, ahead_ns: i64) -> Foreground {
        let now_ns = self.clock.now_ns();
        let site = Config::default().site;
        // Frames end on tenths of a second of the hall's time; where exactly is not known here.
        let time_ns = (now_ns + ahead_ns) / (SECOND_NS / 10) * (SECOND_NS / 10);
        let at = |i: usize| DVec3::new(if i.is_multiple_of(2) { at_m } else { -at_m }, 0.0, 1.0);
        let point = |i: usize| Point { position_m: at(i), time_ns, sensor: 0 };
        Foreground {
            time_ns,
            sensors: site.sensors.iter().map(|sensor| sensor.name.clone()).collect(),
            covers: vec![0],
            views: vec![View { sensor: 0, site_from_sensor: site.sensors[0].site_from_sensor(), fan: None }],
            points: (0..count).map(point).collect(),
            closed_ns: now_ns,
            ..Foreground::default()
        }
    }
}
