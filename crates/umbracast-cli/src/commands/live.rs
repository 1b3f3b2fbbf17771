//! `live`: runs sensors' packets through all stages until a signal comes.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::lidar::udp_port;
use umbracast::site::Sensor;
use umbracast::{Config, Error, Frame, Health, Site};
use umbracast_eval::run::chain::{self, CIRCLE_M};
use umbracast_live::heard::Ear;
use umbracast_live::log::{Event, Form, Level, Log, Watch};
use umbracast_live::receive::Door;
use umbracast_live::record::RecordSettings;
use umbracast_live::run::{Counters, needs_restart};
use umbracast_live::send::{self, Sent};
use umbracast_live::whole::Whole;
use umbracast_live::{HostClock, Live, Settings, Summary};
use umbracast_sim::crowd::{Ground, Stroll};
use umbracast_sim::sensor::Sensors;

use crate::args::{self, Common, LogForm, RecordArgs};
use crate::ending::Ending;
use crate::inputs;
use crate::outward::Outward;
use crate::page::{Page, Shown};
use crate::run_json::{RunJson, Stopwatch};
use crate::setup::{self, TEST_SEED};
use crate::{say, signal};

/// How often it is looked at how the run goes.
const LOOK_NS: i64 = 1_000_000_000;
/// How often the end may be asked for.
const TICK: Duration = Duration::from_millis(50);

/// Runs until the end is asked for, then says how it went.
pub fn run(args: &args::Live, common: &Common) -> Result<Ending, Error> {
    let mut config = setup::config(args.mode, args.site.site.as_deref())?;
    let asked = signal::asked_to_end()?;
    let read_again = args.site.site.as_ref().map(|_| signal::asked_to_read_again()).transpose()?;
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let whole = Arc::new(Whole::default());
    let settings = Settings {
        weights: Some(setup::weights(args.weights.as_deref())?),
        empty: empty_frames(args, &config, common)?,
        doors: doors(&config.site, args.port, args.demo)?,
        record: recorder(&args.record),
        config: config.clone(),
        threads: setup::threads(common.threads),
        clock,
        counters: counters.clone(),
        whole: whole.clone(),
    };
    let title = if args.demo { format!("{}, simulated", config.site.name) } else { config.site.name.clone() };
    let heard = counters.clone();
    let ear: Ear = Arc::new(move |reports| heard.heard.push(reports));
    let shown =
        Shown { whole, ear: Some(ear.clone()), ..Shown::live(&config.site, &counters, clock, &title) };
    let page = Page::open(&args.page, shown)?;
    let (form, quiet) = log_of(args, common);
    let told = say::events(form, quiet, clock);
    let outward = Outward::of_site_file(args.site.site.as_deref(), &config.site, (ear, clock), told)?;
    let live = Live::start(settings, outward.beside(page.listener()))?;
    for (sensor, address) in config.site.sensors.iter().zip(live.receivers().bound()) {
        say::line(format_args!("{}: UDP port {}", sensor.name, address.port()));
    }
    let demo = args
        .demo
        .then(|| demonstration(args, &config, live.receivers().bound(), clock, &asked))
        .transpose()?;
    let watch = Stopwatch::start();
    let names = config.site.sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let mut events = Events::new(args, common, clock, names);
    events.tell(Event::new(Level::Info, "start", format!("{} begins", config.site.name)));
    while !asked.load(Ordering::Relaxed) && args.seconds.is_none_or(|seconds| watch.seconds() < seconds) {
        std::thread::sleep(TICK);
        events.look(&live);
        if read_again.as_ref().is_some_and(|again| again.swap(false, Ordering::Relaxed)) {
            events.tell(reload(args, &mut config, &live, &page, &outward));
        }
        if !live.is_well() {
            // What there is shall be finished all the same.
            live.stop();
            return Err(Error::new("a thread of the pipeline ended; this is a bug"));
        }
    }
    events.tell(Event::new(Level::Info, "end", "the run ends"));
    asked.store(true, Ordering::Relaxed);
    let sent = demo.and_then(|demo| demo.join().ok()).transpose()?;
    let summary = live.stop();
    page.close();
    Ok(tell(&summary, sent, &watch, common))
}

