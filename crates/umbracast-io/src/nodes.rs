//! The messages between nodes, in full precision: a frame sent over the network gives the same results, to the byte.
//! Rows of links and detections are those of [`crate::wire`].

use std::collections::VecDeque;

use umbracast::Health;
use umbracast::detect::{Moments, Point, Prior, Shape};
use umbracast::forecast::{Coupling, Forecast, Gaussian2};
use umbracast::geometry::{Aabb, DMat3, DVec2, DVec3, Obb, Pose};
use umbracast::lidar::{Fan, SECTORS, View};
use umbracast::track::{Canopy, Gait, Observed, Track};

use crate::fields::{Fields, Message, index, matrix, maybe, schema, vec2, vec3};
use crate::messages::Schema;

/// One frame of one front end.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Foreground {
    /// The frame's.
    pub time_ns: i64,
    /// The names of all sensors of the site: what `covers`, views and points count in.
    pub sensors: Vec<String>,
    /// Those that this front end answers for, whether they gave something or not.
    pub covers: Vec<u32>,
    /// What each of them that gave something could see.
    pub views: Vec<View>,
    /// Points that do not belong to the empty hall.
    pub points: Vec<Point>,
    /// What was skipped since the start.
    pub health: Health,
    /// When the frame closed, time of the front end's host.
    pub closed_ns: i64,
    /// How long the foreground took.
    pub took_ns: i64,
}

/// Where people are expected in the next frame; also the sign of life of the tracker that leads.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Priors {
    /// The next frame's, if none is left out.
    pub time_ns: i64,
    /// Who leads,
    pub tracker: String,
    /// and in which term: of two leaders the one of the newer term leads.
    pub term: u64,
    /// A digest of everybody's number, by which one that stands by sees that it numbers people as the leader does.
    pub numbers: u64,
    /// One a track.
    pub priors: Vec<Prior>,
}

/// Everybody followed in one frame, with where they will be once stage 2 has seen them: all that stage 3 needs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Followed {
    /// The frame's.
    pub time_ns: i64,
    /// The frame's.
    pub frame: u64,
    /// Of the tracker that led: who has heard of a newer term gives this up.
    pub term: u64,
    /// Everybody, in order of id.
    pub tracks: Vec<Track>,
    /// None before stage 2; one a track after it.
    pub forecasts: Vec<Forecast>,
    /// The sensors of the site that gave to the frame.
    pub sensors: Vec<u32>,
    /// Of front ends and stages since the start.
    pub health: Health,
    /// When the last front end closed the frame, time of its host.
    pub closed_ns: i64,
    /// How long the stages took until here: of the front ends the slowest, and all that followed.
    pub took_ns: i64,
}

/// What a tracker needs to go on where another one ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrackerState {
    /// The last frame that it has seen.
    pub time_ns: i64,
    /// The end of frame 0.
    pub first_ns: i64,
    /// Of the tracker that led.
    pub term: u64,
    /// The program's, which alone understands the rest.
    pub version: String,
    /// [`umbracast::track::Tracker`] as it writes itself.
    pub tracker: Vec<u8>,
}

/// A change of one link.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Warning {
    /// The frame's.
    pub time_ns: i64,
    /// The frame's.
    pub frame: u64,
    /// Of the tracker that led: who has heard of a newer term gives this up.
    pub term: u64,
    /// Its name.
    pub access_point: String,
    /// Whose link.
    pub track: u64,
    /// `warning`, `blocked`, `clear`, or `gone` where nobody is followed any more.
    pub state: String,
    /// Probability that anything blocks the link now,
    pub p_now: f64,
    /// and within 900 ms.
    pub p_w9: f64,
    /// 10, 50 and 90 % quantiles of the time until somebody else does; NaN: none.
    pub onset_s: [f64; 3],
    /// When the last front end closed the frame, time of its host.
    pub closed_ns: i64,
}

