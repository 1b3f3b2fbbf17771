//! A hall in three network namespaces, as on three hosts: whether its results are those of one process, what the wire
//! adds, and what happens when something fails. Needs root, `ip` and `python3`:
//! `node_faults UMBRACAST SECONDS SECONDS`, with the command built with the feature `node`, the length of the comparison and
//! that of each failure's run. `short`, behind them: a few failures. Ends with an error that names the rows where what must happen
//! does not.
//! `node_faults UMBRACAST fleet`: what happens on one host, alone. `node_faults UMBRACAST rows`: a wire, packets or a node, alone.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;
use umbracast_io::recording::{Entry, RecordingReader};

#[path = "node_faults/fleet.rs"]
mod fleet;
#[path = "node_faults/forged.rs"]
mod forged;
#[path = "node_faults/leaders.rs"]
mod leaders;
#[path = "node_faults/router.rs"]
mod router;
#[path = "node_faults/rows.rs"]
mod rows;
#[path = "node_faults/seen.rs"]
mod seen;
#[path = "node_faults/vanish.rs"]
mod vanish;

use seen::{Account, Seen, account, clock, look};

const PLACES: [(&str, &str); 3] = [("edge", "10.77.0.2"), ("server", "10.77.0.3"), ("radio", "10.77.0.4")];
/// The bad wire's ends.
const BAD: [(&str, &str); 2] = [("edge", "10.78.0.2"), ("server", "10.78.0.3")];
const FAILS_AFTER: Duration = Duration::from_secs(6);
const FAILS_FOR: Duration = Duration::from_secs(5);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // SAFETY: nothing has begun yet, so there is no other thread. Hosts that vanish must not stop who looks on.
    unsafe {
        umbracast_node::runtime::widen();
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [command, only] = &arguments[..]
        && only == "fleet"
    {
        return Ok(fleet::alone(Path::new(command))?);
    }
    let (command, seconds, short) = match &arguments[..] {
        [command, only] if only == "rows" => (command, None, false),
        [command, equal_s, fault_s] => (command, Some((equal_s, fault_s)), false),
        [command, equal_s, fault_s, short] if short == "short" => (command, Some((equal_s, fault_s)), true),
        _ => {
            return Err(
                "expected UMBRACAST SECONDS SECONDS [short], UMBRACAST rows, or UMBRACAST fleet".into()
            );
        }
    };
    let folder = std::env::temp_dir().join(format!("umbracast-nodes-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let bench = Bench { command: command.into(), folder, short, wrong: RefCell::default() };
    bench.lay_wires()?;
    let outcome = match seconds {
        Some((equal_s, fault_s)) => bench.equality(equal_s).and_then(|()| bench.faults(fault_s)),
        None => bench.record("short", "30").and_then(|recording| bench.rows(&recording)),
    };
    let all = seconds.is_some() && !short;
    let outcome =
        outcome.and_then(|()| if all { fleet::cases(&bench.command, &bench.folder) } else { Ok(()) });
    bench.take_wires_away();
    std::fs::remove_dir_all(&bench.folder)?;
    outcome?;
    let wrong = bench.wrong.into_inner();
    if wrong.is_empty() { Ok(()) } else { Err(format!("not as it must be: {}", wrong.join("; ")).into()) }
}

struct Bench {
    command: PathBuf,
    folder: PathBuf,
    /// A few failures only.
    short: bool,
    /// Rows that were not as they must be.
    wrong: RefCell<Vec<String>>,
}

/// Ends with its scope.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    /// Asks for the end; what it said.
    fn stop(mut self) -> Result<String, Error> {
        shell(&format!("kill -TERM {}", self.0.id()))?;
        let mut said = String::new();
        if let Some(mut out) = self.0.stdout.take() {
            out.read_to_string(&mut said).map_err(|e| Error::new(e.to_string()))?;
        }
        self.0.wait().map_err(|e| Error::new(e.to_string()))?;
        Ok(said)
    }
}

impl Bench {
    /// A namespace for each place, on one bridge.
    fn lay_wires(&self) -> Result<(), Error> {
        self.take_wires_away();
        shell(
            "ip link add umbra0 type bridge && ip address add 10.77.0.1/24 dev umbra0 && ip link set umbra0 up",
        )?;
        for (place, address) in PLACES {
            shell(&format!(
                "ip netns add {place} && ip link add {place}0 type veth peer name wire0 netns {place} && \
                 ip link set {place}0 master umbra0 up && ip -n {place} address add {address}/24 dev wire0 && \
                 ip -n {place} link set wire0 up && ip -n {place} link set lo up"
            ))?;
        }
        Ok(())
    }

    /// Without a word where there are none.
    fn take_wires_away(&self) {
        for (place, _) in PLACES {
            let _ = shell(&format!("ip netns delete {place} 2>/dev/null"));
        }
        let _ = shell("ip link delete umbra0 2>/dev/null");
    }

    /// Remembers a row that is not as it must be: the others are still run.
    fn expect(&self, well: bool, what: &str, must: &str) {
        if !well {
            eprintln!("{what}: expected: {must}");
            self.wrong.borrow_mut().push(what.to_owned());
        }
    }

    /// People who have another number at the end of the recording where nothing fails: in the longer one somebody is lost behind
    /// others, and found again.
    fn renumbered_anyway(&self) -> usize {
        usize::from(!self.short)
    }

    fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    fn run(&self, words: &str) -> Result<String, Error> {
        shell(&format!("{} {words}", self.command.display()))
    }

    /// A node at a place; returns once it is ready.
    fn node(&self, place: &str, words: &str) -> Result<Running, Error> {
        self.node_of("hall.toml", place, words)
    }

    /// The same with another site file.
    fn node_of(&self, site: &str, place: &str, words: &str) -> Result<Running, Error> {
        let site = self.path(site);
        let command = format!(
            "exec ip netns exec {place} {} node {words} --site {site} --no-serve --json 2>>{}",
            self.command.display(),
            self.path("said.txt")
        );
        let mut child = Command::new("bash")
            .args(["-c", &command])
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| Error::new(e.to_string()))?;
        let mut said = BufReader::new(child.stdout.take().ok_or_else(|| Error::new("no pipe"))?);
        let mut line = String::new();
        while !line.trim_end().ends_with("ready") {
            line.clear();
            if said.read_line(&mut line).map_err(|e| Error::new(e.to_string()))? == 0 {
                let told = std::fs::read_to_string(self.path("said.txt")).unwrap_or_default();
                return Err(Error::new(format!("{words}: ended before it was ready: {told}")));
            }
        }
        child.stdout = Some(said.into_inner());
        Ok(Running(child))
    }

    /// A recording of so many seconds, the empty hall, and the site file.
    fn record(&self, name: &str, seconds: &str) -> Result<String, Error> {
        if !Path::new(&self.path("sim")).exists() {
            self.run(&format!("simulate --out {} --quiet", self.path("sim")))?;
            std::fs::write(self.path("hall.toml"), "[network]\nhall = \"lab\"\nanyone = true\n")
                .map_err(|e| Error::new(e.to_string()))?;
        }
        let folder = self.path(name);
        self.run(&format!(
            "live --demo --people 10 --seconds {seconds} --no-serve --quiet --json --record {folder} --record-mb 100000"
        ))?;
        let entries = std::fs::read_dir(&folder).map_err(|e| Error::new(e.to_string()).within(&folder))?;
        let file = entries.flatten().next().ok_or_else(|| Error::new("no recording"))?.path();
        Ok(file.display().to_string())
    }

    /// Three nodes, one at each place, against one process.
    fn equality(&self, seconds: &str) -> Result<(), Error> {
        let recording = self.record("whole", seconds)?;
        let (empty, one) = (format!("{}/empty.mcap", self.path("sim")), self.path("one"));
        self.run(&format!("run {recording} --empty {empty} --out {one} --mcap --quiet"))?;
        let [(_, edge), (_, server), (_, radio)] = PLACES;
        let track = self.node("server", &format!("track,forecast --listen tcp/{server}:7447"))?;
        let cast = self.node(
            "radio",
            &format!(
                "cast,record --record {} --listen tcp/{radio}:7447 --connect tcp/{server}:7447",
                self.path("nodes")
            ),
        )?;
        let begun = clock();
        let sensor = self.node(
            "edge",
            &format!(
                "sensor --from {recording} --empty {empty} --listen tcp/{edge}:7447 --connect tcp/{server}:7447"
            ),
        )?;
        let mut sensor = sensor;
        let mut said = String::new();
        if let Some(mut out) = sensor.0.stdout.take() {
            out.read_to_string(&mut said).map_err(|e| Error::new(e.to_string()))?;
        }
        let took_s = begun.elapsed().as_secs_f64();
        sleep(Duration::from_secs(2));
        let summaries = [
            ("edge: sensor", said),
            ("server: track,forecast", track.stop()?),
            ("radio: cast,record", cast.stop()?),
        ];
        println!("three namespaces, 10 people, two HDL-32E, {took_s:.0} s");
        println!(
            "{:24} {:>7} {:>10} {:>10} {:>13} {:>12} {:>11}",
            "node", "frames", "messages/s", "kB/s", "latency,ms", "of wire,ms", "99 %, ms"
        );
        for (name, said) in &summaries {
            let json: serde_json::Value =
                serde_json::from_str(said).map_err(|e| Error::new(format!("{e}: {said}")))?;
            let number = |key: &str| json[key].as_f64().unwrap_or(f64::NAN);
            println!(
                "{name:24} {:7} {:10.1} {:10.1} {:13.3} {:12.3} {:11.3}",
                number("frames"),
                number("messages_published") / took_s,
                number("bytes_published") / took_s * 1e-3,
                number("latency_ms_median"),
                number("wire_ms_median"),
                number("wire_ms_p99")
            );
        }
        let expected = results(&format!("{one}/results-0000.mcap"))?;
        let found = results(&self.only_file("nodes")?)?;
        for (topic, messages) in &expected {
            let nothing = Vec::new();
            let of_nodes = found.get(topic).unwrap_or(&nothing);
            let same = messages.iter().zip(of_nodes).filter(|(a, b)| a == b).count();
            println!(
                "{topic}: {} messages of one process, {same} the same to the byte from the nodes",
                messages.len()
            );
            let all_same = (same, of_nodes.len()) == (messages.len(), messages.len());
            self.expect(all_same, topic, "the messages of one process");
        }
        Ok(())
    }

    fn only_file(&self, name: &str) -> Result<String, Error> {
        let entries = std::fs::read_dir(self.path(name)).map_err(|e| Error::new(e.to_string()))?;
        let file = entries.flatten().next().ok_or_else(|| Error::new("no recording"))?.path();
        Ok(file.display().to_string())
    }

    fn faults(&self, seconds: &str) -> Result<(), Error> {
        let recording = self.record("short", seconds)?;
        println!(
            "\n{:44} {:40} {:>7} {:>7} {:>9} {:>9} {:>11} {:>10}",
            "what failed",
            "what must happen",
            "frames",
            "lost",
            "gap, ms",
            "later, ms",
            "recovers,s",
            "renumbered"
        );
        let long = self.record("long", "26")?;
        self.vanishing(&long)?;
        self.forged(&recording)?;
        self.leaders(&long)?;
        self.rows(&recording)?;
        println!(
            "lost: frames without results from the first to the last. Gap: longest time between results. Later: how \
             much longer after its own time a frame comes while something fails, median against that of before. Recovers: from the \
             end of the failure until frames come again in time with all sensors and as many people as before. Renumbered: \
             people who have another number than before the failure. Loss and jitter: a relay of IP packets between two \
             tun devices, as this kernel has no netem; jitter lets packets overtake each other."
        );
        Ok(())
    }

    /// Sends a recording's packets to the front ends, from their place.
    fn replay(&self, recording: &str) -> Result<Running, Error> {
        let command = format!(
            "exec ip netns exec edge {} replay {recording} --to 127.0.0.1:2368 --quiet",
            self.command.display()
        );
        let child = Command::new("bash").args(["-c", &command]).stdout(Stdio::null()).spawn();
        child.map(Running).map_err(|e| Error::new(e.to_string()))
    }
}

/// The results of a recording by topic.
fn results(file: &str) -> Result<BTreeMap<String, Vec<Vec<u8>>>, Error> {
    let mut reader = RecordingReader::open(Path::new(file))?;
    let mut messages = BTreeMap::<_, Vec<_>>::new();
    while let Some(entry) = reader.next_entry()? {
        if let Entry::Other(topic, _, message) = entry
            && topic.starts_with("/umbracast/")
            && topic != "/umbracast/config"
        {
            messages.entry(topic).or_default().push(message);
        }
    }
    Ok(messages)
}

fn shell(line: &str) -> Result<String, Error> {
    let done = Command::new("bash").args(["-c", line]).output().map_err(|e| Error::new(e.to_string()))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    // Code 3: done, but data was lost; what was lost stands in the table.
    match done.status.code() {
        Some(0 | 3) => Ok(text(&done.stdout)),
        _ => Err(Error::new(format!("{line}: {}{}", text(&done.stdout), text(&done.stderr)))),
    }
}
