//! `node`: runs one process of a hall until a signal comes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc;
use std::time::Duration;

use umbracast::config::ForecastMethod;
use umbracast::forecast::Weights;
use umbracast::lidar::Packet;
use umbracast::{Config, Error, Frame, Health, Site};
use umbracast_io::input::{self, Given, Input};
use umbracast_io::reports;
use umbracast_live::heard::{Ear, Objects};
use umbracast_live::log::Form;
use umbracast_live::receive::{Arrived, Door};
use umbracast_live::run::{Counters, Listener};
use umbracast_live::{HostClock, Published};
use umbracast_node::hall::{Hall, Urgency};
use umbracast_node::keys::Keys;
use umbracast_node::meet::{self, Unanswered};
use umbracast_node::network::{self, Mode, Network};
use umbracast_node::outward::lists_into;
use umbracast_node::role::Role;
use umbracast_node::share::{self, Shared};
use umbracast_node::summary::Summary;
use umbracast_node::{Node, Settings, Source};

use super::live;
use crate::alive::Alive;
use crate::args::{self, Common};
use crate::ending::Ending;
use crate::outward::Outward;
use crate::page::{Page, Shown};
use crate::run_json::{RunJson, Stopwatch};
use crate::{say, setup, signal};

/// How often the end may be asked for.
const TICK: Duration = Duration::from_millis(20);
/// How often the others are told how it goes.
const TELL_S: f64 = 1.0;
/// How often it is said that the empty hall is missing.
const REMIND_S: f64 = 60.0;
const EMPTY_HALL_MISSING: &str = "no node has the empty hall yet: the background is learned while running, and the others are asked \
                                  every second";
/// Packets that are read ahead.
const AHEAD: usize = 4096;
/// What a process may do; the other roles are those of other programs.
const STAGES: [Role; 7] =
    [Role::Sensor, Role::Track, Role::Forecast, Role::Cast, Role::Record, Role::Serve, Role::Router];

/// Runs until the end is asked for, then says how it went.
pub fn run(args: &args::Node, common: &Common) -> Result<Ending, Error> {
    let stages = stages(args)?;
    let asked = signal::asked_to_end()?;
    let clock = HostClock::start();
    let given = args.site.site.as_deref().map(|path| setup::config(args.mode, Some(path))).transpose()?;
    let mut network = network(args)?;
    if stages.contains(&Role::Router) {
        network.mode = Mode::Router;
    }
    let name = match (&args.hall, &given) {
        (Some(hall), _) => network::chunk(hall).map_err(|e| e.within("--hall"))?,
        (None, Some(config)) => network.hall(&config.site)?,
        (None, None) => network.hall(&Config::for_mode(args.mode).site)?,
    };
    let alive = Alive::open(args.probe, clock)?;
    let ends = || {
        alive.beat();
        asked.load(Ordering::Relaxed)
    };
    let Some(session) = meet::open(&network, ends, say::note)? else { return Ok(Ending::Done) };
    let hall = Hall::new(session, Keys::new(&name));
    let Some(config) = config(args, given, &hall, ends)? else { return Ok(Ending::Done) };
    let sensors = sensors(args, &config.site)?;
    let shared = Shared::default().with_config(&hall, &config);
    let (empty, shared) = empty(args, &config, &sensors, &stages, &hall, shared)?;
    let (weights, shared) = weights(args, &config, &stages, &hall, shared)?;
    let counters = Arc::new(Counters::default());
    let ear = stages.contains(&Role::Serve).then(|| ear(&hall, &config.site)).transpose()?;
    let page = match &ear {
        Some(ear) => {
            let mut shown = Shown::live(&config.site, &counters, clock, &config.site.name);
            let take = || -> Objects { Box::new(lists_into(hall.session().clone(), &name)) };
            shown.objects = args.objects.then(take);
            shown.ear = Some(ear.clone());
            Page::open(&args.page, shown)?
        }
        None => Page::default(),
    };
    let session = hall.session().clone();
    let outward = match ear {
        Some(ear) => {
            let told = say::events(Form::Text, common.quiet, clock);
            Outward::of_network(&network, || Ok(session.clone()), &name, &config.site, (ear, clock), told)?
        }
        None => Outward::default(),
    };
    let mut record = live::recorder(&args.record);
    if stages.contains(&Role::Record) && record.is_none() {
        return Err(Error::new("node record: expected --record DIR, found none"));
    }
    record = record.filter(|_| stages.contains(&Role::Record) || stages.contains(&Role::Sensor));
    let settings = Settings {
        wait: network.wait(),
        source: source(args, &network, &config.site, &sensors)?,
        listener: stages.contains(&Role::Serve).then(|| outward.beside(listener(&page, counters))),
        stages: stages.clone(),
        config: config.clone(),
        weights: Some(weights),
        sensors,
        empty,
        record,
        shared,
        threads: setup::threads(common.threads),
        clock,
    };
    let node = Node::start(hall, settings)?;
    for address in node.receivers().iter().flat_map(|receivers| receivers.bound()) {
        say::line(format_args!("UDP port {}", address.port()));
    }
    let names: Vec<&str> = stages.iter().map(|stage| stage.name()).collect();
    say::line(format_args!("node {} of {name}: ready", names.join(",")));
    alive.ready();
    let (mut unanswered, mut empty_hall) = (Unanswered::default(), EmptyHall::of(&node, &stages));
    let watch = Stopwatch::start();
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let mut told_s = 0.0;
    while !ends() && !node.is_done() && args.seconds.is_none_or(|seconds| watch.seconds() < seconds) {
        std::thread::sleep(TICK);
        unanswered.look(&network, meet::calls(&network) && meet::is_alone(node.hall().session()), say::note);
        if watch.seconds() - told_s >= TELL_S {
            told_s += TELL_S;
            node.tell_health(host.trim());
            empty_hall.look(&node, watch.seconds());
        }
        if !node.is_well() {
            node.stop();
            return Err(Error::new("a thread of the node ended; this is a bug"));
        }
    }
    let summary = node.stop();
    page.close();
    Ok(tell(&summary, &names, &watch, common))
}

