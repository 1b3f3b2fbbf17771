//! Some hours through the whole program: packets over UDP, recorder, page and a client of it, MQTT and a broker, with a clock that
//! runs so many times as fast as the host's. A row for each part of them.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use umbracast::geometry::DVec2;
use umbracast::{Config, Error, STEP_NS};
use umbracast_eval::score::bootstrap::quantile;
use umbracast_live::latency::Latencies;
use umbracast_live::receive::{Arrived, Door};
use umbracast_live::record::RecordSettings;
use umbracast_live::run::Counters;
use umbracast_live::send::{self, Sent};
use umbracast_live::serve::{self, Watched};
use umbracast_live::{HostClock, Live, Published, Settings, Summary};
use umbracast_node::mqtt::{Hears, Mqtt, Sender};

use super::broker::{Broker, Said};
use super::legs;
use super::memory::{in_use_mib, resident_mib};
use super::page::{Client, Saw};
use super::play::{HOUR_NS, MINUTE_NS, Play, S_NS};
use super::recorded::{Found, Opener};
use super::tally::Tally;
use super::verdict::Verdict;

/// So many times as fast as the host's clock.
pub const RATE: u32 = 10;
/// A recording is closed after so long or so much: five minutes of two sensors are a little more than that.
const FILE_S: u64 = 300;
const FILE_BYTES: u64 = 1_250_000_000;
const KEPT: usize = 3;
/// Rows are for so long.
const PART_NS: i64 = 15 * MINUTE_NS;
/// So often a broker hangs up, and the site file is read again.
const HANGS_UP_NS: i64 = 20 * MINUTE_NS;
const READ_AGAIN_NS: i64 = 50 * MINUTE_NS;
/// From the start to the first packet.
const AHEAD_NS: i64 = 2 * S_NS;
/// People of so many frames are remembered: what is made ahead and what is under way.
const REMEMBERED: usize = 64;
/// More seconds of tracks that are nobody's than this are not borne in a part.
const NOBODYS_S: f64 = 30.0;
/// A backlog only adds to what is in use, so that so small a share of the moments with least says what is held where none waits.
const IDLE_SHARE: f64 = 0.1;
const TICK: Duration = Duration::from_millis(20);

/// Who was where at the end of a frame.
type People = (i64, Vec<(u64, DVec2)>);

/// What rows are made of, counted on the pipeline's thread.
#[derive(Default)]
struct Part {
    latencies: Latencies,
    steps: Latencies,
    tally: Tally,
}

/// Whoever is told of the frames.
struct Told {
    people: Mutex<VecDeque<People>>,
    part: Mutex<Part>,
}

/// What was counted so far of all that is counted from the start.
#[derive(Debug, Default, Clone, Copy)]
struct Account {
    skipped: u64,
    packets_lost: u64,
    page: u64,
    mqtt_frames: u64,
    warnings: u64,
}

/// A row that was told.
struct Row {
    in_use_mib: f64,
    latency_ms: [f64; 2],
    followed: f64,
    nobodys_s: f64,
}

/// What of the run is asked at its end.
struct Ended {
    rows: Vec<Row>,
    summary: Summary,
    sent: Sent,
    found: Found,
    mqtt_lost: u64,
    hung_up: u64,
    files_begun_anew: u64,
}

