//! One tracked person: filter, height, heading, boxes, and the probability that somebody is there.

use std::collections::VecDeque;

use super::attached::{Attached, Beside};
use super::followed::{Observations, Observed, Track, WIDTH_SCALE_SIGMA, seconds};
use super::gaussian::{Mat2, largest_sigma, plus, scaled};
use super::heading::Heading;
use super::height::{HEIGHT_MEAN_M, Height};
use super::kalman::Filter;
use super::noise::{noise, sway};
use super::numbers::Numbers;
use super::origin::Origin;
use super::outline::{Axis, Outline};
use super::remembered::{Remembered, Words};
use super::shape::LearnedShape;
use super::stride::Stride;
use super::visibility::{Body, BodyView, Visibility};
use crate::detect::{Detection, Prior};
use crate::gait::relative_speed_hz;
use crate::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};
use crate::site::Hall;

/// Nobody is believed in more firmly than this, so that a track that should be seen dies within frames.
const EXISTENCE_MAX: f64 = 0.99;
/// What one sighting alone is worth.
const EXISTENCE_AT_BIRTH: f64 = 0.5;
/// The step that chances of detection are meant for.
const STEP_S: f64 = crate::STEP_S;
/// How much likelier a detection is from a person than from nobody.
const LIKELIHOOD_RATIO: f64 = 20.0;
/// A track dies when the probability that somebody is there falls below this: about four frames missed in full view.
const EXISTENCE_MIN: f64 = 0.05;
/// What shows somebody adds up to this within a time before a track is confirmed: two frames that show most of a body, or more that
/// show less, for arms and other parts do not stay.
const SHOWN_TO_CONFIRM: u32 = 8;
const CONFIRM_WITHIN_S: f64 = 1.0;
/// What a frame counts that shows most of what beams would meet of a body, from this share of its returns on; any other counts one.
const SHOWN_BY_BODY: u32 = 4;
const BODY_SHARE: f64 = 0.5;
/// Legs reach up to this share of the height. They would be seen where so many returns of them are expected, and so much of what
/// they give in free sight.
const LEGS_SHARE: f64 = 0.4;
const LEGS_RETURNS_MIN: f64 = 5.0;
const LEGS_FREE_SHARE: f64 = 0.5;
/// A track is not reported as confirmed while its position, one standard deviation of the larger axis, is less sure:
/// who has been out of sight so long is more likely elsewhere. It is kept, to be known again.
const REPORTED_SIGMA_MAX_M: f64 = 0.6;
/// A track dies when the variances of its position add up to this.
const POSITION_VARIANCE_MAX_M2: f64 = 8.0;
/// A track that stands where another does dies after this long: people who pass each other are sooner apart.
const DUPLICATE_AFTER_S: f64 = 0.5;
/// Furniture is known to the background once it is no longer found.
const FURNITURE_GONE_S: f64 = 0.5;
/// An outline is learned of who walks at least so fast, or is known so well to face some way, and of whom others hide no more.
const OUTLINE_FROM_MPS: f64 = 0.5;
const FACING_SIGMA_RAD: f64 = 0.35;
const FACING_BEHIND: f64 = 0.05;
const FREE_SHARE: f64 = 0.9;
/// A top tells of the body's height where beams meet it up to this share of that.
const SHOWN_SHARE: f64 = 0.6;
/// Time over which the width of a box is averaged, and what detections claim.
const AVERAGE_S: f64 = 1.0;
/// The width of a box until one was seen.
const WIDTH_M: f64 = 0.5;
/// A track with everything behind it, at the time of the last frame.
#[derive(Debug, Clone)]
pub(super) struct Person {
    pub(super) id: u64,
    pub(super) filter: Filter,
    stride: Stride,
    pub(super) confirmed: bool,
    /// Born so near to somebody that it may be an arm.
    on_trial: bool,
    /// How much of somebody matches have shown until it was confirmed.
    shown: u32,
    /// Probability that somebody is there.
    pub(super) existence: f64,
    pub(super) matches: u32,
    /// How long an elder track has stood in the same place.
    pub(super) doubled_s: f64,
    origin: Origin,
    last_match_ns: i64,
    points: u32,
    /// What detections claim of their positions' errors, averaged, m^2.
    claimed_m2: Mat2,
    heading: Heading,
    height: Height,
    outline: Outline,
    shape: LearnedShape,
    /// Whether it is a part of somebody, or moved by one.
    pub(super) attached: Attached,
    /// Averaged extent along x and y.
    extent_m: DVec2,
    /// Averaged highest point of frames in which a head would have been seen.
    shown_top_m: f64,
    /// In how many frames.
    tops_shown: u32,
    observed: Observations,
}

