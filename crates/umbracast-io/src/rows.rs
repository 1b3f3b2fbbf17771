//! The rows of all tables. A field is a column of the same name.
#![allow(missing_docs, reason = "names carry the unit; what needs a word has one")]

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use umbracast::blockage::Chance;
use umbracast::decide::Action;
use umbracast::detect::Detection;
use umbracast::detect::LEVELS;
use umbracast::gait::Gait;
use umbracast::geometry::{Aabb, Obb};
use umbracast::radio::{Binding, Surface};
use umbracast::track::{Canopy, Track};
use umbracast::{Outcome, STEPS};

/// Truth: one body in one frame. Arrived ones too.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PeopleRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub person: u32,
    pub x_m: f64,
    pub y_m: f64,
    pub vx_mps: f64,
    pub vy_mps: f64,
    pub heading_rad: f64,
    pub height_m: f64,
    pub arrived: bool,
    /// Points on this body, all sensors.
    pub returns: u32,
}

/// Truth: one link in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PeopleLinkRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    /// Index into the site's access points.
    pub access_point: u32,
    pub person: u32,
    /// By another person's body.
    pub blocked: bool,
    /// By hall or furniture.
    pub static_blocked: bool,
    /// By the own body; null while the UE is inside it.
    pub self_blocked: Option<bool>,
}

/// Our answer: one detection in one frame, before it is joined to a track.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DetectionRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub x_m: f64,
    pub y_m: f64,
    /// Upper triangle of the covariance of (x, y): xx xy yy; null where the method does not tell.
    pub covariance_m2: [Option<f64>; 3],
    pub points: u32,
    pub top_m: f64,
    /// min x y z, max x y z.
    pub aabb_m: [f64; 6],
    /// centre x y z, half x y z, then the rotation's columns.
    pub obb: [f64; 15],
}

/// Truth and answer joined: whose track a track is, in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MatchRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub person: u32,
    pub track: u64,
}

/// Our answer: one track in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TrackRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub track: u64,
    pub x_m: f64,
    pub y_m: f64,
    pub vx_mps: f64,
    pub vy_mps: f64,
    /// Upper triangle of the covariance of (x, y, vx, vy): xx xy xvx xvy yy yvx yvy vxvx vxvy vyvy.
    pub covariance: [f64; 10],
    pub heading_rad: f64,
    pub heading_sigma_rad: f64,
    pub height_m: f64,
    pub height_sigma_m: f64,
    pub width_scale: f64,
    pub width_scale_sigma: f64,
    /// By level: ahead, left, round, oblong.
    pub outline_m: [[f64; 4]; LEVELS],
    /// What is carried over the head: its middle ahead and left of the axis, radius, rim, top; null where nothing is.
    pub canopy_m: [Option<f64>; 5],
    pub gait_phase_rad: f64,
    pub gait_concentration: f64,
    pub hand_swing: [f64; 2],
    pub hand_swing_sigma: [f64; 2],
    pub points: u32,
    pub confirmed: bool,
    /// Whose thing this is, a track; null for people.
    pub part_of: Option<u64>,
    /// min x y z, max x y z.
    pub aabb_m: [f64; 6],
    /// centre x y z, half x y z, then the rotation's columns.
    pub obb: [f64; 15],
    /// Steps 1..=9: x, y, cov xx, xy, yy.
    pub steps: [[f64; 5]; STEPS],
}

impl TrackRow {
    /// How it walks.
    pub fn gait(&self) -> Gait {
        Gait {
            phase_rad: self.gait_phase_rad,
            concentration: self.gait_concentration,
            hand_swing: self.hand_swing,
            hand_swing_sigma: self.hand_swing_sigma,
        }
    }

    /// What is carried over the head, if all its numbers are there.
    pub fn canopy(&self) -> Option<Canopy> {
        let numbers = self.canopy_m.map(|m| m.unwrap_or(f64::NAN));
        numbers.iter().all(|m| m.is_finite()).then(|| Canopy::of_numbers(numbers))
    }
}

/// Our answer: one link in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinkRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub access_point: u32,
    pub track: u64,
    pub blocked_now: bool,
    pub p_now: f64,
    /// Windows 1..=9.
    pub blocked: [bool; STEPS],
    /// Windows 1..=9.
    pub p: [f64; STEPS],
    /// 10, 50 and 90 % quantiles of the time until the link is blocked; null where it is now or not within the steps.
    pub onset_s: [Option<f64>; 3],
    /// The same of the time until the blockage that is or comes first is over; null where that is not within the steps.
    pub duration_s: [Option<f64>; 3],
    /// Probability that the owner's own body blocks the link: now, then within windows 1..=9; null while the UE is on the
    /// body's axis and where the method knows others alone.
    pub p_own: [Option<f64>; 1 + STEPS],
    /// The same of walls, pillars and furniture.
    pub p_hall: [Option<f64>; 1 + STEPS],
    /// The same of others, the owner or the hall.
    pub p_any: [Option<f64>; 1 + STEPS],
}

/// A link is taken for blocked by any cause from this probability on.
const LIKELY: f64 = 0.5;