/// Passes what access points heard on to the nodes that cast.
fn ear(hall: &Hall, site: &Site) -> Result<Ear, Error> {
    let key = hall.keys().of(&format!("reports/{}", hall.id()));
    let (outlet, site) = (hall.outlet(&key, Urgency::Rest)?, site.clone());
    Ok(Arc::new(move |reports| outlet.put_bytes(reports::to_json(reports, &site).into_bytes())))
}

/// The page, and what `/metrics` counts.
fn listener(page: &Page, counters: Arc<Counters>) -> Listener {
    let told = page.listener();
    Box::new(move |published: &Arc<Published>| {
        counters.count(published);
        told(published);
    })
}

fn stages(args: &args::Node) -> Result<Vec<Role>, Error> {
    let mut stages = [&args.stage[..], &args.stages[..]].concat();
    stages.sort_unstable();
    stages.dedup();
    match stages.iter().find(|stage| !STAGES.contains(stage)) {
        None => Ok(stages),
        Some(other) => {
            let expected = STAGES.map(Role::name).join(", ");
            Err(Error::new(format!("node: expected stages of {expected}, found {}", other.name())))
        }
    }
}

/// The site file's, with what the arguments say otherwise.
fn network(args: &args::Node) -> Result<Network, Error> {
    let mut network = match &args.site.site {
        Some(path) => Network::of_site_file(&setup::read_text(path)?, path)?,
        None => Network::default(),
    };
    if !args.listen.is_empty() {
        network.listen.clone_from(&args.listen);
    }
    if !args.connect.is_empty() {
        network.connect.clone_from(&args.connect);
    }
    network.anyone |= args.anyone;
    Ok(network)
}