impl Remembered for Person {
    fn visit(&mut self, words: &mut impl Words) {
        words.word(&mut self.id);
        self.filter.visit(words);
        self.stride.visit(words);
        words.bool(&mut self.confirmed);
        words.bool(&mut self.on_trial);
        words.u32(&mut self.shown);
        words.f64(&mut self.existence);
        words.u32(&mut self.matches);
        words.f64(&mut self.doubled_s);
        self.origin.visit(words);
        words.i64(&mut self.last_match_ns);
        words.u32(&mut self.points);
        words.f64s(self.claimed_m2.as_flattened_mut());
        self.heading.visit(words);
        self.height.visit(words);
        self.outline.visit(words);
        self.shape.visit(words);
        self.attached.visit(words);
        words.vec2(&mut self.extent_m);
        words.f64(&mut self.shown_top_m);
        words.u32(&mut self.tops_shown);
        self.observed.visit(words);
    }
}

impl Person {
    /// Somebody new, or a part of furniture or of somebody that stands beside.
    pub(super) fn born(
        numbers: &Numbers,
        id: u64,
        detection: &Detection,
        time_ns: i64,
        beside_furniture: bool,
        on_trial: bool,
    ) -> Self {
        let noise = plus(noise(numbers, detection, &BodyView::default()), sway(numbers));
        let variance = noise[0][0].max(noise[1][1]);
        let mut person = Self::new(numbers, id, detection.position_m, variance, time_ns);
        person.origin = Origin::new(detection.position_m, time_ns, beside_furniture);
        person.on_trial = on_trial;
        person.shown = if on_trial { 1 } else { SHOWN_BY_BODY };
        person.see(numbers, detection, &BodyView::default(), None, 0.0);
        person
    }

    /// Somebody of whom nothing is remembered yet.
    pub(super) fn blank(numbers: &Numbers) -> Self {
        Self::new(numbers, 0, DVec2::ZERO, 1.0, 0)
    }

    fn new(numbers: &Numbers, id: u64, position_m: DVec2, variance_m2: f64, time_ns: i64) -> Self {
        Self {
            id,
            filter: Filter::new(numbers, position_m, variance_m2),
            stride: Stride::default(),
            confirmed: false,
            on_trial: false,
            shown: 0,
            existence: EXISTENCE_AT_BIRTH,
            matches: 1,
            doubled_s: 0.0,
            origin: Origin::new(position_m, time_ns, false),
            last_match_ns: time_ns,
            points: 0,
            claimed_m2: [[0.0; 2]; 2],
            heading: Heading::ANY,
            height: Height::new(HEIGHT_MEAN_M, numbers.height_sigma_m, numbers.children_share),
            outline: Outline::new(&numbers.usual),
            shape: LearnedShape::default(),
            attached: Attached::default(),
            extent_m: DVec2::splat(WIDTH_M),
            shown_top_m: HEIGHT_MEAN_M,
            tops_shown: 0,
            observed: Observations::default(),
        }
    }

    /// Moves filter and phase of the gait on.
    pub(super) fn predict(&mut self, numbers: &Numbers, dt_s: f64) {
        self.stride.predict(self.speed_mps(), self.height.mean_m(), dt_s);
        self.filter.predict(numbers, self.height.mean_m(), dt_s);
    }

    fn speed_mps(&self) -> f64 {
        self.filter.velocity_mps().length()
    }