/// How a node does.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NodeHealth {
    /// Now, time of its host.
    pub time_ns: i64,
    /// Its name.
    pub node: String,
    /// Its host's name.
    pub host: String,
    /// The stages that it runs.
    pub stages: Vec<String>,
    /// Seconds since it began.
    pub up_s: f64,
    /// Seconds of processor time since then.
    pub cpu_s: f64,
    /// Bytes of memory that it holds.
    pub resident_bytes: u64,
    /// Frames that it has done.
    pub frames: u64,
    /// Frames that it has given up because it was busy.
    pub frames_skipped: u64,
    /// Frames that waited in vain for a front end.
    pub frames_incomplete: u64,
    /// Messages that came too late for their frame.
    pub messages_late: u64,
    /// Messages that were not understood, or are of another site.
    pub messages_broken: u64,
    /// Bytes that it has published.
    pub bytes_out: u64,
    /// Messages that it has published.
    pub messages_out: u64,
    /// Medians and 99 % quantiles of the newest frames, ms: from the close of the frame to this node's results, and of
    /// that what was not spent in a stage.
    pub latency_ms: [f64; 2],
    /// The second.
    pub wire_ms: [f64; 2],
    /// Whether it leads where several do the same.
    pub leads: bool,
    /// What tells its site file's halls apart: nodes that work together have the same.
    pub site: u64,
    /// What was skipped since the start.
    pub health: Health,
    /// Whether it knows the hall without people; a front end without it learns the background while it runs.
    pub empty_hall: bool,
    /// What is not as it should be now, in words: only what this node knows itself.
    pub troubles: Vec<String>,
}

/// Every definition, for who publishes them.
pub fn schemas() -> [Schema; 6] {
    [
        schema::<Foreground>(),
        schema::<Priors>(),
        schema::<Followed>(),
        schema::<TrackerState>(),
        schema::<Warning>(),
        schema::<NodeHealth>(),
    ]
}

impl Message for Foreground {
    const NAME: &'static str = "Foreground";
    const WHAT: &'static str = "What one front end saw in one frame that does not belong to the empty hall.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.strings("sensors", &mut self.sensors);
        f.u32_list("covers", &mut self.covers);
        f.list("views", &mut self.views);
        f.list("points", &mut self.points);
        f.one("health", &mut self.health);
        f.i64("closed_ns", &mut self.closed_ns);
        f.i64("took_ns", &mut self.took_ns);
    }
}

impl Message for Priors {
    const NAME: &'static str = "Priors";
    const WHAT: &'static str = "Where people are expected in the frame of this time.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.string("tracker", &mut self.tracker);
        f.u64("term", &mut self.term);
        f.u64("numbers", &mut self.numbers);
        f.list("priors", &mut self.priors);
    }
}

impl Message for Followed {
    const NAME: &'static str = "Followed";
    const WHAT: &'static str =
        "Everybody followed at the end of a frame, and where they will be once stage 2 has seen them.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.u64("frame", &mut self.frame);
        f.u64("term", &mut self.term);
        f.list("tracks", &mut self.tracks);
        f.list("forecasts", &mut self.forecasts);
        f.u32_list("sensors", &mut self.sensors);
        f.one("health", &mut self.health);
        f.i64("closed_ns", &mut self.closed_ns);
        f.i64("took_ns", &mut self.took_ns);
    }
}

impl Message for TrackerState {
    const NAME: &'static str = "TrackerState";
    const WHAT: &'static str = "What a tracker needs to go on where another one ended.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.i64("first_ns", &mut self.first_ns);
        f.u64("term", &mut self.term);
        f.string("version", &mut self.version);
        f.bytes("tracker", &mut self.tracker);
    }
}

impl Message for Warning {
    const NAME: &'static str = "Warning";
    const WHAT: &'static str =
        "A link is about to be blocked, is blocked, is clear again, or its owner is gone.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.u64("frame", &mut self.frame);
        f.u64("term", &mut self.term);
        f.string("access_point", &mut self.access_point);
        f.u64("track", &mut self.track);
        f.string("state", &mut self.state);
        f.f64("p_now", &mut self.p_now);
        f.f64("p_w9", &mut self.p_w9);
        f.f64_array("onset_s", &mut self.onset_s);
        f.i64("closed_ns", &mut self.closed_ns);
    }
}

