//! Puts frames together again from what the stages publish, for the page and the recorder.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use umbracast::detect::Point;
use umbracast::{Config, Error, Outcome};
use umbracast_io::nodes::{Followed, Foreground};
use umbracast_io::rows::{self, BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow};
use umbracast_io::{fields, wire};
use umbracast_live::advice::Advised;
use umbracast_live::queue::{Popped, Queue, WhenFull};
use umbracast_live::run::Listener;
use umbracast_live::warnings::Warnings;
use umbracast_live::{HostClock, Published, published};
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;

use crate::front;
use crate::hall::Hall;
use crate::terms::Terms;
use crate::worker::Worker;

/// Messages that wait to be put together.
const WAITING: usize = 256;
/// The parts of a frame are waited for so long from its links on.
const PATIENCE_NS: i64 = 200_000_000;
/// Frames that wait for parts.
const OPEN_MAX: usize = 32;
/// When nothing was told for so long, time is taken as it comes.
const SILENCE_NS: i64 = 1_000_000_000;
const REST: Duration = Duration::from_millis(50);

/// One that looks on.
pub struct Watch {
    /// Its thread.
    pub(crate) worker: Worker<Part>,
    /// Frames that were told.
    pub frames: Arc<AtomicU64>,
    /// Frames of which a part did not come.
    pub incomplete: Arc<AtomicU64>,
    _subscribers: Vec<Subscriber<()>>,
}

pub(crate) enum Part {
    /// Rows, with the term of the tracker that led.
    Links(u64, ZBytes),
    Losses(u64, ZBytes),
    Bindings(u64, ZBytes),
    Decisions(u64, ZBytes),
    Tracks(ZBytes),
    Detections(u64, ZBytes),
    /// A front end's message, and the key that it came with.
    Foreground(String, ZBytes),
}

/// A frame's parts.
#[derive(Default)]
struct Parts {
    /// When the links came.
    since_ns: Option<i64>,
    frame: u64,
    term: u64,
    links: Option<Vec<LinkRow>>,
    losses: Option<Vec<LossRow>>,
    bindings: Option<Vec<BindingRow>>,
    decisions: Option<Vec<DecisionRow>>,
    tracks: Option<Followed>,
    detections: Option<Vec<DetectionRow>>,
    foreground: Vec<Foreground>,
}

impl Watch {
    /// Tells `listener` every frame of the hall, in order of time.
    ///
    /// # Errors
    /// A key that is none.
    pub fn start(
        hall: &Hall,
        config: &Config,
        clock: HostClock,
        points: bool,
        listener: Listener,
    ) -> Result<Self, Error> {
        let queue = Arc::new(Queue::new(WAITING, WhenFull::DropOldest));
        let hear_rows = |key: &str, kind: fn(u64, ZBytes) -> Part| {
            let queue = queue.clone();
            hall.hear_rows(&hall.keys().of(key), move |term, bytes| queue.push(kind(term, bytes.clone())))
        };
        let hear = |key: &str, kind: fn(ZBytes) -> Part| {
            let queue = queue.clone();
            hall.hear(&hall.keys().of(key), move |_, bytes| queue.push(kind(bytes.clone())))
        };
        let mut subscribers = vec![
            hear_rows("links", Part::Links)?,
            hear("tracks", Part::Tracks)?,
            hear_rows("detections", Part::Detections)?,
        ];
        let (has_radio, has_decisions) = (config.site.has_radio(), config.site.has_decisions());
        if has_radio {
            subscribers.push(hear_rows("losses", Part::Losses)?);
            subscribers.push(hear_rows("bindings", Part::Bindings)?);
        }
        if has_decisions {
            subscribers.push(hear_rows("decisions", Part::Decisions)?);
        }
        if points {
            let foregrounds = queue.clone();
            subscribers.push(hall.hear(&hall.keys().of("sensor/*/foreground"), move |key, bytes| {
                foregrounds.push(Part::Foreground(key.to_owned(), bytes.clone()));
            })?);
        }
        let (frames, incomplete) = (Arc::<AtomicU64>::default(), Arc::<AtomicU64>::default());
        let mut gather = Gather {
            names: published::access_points(&config.site),
            sensors: config.site.sensors.len(),
            points,
            has_radio,
            has_decisions,
            warnings: Warnings::default(),
            advised: Advised::default(),
            open: BTreeMap::new(),
            terms: Terms::default(),
            told_ns: (None, 0),
            clock,
            listener,
            frames: frames.clone(),
            incomplete: incomplete.clone(),
        };
        let worker = Worker::start(queue, move |parts| gather.run(parts));
        Ok(Self { worker, frames, incomplete, _subscribers: subscribers })
    }
}