    /// The frame's detection of this person, `step_s` after the last frame; the filter stands at it.
    pub(super) fn matched(
        &mut self,
        numbers: &Numbers,
        detection: &Detection,
        view: &BodyView,
        visibility: &Visibility,
        time_ns: i64,
        step_s: f64,
    ) {
        self.filter.correct(detection.position_m, noise(numbers, detection, view));
        let there = self.existence * LIKELIHOOD_RATIO;
        self.existence = (there / (there + 1.0 - self.existence)).min(EXISTENCE_MAX);
        self.matches += 1;
        self.last_match_ns = time_ns;
        if !self.confirmed {
            self.shown += self.shown_by(detection, visibility.hall.floor_m(self.filter.position_m()), view);
            self.confirmed = self.shown >= SHOWN_TO_CONFIRM;
        }
        self.see(numbers, detection, view, Some(visibility), step_s);
    }

    /// How much a detection shows of somebody on a floor of that height. What may be an arm of somebody beside has to show legs where
    /// beams would meet them.
    fn shown_by(&self, detection: &Detection, floor_m: f64, view: &BodyView) -> u32 {
        let has_legs = detection.aabb.min_m.z - floor_m < LEGS_SHARE * self.height.mean_m();
        if self.on_trial && !has_legs {
            let legs_would_be_seen = view.beams_known
                && view.returns_of_legs >= LEGS_RETURNS_MIN.max(LEGS_FREE_SHARE * view.returns_of_legs_alone);
            return u32::from(!legs_would_be_seen);
        }
        // Who is lower than he was taken for gives fewer.
        let returns = view.returns * (detection.top_m / self.height.mean_m()).min(1.0);
        let is_body = !view.beams_known || f64::from(detection.points) >= BODY_SHARE * returns;
        if is_body { SHOWN_BY_BODY } else { 1 }
    }

    /// No detection in this frame, although there was one with chance `detection_probability` a step.
    pub(super) fn missed(&mut self, detection_probability: f64, step_s: f64) {
        let unseen = (1.0 - detection_probability).powf(step_s / STEP_S);
        self.existence = self.existence * unseen / (1.0 - self.existence * (1.0 - unseen));
        self.points = 0;
    }

    pub(super) fn is_dead(&self, numbers: &Numbers, time_ns: i64) -> bool {
        let spread = self.filter.state().position_covariance();
        self.existence < EXISTENCE_MIN
            || seconds(self.last_match_ns, time_ns) > numbers.coast_max_s
            || spread[0][0] + spread[1][1] >= POSITION_VARIANCE_MAX_M2
            || self.doubled_s > DUPLICATE_AFTER_S
            || self.origin.is_furniture(time_ns) && seconds(self.last_match_ns, time_ns) > FURNITURE_GONE_S
            || !self.confirmed && self.origin.age_s(time_ns) > CONFIRM_WITHIN_S
    }

    /// Where it stands, if it is furniture.
    pub(super) fn furniture_m(&self, time_ns: i64) -> Option<DVec2> {
        self.origin.is_furniture(time_ns).then(|| self.filter.position_m())
    }

    /// Mean and one standard deviation.
    pub(super) fn height_m(&self) -> (f64, f64) {
        (self.height.mean_m(), self.height.sigma_m())
    }

    /// Whether it has a detection in this frame.
    pub(super) fn is_seen(&self) -> bool {
        self.points > 0
    }

    /// As others may move beside it.
    pub(super) fn beside(&self) -> Beside {
        Beside {
            id: self.id,
            position_m: self.filter.position_m(),
            velocity_mps: self.filter.velocity_mps(),
            height_m: self.height.mean_m(),
            shown_top_m: self.shown_top_m,
            diagonal_m: self.extent_m.length(),
        }
    }

    /// The body that others may hide behind.
    pub(super) fn body(&self, position_m: DVec2, hall: &Hall) -> Body {
        Body { position_m, floor_m: hall.floor_m(position_m), height_m: self.height.mean_m() }
    }