impl LinkRow {
    /// The probability that anything blocks the link: now, then within window `window`; that of others alone where the method
    /// knows no other cause.
    pub fn p_of_any(&self, window: usize) -> f64 {
        self.p_any[window].unwrap_or_else(|| self.p_of_others(window))
    }

    /// Whether anything blocks the link now.
    pub fn is_blocked(&self) -> bool {
        self.blocked_now || self.p_of_any(0) >= LIKELY
    }

    /// Whether it is free now, but anything is likely to block it within the last window.
    pub fn is_warned_of(&self) -> bool {
        !self.is_blocked() && (self.blocked[STEPS - 1] || self.p_of_any(STEPS) >= LIKELY)
    }

    /// What is the likeliest to block it, now where it is blocked, else within the last window: `others`, `owner` or `hall`.
    pub fn cause(&self) -> &'static str {
        let window = if self.is_blocked() { 0 } else { STEPS };
        let others = ("others", self.p_of_others(window));
        [("owner", self.p_own[window]), ("hall", self.p_hall[window])]
            .into_iter()
            .filter_map(|(name, p)| Some((name, p?)))
            .fold(others, |likeliest, cause| if cause.1 > likeliest.1 { cause } else { likeliest })
            .0
    }

    fn p_of_others(&self, window: usize) -> f64 {
        window.checked_sub(1).map_or(self.p_now, |window| self.p[window])
    }
}

/// Our answer: what one link loses to bodies in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LossRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub access_point: u32,
    pub track: u64,
    /// 10, 50 and 90 % quantiles of the loss now, then at steps 1..=9.
    pub loss_db: [[f64; 3]; 1 + STEPS],
    /// Probability that the loss is the margin or more: now, then at any step of windows 1..=9.
    pub p_out: [f64; 1 + STEPS],
    /// 10, 50 and 90 % quantiles of the time until the link is out; null where it is now or not within the steps.
    pub out_onset_s: [Option<f64>; 3],
    /// The same of the time until it is not out any more; null where that is not within the steps.
    pub out_duration_s: [Option<f64>; 3],
}

/// Our answer: what to do about one device in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DecisionRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub track: u64,
    /// The access point that serves the device.
    pub serving: u32,
    pub action: Action,
    /// Where a change goes to, or one that is prepared; null otherwise.
    pub target: Option<u32>,
    /// What a beam is to be pointed at; null for the device itself.
    pub surface: Option<Surface>,
    /// Until when a command must have been sent, from the frame's instant; null where nothing comes.
    pub deadline_s: Option<f64>,
    /// Less time in outage than without the action, as expected within the steps.
    pub saved_s: f64,
    /// Probability that the serving link is out now or within the steps.
    pub p_out: f64,
}

/// Our answer: how likely a person carries a device that was heard, in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BindingRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    /// The network's name of the device.
    pub device: u64,
    pub track: u64,
    pub p: f64,
}

/// What an access point heard of a device, as it was taken before one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ReportRow {
    pub scene: u32,
    pub frame: u64,
    /// The frame's.
    pub time_ns: i64,
    /// When it was heard.
    pub heard_ns: i64,
    pub access_point: u32,
    /// The network's name of the device.
    pub device: u64,
    pub power_dbm: f64,
    /// Whether the access point is said to serve the device.
    pub serves: bool,
}

/// Truth of the radio: what bodies cost one link at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RadioRow {
    pub scene: u32,
    pub time_ns: i64,
    pub access_point: u32,
    pub person: u32,
    pub loss_db: f64,
}

/// What of that truth is to be foreseen from one frame on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LabelRow {
    pub scene: u32,
    pub frame: u64,
    pub time_ns: i64,
    pub access_point: u32,
    pub person: u32,
    /// Where the person is.
    pub x_m: f64,
    pub y_m: f64,
    /// Now, then at steps 1..=9.
    pub loss_db: [f64; 1 + STEPS],
    /// Whether the loss is the margin or more now, then at any instant of windows 1..=9.
    pub out: [bool; 1 + STEPS],
    /// Until a link that is not out now first is; null where it is not within the steps.
    pub onset_s: Option<f64>,
}

/// The rows of one outcome.
pub fn of_outcome(scene: u32, outcome: &Outcome, tracks: &mut Vec<TrackRow>, links: &mut Vec<LinkRow>) {
    tracks.reserve(outcome.tracks.len());
    for (track, forecast) in outcome.tracks.iter().zip(&outcome.forecasts) {
        let steps = forecast.steps.map(|s| [s.mean_m.x, s.mean_m.y, s.xx_m2, s.xy_m2, s.yy_m2]);
        tracks.push(TrackRow { scene, steps, ..of_track(outcome.frame, outcome.time_ns, track) });
    }
    links.extend(outcome.blockages.iter().map(|b| LinkRow {
        scene,
        frame: outcome.frame,
        time_ns: outcome.time_ns,
        access_point: b.access_point as u32,
        track: b.track,
        blocked_now: b.blocked_now,
        p_now: b.p_now,
        blocked: b.blocked,
        p: b.p,
        onset_s: b.onset_s,
        duration_s: b.duration_s,
        p_own: of_chance(b.own),
        p_hall: of_chance(b.hall),
        p_any: of_chance(b.any),
    }));
}

