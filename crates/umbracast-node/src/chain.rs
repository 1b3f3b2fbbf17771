//! The stages after the foreground, as many consecutive ones as a process runs: the calls of
//! [`umbracast::Pipeline::step`], with network messages at the ends.

use sha2::{Digest, Sha256};
use umbracast::blockage::Caster;
use umbracast::decide::Decider;
use umbracast::detect::{self, Clocks, Clusterer, Measurer, Prior};
use umbracast::forecast::{Forecaster, Weights};
use umbracast::radio::{Binder, Fader, Listener, Report};
use umbracast::track::{Tracker, Windows};
use umbracast::{Config, Error, Outcome, STEP_NS};
use umbracast_io::nodes::{Followed, Priors, TrackerState, Warning};
use umbracast_io::rows;
use umbracast_io::rows::{BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, TrackRow};
use umbracast_live::warnings::{Event, Warnings};

use crate::join::Joined;
use crate::role::Role;

/// States go from a program to one of the same version alone.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Which stages stand in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// From foreground to tracks.
    pub track: bool,
    /// From tracks to forecasts.
    pub forecast: bool,
    /// From forecasts to links.
    pub cast: bool,
}

impl Row {
    /// The rows of so many stages: stages that follow each other need no wire between.
    pub fn of(stages: &[Role]) -> Vec<Self> {
        let has = |role| stages.contains(&role);
        let (track, forecast, cast) = (has(Role::Track), has(Role::Forecast), has(Role::Cast));
        let rows = match (track, forecast, cast) {
            (true, false, true) => {
                [Self { track, forecast, cast: false }, Self { track: false, forecast, cast }].to_vec()
            }
            _ => vec![Self { track, forecast, cast }],
        };
        rows.into_iter().filter(|row| row.track || row.forecast || row.cast).collect()
    }
}

/// Stages in a row, with what each remembers.
#[derive(Debug)]
pub struct Chain {
    config: Config,
    clocks: Clocks,
    clusterer: Clusterer,
    measurer: Measurer,
    tracker: Option<Tracker>,
    /// Of tracks of another perception.
    windows: Windows,
    forecaster: Option<Forecaster>,
    caster: Option<Caster>,
    fader: Fader,
    binder: Binder,
    listener: Listener,
    decider: Decider,
    access_points: Vec<String>,
    warnings: Warnings,
    priors: Vec<Prior>,
    outcome: Outcome,
    /// The end of frame 0.
    first_ns: Option<i64>,
    last_ns: Option<i64>,
    fewer_samples: u64,
    out_of_order: u64,
}

/// What the stages made of one frame; what a stage makes that is not in the row is not there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Made {
    /// The frame's.
    pub time_ns: i64,
    /// The frame's.
    pub frame: u64,
    /// Where people are expected in the next frame.
    pub priors: Option<Priors>,
    /// Everybody seen.
    pub detections: Option<Vec<DetectionRow>>,
    /// Everybody followed, with forecasts if stage 2 is in the row.
    pub followed: Option<Followed>,
    /// The rows of everybody followed, where links are.
    pub tracks: Vec<TrackRow>,
    /// Every link.
    pub links: Option<Vec<LinkRow>>,
    /// What each of them loses.
    pub losses: Vec<LossRow>,
    /// Who may carry which device that was heard.
    pub bindings: Vec<BindingRow>,
    /// What to do about each device.
    pub decisions: Vec<DecisionRow>,
    /// What changed of the links.
    pub warnings: Vec<Warning>,
    /// When the last front end closed the frame, time of its host.
    pub closed_ns: i64,
    /// How long the stages took until here.
    pub took_ns: i64,
    /// Of the tracker that led.
    pub term: u64,
    /// Everybody's number, in order.
    pub numbers: Vec<u64>,
}