impl Message for NodeHealth {
    const NAME: &'static str = "NodeHealth";
    const WHAT: &'static str = "How a node does.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.header(&mut self.time_ns);
        f.string("node", &mut self.node);
        f.string("host", &mut self.host);
        f.strings("stages", &mut self.stages);
        f.f64("up_s", &mut self.up_s);
        f.f64("cpu_s", &mut self.cpu_s);
        f.u64("resident_bytes", &mut self.resident_bytes);
        f.u64("frames", &mut self.frames);
        f.u64("frames_skipped", &mut self.frames_skipped);
        f.u64("frames_incomplete", &mut self.frames_incomplete);
        f.u64("messages_late", &mut self.messages_late);
        f.u64("messages_broken", &mut self.messages_broken);
        f.u64("bytes_out", &mut self.bytes_out);
        f.u64("messages_out", &mut self.messages_out);
        f.f64_array("latency_ms", &mut self.latency_ms);
        f.f64_array("wire_ms", &mut self.wire_ms);
        f.bool("leads", &mut self.leads);
        f.u64("site", &mut self.site);
        f.one("health", &mut self.health);
        f.bool("empty_hall", &mut self.empty_hall);
        f.strings("troubles", &mut self.troubles);
    }
}

impl Message for View {
    const NAME: &'static str = "View";
    const WHAT: &'static str = "Where a sensor hung, and where its beams went; the fan is none or one.";

    fn empty() -> Self {
        Self { sensor: 0, site_from_sensor: Pose::IDENTITY, fan: None }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        index(f, "sensor", &mut self.sensor);
        matrix(f, "rotation", &mut self.site_from_sensor.rotation);
        vec3(f, "translation_m", &mut self.site_from_sensor.translation_m);
        let mut fan: Vec<Fan> = self.fan.take().into_iter().collect();
        f.list("fan", &mut fan);
        self.fan = fan.into_iter().next();
    }
}

impl Message for Fan {
    const NAME: &'static str = "Fan";
    const WHAT: &'static str =
        "Elevations of beams, ascending, and columns fired into each sector of a turn.";

    fn empty() -> Self {
        Self { elevations_rad: Vec::new(), columns: [0; SECTORS] }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.f64_list("elevations_rad", &mut self.elevations_rad);
        f.u32_array("columns", &mut self.columns);
    }
}

impl Message for Point {
    const NAME: &'static str = "ForegroundPoint";
    const WHAT: &'static str = "A point in the site frame, when it was measured, and by which sensor.";

    fn empty() -> Self {
        Self { position_m: DVec3::ZERO, time_ns: 0, sensor: 0 }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.f64("x_m", &mut self.position_m.x);
        f.f64("y_m", &mut self.position_m.y);
        f.f64("z_m", &mut self.position_m.z);
        f.i64("time_ns", &mut self.time_ns);
        let mut sensor = u32::from(self.sensor);
        f.u32("sensor", &mut sensor);
        self.sensor = sensor.min(u32::from(u16::MAX)) as u16;
    }
}

impl Message for Prior {
    const NAME: &'static str = "Prior";
    const WHAT: &'static str = "Where a person is expected.";

    fn empty() -> Self {
        Self {
            position_m: DVec2::ZERO,
            velocity_mps: DVec2::ZERO,
            position_sigma_m: 0.0,
            height_m: 0.0,
            confirmed: false,
            walked: false,
            is_furniture: false,
            shape: None,
        }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        vec2(f, "position_m", &mut self.position_m);
        vec2(f, "velocity_mps", &mut self.velocity_mps);
        f.f64("position_sigma_m", &mut self.position_sigma_m);
        f.f64("height_m", &mut self.height_m);
        f.bool("confirmed", &mut self.confirmed);
        f.bool("is_furniture", &mut self.is_furniture);
        f.bool("walked", &mut self.walked);
        let bands = self.shape.map(|shape| shape.bands.map(|of| of.numbers()));
        let bands =
            maybe(f, "shape_is_known", bands, |f, bands| f.f64_array("shape", bands.as_flattened_mut()));
        self.shape = bands.map(|bands| Shape { bands: bands.map(Moments::of_numbers) });
    }
}

impl Message for Track {
    const NAME: &'static str = "FollowedTrack";
    const WHAT: &'static str = "One person followed, at the frame's instant; metres, seconds, radians.";

