//! How many halls one host carries: their front ends are simulated, everything behind them is real.
//!
//! ```sh
//! cargo run --release -p umbracast-node --example halls -- target/release/umbracast 30 halls.svg 1 2 4 8 16 32 64 96
//! ```
//!
//! A minute of ten people before two HDL-32E is turned into what both front ends publish, once. Then it is replayed
//! for so many halls at once, each shifted in time against the others, and for each hall a process of the command
//! runs all stages after the foreground. Its use of the host is what it reports (`umbracast fleet`). A column of its
//! own shows what the replay uses.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use umbracast::{Config, Error, STEP_NS};
use umbracast_eval::report::plot::{self, Mark, Panel, Series};
use umbracast_io::nodes::{Foreground, NodeHealth};
use umbracast_live::HostClock;
use umbracast_live::receive::Arrived;
use umbracast_node::fleet::{self, Hall as Seen};
use umbracast_node::front::Front;
use umbracast_node::hall::{Hall, Outlet, Urgency};
use umbracast_node::keys::Keys;
use umbracast_node::network::{Mode, Network};
use umbracast_node::share::empty_frames;
use umbracast_sim::crowd::{Ground, Preset, Stroll};
use umbracast_sim::scene::Scene;
use zenoh::Wait;

const PEOPLE: usize = 10;
const SEED: u64 = 100_800;
/// The circle that people cross, metres.
const CIRCLE_M: f64 = 12.5;
/// Seconds of the scene, and of a run before it is looked at: who was there at once has been followed by then.
const SCENE_S: u64 = 60;
const SETTLING: Duration = Duration::from_secs(4);
/// Revolutions of the empty hall.
const EMPTY: u64 = 10;

/// One line of the table.
struct Row {
    halls: usize,
    /// Behind the front ends, of all halls.
    cores: f64,
    /// Of the simulated front ends.
    replay_cores: f64,
    resident_mib: f64,
    /// From the front ends, and from the stages behind them, of all halls.
    in_mb_per_s: f64,
    out_mb_per_s: f64,
    warnings_per_s: f64,
    /// Of all that there were.
    frames_done: f64,
    /// The slowest hall's.
    median_ms: f64,
    p99_ms: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [command, seconds, picture, counts @ ..] = &words[..] else {
        return Err("expected COMMAND SECONDS PICTURE COUNT...".into());
    };
    let (seconds, clock) = (seconds.parse::<u64>()?, HostClock::start());
    let config = Config::default();
    let (recorded, packet_bytes) = recorded(&config)?;
    let bytes: usize = recorded.iter().flatten().map(|message| encoded(message).len()).sum();
    let mb_per_s = |bytes: usize| bytes as f64 / (SCENE_S * recorded.len() as u64) as f64 / 1e6;
    println!("{PEOPLE} people, each of {} sensors, MB a second", recorded.len());
    println!("packets as it sends them        {:6.3}", mb_per_s(packet_bytes));
    println!("foreground, what leaves its host{:6.3}\n", mb_per_s(bytes));
    println!(
        "halls   cores  a hall  replay  MiB a hall  in, MB/s  out, MB/s  warnings/s a hall  frames  median, ms  99 %, ms"
    );
    let mut rows = Vec::new();
    for count in counts {
        let row = run(Path::new(command), count.parse()?, seconds, &config, &recorded, clock)?;
        let halls = row.halls as f64;
        println!(
            "{:5} {:7.2} {:7.3} {:7.2} {:11.1} {:9.2} {:10.2} {:18.2} {:6.1}% {:11.1} {:9.1}",
            row.halls,
            row.cores,
            row.cores / halls,
            row.replay_cores,
            row.resident_mib / halls,
            row.in_mb_per_s,
            row.out_mb_per_s,
            row.warnings_per_s / halls,
            100.0 * row.frames_done,
            row.median_ms,
            row.p99_ms
        );
        rows.push(row);
    }
    city(&rows);
    fs::write(picture, drawn(&rows)?)?;
    Ok(())
}