/// Reads the site file again and takes over what can be; whatever is wrong with it, the run goes on as it was.
fn reload(args: &args::Live, config: &mut Config, live: &Live, page: &Page, outward: &Outward) -> Event {
    let stays =
        |told: String| Event::new(Level::Warn, "reload_failed", format!("{told}; nothing was changed"));
    let new = match setup::config(args.mode, args.site.site.as_deref()) {
        Ok(new) => new,
        Err(error) => return stays(error.to_string()),
    };
    let apart = needs_restart(config, &new);
    if !apart.is_empty() {
        return stays(format!("these differences need a restart: {}", apart.join(", ")));
    }
    page.take_over(&new.site);
    outward.take_over(&new.site);
    live.take_over(new.clone());
    *config = new;
    Event::new(
        Level::Info,
        "reload",
        "the site file was read again: access points, UE and stage 3 now follow it",
    )
}

/// The log's form, and whether nobody reads it: whoever asks for JSON does.
fn log_of(args: &args::Live, common: &Common) -> (Form, bool) {
    match args.log {
        LogForm::Json => (Form::Json, false),
        LogForm::Text => (Form::Text, common.quiet),
    }
}

/// What happens, told on stderr.
struct Events {
    watch: Watch,
    log: Log,
    clock: HostClock,
    looked_ns: i64,
    quiet: bool,
}

impl Events {
    fn new(args: &args::Live, common: &Common, clock: HostClock, sensors: Vec<String>) -> Self {
        let (form, quiet) = log_of(args, common);
        Self { watch: Watch::new(sensors), log: Log::new(form), clock, looked_ns: clock.now_ns(), quiet }
    }

    /// Once a second.
    fn look(&mut self, live: &Live) {
        if self.clock.now_ns() - self.looked_ns >= LOOK_NS {
            self.looked_ns += LOOK_NS;
            self.watch.look(live.summary()).into_iter().for_each(|event| self.tell(event));
        }
    }

    fn tell(&mut self, event: Event) {
        if let Some(line) = self.log.line(&event, self.clock.now_ns()).filter(|_| !self.quiet) {
            eprintln!("{line}");
        }
    }
}

/// Where each sensor's packets come in: as the site says, or on ports from `--port` on. A demonstration takes free
/// ports: nobody is disturbed who listens already.
pub fn doors(site: &Site, port: Option<u16>, demo: bool) -> Result<Vec<Door>, Error> {
    let door = |(number, sensor): (usize, &Sensor)| {
        let counted = port.map(|first| if first == 0 { 0 } else { first.saturating_add(number as u16) });
        let port = if demo { Some(0) } else { counted.or(udp_port(sensor)) };
        let port = port.ok_or_else(|| {
            let (name, model) = (&sensor.name, &sensor.model);
            Error::new(format!("sensor {name:?}: expected a model that sends packets, found {model:?}"))
        })?;
        // Simulated packets come from loopback, whatever the site file says.
        let from = sensor.address_bytes().filter(|_| !demo).map(IpAddr::from);
        Ok(Door { sensor: number, port, from })
    };
    let doors: Vec<Door> = site.sensors.iter().enumerate().map(door).collect::<Result<_, _>>()?;
    told_apart(site, &doors)?;
    Ok(doors)
}

/// Refuses two sensors of one port that no address tells apart.
fn told_apart(site: &Site, doors: &[Door]) -> Result<(), Error> {
    for (d, one) in doors.iter().enumerate().filter(|(_, door)| door.port != 0) {
        let same = |other: &&Door| {
            let apart = matches!((other.from, one.from), (Some(a), Some(b)) if a != b);
            other.port == one.port && !apart
        };
        if let Some(other) = doors[..d].iter().find(same) {
            let [first, second] = [other, one].map(|door| &site.sensors[door.sensor].name);
            return Err(Error::new(format!(
                "sensors {first:?} and {second:?}: expected an `address` or a `udp_port` of its own for each in the site file, or \
                 --port, found both at UDP port {}",
                one.port
            )));
        }
    }
    Ok(())
}