struct Gather {
    names: Arc<[String]>,
    sensors: usize,
    points: bool,
    has_radio: bool,
    has_decisions: bool,
    warnings: Warnings,
    advised: Advised,
    open: BTreeMap<i64, Parts>,
    terms: Terms,
    /// The last frame that was told, and when.
    told_ns: (Option<i64>, i64),
    clock: HostClock,
    listener: Listener,
    frames: Arc<AtomicU64>,
    incomplete: Arc<AtomicU64>,
}

/// Whether a front end covers sensors of the site, none of which was covered before: so a frame has as many parts as there are
/// sensors, whatever is sent.
fn is_another(part: &Foreground, known: &[Foreground], sensors: usize) -> bool {
    let is_new = |sensor: &u32| known.iter().all(|other| !other.covers.contains(sensor));
    !part.covers.is_empty() && part.covers.iter().all(|sensor| (*sensor as usize) < sensors && is_new(sensor))
}

impl Gather {
    fn run(&mut self, queue: &Queue<Part>) {
        loop {
            let ended = match queue.pop_within(REST) {
                Popped::Item(part) => {
                    self.take(part);
                    false
                }
                Popped::Nothing => false,
                Popped::Closed => true,
            };
            self.tell(ended);
            if ended {
                return;
            }
        }
    }

    /// What is not understood is left.
    fn take(&mut self, part: Part) {
        let names = self.names.clone();
        match part {
            Part::Links(term, bytes) => {
                let Some((frame, time_ns, rows)) = wire::decode(&bytes.to_bytes(), &names) else { return };
                let now_ns = self.clock.now_ns();
                let Some(parts) = self.led(term, time_ns) else { return };
                (parts.frame, parts.since_ns, parts.links) = (frame, Some(now_ns), Some(rows));
            }
            Part::Losses(term, bytes) => {
                let Some((_, time_ns, rows)) = wire::decode(&bytes.to_bytes(), &names) else { return };
                let Some(parts) = self.led(term, time_ns) else { return };
                parts.losses = Some(rows);
            }
            Part::Bindings(term, bytes) => {
                let Some((_, time_ns, rows)) = wire::decode(&bytes.to_bytes(), &names) else { return };
                let Some(parts) = self.led(term, time_ns) else { return };
                parts.bindings = Some(rows);
            }
            Part::Decisions(term, bytes) => {
                let Some((_, time_ns, rows)) = wire::decode(&bytes.to_bytes(), &names) else { return };
                let Some(parts) = self.led(term, time_ns) else { return };
                parts.decisions = Some(rows);
            }
            Part::Detections(term, bytes) => {
                let Some((_, time_ns, rows)) = wire::decode(&bytes.to_bytes(), &names) else { return };
                let Some(parts) = self.led(term, time_ns) else { return };
                parts.detections = Some(rows);
            }
            Part::Tracks(bytes) => {
                let Some(tracks) = fields::decode::<Followed>(&bytes.to_bytes()) else { return };
                if tracks.forecasts.len() == tracks.tracks.len() {
                    let Some(parts) = self.led(tracks.term, tracks.time_ns) else { return };
                    parts.tracks = Some(tracks);
                }
            }
            Part::Foreground(key, bytes) => {
                let Some(part) = front::heard(&key, &bytes.to_bytes()) else { return };
                if self.is_told(part.time_ns) {
                    return;
                }
                let (sensors, known) = (self.sensors, &mut self.parts(part.time_ns).foreground);
                if is_another(&part, known, sensors) {
                    known.push(part);
                }
            }
        }
    }

    /// Where a part of a leader goes; none of an older term, nor of a frame that was told.
    fn led(&mut self, term: u64, time_ns: i64) -> Option<&mut Parts> {
        let now_ns = self.clock.now_ns();
        if !self.terms.takes(term, now_ns) || self.is_told(time_ns) {
            return None;
        }
        let parts = self.parts(time_ns);
        if parts.term < term {
            // What another leader said of this frame is of other numbers.
            let foreground = std::mem::take(&mut parts.foreground);
            *parts = Parts { term, foreground, ..Parts::default() };
        }
        Some(parts)
    }