impl Made {
    /// Everybody has another number.
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        let followed = self.followed.iter_mut().flat_map(|followed| {
            let tracks = followed.tracks.iter_mut().map(|track| &mut track.id);
            tracks.chain(followed.forecasts.iter_mut().map(|forecast| &mut forecast.track))
        });
        let links = self.links.iter_mut().flatten().map(|link| &mut link.track);
        let rows = self.tracks.iter_mut().map(|row| &mut row.track);
        let losses = self.losses.iter_mut().map(|row| &mut row.track);
        let bindings = self.bindings.iter_mut().map(|row| &mut row.track);
        let decisions = self.decisions.iter_mut().map(|row| &mut row.track);
        let warnings = self.warnings.iter_mut().map(|warning| &mut warning.track);
        let radio = losses.chain(bindings).chain(decisions);
        let all = followed.chain(links).chain(rows).chain(radio).chain(warnings).chain(&mut self.numbers);
        all.for_each(|old| *old = number(*old));
    }

    /// A digest of everybody's number.
    pub fn digest(&self) -> u64 {
        let bytes: Vec<u8> = self.numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let digest = Sha256::digest(bytes);
        digest.iter().take(8).fold(0, |number, &byte| number << 8 | u64::from(byte))
    }
}

impl Chain {
    /// # Errors
    /// A setting that cannot work.
    pub fn new(config: &Config, weights: Option<&Weights>, row: Row, threads: usize) -> Result<Self, Error> {
        let caster = || {
            let mut caster = Caster::new(&config.blockage, &config.site);
            caster.use_threads(threads);
            caster
        };
        Ok(Self {
            clocks: Clocks::new(&config.detect, &config.site),
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            tracker: row.track.then(|| Tracker::new(&config.track, &config.site)),
            windows: Windows::default(),
            forecaster: row.forecast.then(|| Forecaster::new(&config.forecast, weights)).transpose()?,
            caster: row.cast.then(caster),
            fader: Fader::new(&config.site),
            binder: Binder::new(&config.site),
            listener: Listener::new(&config.site),
            decider: Decider::new(&config.site),
            access_points: config.site.access_points.iter().map(|ap| ap.name.clone()).collect(),
            warnings: Warnings::default(),
            priors: Vec::new(),
            outcome: Outcome::default(),
            first_ns: None,
            last_ns: None,
            fewer_samples: 0,
            out_of_order: 0,
            config: config.clone(),
        })
    }

    /// A frame of all front ends. Nothing comes of one that does not lie after the last.
    pub fn joined(&mut self, joined: Joined, now_ns: impl Fn() -> i64) -> Option<Made> {
        let time_ns = joined.views.time_ns;
        if joined.anew && !self.is_later(time_ns) {
            // Somebody's clock was set back: who was followed is followed no more, and nobody else gets their numbers.
            self.tracker = self.tracker.as_ref().map(|before| {
                let mut tracker = Tracker::new(&self.config.track, &self.config.site);
                tracker.renumber(|id| id, before.next_id());
                tracker
            });
            (self.first_ns, self.last_ns) = (None, None);
        }
        if !self.is_later(time_ns) {
            self.out_of_order += 1;
            return None;
        }
        let begun_ns = now_ns();
        let tracker = self.tracker.as_mut()?;
        self.last_ns = Some(time_ns);
        let first_ns = *self.first_ns.get_or_insert(time_ns);
        let o = &mut self.outcome;
        (o.time_ns, o.frame) = (time_ns, frames_between(first_ns, time_ns));
        o.health = joined.health;
        o.foreground = joined.foreground;
        detect::keep_most(&mut o.foreground, &mut o.health);
        let are_followed = joined.tracks.is_some();
        if let Some(tracks) = joined.tracks {
            // Whoever follows people elsewhere expects nothing of our detector.
            self.priors.clear();
            o.detections.clear();
            o.tracks = tracks;
            self.windows.follow(time_ns, &mut o.tracks);
        } else {
            tracker.priors(time_ns, &mut self.priors);
            match joined.detections {
                Some(detections) => o.detections = detections,
                None => {
                    self.clocks.put_right(&mut o.foreground);
                    self.clusterer.clusters(&o.foreground, &self.priors, &mut o.clusters);
                    self.clocks.follow(&o.foreground, &o.clusters, &self.priors);
                    self.measurer.detections(&o.foreground, &o.clusters, &self.priors, &mut o.detections);
                }
            }
            tracker.update(&joined.views, &o.detections, &mut o.tracks);
            tracker.priors(time_ns + STEP_NS, &mut self.priors);
        }
        o.health.frames_out_of_order = o.health.frames_out_of_order.saturating_add(self.out_of_order);
        o.health.clocks_corrected = self.clocks.corrected();
        let made = Made {
            priors: Some(Priors {
                time_ns: time_ns + STEP_NS,
                priors: self.priors.clone(),
                ..Priors::default()
            }),
            detections: Some(rows::detections(0, o).collect()),
            closed_ns: joined.closed_ns,
            // Numbers of others are theirs: no tracker that takes over gives new ones.
            numbers: o.tracks.iter().filter(|_| !are_followed).map(|track| track.id).collect(),
            ..Made::default()
        };
        let sensors = joined.views.of_scans.iter().map(|view| view.sensor as u32).collect();
        let forecast_here = self.forecaster.is_some();
        self.later_stages(made, sensors, joined.took_ns, begun_ns, now_ns, !forecast_here)
    }