/// The site file's, or the one that somebody of the hall has: it may come later. `None` where the end was asked for.
fn config(
    args: &args::Node,
    given: Option<Config>,
    hall: &Hall,
    ends: impl Fn() -> bool,
) -> Result<Option<Config>, Error> {
    if given.is_some() {
        return Ok(given);
    }
    if args.hall.is_none() && args.connect.is_empty() {
        return Ok(Some(Config::for_mode(args.mode)));
    }
    let mut told = false;
    while !ends() {
        if let Some(config) = share::ask_config(hall)? {
            return Ok(Some(config));
        }
        if !told {
            say::note(&format!("no --site: waiting for a node of {} that has the site", hall.keys().hall()));
            told = true;
        }
        std::thread::sleep(TICK);
    }
    Ok(None)
}

/// Places in the site of the sensors that are named; all where none is.
fn sensors(args: &args::Node, site: &Site) -> Result<Vec<usize>, Error> {
    let place = |name: &String| {
        site.sensors.iter().position(|sensor| sensor.name == *name).ok_or_else(|| {
            let known: Vec<&str> = site.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
            Error::new(format!("--sensors: expected some of {}, found {name:?}", known.join(", ")))
        })
    };
    let mut sensors: Vec<usize> = args.sensors.iter().map(place).collect::<Result<_, _>>()?;
    sensors.sort_unstable();
    sensors.dedup();
    Ok(if sensors.is_empty() { (0..site.sensors.len()).collect() } else { sensors })
}

/// The hall without people: as given, and given to who asks; or asked for by a front end.
fn empty(
    args: &args::Node,
    config: &Config,
    own: &[usize],
    stages: &[Role],
    hall: &Hall,
    shared: Shared,
) -> Result<(Vec<Frame>, Shared), Error> {
    let site = &config.site;
    if let Some(path) = &args.empty {
        let mut packets = vec![Vec::new(); site.sensors.len()];
        let empty = input::empty_hall(std::slice::from_ref(path), site, &[])?;
        empty.packets(site, |sensor, packet: Packet| {
            packets[sensor].push(packet);
            Ok(())
        })?;
        // A tracker has it for front ends, of which each needs its own sensors'.
        let needed = if stages.contains(&Role::Sensor) { own } else { &[] };
        let (frames, _) = empty.empty_frames(site, needed, &mut Health::default())?;
        return Ok((frames, shared.with_empty(hall, site, &packets)));
    }
    if !stages.contains(&Role::Sensor) {
        return Ok((Vec::new(), shared));
    }
    match share::ask_empty(hall, site, own) {
        Some(packets) => Ok((share::empty_frames(site, &packets)?, shared.with_empty(hall, site, &packets))),
        None => Ok((Vec::new(), shared)),
    }
}

/// Says that a front end is without the empty hall, now and again, until it comes.
struct EmptyHall {
    /// Whether it is without.
    missing: bool,
    said_s: f64,
}

impl EmptyHall {
    fn of(node: &Node, stages: &[Role]) -> Self {
        let missing = stages.contains(&Role::Sensor) && !node.has_empty_hall();
        if missing {
            say::note(EMPTY_HALL_MISSING);
        }
        Self { missing, said_s: 0.0 }
    }

    fn look(&mut self, node: &Node, now_s: f64) {
        if self.missing && node.has_empty_hall() {
            self.missing = false;
            say::note("the empty hall came from another node: the background is known from now on");
        }
        if self.missing && now_s - self.said_s >= REMIND_S {
            self.said_s = now_s;
            say::note(EMPTY_HALL_MISSING);
        }
    }
}

/// The weights that are given, and given to who asks; or asked for by a forecast that needs some.
fn weights(
    args: &args::Node,
    config: &Config,
    stages: &[Role],
    hall: &Hall,
    shared: Shared,
) -> Result<(Weights, Shared), Error> {
    let needed = stages.contains(&Role::Forecast) && config.forecast.method == ForecastMethod::Lstm;
    let asked = if args.weights.is_none() && needed { share::ask_weights(hall) } else { None };
    match asked {
        Some(file) => {
            let weights = Weights::from_safetensors(&file).map_err(|e| e.within("weights of the hall"))?;
            Ok((weights, shared.with_weights(hall, file)))
        }
        None => {
            let weights = setup::weights(args.weights.as_deref())?;
            let given = args.weights.as_deref().map(|path| setup::weights_file(Some(path))).transpose()?;
            Ok((weights, given.into_iter().fold(shared, |s, file| s.with_weights(hall, file.into_owned()))))
        }
    }
}

