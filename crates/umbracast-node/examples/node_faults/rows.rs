//! One thing that fails in a hall of four nodes at three places: a wire, packets, or a node that is killed, or stopped and woken.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;

use super::{
    Account, BAD, Bench, FAILS_AFTER, FAILS_FOR, PLACES, Running, Seen, account, clock, look, shell,
};

/// A node that is stopped is woken after so long.
const STOPPED_FOR: Duration = Duration::from_secs(3);
/// One that is killed is started again after so long.
const AWAY_FOR: Duration = Duration::from_secs(1);

struct Fault {
    what: &'static str,
    must: &'static str,
    kind: Kind,
    /// Frames without results, at most; how many people may have another number, and within how many seconds all is well again.
    may_lose: i64,
    may_renumber: usize,
    within_s: f64,
    /// Share of packets lost, and by how much they are late at most, ms, all the time.
    wire: Option<(f64, f64)>,
    /// Whether a second tracker stands by.
    doubled: bool,
    /// Whether it is among the few.
    short: bool,
}

enum Kind {
    Nothing,
    Cut,
    Killed(&'static str),
    Stopped(&'static str),
}

const fn fault(what: &'static str, must: &'static str, kind: Kind) -> Fault {
    Fault {
        what,
        must,
        kind,
        may_lose: 0,
        may_renumber: 0,
        within_s: 2.0,
        wire: None,
        doubled: false,
        short: false,
    }
}

// A tracker or caster that is away for a second, and half a second until it has the others; who stands still for three.
#[rustfmt::skip]
const FAULTS: &[Fault] = &[
    fault("nothing", "nothing", Kind::Nothing),
    Fault { may_lose: 60, may_renumber: 4, ..fault("the front ends' wire cut for 5 s", "goes on by itself", Kind::Cut) },
    Fault { wire: Some((0.01, 0.0)), ..fault("1 % of packets lost, all the time", "nothing", Kind::Nothing) },
    Fault { wire: Some((0.1, 0.0)), may_lose: 5, may_renumber: 2, ..fault("10 % of packets lost, all the time", "late frames, counted", Kind::Nothing) },
    Fault { wire: Some((0.0, 100.0)), may_lose: 5, may_renumber: 1, ..fault("0 to 100 ms of jitter, all the time", "late frames, counted", Kind::Nothing) },
    Fault { may_renumber: 1, ..fault("a front end killed, back after 1 s", "people are followed with the other one", Kind::Killed("east")) },
    Fault { short: true, may_lose: 25, ..fault("the tracker killed, back after 1 s", "everybody has the same number", Kind::Killed("track")) },
    Fault { may_lose: 25, ..fault("forecast and cast killed, back after 1 s", "goes on by itself", Kind::Killed("cast")) },
    Fault { short: true, doubled: true, ..fault("the tracker that leads killed, another by", "no frame lost", Kind::Killed("track")) },
    Fault { may_lose: 3, may_renumber: 1, ..fault("a front end stopped for 3 s, and woken", "people are followed with the other one", Kind::Stopped("east")) },
    Fault { may_lose: 40, may_renumber: 1, ..fault("the tracker stopped for 3 s, and woken", "goes on by itself", Kind::Stopped("track")) },
    Fault { may_lose: 40, ..fault("forecast and cast stopped for 3 s, and woken", "goes on by itself", Kind::Stopped("cast")) },
    Fault { doubled: true, may_lose: 6, ..fault("the tracker that leads stopped for 3 s", "another leads", Kind::Stopped("track")) },
];

impl Bench {
    /// A row for each.
    pub fn rows(&self, recording: &str) -> Result<(), Error> {
        for fault in FAULTS.iter().filter(|fault| fault.short || !self.short) {
            let seen = self.fault(fault, recording)?;
            println!("{:44} {:40} {seen}", fault.what, fault.must);
            let well = seen.is_well(fault.within_s)
                && seen.lost <= fault.may_lose
                && seen.renumbered <= fault.may_renumber + self.renumbered_anyway();
            self.expect(well, fault.what, fault.must);
        }
        if self.short { Ok(()) } else { self.router(recording) }
    }

    fn fault(&self, fault: &Fault, recording: &str) -> Result<Account, Error> {
        let empty = format!("{}/empty.mcap", self.path("sim"));
        let [(_, edge), (_, server), (_, radio)] = PLACES;
        let bad = fault.wire.map(|(loss, jitter_ms)| self.bad_wire(loss, jitter_ms)).transpose()?;
        let of_server = if bad.is_some() { BAD[1].1 } else { server };
        let listen = if bad.is_some() {
            format!("--listen tcp/{server}:7447,tcp/{}:7447", BAD[1].1)
        } else {
            format!("--listen tcp/{server}:7447")
        };
        let track = format!("track {listen}");
        let second = format!("track --listen tcp/{server}:7448 --connect tcp/{server}:7447,tcp/{radio}:7447");
        let cast = format!("forecast,cast --listen tcp/{radio}:7447 --connect tcp/{server}:7447");
        let at_edge = if bad.is_some() { BAD[0].1 } else { edge };
        let front = |name: &str, port: u16, listens: u16| {
            format!(
                "sensor --sensors {name} --port {port} --empty {empty} --listen tcp/{at_edge}:{listens} \
                 --connect tcp/{of_server}:7447,tcp/{of_server}:7448"
            )
        };
        let mut nodes = BTreeMap::new();
        let mut start = |name: &'static str, place: &str, words: &str| -> Result<(), Error> {
            nodes.insert(name, self.node(place, words)?);
            Ok(())
        };
        start("cast", "radio", &cast)?;
        start("track", "server", &track)?;
        if fault.doubled {
            start("second", "server", &second)?;
        }
        start("east", "edge", &front("lidar_east", 2368, 7447))?;
        start("west", "edge", &front("lidar_west", 2369, 7448))?;
        let watch = Arc::<Mutex<Vec<Seen>>>::default();
        let _looking = look(&watch, &[format!("tcp/{radio}:7447"), format!("tcp/{server}:7447")])?;
        sleep(Duration::from_secs(1));
        let mut replay = self.replay(recording)?;
        sleep(FAILS_AFTER);
        let failed = clock();
        let restored = match fault.kind {
            Kind::Nothing => failed,
            Kind::Cut => {
                shell("ip -n edge link set wire0 down")?;
                sleep(FAILS_FOR);
                shell("ip -n edge link set wire0 up")?;
                clock()
            }
            Kind::Killed(name) => {
                nodes.remove(name);
                if fault.doubled {
                    failed
                } else {
                    sleep(AWAY_FOR);
                    let again = clock();
                    let (place, words) = match name {
                        "cast" => ("radio", cast.clone()),
                        "track" => ("server", track.clone()),
                        _ => ("edge", front("lidar_east", 2368, 7447)),
                    };
                    nodes.insert(name, self.node(place, &words)?);
                    again
                }
            }
            Kind::Stopped(name) => {
                let id = nodes.get(name).map(|node| node.0.id()).ok_or_else(|| Error::new(name))?;
                shell(&format!("kill -STOP {id}"))?;
                sleep(STOPPED_FOR);
                shell(&format!("kill -CONT {id}"))?;
                clock()
            }
        };
        replay.0.wait().map_err(|e| Error::new(e.to_string()))?;
        sleep(Duration::from_secs(1));
        let seen = std::mem::take(&mut *watch.lock().unwrap_or_else(PoisonError::into_inner));
        Ok(account(seen, failed, restored))
    }

    /// In place of the wire between edge and server.
    fn bad_wire(&self, loss: f64, jitter_ms: f64) -> Result<BadWire, Error> {
        let [(a, at_a), (b, at_b)] = BAD;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/wire.py");
        let mut child = Command::new("python3")
            .arg(script)
            .args([a, at_a, b, at_b, &loss.to_string(), &jitter_ms.to_string()])
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| Error::new(format!("python3: {e}")))?;
        let mut line = String::new();
        let said = child.stdout.take().ok_or_else(|| Error::new("no pipe"))?;
        BufReader::new(said).read_line(&mut line).map_err(|e| Error::new(e.to_string()))?;
        if line.trim() != "ready" {
            return Err(Error::new("wire.py: ended before it was ready"));
        }
        shell("ip -n edge link set wire0 down")?;
        Ok(BadWire(Running(child)))
    }
}

/// The good wire comes back with its end.
struct BadWire(#[expect(dead_code, reason = "it ends with its scope")] Running);

impl Drop for BadWire {
    fn drop(&mut self) {
        let _ = shell("ip -n edge link set wire0 up");
    }
}