    /// A frame that a tracker or a forecast in another process has done. Nothing comes of one that this row cannot go on
    /// with.
    pub fn followed(&mut self, followed: Followed, now_ns: impl Fn() -> i64) -> Option<Made> {
        let begun_ns = now_ns();
        let foreseen = followed.forecasts.len() == followed.tracks.len()
            && followed.forecasts.iter().zip(&followed.tracks).all(|(f, t)| f.track == t.id);
        let finite = followed.tracks.iter().all(|track| track.position_m.is_finite());
        if !finite || !self.is_later(followed.time_ns) || self.forecaster.is_none() && !foreseen {
            self.out_of_order += 1;
            return None;
        }
        self.last_ns = Some(followed.time_ns);
        let o = &mut self.outcome;
        (o.time_ns, o.frame, o.health) = (followed.time_ns, followed.frame, followed.health);
        (o.tracks, o.forecasts) = (followed.tracks, followed.forecasts);
        let made = Made { closed_ns: followed.closed_ns, term: followed.term, ..Made::default() };
        self.later_stages(made, followed.sensors, followed.took_ns, begun_ns, now_ns, false)
    }

    /// What another tracker needs to go on from here, as it is known in a term; `None` before the first frame, or where no
    /// tracker is in the row.
    pub fn state(&self, term: u64) -> Option<TrackerState> {
        Some(TrackerState {
            time_ns: self.last_ns?,
            first_ns: self.first_ns?,
            term,
            version: VERSION.to_owned(),
            tracker: self.tracker.as_ref()?.state(),
        })
    }

    /// Goes on where another tracker stood; false, and nothing is changed, where that cannot be.
    pub fn take_up(&mut self, state: &TrackerState) -> bool {
        let Some(tracker) = &mut self.tracker else { return false };
        let taken = state.version == VERSION && tracker.take_up(&state.tracker);
        if taken {
            (self.first_ns, self.last_ns) = (Some(state.first_ns), Some(state.time_ns));
            self.warnings = Warnings::default();
        }
        taken
    }

    /// The number of who is born next.
    pub fn next_number(&self) -> u64 {
        self.tracker.as_ref().map_or(0, Tracker::next_id)
    }

    /// Everybody's number, ascending.
    pub fn numbers(&self) -> Vec<u64> {
        self.tracker.as_ref().map(Tracker::ids).unwrap_or_default()
    }