    pub(super) fn prior(&self, numbers: &Numbers, last_ns: i64, after_s: f64) -> Prior {
        let state = self.filter.state_after(numbers, after_s);
        Prior {
            position_m: state.position_m(),
            velocity_mps: state.velocity_mps(),
            position_sigma_m: largest_sigma(state.position_covariance()),
            height_m: self.height.mean_m(),
            confirmed: self.confirmed && !self.origin.is_furniture(last_ns),
            walked: self.origin.walked,
            is_furniture: self.origin.is_furniture(last_ns),
            shape: self.shape.known(),
        }
    }

    /// The track at the frame's time, `step_s` after the last frame; the filter stands there. `observed` gives its memory.
    pub(super) fn track(
        &mut self,
        numbers: &Numbers,
        time_ns: i64,
        step_s: f64,
        hall: &Hall,
        mut observed: VecDeque<Observed>,
    ) -> Track {
        let state = self.filter.state();
        let (position_m, velocity_mps) = (state.position_m(), state.velocity_mps());
        self.heading.follow(&state, step_s);
        self.observed.push(time_ns, position_m, velocity_mps);
        observed.clone_from(&self.observed.0);
        let mut covariance = state.P;
        let lasting_m2 = scaled(self.claimed_m2, numbers.lasting_share);
        (0..2).for_each(|row| (0..2).for_each(|column| covariance[row][column] += lasting_m2[row][column]));
        let outline_m = self.outline.levels_m();
        let canopy = self.shape.canopy();
        let (aabb, obb) = self.boxes(position_m, hall.floor_m(position_m));
        Track {
            id: self.id,
            position_m,
            velocity_mps,
            covariance,
            heading_rad: self.heading.mean_rad,
            heading_sigma_rad: self.heading.sigma_rad(),
            heading_behind: self.heading.behind,
            // A thing may be lower than anybody.
            height_m: if self.attached.is_thing() { self.shown_top_m } else { self.height.mean_m() },
            height_sigma_m: self.height.sigma_m(),
            width_scale: 1.0,
            width_scale_sigma: WIDTH_SCALE_SIGMA,
            outline_m,
            canopy,
            gait: self.stride.gait(velocity_mps.length()),
            points: self.points,
            confirmed: self.confirmed
                && !self.origin.is_furniture(time_ns)
                && !self.attached.is_thing()
                && !self.attached.is_undecided()
                && largest_sigma(state.position_covariance()) < REPORTED_SIGMA_MAX_M,
            part_of: self.attached.part_of(),
            aabb,
            obb,
            observed,
        }
    }

    /// Learns what a detection says of the body's shape and gait.
    fn see(
        &mut self,
        numbers: &Numbers,
        detection: &Detection,
        view: &BodyView,
        visibility: Option<&Visibility>,
        step_s: f64,
    ) {
        let new = 1.0 - (-step_s / AVERAGE_S).exp();
        if let Some(claimed_m2) = detection.covariance_m2 {
            let new = new.max(1.0 / f64::from(self.matches));
            self.claimed_m2 = plus(scaled(self.claimed_m2, 1.0 - new), scaled(claimed_m2, new));
        }
        self.points = detection.points;
        let state = self.filter.state();
        let speed_mps = state.velocity_mps().length();
        self.origin.see(detection, view, state.position_m(), speed_mps, step_s);
        if let Some(gait) = detection.gait.as_ref().filter(|_| numbers.stride) {
            self.stride.see(gait);
        }
        if !view.on_step && detection.overhead.is_none() {
            self.height.see(detection.top_m, view.beams_per_m_at_top);
        }
        if let Some(facing) = &detection.facing {
            self.heading.see(facing, speed_mps);
        }
        if let Some(visibility) = visibility.filter(|_| numbers.outline) {
            self.see_outline(numbers, detection, view, visibility, step_s);
        }
        self.extent_m += (detection.aabb.size_m().truncate() - self.extent_m) * new;
        // What shows no more than the part of a body that beams meet may be a body.
        let height_m = self.height.mean_m();
        if !view.beams_known {
            self.shown_top_m = height_m;
        } else if view.top_m > SHOWN_SHARE * height_m {
            self.tops_shown += 1;
            let new = new.max(1.0 / f64::from(self.tops_shown));
            self.shown_top_m += (detection.top_m * height_m / view.top_m - self.shown_top_m) * new;
        }
    }

