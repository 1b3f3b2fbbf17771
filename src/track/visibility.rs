//! The probability that a person at a place can be seen. It follows from the sensors' poses, the beams in a frame,
//! and what stands between: pillars, furniture and other people.

use std::f64::consts::TAU;

use crate::geometry::slab::hit_obb;
use crate::geometry::{Covered, DMat3, DVec2, DVec3, Obb, Pose, Sectors};
use crate::lidar::{Fan, SECTORS, Views, sector};
use crate::site::{Hall, Site, from_segment_m};

/// Radius of the upright cylinder that stands for a body, both as what is seen and as what hides: the trunk,
/// 0.26 m by 0.46 m, averaged over all directions.
const BODY_RADIUS_M: f64 = 0.155;
/// A body is looked at in so many slices from the feet to the top.
const SLICES: usize = 8;
/// The lowest of them are the legs'.
const LEGS_SLICES: usize = 4;
/// Expected returns at which the chance of a detection has fallen to half, measured; a cluster has at least 5 points.
const RETURNS_AT_HALF: f64 = 6.0;
/// A body that sensors meet only below this height is not detected: legs alone are not taken for a person.
const SEEN_TOP_MIN_M: f64 = 0.5;
/// Returns from a body in free sight of a sensor whose beams are unknown: enough to be found.
const RETURNS_OF_UNKNOWN_BEAMS: f64 = 50.0;
/// Sectors of a turn by which an eye looks for who stands in the way: a body at ten metres covers five.
const WAYS: usize = 512;
/// More than rounding takes from a share, and from a square metre.
const ROUNDED: f64 = 1e-9;

/// A body as sight knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Ground point of its axis.
    pub position_m: DVec2,
    /// How high the floor is there, metres.
    pub floor_m: f64,
    /// Standing height.
    pub height_m: f64,
}

impl Body {
    /// How far above the floor a slice begins.
    fn up_m(&self, slice: usize) -> f64 {
        self.height_m * (slice as f64 / SLICES as f64)
    }
}

/// Sensors of the last frame, and what stands still between them and people.
#[derive(Debug, Clone)]
pub struct Visibility {
    /// Says how high the floor is.
    pub(super) hall: Hall,
    pillars: Vec<(DVec2, f64)>,
    furniture: Vec<Obb>,
    /// Shortest and longest range of each sensor of the site.
    ranges_m: Vec<(f64, f64)>,
    eyes: Vec<Eye>,
    /// Everybody.
    bodies: Vec<Body>,
    covered: Vec<Covered>,
    /// Of all that could hide a body from an eye, what is near the line between them.
    between: Between,
}

/// One scan's view.
#[derive(Debug, Clone)]
struct Eye {
    sensor: usize,
    origin_m: DVec3,
    sensor_from_site: Pose,
    range_m: (f64, f64),
    fan: Option<Fan>,
    /// Of the fan's beams: how far each rises in a metre, ascending.
    rises: Vec<f64>,
    /// Of everybody, by number.
    bodies: Sectors<WAYS>,
}

#[derive(Debug, Clone, Default)]
struct Between {
    others: Vec<Body>,
    pillars: Vec<(DVec2, f64)>,
    furniture: Vec<Obb>,
    /// Upright cylinders on the line to the left and to the right side of the body.
    crossed: [Vec<Crossed>; 2],
}

/// An upright cylinder that a line of sight crosses.
#[derive(Debug, Clone, Copy)]
struct Crossed {
    /// Shares of the line where it enters and leaves.
    enter: f64,
    leave: f64,
    top_m: f64,
}

/// What a body gives.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BodyView {
    /// Returns expected from all sensors together.
    pub returns: f64,
    /// The same if nobody and nothing stood between.
    pub returns_alone: f64,
    /// Of them from below the hips.
    pub returns_of_legs: f64,
    /// Those of the legs if nobody and nothing stood between.
    pub returns_of_legs_alone: f64,
    /// Whether all were counted from the sensors' beams; a guess otherwise.
    pub beams_known: bool,
    /// Beams that meet a metre of upright head, all sensors together.
    pub beams_per_m_at_top: f64,
    /// Upper end of the highest part of the body that beams meet, above the floor.
    pub top_m: f64,
    /// Whether it stands at a step, on which level cannot be told.
    pub on_step: bool,
}