    /// Everybody has another number, and who is born next has `next`.
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64, next: u64) {
        if let Some(tracker) = &mut self.tracker {
            tracker.renumber(&number, next);
        }
        self.binder.renumber(&number);
        self.listener.renumber(&number);
        self.decider.renumber(&number);
        self.warnings.renumber(number);
    }

    /// What access points heard of devices, for the next frame.
    pub fn hear(&mut self, reports: &[Report]) {
        self.binder.hear(reports);
    }

    /// Reports of which nothing could be made since the start.
    pub fn reports_skipped(&self) -> u64 {
        self.binder.skipped()
    }

    /// The next frame says again which warnings hold.
    pub fn say_again(&mut self) {
        self.warnings = Warnings::default();
    }

    /// Time begins anew: the next frame is taken whatever its time.
    pub fn forget_time(&mut self) {
        if self.tracker.is_none() {
            self.last_ns = None;
        }
    }

    /// Frames that were of no use since the start.
    pub fn out_of_order(&self) -> u64 {
        self.out_of_order
    }

    /// Stages 2 and 3, where they are in the row.
    fn later_stages(
        &mut self,
        mut made: Made,
        sensors: Vec<u32>,
        took_ns: i64,
        begun_ns: i64,
        now_ns: impl Fn() -> i64,
        publish_tracks: bool,
    ) -> Option<Made> {
        let o = &mut self.outcome;
        (made.time_ns, made.frame) = (o.time_ns, o.frame);
        if let Some(forecaster) = &mut self.forecaster {
            forecaster.forecast(&o.tracks, &mut o.forecasts);
        }
        if let Some(caster) = &mut self.caster {
            caster.cast(&o.tracks, &o.forecasts, &mut o.blockages);
            self.fader.fade(caster, &mut o.losses);
            self.binder.bind(o.time_ns, &o.tracks, &o.losses, &mut o.bindings);
            self.listener.sharpen(o.time_ns, &o.tracks, caster, &self.binder, &mut o.blockages);
            self.binder.served().for_each(|served| self.decider.serve(&served));
            self.decider.decide(o.time_ns, &o.tracks, &o.losses, self.fader.outages(), &mut o.decisions);
            let fewer = caster.took_fewer_samples() || self.fader.took_fewer_samples();
            self.fewer_samples += u64::from(fewer);
            o.health.frames_with_fewer_samples =
                o.health.frames_with_fewer_samples.saturating_add(self.fewer_samples);
            let (mut tracks, mut links) = (Vec::new(), Vec::new());
            rows::of_outcome(0, o, &mut tracks, &mut links);
            let events = self.warnings.changes(&links, &self.access_points);
            let warning = |event: &Event| warning(event, o.time_ns, o.frame, made.closed_ns);
            made.warnings = events.iter().map(warning).collect();
            (made.tracks, made.links) = (tracks, Some(links));
            made.losses = rows::losses(0, o).collect();
            made.bindings = rows::bindings(0, o).collect();
            made.decisions = rows::decisions(0, o).collect();
        }
        made.took_ns = took_ns + now_ns() - begun_ns;
        if publish_tracks || self.forecaster.is_some() {
            made.followed = Some(Followed {
                time_ns: o.time_ns,
                frame: o.frame,
                term: made.term,
                tracks: o.tracks.clone(),
                forecasts: if self.forecaster.is_some() { o.forecasts.clone() } else { Vec::new() },
                sensors,
                health: o.health,
                closed_ns: made.closed_ns,
                took_ns: made.took_ns,
            });
        }
        Some(made)
    }

    fn is_later(&self, time_ns: i64) -> bool {
        self.last_ns.is_none_or(|last_ns| time_ns > last_ns)
    }
}

/// A change of a link, as controllers get it.
fn warning(event: &Event, time_ns: i64, frame: u64, closed_ns: i64) -> Warning {
    let link = &event.link;
    Warning {
        time_ns,
        frame,
        term: 0,
        access_point: event.access_point.clone(),
        track: link.track,
        state: event.state.name().to_owned(),
        p_now: link.p_of_any(0),
        p_w9: link.p_of_any(umbracast::STEPS),
        onset_s: link.onset_s.map(|onset_s| onset_s.unwrap_or(f64::NAN)),
        closed_ns,
    }
}

/// The number of the frame that ends at `time_ns`.
fn frames_between(first_ns: i64, time_ns: i64) -> u64 {
    ((time_ns - first_ns + STEP_NS / 2) / STEP_NS) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tracker that took over gave everybody another number, but losses and decisions of its frames kept the old ones.
    #[test]
    fn losses_bindings_and_decisions_of_a_new_term_have_its_numbers() {
        let mut made = Made {
            losses: vec![LossRow { track: 3, ..LossRow::default() }],
            bindings: vec![BindingRow { track: 3, ..BindingRow::default() }],
            decisions: vec![DecisionRow { track: 3, ..DecisionRow::default() }],
            ..Made::default()
        };
        made.renumber(|number| number + 100);
        assert_eq!((made.losses[0].track, made.bindings[0].track, made.decisions[0].track), (103, 103, 103));
    }
}