/// The recorder's settings; none where nothing is recorded.
pub fn recorder(args: &RecordArgs) -> Option<RecordSettings> {
    args.record.as_ref().map(|folder: &PathBuf| RecordSettings {
        folder: folder.clone(),
        file_bytes: args.record_mb << 20,
        file_s: args.record_minutes * 60,
        keep: args.record_keep,
        points: args.record_points,
    })
}

/// The hall without people, as given; a demonstration simulates it.
fn empty_frames(args: &args::Live, config: &Config, common: &Common) -> Result<Vec<Frame>, Error> {
    match (args.empty.as_deref(), args.demo) {
        (Some(path), _) => {
            let (site, mut health) = (&config.site, Health::default());
            let read = inputs::empty_frames(Some(path), None, &args.captures, site, &mut health, common);
            read.map(|(frames, _)| frames)
        }
        (None, true) => chain::empty_frames(&config.site, TEST_SEED),
        (None, false) => {
            say::caution(
                "no empty hall is given, so the background is learned on the way: people who stand from the start cannot be told \
                 from furniture, and the first frames cannot be trusted. Record two seconds without people (--record) and give \
                 them with --empty",
            );
            Ok(Vec::new())
        }
    }
}

/// Simulated sensors, from a thread of their own.
fn demonstration(
    args: &args::Live,
    config: &Config,
    to: &[SocketAddr],
    clock: HostClock,
    stop: &Arc<AtomicBool>,
) -> Result<JoinHandle<Result<Sent, Error>>, Error> {
    let (site, stop) = (config.site.clone(), stop.clone());
    let (preset, people) = (args.crowd.preset, args.crowd.people);
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    let to: Vec<SocketAddr> =
        to.iter().map(|at| SocketAddr::from((Ipv4Addr::LOCALHOST, at.port()))).collect();
    let sensors = Sensors::new(&site, seed)?;
    let ground = Ground::of(&site, CIRCLE_M)?;
    ground.hold(people)?;
    let stroll = Stroll::new(preset, people, &ground, seed);
    Ok(std::thread::spawn(move || {
        let first = send::frame_of_hour(clock.now_ns());
        let packets = send::ahead(send::strolling(stroll, site, sensors, seed, first));
        send::send(packets, &to, 1.0, clock, &stop)
    }))
}

fn tell(summary: &Summary, sent: Option<Sent>, watch: &Stopwatch, common: &Common) -> Ending {
    let (latency, step) = (&summary.latencies, &summary.steps);
    let mut json = RunJson::new("live", watch)
        .with("packets", summary.packets)
        .with("packets_dropped_by_system", summary.dropped_by_system)
        .with("packets_lost", summary.packets_lost)
        .with("packets_of_strangers", summary.strangers)
        .with("frames", summary.frames)
        .with("frames_skipped", summary.frames_skipped)
        .with("latency_ms_median", latency.quantile_ms(0.5))
        .with("latency_ms_p99", latency.quantile_ms(0.99))
        .with("latency_ms_max", latency.longest().as_nanos() as f64 / 1e6)
        .with("step_ms_median", step.quantile_ms(0.5))
        .with("step_ms_p99", step.quantile_ms(0.99))
        .with("health", summary.health)
        .with("recorder", &summary.recorded);
    if let Some(sent) = sent {
        json = json.with("packets_sent", sent.packets).with("sent_late_ms_max", sent.latest_ns as f64 / 1e6);
    }
    let text = format!(
        "{} frames of {} packets in {:.1} s: {:.2} ms from the last packet to the warning (median), {:.2} ms (99 %)",
        summary.frames,
        summary.packets,
        watch.seconds(),
        latency.quantile_ms(0.5),
        latency.quantile_ms(0.99)
    );
    json.print(common, &text);
    let lost = [
        (summary.dropped_by_system, "packets dropped by the system"),
        (summary.packets_lost, "packets dropped"),
        (summary.strangers, "packets from addresses of no sensor"),
        (summary.frames_skipped, "frames skipped"),
        (summary.recorded.lost, "packets and results not recorded"),
    ];
    Ending::of_losses(&lost, summary.recorded.failing.as_deref())
}