impl Visibility {
    /// For what stands in the site.
    pub fn new(site: &Site) -> Self {
        let furniture = site.furniture.iter().map(|f| {
            let (position_m, half_m) = (DVec2::from_array(f.position_m), DVec3::from_array(f.size_m) * 0.5);
            Obb {
                center_m: position_m.extend(site.hall.floor_m(position_m) + half_m.z),
                half_m,
                site_from_box: DMat3::from_rotation_z(f.yaw_deg.to_radians()),
            }
        });
        Self {
            hall: site.hall.clone(),
            pillars: site.pillars.iter().map(|p| (DVec2::from_array(p.position_m), p.radius_m)).collect(),
            furniture: furniture.collect(),
            ranges_m: site.sensors.iter().map(|s| (s.range_min_m, s.range_max_m)).collect(),
            eyes: Vec::new(),
            bodies: Vec::new(),
            covered: Vec::new(),
            between: Between::default(),
        }
    }

    /// From here on as the sensors of this frame, with these bodies in each other's way. One that sent nothing sees nobody.
    pub fn look(&mut self, views: &Views, bodies: &[Body]) {
        self.bodies.clear();
        self.bodies.extend_from_slice(bodies);
        self.eyes.truncate(views.of_scans.len());
        for (i, view) in views.of_scans.iter().enumerate() {
            let eye = Eye {
                sensor: view.sensor,
                origin_m: view.site_from_sensor.translation_m,
                sensor_from_site: view.site_from_sensor.inverse(),
                range_m: self.ranges_m.get(view.sensor).copied().unwrap_or((0.0, f64::INFINITY)),
                fan: None,
                rises: Vec::new(),
                bodies: Sectors::default(),
            };
            match self.eyes.get_mut(i) {
                // What was allocated stays.
                Some(old) => {
                    let (rises, bodies) = (std::mem::take(&mut old.rises), std::mem::take(&mut old.bodies));
                    *old = Eye { fan: old.fan.take(), rises, bodies, ..eye };
                }
                None => self.eyes.push(eye),
            }
            let eye = &mut self.eyes[i];
            eye.take(view.fan.as_ref());
            let covered = |body: &Body| {
                let off_m = body.position_m - eye.origin_m.truncate();
                Covered::of::<WAYS>(off_m, BODY_RADIUS_M + BODY_RADIUS_M)
            };
            self.covered.clear();
            self.covered.extend(bodies.iter().map(covered));
            eye.bodies.sort(&self.covered);
        }
    }

    /// How far apart the columns of a sensor of the site lie at a place, metres; 0 where they are not known.
    pub fn gap_m(&self, sensor: u16, at_m: DVec2) -> f64 {
        let of_sensor = |eye: &&Eye| eye.sensor == usize::from(sensor);
        self.eyes.iter().find(of_sensor).map_or(0.0, |eye| eye.gap_m(at_m))
    }

    /// What `body` gives to all sensors while the others stand round it.
    pub fn view(&mut self, body: &Body) -> BodyView {
        let Self { hall, pillars, furniture, eyes, bodies, between, .. } = self;
        let mut view = BodyView {
            beams_known: !eyes.is_empty() && eyes.iter().all(|eye| eye.fan.is_some()),
            on_step: hall.has_step_about(body.position_m),
            ..BodyView::default()
        };
        for eye in eyes {
            let sides = eye.sides(body);
            if !eye.meets(&sides) {
                continue;
            }
            let from = eye.origin_m.truncate();
            let along = body.position_m - from;
            // Most stand far beside the line that the segment is a part of.
            let per_m = (1.0 + ROUNDED) * along.length();
            let near = |point: DVec2, radius: f64| {
                let near_m = radius + BODY_RADIUS_M;
                along.perp_dot(point - from).abs() <= near_m * per_m + ROUNDED
                    && from_segment_m(point, [from, body.position_m]) < near_m
            };
            between.others.clear();
            // Only who covers its sector may be as near to the line.
            let others = eye.bodies.towards(along).iter().map(|&number| &bodies[number as usize]);
            between.others.extend(others.filter(|o| *o != body && near(o.position_m, BODY_RADIUS_M)));
            between.pillars.clear();
            between.pillars.extend(pillars.iter().filter(|p| near(p.0, p.1)));
            between.furniture.clear();
            let around = |f: &&Obb| near(f.center_m.truncate(), f.half_m.length());
            between.furniture.extend(furniture.iter().filter(around));
            eye.view(body, &sides, between, &mut view);
        }
        view
    }
}

