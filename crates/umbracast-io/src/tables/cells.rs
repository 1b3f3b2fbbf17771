//! Each row type as a list of named cells: the one place that knows the columns.

use std::fmt;

use umbracast::STEPS;
use umbracast::decide::Action;
use umbracast::radio::Surface;

use crate::rows::{
    BindingRow, DecisionRow, DetectionRow, LabelRow, LinkRow, LossRow, MatchRow, PeopleLinkRow, PeopleRow,
    RadioRow, ReportRow, TrackRow,
};

/// A row of a table.
pub trait Row: Copy + Default {
    /// The table's name, and so its file's.
    const TABLE: &'static str;

    /// Shows every cell with its column's name, always the same ones in the same order.
    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell));
}

/// A column's name: what stands before and after the number of a step or window, where there is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Name(&'static str, Option<usize>, &'static str);

/// One value of a row, to be read or set.
#[derive(Debug)]
pub enum Cell<'a> {
    /// A small count or a number of something.
    U32(&'a mut u32),
    /// A frame or a track.
    U64(&'a mut u64),
    /// A track or null.
    MaybeU64(&'a mut Option<u64>),
    /// A time.
    I64(&'a mut i64),
    /// A measure.
    F64(&'a mut f64),
    /// Yes or no.
    Bool(&'a mut bool),
    /// Yes, no or null.
    MaybeBool(&'a mut Option<bool>),
    /// A measure or null.
    MaybeF64(&'a mut Option<f64>),
    /// Index of an access point; its name in the file.
    AccessPoint(&'a mut u32),
    /// The same or null.
    MaybeAccessPoint(&'a mut Option<u32>),
    /// What to do; its name in the file.
    Action(&'a mut Action),
    /// What a beam is pointed at, by name, or null.
    MaybeSurface(&'a mut Option<Surface>),
}

impl Cell<'_> {
    /// Whether a table may leave the value empty.
    pub fn may_be_null(&self) -> bool {
        matches!(
            self,
            Self::MaybeU64(_)
                | Self::MaybeBool(_)
                | Self::MaybeF64(_)
                | Self::MaybeAccessPoint(_)
                | Self::MaybeSurface(_)
        )
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            Some(number) => write!(f, "{}{number}{}", self.0, self.2),
            None => f.write_str(self.0),
        }
    }
}

fn plain(name: &'static str) -> Name {
    Name(name, None, "")
}

impl Row for PeopleRow {
    const TABLE: &'static str = "people";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("person"), Cell::U32(&mut self.person));
        see(plain("x_m"), Cell::F64(&mut self.x_m));
        see(plain("y_m"), Cell::F64(&mut self.y_m));
        see(plain("vx_mps"), Cell::F64(&mut self.vx_mps));
        see(plain("vy_mps"), Cell::F64(&mut self.vy_mps));
        see(plain("heading_rad"), Cell::F64(&mut self.heading_rad));
        see(plain("height_m"), Cell::F64(&mut self.height_m));
        see(plain("arrived"), Cell::Bool(&mut self.arrived));
        see(plain("returns"), Cell::U32(&mut self.returns));
    }
}

impl Row for PeopleLinkRow {
    const TABLE: &'static str = "people_links";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("person"), Cell::U32(&mut self.person));
        see(plain("blocked"), Cell::Bool(&mut self.blocked));
        see(plain("static_blocked"), Cell::Bool(&mut self.static_blocked));
        see(plain("self_blocked"), Cell::MaybeBool(&mut self.self_blocked));
    }
}

const COVARIANCE: [&str; 10] = [
    "cov_xx_m2",
    "cov_xy_m2",
    "cov_xvx_m2ps",
    "cov_xvy_m2ps",
    "cov_yy_m2",
    "cov_yvx_m2ps",
    "cov_yvy_m2ps",
    "cov_vxvx_m2ps2",
    "cov_vxvy_m2ps2",
    "cov_vyvy_m2ps2",
];
const AABB: [&str; 6] =
    ["aabb_min_x_m", "aabb_min_y_m", "aabb_min_z_m", "aabb_max_x_m", "aabb_max_y_m", "aabb_max_z_m"];
/// Axis i is column i of the rotation from the box's frame to the site's.
const OBB: [&str; 15] = [
    "obb_center_x_m",
    "obb_center_y_m",
    "obb_center_z_m",
    "obb_half_1_m",
    "obb_half_2_m",
    "obb_half_3_m",
    "obb_axis_1_x",
    "obb_axis_1_y",
    "obb_axis_1_z",
    "obb_axis_2_x",
    "obb_axis_2_y",
    "obb_axis_2_z",
    "obb_axis_3_x",
    "obb_axis_3_y",
    "obb_axis_3_z",
];
const OUTLINE: [&str; 4] = ["outline_ahead_", "outline_left_", "outline_round_", "outline_oblong_"];
const CANOPY: [&str; 5] =
    ["canopy_ahead_m", "canopy_left_m", "canopy_radius_m", "canopy_low_m", "canopy_top_m"];
const STEP: [(&str, &str); 5] =
    [("x_s", "_m"), ("y_s", "_m"), ("cov_xx_s", "_m2"), ("cov_xy_s", "_m2"), ("cov_yy_s", "_m2")];

impl Row for DetectionRow {
    const TABLE: &'static str = "detections";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("x_m"), Cell::F64(&mut self.x_m));
        see(plain("y_m"), Cell::F64(&mut self.y_m));
        for (name, value) in ["cov_xx_m2", "cov_xy_m2", "cov_yy_m2"].into_iter().zip(&mut self.covariance_m2)
        {
            see(plain(name), Cell::MaybeF64(value));
        }
        see(plain("points"), Cell::U32(&mut self.points));
        see(plain("top_m"), Cell::F64(&mut self.top_m));
        see_boxes(&mut self.aabb_m, &mut self.obb, see);
    }
}

impl Row for MatchRow {
    const TABLE: &'static str = "matches";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("person"), Cell::U32(&mut self.person));
        see(plain("track"), Cell::U64(&mut self.track));
    }
}

fn see_boxes(aabb_m: &mut [f64; 6], obb: &mut [f64; 15], see: &mut dyn FnMut(Name, Cell)) {
    for (name, value) in AABB.into_iter().zip(aabb_m) {
        see(plain(name), Cell::F64(value));
    }
    for (name, value) in OBB.into_iter().zip(obb) {
        see(plain(name), Cell::F64(value));
    }
}

impl Row for TrackRow {
    const TABLE: &'static str = "tracks";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("track"), Cell::U64(&mut self.track));
        see(plain("x_m"), Cell::F64(&mut self.x_m));
        see(plain("y_m"), Cell::F64(&mut self.y_m));
        see(plain("vx_mps"), Cell::F64(&mut self.vx_mps));
        see(plain("vy_mps"), Cell::F64(&mut self.vy_mps));
        for (name, value) in COVARIANCE.into_iter().zip(&mut self.covariance) {
            see(plain(name), Cell::F64(value));
        }
        see(plain("heading_rad"), Cell::F64(&mut self.heading_rad));
        see(plain("heading_sigma_rad"), Cell::F64(&mut self.heading_sigma_rad));
        see(plain("height_m"), Cell::F64(&mut self.height_m));
        see(plain("height_sigma_m"), Cell::F64(&mut self.height_sigma_m));
        see(plain("width_scale"), Cell::F64(&mut self.width_scale));
        see(plain("width_scale_sigma"), Cell::F64(&mut self.width_scale_sigma));
        for (level, outline_m) in self.outline_m.iter_mut().enumerate() {
            for (name, value) in OUTLINE.into_iter().zip(outline_m) {
                see(Name(name, Some(level), "_m"), Cell::F64(value));
            }
        }
        for (name, value) in CANOPY.into_iter().zip(&mut self.canopy_m) {
            see(plain(name), Cell::MaybeF64(value));
        }
        see(plain("gait_phase_rad"), Cell::F64(&mut self.gait_phase_rad));
        see(plain("gait_concentration"), Cell::F64(&mut self.gait_concentration));
        for (name, swing) in ["hand_swing_left", "hand_swing_right"].into_iter().zip(&mut self.hand_swing) {
            see(plain(name), Cell::F64(swing));
        }
        for (name, sigma) in
            ["hand_swing_left_sigma", "hand_swing_right_sigma"].into_iter().zip(&mut self.hand_swing_sigma)
        {
            see(plain(name), Cell::F64(sigma));
        }
        see(plain("points"), Cell::U32(&mut self.points));
        see(plain("confirmed"), Cell::Bool(&mut self.confirmed));
        see(plain("part_of"), Cell::MaybeU64(&mut self.part_of));
        see_boxes(&mut self.aabb_m, &mut self.obb, see);
        for (h, step) in (1..).zip(&mut self.steps) {
            for ((before, after), value) in STEP.into_iter().zip(step) {
                see(Name(before, Some(h), after), Cell::F64(value));
            }
        }
    }
}

impl Row for LinkRow {
    const TABLE: &'static str = "links";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("track"), Cell::U64(&mut self.track));
        see(plain("blocked_now"), Cell::Bool(&mut self.blocked_now));
        for w in 1..=STEPS {
            see(Name("blocked_w", Some(w), ""), Cell::Bool(&mut self.blocked[w - 1]));
        }
        see(plain("p_now"), Cell::F64(&mut self.p_now));
        for w in 1..=STEPS {
            see(Name("p_w", Some(w), ""), Cell::F64(&mut self.p[w - 1]));
        }
        for (name, quantiles) in [("onset_p", &mut self.onset_s), ("duration_p", &mut self.duration_s)] {
            for (percent, value) in [10, 50, 90].into_iter().zip(quantiles) {
                see(Name(name, Some(percent), "_s"), Cell::MaybeF64(value));
            }
        }
        for (now, within, chances) in [
            ("p_own_now", "p_own_w", &mut self.p_own),
            ("p_hall_now", "p_hall_w", &mut self.p_hall),
            ("p_any_now", "p_any_w", &mut self.p_any),
        ] {
            for (w, value) in chances.iter_mut().enumerate() {
                let name = if w == 0 { plain(now) } else { Name(within, Some(w), "") };
                see(name, Cell::MaybeF64(value));
            }
        }
    }
}

const LOSS: [(&str, &str, &str); 3] = [
    ("loss_now_p10_db", "loss_s", "_p10_db"),
    ("loss_now_p50_db", "loss_s", "_p50_db"),
    ("loss_now_p90_db", "loss_s", "_p90_db"),
];

impl Row for LossRow {
    const TABLE: &'static str = "links_db";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("track"), Cell::U64(&mut self.track));
        for (h, quantiles) in self.loss_db.iter_mut().enumerate() {
            for ((now, before, after), value) in LOSS.into_iter().zip(quantiles) {
                let name = if h == 0 { plain(now) } else { Name(before, Some(h), after) };
                see(name, Cell::F64(value));
            }
        }
        for (w, value) in self.p_out.iter_mut().enumerate() {
            let name = if w == 0 { plain("p_out_now") } else { Name("p_out_w", Some(w), "") };
            see(name, Cell::F64(value));
        }
        for (name, quantiles) in
            [("out_onset_p", &mut self.out_onset_s), ("out_duration_p", &mut self.out_duration_s)]
        {
            for (percent, value) in [10, 50, 90].into_iter().zip(quantiles) {
                see(Name(name, Some(percent), "_s"), Cell::MaybeF64(value));
            }
        }
    }
}

impl Row for DecisionRow {
    const TABLE: &'static str = "decisions";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("track"), Cell::U64(&mut self.track));
        see(plain("serving"), Cell::AccessPoint(&mut self.serving));
        see(plain("action"), Cell::Action(&mut self.action));
        see(plain("target"), Cell::MaybeAccessPoint(&mut self.target));
        see(plain("surface"), Cell::MaybeSurface(&mut self.surface));
        see(plain("deadline_s"), Cell::MaybeF64(&mut self.deadline_s));
        see(plain("saved_s"), Cell::F64(&mut self.saved_s));
        see(plain("p_out"), Cell::F64(&mut self.p_out));
    }
}

impl Row for BindingRow {
    const TABLE: &'static str = "bindings";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("device"), Cell::U64(&mut self.device));
        see(plain("track"), Cell::U64(&mut self.track));
        see(plain("p"), Cell::F64(&mut self.p));
    }
}