    fn empty() -> Self {
        Self {
            id: 0,
            position_m: DVec2::ZERO,
            velocity_mps: DVec2::ZERO,
            covariance: [[0.0; 4]; 4],
            heading_rad: 0.0,
            heading_sigma_rad: 0.0,
            heading_behind: 0.0,
            height_m: 0.0,
            height_sigma_m: 0.0,
            width_scale: 0.0,
            width_scale_sigma: 0.0,
            outline_m: Default::default(),
            canopy: None,
            gait: Gait::UNKNOWN,
            points: 0,
            confirmed: false,
            part_of: None,
            aabb: Aabb { min_m: DVec3::ZERO, max_m: DVec3::ZERO },
            obb: Obb { center_m: DVec3::ZERO, half_m: DVec3::ZERO, site_from_box: DMat3::ZERO },
            observed: VecDeque::new(),
        }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.u64("id", &mut self.id);
        vec2(f, "position_m", &mut self.position_m);
        vec2(f, "velocity_mps", &mut self.velocity_mps);
        f.f64_array("covariance", self.covariance.as_flattened_mut());
        f.f64("heading_rad", &mut self.heading_rad);
        f.f64("heading_sigma_rad", &mut self.heading_sigma_rad);
        f.f64("heading_behind", &mut self.heading_behind);
        f.f64("height_m", &mut self.height_m);
        f.f64("height_sigma_m", &mut self.height_sigma_m);
        f.f64("width_scale", &mut self.width_scale);
        f.f64("width_scale_sigma", &mut self.width_scale_sigma);
        f.f64_array("outline_m", self.outline_m.as_flattened_mut());
        let canopy = self.canopy.map(|canopy| canopy.numbers());
        let canopy = maybe(f, "is_covered", canopy, |f, numbers| f.f64_array("canopy_m", numbers));
        self.canopy = canopy.map(Canopy::of_numbers);
        f.f64("gait_phase_rad", &mut self.gait.phase_rad);
        f.f64("gait_concentration", &mut self.gait.concentration);
        let [left, right] = &mut self.gait.hand_swing;
        f.f64("hand_swing_left", left);
        f.f64("hand_swing_right", right);
        let [left, right] = &mut self.gait.hand_swing_sigma;
        f.f64("hand_swing_left_sigma", left);
        f.f64("hand_swing_right_sigma", right);
        f.u32("points", &mut self.points);
        f.bool("confirmed", &mut self.confirmed);
        self.part_of = maybe(f, "is_part", self.part_of, |f, id| f.u64("part_of", id));
        vec3(f, "aabb_min_m", &mut self.aabb.min_m);
        vec3(f, "aabb_max_m", &mut self.aabb.max_m);
        vec3(f, "obb_center_m", &mut self.obb.center_m);
        vec3(f, "obb_half_m", &mut self.obb.half_m);
        matrix(f, "site_from_box", &mut self.obb.site_from_box);
        let mut observed = Vec::from(std::mem::take(&mut self.observed));
        f.list("observed", &mut observed);
        self.observed = observed.into();
    }
}

impl Message for Observed {
    const NAME: &'static str = "Observed";
    const WHAT: &'static str = "A track's state at an earlier frame.";

    fn empty() -> Self {
        Self { time_ns: 0, position_m: DVec2::ZERO, velocity_mps: DVec2::ZERO }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.i64("time_ns", &mut self.time_ns);
        vec2(f, "position_m", &mut self.position_m);
        vec2(f, "velocity_mps", &mut self.velocity_mps);
    }
}

impl Message for Forecast {
    const NAME: &'static str = "Forecast";
    const WHAT: &'static str = "Where a track will be: mean x, y and covariance xx, xy, yy at each of nine steps of 100 ms, and how their \
         errors hang together.";

    fn empty() -> Self {
        let coupling = Coupling { state: [[0.0; 4]; 4], acceleration_psd_m2ps3: [[0.0; 2]; 2] };
        Self { track: 0, steps: [Gaussian2::default(); umbracast::STEPS], coupling }
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.u64("track", &mut self.track);
        let mut steps = self.steps.map(|s| [s.mean_m.x, s.mean_m.y, s.xx_m2, s.xy_m2, s.yy_m2]);
        f.f64_array("steps", steps.as_flattened_mut());
        self.steps = steps.map(|[x, y, xx_m2, xy_m2, yy_m2]| Gaussian2 {
            mean_m: DVec2::new(x, y),
            xx_m2,
            xy_m2,
            yy_m2,
        });
        f.f64_array("state_covariance", self.coupling.state.as_flattened_mut());
        f.f64_array("acceleration_psd_m2ps3", self.coupling.acceleration_psd_m2ps3.as_flattened_mut());
    }
}