fn one_input(path: &Path, site: &Site) -> Result<Input, Error> {
    let mut inputs = Given::of(&[path.to_owned()])?.of_site(site, &[])?.scenes;
    match (inputs.pop(), inputs.is_empty()) {
        (Some(input), true) => Ok(input),
        _ => Err(Error::new("expected one scene, found several").within(path.display())),
    }
}

/// Sockets, or a recording that is read ahead on a thread of its own.
fn source(args: &args::Node, network: &Network, site: &Site, own: &[usize]) -> Result<Source, Error> {
    if !args.ros2.is_empty() {
        if args.ros2.len() != own.len() {
            let (expected, found) = (own.len(), args.ros2.len());
            return Err(Error::new(format!(
                "--ros2: expected a topic for each of {expected} sensors, found {found}"
            )));
        }
        let topics = own.iter().copied().zip(args.ros2.iter().cloned()).collect();
        return Ok(Source::Ros2(network.ros2.map_or(0, |ros2| ros2.domain), topics));
    }
    let Some(path) = &args.from else {
        let doors = live::doors(
            &Site { sensors: own.iter().map(|&s| site.sensors[s].clone()).collect(), ..site.clone() },
            args.port,
            false,
        );
        let place = |door: Door| Door { sensor: own[door.sensor], ..door };
        // Nobody listens who is no front end.
        return match args.stage.iter().chain(&args.stages).any(|stage| *stage == Role::Sensor) {
            true => Ok(Source::Doors(doors?.into_iter().map(place).collect())),
            false => Ok(Source::Doors(Vec::new())),
        };
    };
    let (input, site) = (one_input(path, site)?, site.clone());
    let (packets, coming) = mpsc::sync_channel(AHEAD);
    std::thread::spawn(move || {
        let sent = input.packets(&site, |sensor, packet: Packet| {
            packets.send(Arrived { sensor, packet }).map_err(|_| Error::new("asked to end"))
        });
        if let Err(error) = sent.as_ref().map(|_| ()).map_err(ToString::to_string) {
            say::note(&format!("{input}: {error}"));
        }
    });
    Ok(Source::Replay(Box::new(coming.into_iter()), args.rate))
}

fn tell(summary: &Summary, stages: &[&str], watch: &Stopwatch, common: &Common) -> Ending {
    let (latency, wire) = (&summary.latency, &summary.wire);
    let (messages, bytes) = summary.published;
    RunJson::new("node", watch)
        .with("stages", stages)
        .with("packets", summary.packets)
        .with("packets_lost", summary.packets_lost)
        .with("frames", summary.frames)
        .with("frames_incomplete", summary.incomplete)
        .with("messages_skipped", summary.skipped)
        .with("messages_late", summary.late)
        .with("messages_broken", summary.broken)
        .with("priors_late", summary.priors_late)
        .with("messages_published", messages)
        .with("bytes_published", bytes)
        .with("latency_ms_median", latency.quantile_ms(0.5))
        .with("latency_ms_p99", latency.quantile_ms(0.99))
        .with("wire_ms_median", wire.quantile_ms(0.5))
        .with("wire_ms_p99", wire.quantile_ms(0.99))
        .with("leads", summary.leads)
        .with("health", summary.health)
        .with("recorder", &summary.recorded)
        .print(
            common,
            &format!(
                "{}: {} frames in {:.1} s, {} messages of {:.1} MB published",
                stages.join(","),
                summary.frames,
                watch.seconds(),
                messages,
                bytes as f64 * 1e-6
            ),
        );
    let lost = [
        (summary.packets_lost, "packets dropped"),
        (summary.skipped, "messages given up"),
        (summary.incomplete, "frames incomplete"),
        (summary.recorded.lost, "packets and results not recorded"),
    ];
    Ending::of_losses(&lost, summary.recorded.failing.as_deref())
}