    /// Learns how the points lie of who walks with nobody near.
    pub(super) fn see_alone(&mut self, detection: &Detection, view: &BodyView) {
        let (position_m, velocity_mps) = (self.filter.position_m(), self.filter.velocity_mps());
        if !detection.full_body
            || view.returns < FREE_SHARE * view.returns_alone
            || velocity_mps.length() < OUTLINE_FROM_MPS
        {
            return;
        }
        self.shape.see(detection, position_m, velocity_mps.normalize());
    }

    /// Learns the outline from a detection in free sight, where it is known which way the body faces.
    fn see_outline(
        &mut self,
        numbers: &Numbers,
        detection: &Detection,
        view: &BodyView,
        visibility: &Visibility,
        step_s: f64,
    ) {
        let state = self.filter.state();
        let speed_mps = state.velocity_mps().length();
        self.outline.age(&numbers.usual, step_s);
        let ahead = if speed_mps > OUTLINE_FROM_MPS {
            state.velocity_mps() / speed_mps
        } else if self.heading.sigma_rad() < FACING_SIGMA_RAD && self.heading.behind < FACING_BEHIND {
            DVec2::from_angle(self.heading.mean_rad)
        } else {
            return;
        };
        if !detection.full_body || view.returns < FREE_SHARE * view.returns_alone {
            return;
        }
        let axis = Axis { from_detection_m: state.position_m() - detection.position_m, ahead };
        let height_m = self.height.mean_m();
        let body = (height_m, relative_speed_hz(speed_mps, height_m));
        for reach in &detection.reaches {
            let gap_m = visibility.gap_m(reach.sensor, detection.position_m);
            self.outline.see(&numbers.usual, reach, &axis, gap_m, body);
        }
    }

    /// As wide as seen on the mean, standing on the floor; the oriented one turned with the heading.
    fn boxes(&self, position_m: DVec2, floor_m: f64) -> (Aabb, Obb) {
        let half_m = (0.5 * self.extent_m).extend(0.5 * self.height.mean_m());
        let center_m = position_m.extend(floor_m + half_m.z);
        let aabb = Aabb { min_m: center_m - half_m, max_m: center_m + half_m };
        let site_from_box = DMat3::from_rotation_z(self.heading.mean_rad);
        // Shoulders are twice as wide as a trunk is deep; the plan area is what was seen.
        let depth_m = (0.5 * half_m.x * half_m.y).sqrt();
        let half_m = DVec3::new(depth_m, 2.0 * depth_m, half_m.z);
        (aabb, Obb { center_m, half_m, site_from_box })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use crate::track::gaussian::round;

    #[test]
    fn no_number_of_frames_mends_what_each_of_them_has() {
        let config = Config::default();
        let numbers = Numbers { lasting_share: 0.25, ..Numbers::new(&config.track) };
        let box_m = Aabb { min_m: DVec3::new(-0.2, -0.2, 0.0), max_m: DVec3::new(0.2, 0.2, 1.7) };
        let detection = Detection { covariance_m2: Some(round(0.0016)), ..Detection::of_box(box_m) };
        let mut person = Person::born(&numbers, 1, &detection, 0, false, false);
        let mut track = None;
        for k in 1..100_i64 {
            person.predict(&numbers, STEP_S);
            let visibility = Visibility::new(&config.site);
            person.matched(&numbers, &detection, &BodyView::default(), &visibility, k * 100_000_000, STEP_S);
            track = Some(person.track(&numbers, k * 100_000_000, STEP_S, &config.site.hall, VecDeque::new()));
        }
        let told_m2 = track.unwrap().covariance[0][0];
        let filtered_m2 = person.filter.state().P[0][0];
        assert!((told_m2 - filtered_m2 - 0.25 * 0.0016).abs() < 1e-9, "{told_m2} {filtered_m2}");
        assert!(filtered_m2 < 0.5 * 0.0016, "{filtered_m2}");
    }
}