impl Row for ReportRow {
    const TABLE: &'static str = "reports";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("heard_ns"), Cell::I64(&mut self.heard_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("device"), Cell::U64(&mut self.device));
        see(plain("power_dbm"), Cell::F64(&mut self.power_dbm));
        see(plain("serves"), Cell::Bool(&mut self.serves));
    }
}

impl Row for RadioRow {
    const TABLE: &'static str = "radio";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("person"), Cell::U32(&mut self.person));
        see(plain("loss_db"), Cell::F64(&mut self.loss_db));
    }
}

impl Row for LabelRow {
    const TABLE: &'static str = "labels";

    fn visit(&mut self, see: &mut dyn FnMut(Name, Cell)) {
        see(plain("scene"), Cell::U32(&mut self.scene));
        see(plain("frame"), Cell::U64(&mut self.frame));
        see(plain("time_ns"), Cell::I64(&mut self.time_ns));
        see(plain("access_point"), Cell::AccessPoint(&mut self.access_point));
        see(plain("person"), Cell::U32(&mut self.person));
        see(plain("x_m"), Cell::F64(&mut self.x_m));
        see(plain("y_m"), Cell::F64(&mut self.y_m));
        for (h, value) in self.loss_db.iter_mut().enumerate() {
            let name = if h == 0 { plain("loss_now_db") } else { Name("loss_s", Some(h), "_db") };
            see(name, Cell::F64(value));
        }
        for (w, value) in self.out.iter_mut().enumerate() {
            let name = if w == 0 { plain("out_now") } else { Name("out_w", Some(w), "") };
            see(name, Cell::Bool(value));
        }
        see(plain("onset_s"), Cell::MaybeF64(&mut self.onset_s));
    }
}
