//! The published results of one frame: the rows of the tables, the points to draw, and the latency.

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use serde_json::Value;
use umbracast::detect::Point;
use umbracast::{Frame, Health, Outcome, Site};
use umbracast_io::results::Results;
use umbracast_io::rows::{
    self, BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, ReportRow, TrackRow,
};
use umbracast_io::wire::{Asked, Json};

use crate::advice::Advice;
use crate::warnings::Event;

/// Points beyond this are drawn by nobody: every n-th is kept.
const POINTS_DRAWN: usize = 4000;

/// What a client wants of a frame.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// The points to draw.
    pub points: bool,
    /// Of the rows.
    pub rows: Asked,
}

impl Wanted {
    /// All there is.
    pub const WHOLE: Self = Self { points: true, rows: Asked::WHOLE };
    /// All rows.
    pub const WITHOUT_POINTS: Self = Self { points: false, ..Self::WHOLE };
}

/// One frame's results. Shared, never changed.
#[derive(Debug, Clone, Default)]
pub struct Published {
    /// Counts from the first packet.
    pub frame: u64,
    /// The end of the frame, in the time of the sensors.
    pub time_ns: i64,
    /// Of the tracker that led, where several may (`umbracast_node::terms`).
    pub term: u64,
    /// When it was published, host time.
    pub published_ns: i64,
    /// From the last packet of the frame to this.
    pub latency: Duration,
    /// Of the stages alone.
    pub step: Duration,
    /// Everybody seen.
    pub detections: Vec<DetectionRow>,
    /// Everybody followed, with where they will be.
    pub tracks: Vec<TrackRow>,
    /// Every link.
    pub links: Vec<LinkRow>,
    /// What each of them loses; empty where no access point has a radio.
    pub losses: Vec<LossRow>,
    /// Who may carry which device that was heard, likeliest first.
    pub bindings: Vec<BindingRow>,
    /// What was heard before the frame.
    pub reports: Vec<ReportRow>,
    /// What to do about each device; empty where the site does not say what changes cost.
    pub decisions: Vec<DecisionRow>,
    /// What changed of the links.
    pub events: Vec<Event>,
    /// What changed of the decisions.
    pub advice: Vec<Advice>,
    /// New points, site frame, centimetres.
    pub points_cm: Vec<[i32; 3]>,
    /// All of them as they are, where they are recorded.
    pub foreground: Option<Vec<Point>>,
    /// Of assembler and stages since the start.
    pub health: Health,
    /// Frames since the start that were given up because the pipeline was busy.
    pub frames_skipped: u64,
    /// For each sensor, whether it gave anything to this frame.
    pub sensors: Vec<bool>,
    /// The names of the site's access points.
    pub access_points: Arc<[String]>,
    /// How often the site file was read again.
    pub reloads: u64,
}

impl Published {
    /// The rows and points of a frame's outcome, and which of the site's `sensors` gave to it.
    pub fn of(outcome: &Outcome, frame: &Frame, sensors: usize, access_points: &Arc<[String]>) -> Self {
        let (mut tracks, mut links) = (Vec::new(), Vec::new());
        rows::of_outcome(0, outcome, &mut tracks, &mut links);
        Self {
            frame: outcome.frame,
            time_ns: outcome.time_ns,
            detections: rows::detections(0, outcome).collect(),
            tracks,
            links,
            losses: rows::losses(0, outcome).collect(),
            bindings: rows::bindings(0, outcome).collect(),
            decisions: rows::decisions(0, outcome).collect(),
            points_cm: points_cm(&outcome.foreground),
            health: outcome.health,
            sensors: (0..sensors).map(|s| frame.scans.iter().any(|scan| scan.sensor == s)).collect(),
            access_points: access_points.clone(),
            ..Self::default()
        }
    }

    /// Of memory, in a queue.
    pub fn bytes(&self) -> usize {
        let rows = [
            size_of_val(&*self.detections),
            size_of_val(&*self.tracks),
            size_of_val(&*self.links),
            size_of_val(&*self.losses),
            size_of_val(&*self.bindings),
            size_of_val(&*self.reports),
            size_of_val(&*self.decisions),
            size_of_val(&*self.events),
            size_of_val(&*self.advice),
            size_of_val(&*self.points_cm),
            self.foreground.as_deref().map_or(0, size_of_val),
        ];
        size_of::<Self>() + rows.iter().sum::<usize>()
    }

    /// As recordings and the topics of ROS 2 carry it.
    pub fn results(&self) -> Results<'_> {
        Results {
            frame: self.frame,
            time_ns: self.time_ns,
            logged_ns: self.published_ns,
            detections: &self.detections,
            tracks: &self.tracks,
            links: &self.links,
            losses: &self.losses,
            bindings: &self.bindings,
            reports: &self.reports,
            decisions: &self.decisions,
            foreground: self.foreground.as_deref(),
        }
    }

    /// As the page, `curl` and every client get it, so long after it was published. Names are those of the tables.
    pub fn json<'a>(&'a self, wanted: &'a Wanted, age: Option<Duration>) -> impl Serialize + 'a {
        let (names, asked) = (&*self.access_points, &wanted.rows);
        let ms = |time: Duration| (time.as_secs_f64() * 1e6).round() / 1e3;
        FrameJson {
            frame: self.frame,
            time_ns: self.time_ns,
            published_ns: self.published_ns,
            age_ms: age.map(|age| age.as_millis() as u64),
            latency_ms: ms(self.latency),
            step_ms: ms(self.step),
            frames_skipped: self.frames_skipped,
            reloads: self.reloads,
            sensors: &self.sensors,
            health: &self.health,
            tracks: Json::of(&self.tracks, names, asked),
            blockages: Json::of(&self.links, names, asked),
            losses: (!self.losses.is_empty()).then(|| Json::of(&self.losses, names, asked)),
            bindings: (!self.bindings.is_empty()).then(|| Json::of(&self.bindings, names, asked)),
            decisions: (!self.decisions.is_empty()).then(|| Json::of(&self.decisions, names, asked)),
            events: self.events.iter().map(Event::json).chain(self.advice.iter().map(Advice::json)).collect(),
            points_cm: wanted.points.then(|| self.points_cm.as_flattened()),
        }
    }
}

/// A frame's fields as they are sent.
#[derive(Serialize)]
struct FrameJson<'a> {
    frame: u64,
    time_ns: i64,
    published_ns: i64,
    age_ms: Option<u64>,
    latency_ms: f64,
    step_ms: f64,
    frames_skipped: u64,
    reloads: u64,
    sensors: &'a [bool],
    health: &'a Health,
    tracks: Json<'a, TrackRow>,
    blockages: Json<'a, LinkRow>,
    #[serde(skip_serializing_if = "Option::is_none")]
    losses: Option<Json<'a, LossRow>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bindings: Option<Json<'a, BindingRow>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    decisions: Option<Json<'a, DecisionRow>>,
    events: Vec<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    points_cm: Option<&'a [i32]>,
}

/// What is drawn of a frame's new points.
pub fn points_cm(foreground: &[Point]) -> Vec<[i32; 3]> {
    let every = foreground.len().div_ceil(POINTS_DRAWN).max(1);
    let in_cm = |value_m: f64| (value_m * 100.0).round() as i32; // A map in UTM fits in.
    foreground.iter().step_by(every).map(|point| point.position_m.to_array().map(in_cm)).collect()
}

/// The names of a site's access points, as every frame carries them.
pub fn access_points(site: &Site) -> Arc<[String]> {
    site.access_points.iter().map(|ap| ap.name.clone()).collect()
}