impl Eye {
    fn gap_m(&self, at_m: DVec2) -> f64 {
        let Some(fan) = &self.fan else { return 0.0 };
        let from_eye_m = self.sensor_from_site.point(at_m.extend(self.origin_m.z));
        let columns = fan.columns[sector((-from_eye_m.y).atan2(from_eye_m.x))];
        match columns {
            0 => 0.0,
            columns => TAU / (SECTORS as f64 * f64::from(columns)) * from_eye_m.truncate().length(),
        }
    }

    /// Sees by a scan's beams.
    fn take(&mut self, fan: Option<&Fan>) {
        let [own, new] = [self.fan.as_ref(), fan].map(|fan| fan.map_or(&[][..], |fan| &fan.elevations_rad));
        if own != new {
            self.rises.clear();
            self.rises.extend(new.iter().map(|rad| rad.tan()));
        }
        match (&mut self.fan, fan) {
            (Some(own), Some(fan)) => own.copy_from(fan),
            (own, fan) => *own = fan.cloned(),
        }
    }

    /// Both sides of a body, as this sensor sees them.
    fn sides(&self, body: &Body) -> [Side; 2] {
        let across = (body.position_m - self.origin_m.truncate()).perp().normalize_or_zero();
        [-0.5, 0.5].map(|side| Side::of(self, body, body.position_m + across * (side * BODY_RADIUS_M)))
    }

    /// Whether any beam passes where the body is: most sensors of a large hall look elsewhere.
    fn meets(&self, sides: &[Side; 2]) -> bool {
        sides.iter().any(|side| side.edges.windows(2).any(|of| self.beams_between(&of[0], &of[1]) != 0.0))
    }

    /// Adds what a body gives to this sensor.
    fn view(&self, body: &Body, sides: &[Side; 2], between: &mut Between, view: &mut BodyView) {
        between.cross(self.origin_m.truncate(), sides.each_ref().map(|side| side.foot_m));
        for slice in 0..SLICES {
            let (low_m, high_m) = (body.up_m(slice), body.up_m(slice + 1));
            for (i, side) in sides.iter().enumerate() {
                let beams = self.beams_between(&side.edges[slice], &side.edges[slice + 1]);
                if beams == 0.0 {
                    continue;
                }
                let returns = beams * side.columns_on(slice) * 0.5;
                view.returns_alone += returns;
                if slice < LEGS_SLICES {
                    view.returns_of_legs_alone += returns;
                }
                let middle_m = side.foot_m.extend(body.floor_m + 0.5 * (low_m + high_m));
                if between.hide(i, self.origin_m, middle_m) {
                    continue;
                }
                view.top_m = view.top_m.max(high_m);
                view.returns += returns;
                if slice < LEGS_SLICES {
                    view.returns_of_legs += returns;
                }
                if slice + 1 == SLICES {
                    view.beams_per_m_at_top += 0.5 * beams / (high_m - low_m);
                }
            }
        }
    }

    /// Beams that pass between two points of a vertical line.
    fn beams_between(&self, low: &Edge, high: &Edge) -> f64 {
        if low.range_m < self.range_m.0 || low.range_m > self.range_m.1 {
            return 0.0;
        }
        match self.fan {
            Some(_) => (high.beam - low.beam).abs(),
            None => RETURNS_OF_UNKNOWN_BEAMS / SLICES as f64,
        }
    }
}

/// A body's side, from the feet up, as a sensor sees it.
struct Side {
    /// From above.
    foot_m: DVec2,
    edges: [Edge; SLICES + 1],
    /// Columns in the direction of its middle; none where they are not known.
    columns_per_rad: Option<f64>,
}