fn of_chance(chance: Option<Chance>) -> [Option<f64>; 1 + STEPS] {
    std::array::from_fn(|w| chance.map(|of| w.checked_sub(1).map_or(of.p_now, |w| of.p[w])))
}

/// The losses of one outcome.
pub fn losses(scene: u32, outcome: &Outcome) -> impl Iterator<Item = LossRow> + '_ {
    outcome.losses.iter().map(move |loss| LossRow {
        scene,
        frame: outcome.frame,
        time_ns: outcome.time_ns,
        access_point: loss.access_point as u32,
        track: loss.track,
        loss_db: with_now(loss.now_db, loss.steps_db),
        p_out: with_now(loss.p_out_now, loss.p_out),
        out_onset_s: loss.onset_s,
        out_duration_s: loss.duration_s,
    })
}

/// The decisions of one outcome.
pub fn decisions(scene: u32, outcome: &Outcome) -> impl Iterator<Item = DecisionRow> + '_ {
    outcome.decisions.iter().map(move |decision| DecisionRow {
        scene,
        frame: outcome.frame,
        time_ns: outcome.time_ns,
        track: decision.track,
        serving: decision.serving as u32,
        action: decision.action,
        target: decision.target.map(|target| target as u32),
        surface: decision.surface,
        deadline_s: decision.deadline_s,
        saved_s: decision.saved_s,
        p_out: decision.p_out,
    })
}

/// The bindings of one outcome.
pub fn bindings(scene: u32, outcome: &Outcome) -> impl Iterator<Item = BindingRow> + '_ {
    let &Outcome { frame, time_ns, .. } = outcome;
    let of =
        move |b: &Binding| BindingRow { scene, frame, time_ns, device: b.device, track: b.track, p: b.p };
    outcome.bindings.iter().map(of)
}

fn with_now<T: Copy>(now: T, steps: [T; STEPS]) -> [T; 1 + STEPS] {
    std::array::from_fn(|step| step.checked_sub(1).map_or(now, |step| steps[step]))
}

/// The detections of one outcome.
pub fn detections(scene: u32, outcome: &Outcome) -> impl Iterator<Item = DetectionRow> + '_ {
    outcome.detections.iter().map(move |detection: &Detection| DetectionRow {
        scene,
        frame: outcome.frame,
        time_ns: outcome.time_ns,
        x_m: detection.position_m.x,
        y_m: detection.position_m.y,
        covariance_m2: detection.covariance_m2.map_or([None; 3], |c| [c[0][0], c[0][1], c[1][1]].map(Some)),
        points: detection.points,
        top_m: detection.top_m,
        aabb_m: of_aabb(&detection.aabb),
        obb: of_obb(&detection.obb),
    })
}

/// The row of a track without a forecast, of scene 0.
pub fn of_track(frame: u64, time_ns: i64, track: &Track) -> TrackRow {
    let c = &track.covariance;
    TrackRow {
        frame,
        time_ns,
        track: track.id,
        x_m: track.position_m.x,
        y_m: track.position_m.y,
        vx_mps: track.velocity_mps.x,
        vy_mps: track.velocity_mps.y,
        covariance: [
            c[0][0], c[0][1], c[0][2], c[0][3], c[1][1], c[1][2], c[1][3], c[2][2], c[2][3], c[3][3],
        ],
        heading_rad: track.heading_rad,
        heading_sigma_rad: heading_sigma_rad(track),
        height_m: track.height_m,
        height_sigma_m: track.height_sigma_m,
        width_scale: track.width_scale,
        width_scale_sigma: track.width_scale_sigma,
        outline_m: track.outline_m,
        canopy_m: track.canopy.map_or([None; 5], |canopy| canopy.numbers().map(Some)),
        gait_phase_rad: track.gait.phase_rad,
        gait_concentration: track.gait.concentration,
        hand_swing: track.gait.hand_swing,
        hand_swing_sigma: track.gait.hand_swing_sigma,
        points: track.points,
        confirmed: track.confirmed,
        part_of: track.part_of,
        aabb_m: of_aabb(&track.aabb),
        obb: of_obb(&track.obb),
        ..TrackRow::default()
    }
}

/// One standard deviation over both ways that the trunk may face.
fn heading_sigma_rad(track: &Track) -> f64 {
    let of_ways_rad = PI * (track.heading_behind * (1.0 - track.heading_behind)).sqrt();
    track.heading_sigma_rad.hypot(of_ways_rad).min(PI / 3.0_f64.sqrt())
}

fn of_aabb(aabb: &Aabb) -> [f64; 6] {
    let (low, high) = (aabb.min_m, aabb.max_m);
    [low.x, low.y, low.z, high.x, high.y, high.z]
}

fn of_obb(obb: &Obb) -> [f64; 15] {
    let (m, h, r) = (obb.center_m, obb.half_m, obb.site_from_box.to_cols_array());
    [m.x, m.y, m.z, h.x, h.y, h.z, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]]
}