/// Runs the program, tells how it goes, and says what is not as it must be.
///
/// # Errors
/// A port, a folder or a leg that is not there.
pub fn run(folder: &Path, hours: f64) -> Result<Verdict, Error> {
    let (config, counters) = (Config::default(), Arc::new(Counters::default()));
    let empty = legs::empty_frames(folder, &config)?;
    let recordings = folder.join("recordings");
    let clock = HostClock::faster(RATE);
    let broker = Broker::start()?;
    let mqtt = Mqtt {
        broker: broker.address.to_string(),
        user: None,
        password_file: None,
        ca: None,
        plain: false,
        objects: false,
        frames: true,
    };
    let sender = Arc::new(Sender::start(&mqtt, "soak", Hears::default(), drop)?);
    let watched = Watched::new(config.site.clone(), counters.clone(), clock, "soak");
    let page = serve::start(serve::Door::at(SocketAddr::from((Ipv4Addr::LOCALHOST, 0))), watched)?;
    let settings = Settings {
        doors: (0..config.site.sensors.len()).map(|sensor| Door { sensor, port: 0, from: None }).collect(),
        config: config.clone(),
        weights: None,
        empty,
        record: Some(RecordSettings {
            folder: recordings.clone(),
            file_bytes: FILE_BYTES,
            file_s: FILE_S,
            keep: Some(KEPT),
            points: false,
        }),
        threads: 1,
        clock,
        counters,
        whole: Arc::default(),
    };
    let told = Arc::new(Told { people: Mutex::default(), part: Mutex::default() });
    let (hears, publisher, outward) = (told.clone(), page.publisher(), sender.clone());
    let listener = move |published: &Arc<Published>| {
        publisher.publish(published);
        outward.frame(published);
        published.events.iter().for_each(|event| outward.send(event, published.term));
        hears.hear(published);
    };
    let live = Live::start(settings, Box::new(listener))?;
    let client = Client::start(page.address());
    let opener = Opener::start(recordings);
    let to: Vec<SocketAddr> =
        live.receivers().bound().iter().map(|at| (Ipv4Addr::LOCALHOST, at.port()).into()).collect();
    let from_ns = (clock.now_ns() + AHEAD_NS) / STEP_NS * STEP_NS;
    let packets = packets(Play::new(folder.to_owned(), from_ns, hours)?, told.clone());
    let (ended, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let sending = {
        let (stop, done) = (ended.clone(), done.clone());
        std::thread::spawn(move || {
            clock.sleep_until(from_ns);
            let sent = send::send(send::ahead(packets), &to, 1.0, clock, &stop);
            done.store(true, Ordering::Relaxed);
            sent
        })
    };
    tell_head(hours);
    let mut is_early = true;
    let (mut rows, mut before, mut number, mut hung_up, mut again) =
        (Vec::new(), Account::default(), 0, 0, 0);
    let mut in_use = Vec::new();
    while !done.load(Ordering::Relaxed) && live.is_well() {
        std::thread::sleep(TICK);
        in_use.push(in_use_mib());
        let gone_ns = clock.now_ns() - from_ns;
        if is_early && gone_ns >= i64::from(RATE) * S_NS {
            println!("{:>20.1}  a second later", resident_mib());
            is_early = false;
        }
        if gone_ns >= (hung_up + 1) * HANGS_UP_NS {
            broker.said.hang_up.store(true, Ordering::Relaxed);
            hung_up += 1;
        }
        if gone_ns >= (again + 1) * READ_AGAIN_NS {
            live.take_over(config.clone());
            again += 1;
        }
        if gone_ns >= (number + 1) * PART_NS {
            number += 1;
            let now = Account::of(&live.summary(), &client.saw, &broker.said);
            rows.push(told.tell(number, std::mem::take(&mut in_use), &before, &now));
            before = now;
        }
    }
    ended.store(true, Ordering::Relaxed);
    let is_well = live.is_well();
    let sent = sending.join().unwrap_or_else(|_| Err(Error::new("who sends panicked")))?;
    let summary = live.stop();
    let found = opener.stop()?;
    let mqtt_lost = sender.lost();
    drop(sender);
    let ended = Ended {
        rows,
        summary,
        sent,
        found,
        mqtt_lost,
        hung_up: hung_up as u64,
        files_begun_anew: again as u64,
    };
    let mut verdict = Verdict::default();
    verdict.expect("every thread works until the end", f64::from(u8::from(is_well)), 1.0..);
    ended.judge(&mut verdict, &client.saw, &broker.said);
    client.stop();
    page.stop();
    broker.stop();
    Ok(verdict)
}

/// What the sensors send; who is where is told on the way. A leg that is not there ends it.
fn packets(mut play: Play, told: Arc<Told>) -> impl Iterator<Item = Arrived> + Send + 'static {
    std::iter::from_fn(move || play.next_frame().ok().flatten()).flat_map(move |mut played| {
        let mut people = lock(&told.people);
        if people.len() == REMEMBERED {
            people.pop_front();
        }
        people.push_back((played.end_ns, std::mem::take(&mut played.people)));
        played.packets
    })
}

impl Told {
    /// On the pipeline's thread.
    fn hear(&self, published: &Published) {
        let mut part = lock(&self.part);
        part.latencies.add(published.latency / RATE);
        part.steps.add(published.step / RATE);
        let tracks: Vec<(u64, DVec2)> = published
            .tracks
            .iter()
            .filter(|track| track.confirmed)
            .map(|track| (track.track, DVec2::new(track.x_m, track.y_m)))
            .collect();
        let people = lock(&self.people);
        let off_ns = |people: &&People| (people.0 - published.time_ns).abs();
        if let Some((_, here)) = people.iter().min_by_key(off_ns) {
            part.tally.count(&tracks, here);
        }
    }

    /// `in_use` holds MiB at many moments of the part.
    fn tell(&self, number: i64, mut in_use: Vec<f64>, before: &Account, now: &Account) -> Row {
        in_use.sort_unstable_by(f64::total_cmp);
        let mut part = lock(&self.part);
        let tally = part.tally.followed_on();
        let Part { latencies, steps, tally } =
            std::mem::replace(&mut *part, Part { tally, ..Part::default() });
        drop(part);
        let row = Row {
            in_use_mib: quantile(&in_use, IDLE_SHARE),
            latency_ms: [0.5, 0.99].map(|share| latencies.quantile_ms(share)),
            followed: tally.share_followed(),
            nobodys_s: tally.nobodys_s(),
        };
        println!(
            "{:5.2} {:7} {:6.1} {:7.1} {:7.1} {:11.2} {:9.2} {:10.2} {:9.2} {:7.1} {:9.4} {:14.1} {:12.1} \
             {:8} {:8} {:9} {:7} {:8} {:9}",
            number as f64 * PART_NS as f64 / HOUR_NS as f64,
            tally.frames,
            resident_mib(),
            row.in_use_mib,
            quantile(&in_use, 1.0),
            row.latency_ms[0],
            row.latency_ms[1],
            1e3 * latencies.longest().as_secs_f64(),
            steps.quantile_ms(0.5),
            tally.at_once(),
            row.followed,
            tally.outlasting_s(),
            row.nobodys_s,
            tally.given(),
            now.skipped - before.skipped,
            now.packets_lost - before.packets_lost,
            now.page - before.page,
            now.mqtt_frames - before.mqtt_frames,
            now.warnings - before.warnings,
        );
        row
    }
}