    /// Whether a frame was told, or a later one. When all has been silent, time is taken as it comes.
    fn is_told(&self, time_ns: i64) -> bool {
        let silent = self.clock.now_ns() - self.told_ns.1 > SILENCE_NS;
        !silent && self.told_ns.0.is_some_and(|told_ns| time_ns <= told_ns)
    }

    fn parts(&mut self, time_ns: i64) -> &mut Parts {
        if self.open.len() >= OPEN_MAX && !self.open.contains_key(&time_ns) {
            self.open.pop_first();
        }
        self.open.entry(time_ns).or_default()
    }

    /// Every frame whose parts are all there, or have been waited for; with what never came, the frames before.
    fn tell(&mut self, ended: bool) {
        let (now_ns, points_wanted) = (self.clock.now_ns(), self.points);
        let (has_radio, has_decisions) = (self.has_radio, self.has_decisions);
        let whole = |parts: &Parts| {
            let seen = parts.tracks.as_ref().map_or(0, |tracks| tracks.sensors.len());
            let points: usize = parts.foreground.iter().map(|part| part.views.len()).sum();
            parts.links.is_some()
                && parts.tracks.is_some()
                && parts.detections.is_some()
                && (!has_radio || parts.losses.is_some() && parts.bindings.is_some())
                && (!has_decisions || parts.decisions.is_some())
                && (!points_wanted || points >= seen)
        };
        let waited = |parts: &Parts| parts.since_ns.is_some_and(|since_ns| now_ns - since_ns >= PATIENCE_NS);
        loop {
            let first_open = self.open.values().position(|parts| whole(parts) || waited(parts) || ended);
            match first_open {
                // A frame waits for those before it, whose links may still come.
                Some(0) => {}
                Some(n) if self.open.values().nth(n).is_some_and(waited) => {}
                _ => return,
            }
            let Some((time_ns, parts)) = self.open.pop_first() else { return };
            let complete = whole(&parts);
            if let Some(published) = self.published(time_ns, parts) {
                self.told_ns = (Some(time_ns), now_ns);
                self.frames.fetch_add(1, Ordering::Relaxed);
                (self.listener)(&Arc::new(published));
            }
            self.incomplete.fetch_add(u64::from(!complete), Ordering::Relaxed);
        }
    }

    fn published(&mut self, time_ns: i64, parts: Parts) -> Option<Published> {
        let (links, followed) = (parts.links?, parts.tracks?);
        let mut foreground: Vec<Point> = parts.foreground.into_iter().flat_map(|part| part.points).collect();
        foreground.sort_by_key(|point| point.sensor);
        let mut outcome = Outcome::default();
        (outcome.frame, outcome.time_ns) = (parts.frame, time_ns);
        (outcome.tracks, outcome.forecasts) = (followed.tracks, followed.forecasts);
        let mut tracks = Vec::new();
        rows::of_outcome(0, &outcome, &mut tracks, &mut Vec::new());
        let events = self.warnings.changes(&links, &self.names);
        let decisions = parts.decisions.unwrap_or_default();
        let advice = self.advised.changes(&decisions, &self.names);
        let now_ns = self.clock.now_ns();
        let time = |ns: i64| Duration::from_nanos(ns.max(0) as u64);
        Some(Published {
            frame: parts.frame,
            time_ns,
            term: parts.term,
            published_ns: now_ns,
            latency: time(now_ns.saturating_sub(followed.closed_ns)),
            step: time(followed.took_ns),
            detections: parts.detections.unwrap_or_default(),
            tracks,
            links,
            losses: parts.losses.unwrap_or_default(),
            bindings: parts.bindings.unwrap_or_default(),
            decisions,
            events,
            advice,
            points_cm: published::points_cm(&foreground),
            foreground: self.points.then_some(foreground),
            health: followed.health,
            sensors: (0..self.sensors).map(|s| followed.sensors.contains(&(s as u32))).collect(),
            access_points: self.names.clone(),
            ..Published::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every part that covered other sensors was kept until its frame was told, and that of a far future never is.
    #[test]
    fn a_frame_has_no_more_parts_than_the_site_has_sensors() {
        let mut known = Vec::new();
        for covers in
            [vec![], vec![2], vec![0], vec![0], vec![0, 1], vec![7, 1], vec![1], vec![1, 1], vec![u32::MAX]]
        {
            let part = Foreground { covers, ..Foreground::default() };
            if is_another(&part, &known, 2) {
                known.push(part);
            }
        }
        assert_eq!(known.iter().map(|part| part.covers.clone()).collect::<Vec<_>>(), [[0], [1]]);
    }
}
