//! The results of one frame, and their messages for recordings and for the network.

use umbracast::Site;
use umbracast::detect::Point;

use crate::messages::{self, Schema};
use crate::rows::{BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, ReportRow, TrackRow};
use crate::viewers;
use crate::wire::{self, WireRow};

/// What a run made of one frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Results<'a> {
    /// The frame's number.
    pub frame: u64,
    /// The frame's time; every position is given at it.
    pub time_ns: i64,
    /// When a live run published it, in the host's time; else the frame's time. Recordings are ordered by it.
    pub logged_ns: i64,
    /// Everybody seen.
    pub detections: &'a [DetectionRow],
    /// Everybody followed, with where they will be.
    pub tracks: &'a [TrackRow],
    /// Every link.
    pub links: &'a [LinkRow],
    /// What each of them loses; sent where the site has a radio.
    pub losses: &'a [LossRow],
    /// Who may carry which device; sent where the site has a radio.
    pub bindings: &'a [BindingRow],
    /// What was heard before the frame; recorded, where there is any, so that a replay hears the same.
    pub reports: &'a [ReportRow],
    /// What to do about each device; sent where the site says what changes cost.
    pub decisions: &'a [DecisionRow],
    /// Points that do not belong to the empty scene; none where nobody asked for them.
    pub foreground: Option<&'a [Point]>,
}

/// What gives a message's type, for who needs it.
pub type SchemaOf = fn() -> Schema;

/// A message with the topic it goes to.
#[derive(Debug, Clone)]
pub struct Message {
    /// As ROS 2 names it.
    pub topic: &'static str,
    /// Its type.
    pub schema: SchemaOf,
    /// Its CDR.
    pub bytes: Vec<u8>,
}

/// The topics of [`Results::messages`] that a frame of every site has, with their types.
const OF_EVERY_SITE: [(&str, SchemaOf); 6] = [
    (DetectionRow::TOPIC, wire::schema::<DetectionRow>),
    (TrackRow::TOPIC, wire::schema::<TrackRow>),
    (LinkRow::TOPIC, wire::schema::<LinkRow>),
    ("/tf", transforms_schema),
    (viewers::MARKERS_TOPIC, viewers::markers_schema),
    (viewers::PEOPLE_TOPIC, viewers::people_schema),
];

/// The topics of [`Results::messages`] that every frame of this site has, with their types.
pub fn topics(site: &Site) -> Vec<(&'static str, SchemaOf)> {
    let losses = (LossRow::TOPIC, wire::schema::<LossRow> as SchemaOf);
    let decisions = (DecisionRow::TOPIC, wire::schema::<DecisionRow> as SchemaOf);
    let bindings = (BindingRow::TOPIC, wire::schema::<BindingRow> as SchemaOf);
    let of_radio =
        [(site.has_radio(), losses), (site.has_radio(), bindings), (site.has_decisions(), decisions)];
    let asked_for = of_radio.into_iter().filter_map(|(has, topic)| has.then_some(topic));
    OF_EVERY_SITE.into_iter().chain(asked_for).collect()
}

impl Results<'_> {
    /// The frame's messages in the order of [`topics`], and behind them the foreground where somebody asked for it, and what was heard.
    pub fn messages(&self, site: &Site) -> Vec<Message> {
        let &Results { frame, time_ns, detections, tracks, links, losses, .. } = self;
        let &Results { bindings, reports, decisions, foreground, .. } = self;
        let access_points: Vec<String> = site.access_points.iter().map(|ap| ap.name.clone()).collect();
        let every = [
            wire::encode(time_ns, frame, detections, &access_points),
            wire::encode(time_ns, frame, tracks, &access_points),
            wire::encode(time_ns, frame, links, &access_points),
            // Who plays a recording with `ros2 bag` sends `/tf_static` once, to nobody who asks later.
            messages::transforms(site, time_ns),
            viewers::markers(time_ns, site, tracks, links),
            viewers::people(time_ns, tracks),
        ];
        let losses = site.has_radio().then(|| wire::encode(time_ns, frame, losses, &access_points));
        let bindings = site.has_radio().then(|| wire::encode(time_ns, frame, bindings, &access_points));
        let decisions = site.has_decisions().then(|| wire::encode(time_ns, frame, decisions, &access_points));
        let every = topics(site)
            .into_iter()
            .zip(every.into_iter().chain(losses).chain(bindings).chain(decisions))
            .map(|((topic, schema), bytes)| Message { topic, schema, bytes });
        let points = foreground.map(|points| Message {
            topic: viewers::FOREGROUND_TOPIC,
            schema: || messages::CLOUD,
            bytes: viewers::foreground(time_ns, points),
        });
        let reports = (!reports.is_empty()).then(|| Message {
            topic: ReportRow::TOPIC,
            schema: wire::schema::<ReportRow>,
            bytes: wire::encode(time_ns, frame, reports, &access_points),
        });
        every.chain(points).chain(reports).collect()
    }
}

fn transforms_schema() -> Schema {
    messages::TRANSFORMS
}