/// A point of a body's side.
#[derive(Clone, Copy)]
struct Edge {
    range_m: f64,
    /// Across the sensor's axis.
    away_m: f64,
    /// Beams below it; 0 where they are not known.
    beam: f64,
}

impl Side {
    /// Of the vertical line above `foot_m`, with edges at the body's slices.
    fn of(eye: &Eye, body: &Body, foot_m: DVec2) -> Self {
        let up = eye.sensor_from_site.direction(DVec3::Z);
        let from_eye_m = eye.sensor_from_site.point(foot_m.extend(body.floor_m));
        let at_m = |edge: usize| from_eye_m + up * body.up_m(edge);
        let edges = std::array::from_fn(|edge| {
            let at_m = at_m(edge);
            let away_m2 = at_m.x * at_m.x + at_m.y * at_m.y;
            let away_m = away_m2.sqrt();
            let beam = beam_at(&eye.rises, at_m.z / away_m.max(f64::MIN_POSITIVE));
            Edge { range_m: (away_m2 + at_m.z * at_m.z).sqrt(), away_m, beam }
        });
        let columns_per_rad = eye.fan.as_ref().map(|fan| {
            let middle_m = at_m(SLICES / 2);
            f64::from(fan.columns[sector((-middle_m.y).atan2(middle_m.x))]) * SECTORS as f64 / TAU
        });
        Self { foot_m, edges, columns_per_rad }
    }

    /// Columns that meet the body at an edge.
    fn columns_on(&self, edge: usize) -> f64 {
        let width_rad = 2.0 * BODY_RADIUS_M / self.edges[edge].away_m.max(BODY_RADIUS_M);
        self.columns_per_rad.map_or(1.0, |columns_per_rad| columns_per_rad * width_rad)
    }
}

impl Between {
    /// Finds out what stands on the lines from the eye to both sides of the body, as seen from above.
    fn cross(&mut self, eye_m: DVec2, sides_m: [DVec2; 2]) {
        let Self { others, pillars, crossed, .. } = self;
        for (crossed, side_m) in crossed.iter_mut().zip(sides_m) {
            let cross = |axis_m: DVec2, radius_m: f64, top_m: f64| {
                let (enter, leave) = crossing(axis_m, radius_m, eye_m, side_m)?;
                Some(Crossed { enter, leave, top_m })
            };
            crossed.clear();
            crossed.extend(pillars.iter().filter_map(|p| cross(p.0, p.1, f64::INFINITY)));
            crossed.extend(
                others.iter().filter_map(|o| cross(o.position_m, BODY_RADIUS_M, o.floor_m + o.height_m)),
            );
        }
    }

    /// Does anything stand on the line from the eye to a target on that side of the body?
    fn hide(&self, side: usize, eye_m: DVec3, target_m: DVec3) -> bool {
        let z_m = |share: f64| eye_m.z + (target_m.z - eye_m.z) * share;
        // Where the line leaves a cylinder it is lowest, if the eye looks down; where it enters, if up.
        self.crossed[side].iter().any(|c| z_m(c.enter).min(z_m(c.leave)) < c.top_m)
            || self.furniture.iter().any(|f| hit_obb(f, eye_m, target_m).is_some())
    }
}

/// How many beams lie below a direction that rises so far in a metre, counted smoothly: half a beam at the lowest one.
fn beam_at(rises: &[f64], rise: f64) -> f64 {
    let n = rises.partition_point(|&of_beam| of_beam < rise);
    let (low, high) = match n {
        0 => return 0.0,
        n if n == rises.len() => return n as f64,
        n => (rises[n - 1], rises[n]),
    };
    n as f64 - 0.5 + (rise - low) / (high - low)
}