/// What the last line with every frame done, in time, means for a city; arithmetic, not measured.
fn city(rows: &[Row]) {
    let in_time = |row: &&Row| row.frames_done > 0.999 && row.p99_ms < STEP_NS as f64 * 1e-6;
    let Some(row) = rows.iter().rev().find(in_time) else { return };
    let halls = row.halls as f64;
    let health = umbracast_io::fields::encode(&mut NodeHealth {
        node: "0123456789abcdef0123456789abcdef".to_owned(),
        host: "edge-17.example.org".to_owned(),
        stages: vec!["track".to_owned(), "forecast".to_owned(), "cast".to_owned()],
        ..NodeHealth::default()
    });
    println!(
        "\nArithmetic from the line of {} halls; {NODES} nodes a hall, health of {} bytes",
        row.halls,
        health.len()
    );
    println!("what                                    a hall   a region of {REGION}   a city of {CITY}");
    let line = |what: &str, of_hall: f64| {
        println!("{what:38}{of_hall:8.3} {:17.1} {:17.0}", of_hall * REGION as f64, of_hall * CITY as f64);
    };
    line("hosts of this kind for its stages", 1.0 / halls);
    line("foreground, MB a second", row.in_mb_per_s / halls);
    line("all that stages publish, MB a second", row.out_mb_per_s / halls);
    line("warnings a second", row.warnings_per_s / halls);
    line("sessions", NODES as f64);
    line("health, messages a second", NODES as f64);
    line("health, MB a second", (NODES * health.len()) as f64 / 1e6);
}

/// A front end, a leader and one that stands by.
const NODES: usize = 3;
const REGION: usize = 100;
const CITY: usize = 10_000;

/// What each sensor's front end publishes of the scene, in order, and the bytes of all packets.
fn recorded(config: &Config) -> Result<(Vec<Vec<Foreground>>, usize), Error> {
    let site = &config.site;
    let empty = Scene::empty(site, SEED, EMPTY)?;
    let sensors = site.sensors.len();
    let of_sensor = |sensor: usize| empty.iter().flat_map(|frame| frame[sensor].clone()).collect();
    let empty = empty_frames(site, &(0..sensors).map(of_sensor).collect::<Vec<_>>())?;
    let crowd = Stroll::new(Preset::Orca03, PEOPLE, &Ground::circle(CIRCLE_M), SEED).leg(SCENE_S);
    let mut scene = Scene::new(crowd, site, SEED)?;
    let new = |sensor| Front::new(config, &[sensor], &empty, Arc::default(), HostClock::start());
    let mut fronts = (0..sensors).map(new).collect::<Result<Vec<Front>, _>>()?;
    let (mut messages, mut bytes) = (vec![Vec::new(); sensors], 0);
    while let Some(frame) = scene.next_frame() {
        for (sensor, packets) in frame.packets.into_iter().enumerate() {
            for packet in packets {
                bytes += packet.payload.len();
                let arrived = Arrived { sensor, packet };
                fronts[sensor].push(&arrived, |message| messages[sensor].push(message));
            }
        }
    }
    Ok((messages, bytes))
}

fn encoded(message: &Foreground) -> Vec<u8> {
    umbracast_io::fields::encode(&mut message.clone())
}