impl Account {
    fn of(summary: &Summary, saw: &Saw, said: &Said) -> Self {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Self {
            skipped: summary.frames_skipped,
            packets_lost: summary.packets_lost + summary.dropped_by_system,
            page: count(&saw.frames),
            mqtt_frames: count(&said.frames),
            warnings: count(&said.warnings),
        }
    }
}

fn tell_head(hours: f64) {
    println!(
        "\nLive, {hours} h with a clock {RATE} times as fast as the host's; latencies and steps by the host's. UDP, recorder, page, \
         MQTT"
    );
    println!(
        "hours  frames    MiB  in use  at most  median, ms  99 %, ms  worst, ms  step, ms  people  followed  outlasting, s  nobody's, s  \
         numbers  skipped  lost pkts    page     MQTT  warnings"
    );
    println!("{:>20.1}  before the first packet", resident_mib());
}

impl Ended {
    /// What has to be so of the run.
    fn judge(&self, verdict: &mut Verdict, saw: &Saw, said: &Said) {
        let Self { rows, summary, sent, found, .. } = self;
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed) as f64;
        let frames = summary.frames as f64;
        println!(
            "{} packets sent, {} received, {} lost by system, {} by the program; {} frames, {} skipped; {} recordings, {} opened \
             whole, the largest {:.2} GB; page: {:.0} frames, {:.0} connections, {:.1} kB a frame; MQTT: {:.0} frames, {:.0} warnings, {} \
             lost, {:.0} connections",
            sent.packets,
            summary.packets,
            summary.dropped_by_system,
            summary.packets_lost,
            summary.frames,
            summary.frames_skipped,
            found.files,
            found.whole,
            1e-9 * found.longest_bytes as f64,
            count(&saw.frames),
            count(&saw.connections),
            1e-3 * count(&saw.bytes) / count(&saw.frames),
            count(&said.frames),
            count(&said.warnings),
            self.mqtt_lost,
            count(&said.connections),
        );
        if let Some(told) = &found.told {
            println!("{told}");
        }
        let skipped = summary.frames_skipped as f64 / (frames + summary.frames_skipped as f64);
        verdict.expect("share of frames that were skipped", skipped, ..0.02);
        let lost = (sent.packets - summary.packets.min(sent.packets) + summary.packets_lost) as f64;
        verdict.expect("share of packets that were lost", lost / sent.packets as f64, ..0.001);
        if let (Some(first), Some(last)) = (rows.first(), rows.last()) {
            verdict.expect(
                "memory in use where nothing waits, last part / first",
                last.in_use_mib / first.in_use_mib,
                ..1.08,
            );
            verdict.expect(
                "median latency, last part / first",
                last.latency_ms[0] / first.latency_ms[0],
                ..1.5,
            );
        }
        let worst = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        verdict.expect("99 % of latencies, ms, worst of the parts", worst(&|row| row.latency_ms[1]), ..50.0);
        verdict.expect("share not followed, worst of the parts", worst(&|row| 1.0 - row.followed), ..0.03);
        verdict.expect("nobody's seconds, worst of the parts", worst(&|row| row.nobodys_s), ..NOBODYS_S);
        let of_page = count(&saw.frames) / frames;
        verdict.expect("share of frames that the page got", of_page, 0.9..);
        verdict.expect("connections of the page", count(&saw.connections), 1.0..=1.0);
        verdict.expect(
            "share of looks at the counters that were answered",
            count(&saw.answers) / count(&saw.looks),
            0.99..,
        );
        verdict.expect("share of frames that the broker got", count(&said.frames) / frames, 0.9..);
        let connections = (self.hung_up + 1) as f64;
        verdict.expect("connections to the broker", count(&said.connections), connections..=connections);
        verdict.expect("warnings that the broker did not get", self.mqtt_lost as f64, ..=0.0);
        let recorded = &summary.recorded;
        let begun = self.files_begun_anew + 1;
        verdict.expect("recordings", found.files as f64, (begun + 1) as f64..);
        verdict.expect(
            "recordings that were begun and not opened",
            (recorded.files - found.files) as f64,
            ..=0.0,
        );
        verdict.expect("recordings that were not whole", (found.files - found.whole) as f64, ..=0.0);
        let all = (summary.packets + summary.frames) as f64;
        verdict.expect(
            "share of packets and results that were not recorded",
            recorded.lost as f64 / all,
            ..0.001,
        );
        let missing = all - (found.packets + found.frames + recorded.lost) as f64;
        verdict.expect("packets and frames neither recorded nor counted as lost", missing, 0.0..=0.0);
    }
}

/// What a thread that panicked left is whole.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