/// Between which shares of its length the line from the eye to the target is within an upright cylinder, if at all. One
/// that holds the target hides nothing.
fn crossing(axis_m: DVec2, radius_m: f64, eye: DVec2, target: DVec2) -> Option<(f64, f64)> {
    let along = target - eye;
    let length_squared = along.length_squared();
    if length_squared == 0.0 || (target - axis_m).length() < radius_m {
        return None;
    }
    let middle = (axis_m - eye).dot(along) / length_squared;
    let off_squared = (eye + along * middle - axis_m).length_squared();
    let half_squared = (radius_m * radius_m - off_squared) / length_squared;
    if half_squared <= 0.0 {
        return None;
    }
    let half = half_squared.sqrt();
    let (enter, leave) = ((middle - half).max(0.0), (middle + half).min(1.0));
    (enter < leave).then_some((enter, leave))
}

/// Chance that a body seen like this is detected, where it is `in_full_view` with every return (the shape of the curve
/// is a fit to simulated scenes).
pub fn detection_probability(in_full_view: f64, view: &BodyView) -> f64 {
    if view.returns <= 0.0 || view.top_m < SEEN_TOP_MIN_M {
        return 0.0;
    }
    let few = RETURNS_AT_HALF / view.returns;
    in_full_view / (1.0 + few * few)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use crate::lidar::{Cloud, Column, Frame, Model, RangeImage, Scan};

    /// One HDL-32E in the west of the default site, whose columns lie evenly over `turn_cdeg` from ahead on.
    fn frame(turn_cdeg: f32) -> Frame {
        let column = |i: u16| Column {
            time_ns: i64::from(i),
            azimuth_cdeg: f32::from(i) * turn_cdeg / 2170.0,
            azimuth_rate_cdeg_per_ns: 0.0,
        };
        let image = RangeImage {
            beams: Model::hdl_32e().beams,
            columns: (0..2170).map(column).collect(),
            range_m: Vec::new(),
            reflectivity: Vec::new(),
        };
        let site_from_sensor = Config::default().site.sensors[1].site_from_sensor();
        let scan = Scan { sensor: 1, site_from_sensor, cloud: Cloud::Organised(image) };
        Frame { index: 0, time_ns: 0, scans: vec![scan] }
    }

    fn body(x_m: f64, y_m: f64) -> Body {
        Body { position_m: DVec2::new(x_m, y_m), floor_m: 0.0, height_m: 1.75 }
    }

    fn view(frame: &Frame, seen: Body, others: &[Body]) -> BodyView {
        let mut visibility = Visibility::new(&Config::default().site);
        visibility.look(&Views::of(frame), others);
        visibility.view(&seen)
    }

    #[test]
    fn a_body_gives_fewer_returns_the_farther_it_is() {
        let frame = frame(36_000.0);
        let returns = [-10.0, -4.0, 2.0].map(|x_m| view(&frame, body(x_m, 0.0), &[]).returns);
        assert!(returns[0] > returns[1] && returns[1] > returns[2] && returns[2] > 5.0, "{returns:?}");
    }

    #[test]
    fn whoever_stands_right_behind_somebody_is_seen_less_and_in_front_not() {
        let frame = frame(36_000.0);
        let alone = view(&frame, body(0.0, 0.0), &[]);
        let behind = view(&frame, body(0.0, 0.0), &[body(-0.5, 0.0)]);
        let before = view(&frame, body(0.0, 0.0), &[body(0.5, 0.0)]);
        assert!(behind.returns < 0.7 * alone.returns, "{behind:?}, alone {alone:?}");
        assert_eq!(before, alone);
    }

    #[test]
    fn a_pillar_hides_a_person_and_a_lost_sector_does_too() {
        let whole = frame(36_000.0);
        assert_eq!(view(&whole, body(-11.2, 12.27), &[]).returns, 0.0);
        // Clockwise from ahead: the first half looks to the south of the room.
        let half = frame(18_000.0);
        assert_eq!(view(&half, body(-4.0, 6.0), &[]).returns, 0.0);
        assert!(view(&half, body(-4.0, -6.0), &[]).returns > 10.0);
    }

    #[test]
    fn where_the_highest_beam_meets_the_knees_only_legs_are_seen() {
        let frame = frame(36_000.0);
        let legs = view(&frame, body(3.0, 0.0), &[]);
        assert!(legs.top_m < 0.9 && legs.top_m > 0.0, "{legs:?}");
        assert_eq!(detection_probability(0.9, &BodyView { top_m: 0.4, ..legs }), 0.0);
    }
}