/// So many halls for so many seconds.
fn run(
    command: &Path,
    halls: usize,
    seconds: u64,
    config: &Config,
    recorded: &[Vec<Foreground>],
    clock: HostClock,
) -> Result<Row, Box<dyn std::error::Error + Send + Sync>> {
    let folder = std::env::temp_dir().join(format!("umbracast-halls-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let port = std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let network = Network { mode: Mode::Router, listen: vec![endpoint.clone()], ..Network::default() };
    let session = network.open()?;
    let name = |hall: usize| format!("hall_{hall}");
    let mut nodes = Nodes(Vec::new());
    for hall in 0..halls {
        let site = folder.join(format!("{}.toml", name(hall)));
        let table =
            format!("[network]\nhall = \"{}\"\nmode = \"client\"\nconnect = [\"{endpoint}\"]\n", name(hall));
        fs::write(&site, table)?;
        let mut node = Command::new(command);
        node.args(["node", "track,forecast,cast", "--quiet", "--site"]).arg(&site);
        nodes.0.push(node.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?);
    }
    let warnings = Arc::new(AtomicU64::new(0));
    let counted = warnings.clone();
    let subscriber = session.declare_subscriber("umbracast/*/warnings/*");
    let _subscriber = subscriber
        .callback(move |_| {
            counted.fetch_add(1, Ordering::Relaxed);
        })
        .wait()?;
    while fleet::look(&session, None, Duration::from_millis(500))?.len() < halls {}
    let mut outlets: Vec<Vec<Outlet>> = Vec::new();
    for hall in 0..halls {
        let hall = Hall::new(session.clone(), Keys::new(&name(hall)));
        let outlet =
            |s: usize| hall.outlet(&hall.keys().foreground(&config.site.sensors[s].name), Urgency::Points);
        outlets.push((0..recorded.len()).map(outlet).collect::<Result<_, _>>()?);
    }
    let (start_ns, settling_ns) = (clock.now_ns(), SETTLING.as_nanos() as i64);
    let end_ns = start_ns + settling_ns + seconds as i64 * 1_000_000_000;
    let (bytes, look) = (Arc::new(AtomicU64::new(0)), session.clone());
    let (sent, late) = (bytes.clone(), Arc::new(AtomicU64::new(0)));
    let replay = {
        let (recorded, late) = (recorded.to_vec(), late.clone());
        std::thread::spawn(move || replay(&recorded, &outlets, clock, (start_ns, end_ns), &sent, &late))
    };
    clock.sleep_until(start_ns + settling_ns);
    let (before, own_s) = (warnings.load(Ordering::Relaxed), own_cpu_s());
    let (bytes_before, from_ns) = (bytes.load(Ordering::Relaxed), clock.now_ns());
    let left = Duration::from_nanos((end_ns - from_ns - 500_000_000).max(0) as u64);
    let seen = fleet::look(&look, None, left)?;
    let took_s = (clock.now_ns() - from_ns) as f64 * 1e-9;
    let replay_cores = (own_cpu_s() - own_s) / took_s;
    let in_mb_per_s = (bytes.load(Ordering::Relaxed) - bytes_before) as f64 / took_s / 1e6;
    let warnings_per_s = (warnings.load(Ordering::Relaxed) - before) as f64 / took_s;
    replay.join().map_err(|_| "the replay panicked")?;
    if late.load(Ordering::Relaxed) > 0 {
        println!("      # the replay itself was late with {} messages", late.load(Ordering::Relaxed));
    }
    drop(nodes);
    fs::remove_dir_all(&folder)?;
    Ok(row(halls, &seen, Row { halls, in_mb_per_s, replay_cores, warnings_per_s, ..NOTHING }))
}

const NOTHING: Row = Row {
    halls: 0,
    cores: 0.0,
    replay_cores: 0.0,
    resident_mib: 0.0,
    in_mb_per_s: 0.0,
    out_mb_per_s: 0.0,
    warnings_per_s: 0.0,
    frames_done: 0.0,
    median_ms: 0.0,
    p99_ms: 0.0,
};

/// What the nodes said, all together.
fn row(halls: usize, seen: &BTreeMap<String, Seen>, rest: Row) -> Row {
    let nodes: Vec<_> = seen.values().flat_map(|hall| hall.nodes.values()).collect();
    let healths: Vec<_> = nodes.iter().filter_map(|node| node.health.as_ref()).collect();
    let worst = |of: usize| healths.iter().map(|health| health.latency_ms[of]).fold(0.0, f64::max);
    let done: u64 = healths.iter().map(|health| health.frames).sum();
    let skipped: u64 = healths.iter().map(|health| health.frames_skipped).sum();
    Row {
        cores: nodes.iter().filter_map(|node| node.cores()).sum(),
        out_mb_per_s: nodes.iter().filter_map(|node| node.bytes_per_s()).sum::<f64>() / 1e6,
        resident_mib: healths.iter().map(|health| health.resident_bytes as f64 / f64::from(1 << 20)).sum(),
        frames_done: done as f64 / (done + skipped).max(1) as f64,
        median_ms: worst(0),
        p99_ms: worst(1),
        halls,
        ..rest
    }
}

/// Publishes until the end, every hall a little later than the one before.
fn replay(
    recorded: &[Vec<Foreground>],
    outlets: &[Vec<Outlet>],
    clock: HostClock,
    (start_ns, end_ns): (i64, i64),
    sent: &AtomicU64,
    late: &AtomicU64,
) {
    let length = recorded.iter().map(Vec::len).min().unwrap_or(0);
    for number in 0_i64.. {
        for (hall, outlets) in outlets.iter().enumerate() {
            let due_ns = start_ns + number * STEP_NS + hall as i64 * STEP_NS / 64;
            if due_ns >= end_ns || length == 0 {
                return;
            }
            clock.sleep_until(due_ns);
            late.fetch_add(u64::from(clock.now_ns() - due_ns > STEP_NS), Ordering::Relaxed);
            for (messages, outlet) in recorded.iter().zip(outlets) {
                let turn = (number as usize / length) as i64 * length as i64 * STEP_NS;
                let mut message = messages[number as usize % length].clone();
                message.time_ns += start_ns + turn;
                message.points.iter_mut().for_each(|point| point.time_ns += start_ns + turn);
                message.closed_ns = clock.now_ns();
                let bytes = umbracast_io::fields::encode(&mut message);
                sent.fetch_add(bytes.len() as u64, Ordering::Relaxed);
                outlet.put_bytes(bytes);
            }
        }
    }
}

/// Processes that end with this.
struct Nodes(Vec<Child>);

impl Drop for Nodes {
    fn drop(&mut self) {
        for node in &mut self.0 {
            let _ = node.kill().and_then(|()| node.wait()); // One that has ended by itself is gone all the same.
        }
    }
}

/// Processor time of this process, seconds.
fn own_cpu_s() -> f64 {
    const TICKS_PER_S: f64 = 100.0; // Of Linux, whatever the kernel's own.
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|word| word.parse::<f64>().ok());
    ticks.sum::<f64>() / TICKS_PER_S
}

/// Cores, and how late the slowest hall is, over the number of halls.
fn drawn(rows: &[Row]) -> Result<String, Error> {
    let series = |name: &str, color, value: fn(&Row) -> f64| Series {
        name: name.to_owned(),
        color,
        mark: Mark::Line(2.0),
        points: rows.iter().map(|row| (row.halls as f64, value(row))).collect(),
        band: Vec::new(),
    };
    let halls = rows.iter().map(|row| row.halls).max().unwrap_or(1) as f64;
    let panel = |title: &str, series: Vec<Series>| {
        let top = series.iter().flat_map(|s| &s.points).map(|point| point.1).fold(0.0, f64::max);
        Panel {
            title: title.to_owned(),
            x_label: "halls".to_owned(),
            x: (0.0, halls),
            y: (0.0, 1.1 * top.max(f64::MIN_POSITIVE)),
            y_digits: 1,
            series,
            ..Panel::default()
        }
    };
    let cores = vec![
        series("stages behind the front ends", BLUE, |row| row.cores),
        series("the simulated front ends", GREY, |row| row.replay_cores),
    ];
    let late = vec![series("", BLUE, |row| row.median_ms), series("", RED, |row| row.p99_ms)];
    let panels = [panel("cores", cores), panel("slowest hall, frame to links, ms: median, 99 %", late)];
    Ok(plot::draw_grid("halls", &panels, 2, (420.0, 300.0))?.svg)
}

const BLUE: &str = "#1b6ca8";
const GREY: &str = "#9aa5b1";
const RED: &str = "#b74a2f";
