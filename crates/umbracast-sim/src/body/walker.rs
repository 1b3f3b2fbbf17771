//! A body on its way: its state and its mesh at any time.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use rand::{Rng, RngExt};
use umbracast::gait::WALKS_FROM_MPS;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::{Hall, Ue};

use super::build::Build;
use super::gestures::{Gestures, arm_m};
use super::individual::Individual;
use super::kind::Kind;
use super::meshes::Meshes;
use super::recorded::Gait;
use super::shape::{Shape, Surface};
use super::sitting::Sitting;
use super::skeleton::{Bone, Holds, PelvisPose, Pose};
use super::things::Things;
use super::walk::{self, Instant, Walk};
use super::{carried, device, feet, gait, things};
use crate::crowd::Trajectory;
use crate::random::stream;

/// Of a person of 2 m.
const ARM_SPAN_M: f64 = 2.0;
/// A body climbs from one level to the next over so much of its way, before the edge and behind it.
const CLIMB_M: f64 = 0.3;
/// Hands are looked at so many times in a stride.
const SWINGS: u32 = 8;

/// Where a person is and how he stands, at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonState {
    /// Ground point of the body axis.
    pub position_m: DVec2,
    /// Its velocity.
    pub velocity_mps: DVec2,
    /// The trunk's, held while standing.
    pub heading_rad: f64,
    /// How high the floor is that the feet are on; climbing a step, between both levels.
    pub floor_m: f64,
    /// Standing height with shoes; of who sits, the height of the head's top.
    pub height_m: f64,
    /// Of the stride, since the right heel touched the floor, a stride a full turn; held while standing.
    pub phase_rad: f64,
}

/// A body drawn at random, walking along a trajectory: pose and mesh at any time.
#[derive(Debug, Clone)]
pub struct Walker {
    /// Whose.
    pub trajectory: Trajectory,
    /// Its measures.
    pub build: Build,
    /// How it walks.
    own: Individual,
    shape: Shape,
    pub(super) walk: Walk,
    first_phase: f64,
    holds: Holds,
    /// In place of what the hands hold.
    gestures: Option<Gestures>,
    /// Of who sits down now and then.
    sitting: Option<Sitting>,
    /// Height of the hip joints of who always sits.
    seat_m: Option<f64>,
    /// In place of the published gait.
    gait: Option<Arc<Gait>>,
    /// Standing (or sitting) upright at the origin, looking along x.
    upright: Pose,
    /// Whose floor is not level.
    hall: Option<Arc<Hall>>,
    seed: u64,
}

impl Walker {
    /// Draws a body (sex, height, build, proportions) from `seed` and lets it walk along the trajectory.
    pub fn new(trajectory: Trajectory, seed: u64) -> Self {
        Self::of_kind(trajectory, seed, Kind::Plain)
    }

    /// The same for a kind of body. Children have heights of their own.
    pub fn of_kind(trajectory: Trajectory, seed: u64, kind: Kind) -> Self {
        Self::of_meshes(trajectory, seed, kind, None)
    }

    /// The same with a body out of these meshes. Children have bodies of our own.
    pub fn of_meshes(trajectory: Trajectory, seed: u64, kind: Kind, meshes: Option<&Meshes>) -> Self {
        let (build, skin) = match (kind, meshes) {
            (Kind::Child, _) => (Build::draw_child(seed), None),
            (_, None) => (Build::draw(seed, trajectory.height_m), None),
            (_, Some(meshes)) => {
                let (build, skin) = meshes.draw(seed, trajectory.height_m);
                (build, Some(skin))
            }
        };
        let things = match kind {
            Kind::Pushed => pushed(seed),
            _ => things::of(kind, &build, seed),
        };
        let first_phase: f64 = stream(seed, "phase", 0).random();
        // Feet of who sits stay where they are.
        let faces = (kind != Kind::Sitting).then_some(seed);
        let own = Individual::draw(seed, build.male);
        let walk = Walk::plan(&trajectory, &build, &own, first_phase, faces);
        let still = gait::upper_body(0.0, 0.0, &Individual::MEAN);
        let (hips_m, feet) = match things.seat_m {
            Some(seat_m) => (seat_m, things::feet_on_rests(&build, DVec2::ZERO, 0.0)),
            None => (build.hip_height_m() - 0.006, feet::at_rest(&build, &Individual::MEAN)),
        };
        let pelvis = PelvisPose::new(DVec2::ZERO, 0.0, &still, hips_m);
        let upright = Pose::new(&build, 0.0, &still, &pelvis, &feet, &things.holds);
        let shape = match skin {
            None => Shape::new(&build, things.parts),
            Some(skin) => Shape::of_skin(skin, things.parts),
        };
        Self {
            shape,
            trajectory,
            build,
            own,
            holds: things.holds,
            gestures: (kind == Kind::Gesturing).then(|| Gestures::draw(seed)),
            sitting: (kind == Kind::Sitting).then(|| Sitting::plan(&walk)),
            walk,
            first_phase,
            seat_m: things.seat_m,
            gait: None,
            upright,
            hall: None,
            seed,
        }
    }

    /// The same body, moving as somebody who was recorded.
    #[must_use]
    pub fn with_gait(mut self, gait: Arc<Gait>) -> Self {
        self.walk.keep_pace(self.own.stride * gait.stride_m(&self.build));
        self.gait = Some(gait);
        self
    }

    /// The same body, facing along its way and holding that while it stands.
    #[must_use]
    pub fn looking_ahead(mut self) -> Self {
        self.walk = Walk::plan(&self.trajectory, &self.build, &self.own, self.first_phase, None);
        self
    }

    /// The same body on this hall's floor.
    #[must_use]
    pub fn on_floor_of(mut self, hall: &Arc<Hall>) -> Self {
        self.hall = (!hall.floors.is_empty()).then(|| hall.clone());
        self
    }

    /// Where the device is that the person carries, in the site; `None` outside the time of the trajectory.
    pub fn ue_m_at(&self, ue: &Ue, time_ns: i64) -> Option<DVec3> {
        let state = self.state_at(time_ns)?;
        let ue = device::held(ue, self.seed, time_ns, state.height_m);
        let on_body = ue.on_body(state.position_m, state.heading_rad, state.height_m);
        Some(on_body + DVec3::Z * state.floor_m)
    }

    /// The person's state, or `None` while not in the scene.
    pub fn state_at(&self, time_ns: i64) -> Option<PersonState> {
        let (position_m, velocity_mps) = self.trajectory.at(time_ns)?;
        let Instant { heading_rad, phase, .. } = self.walk.at(time_ns);
        let heading_rad = (heading_rad + PI).rem_euclid(TAU) - PI;
        let floor_m = self.hall.as_ref().map_or(0.0, |hall| underfoot(hall, position_m, heading_rad).0);
        let (height_m, phase_rad) = (self.height_m(time_ns), TAU * phase);
        Some(PersonState { position_m, velocity_mps, heading_rad, floor_m, height_m, phase_rad })
    }

    /// How far the left and the right hand swing to either side of their middles in the stride about a time: shares of the height for
    /// a speed of one hip height a second, less than 0 of a hand that swings with the leg of its side. `None` of who stands, or is not
    /// in the scene for that stride.
    pub fn hand_swing_at(&self, time_ns: i64) -> Option<[f64; 2]> {
        let PersonState { velocity_mps, height_m, .. } = self.state_at(time_ns)?;
        let speed_mps = velocity_mps.length();
        let stride_ns = 1e9 / umbracast::gait::stride_hz(speed_mps, height_m);
        let (offset_m, level_m) = self.build.shoulder_m();
        let hand_up_m = level_m - arm_m(&self.build);
        let mut swing_m = [0.0; 2];
        for k in 0..SWINGS {
            let late_ns = ((f64::from(k) / f64::from(SWINGS) - 0.5) * stride_ns) as i64;
            let (pose, state) = self.pose_at(time_ns + late_ns)?;
            let ahead = DVec2::from_angle(state.heading_rad);
            for (i, (bone, side)) in
                [(Bone::ForearmLeft, 1.0), (Bone::ForearmRight, -1.0)].into_iter().enumerate()
            {
                let hand_m = pose.point(bone, DVec3::new(0.0, side * offset_m, hand_up_m)).truncate();
                let wave = 2.0 / f64::from(SWINGS) * side * state.phase_rad.cos();
                swing_m[i] += wave * ahead.dot(hand_m - state.position_m);
            }
        }
        let usual_m = height_m * umbracast::gait::relative_speed_hz(speed_mps, height_m);
        (speed_mps > WALKS_FROM_MPS).then(|| swing_m.map(|m| m / usual_m))
    }

    fn height_m(&self, time_ns: i64) -> f64 {
        let sunk_m = self.sitting.as_ref().map_or(0.0, |sitting| sitting.sunk_m(time_ns, &self.build));
        let seated_m = self.seat_m.map_or(0.0, |seat_m| self.build.hip_height_m() - seat_m);
        self.build.height_m() - seated_m - sunk_m
    }

    /// Writes the vertices of the walking body in the site frame; false (and nothing written) while the person
    /// is not in the scene.
    pub fn mesh_at(&self, time_ns: i64, vertices: &mut Vec<DVec3>) -> bool {
        vertices.clear();
        let Some((pose, state)) = self.pose_at(time_ns) else { return false };
        self.shape.skin(|bone, rest| pose.point(bone, rest), vertices);
        self.raise(state.position_m, state.heading_rad, vertices);
        true
    }

    /// The same body standing upright, arms hanging, at any place: what the ladder of oracles casts.
    pub fn upright_mesh(&self, position_m: DVec2, heading_rad: f64, vertices: &mut Vec<DVec3>) {
        let pose = self.upright.moved(DVec2::ZERO, heading_rad, position_m);
        self.shape.skin(|bone, rest| pose.point(bone, rest), vertices);
        self.raise(position_m, heading_rad, vertices);
    }

    /// The walking mesh of `time_ns` moved so that its axis stands at `position_m` with `heading_rad`. Nothing
    /// is written while the person is not in the scene.
    pub fn mesh_moved(&self, time_ns: i64, position_m: DVec2, heading_rad: f64, vertices: &mut Vec<DVec3>) {
        vertices.clear();
        let Some((pose, state)) = self.pose_at(time_ns) else { return };
        let pose = pose.moved(state.position_m, heading_rad - state.heading_rad, position_m);
        self.shape.skin(|bone, rest| pose.point(bone, rest), vertices);
        self.raise(position_m, heading_rad, vertices);
    }

    /// Puts a body that stands at z = 0 on the floor: upright, and on a ramp each foot at the height of its own place.
    fn raise(&self, position_m: DVec2, heading_rad: f64, vertices: &mut [DVec3]) {
        if let Some(hall) = &self.hall {
            let (floor_m, slope) = underfoot(hall, position_m, heading_rad);
            vertices.iter_mut().for_each(|v| v.z += floor_m + slope.dot(v.truncate() - position_m));
        }
    }

    /// No vertex of any mesh of this walker is farther from the body axis: arms stretched out, or what the person pushes.
    pub fn reach_m(&self) -> f64 {
        self.shape.reach_m().max(ARM_SPAN_M / 2.0)
    }

    /// How the vertices of every mesh that this walker makes hang together.
    pub fn surface(&self) -> &Surface {
        self.shape.surface()
    }

    fn pose_at(&self, time_ns: i64) -> Option<(Pose, PersonState)> {
        let state = self.state_at(time_ns)?;
        let instant = self.walk.at(time_ns);
        if let Some(seat_m) = self.seat_m {
            return Some((self.seated(seat_m, &instant, &state), state));
        }
        if let Some(gait) = &self.gait {
            let Instant { heading_rad, speed_mps, phase, twist_rad, .. } = instant;
            let (build, own, at_m) = (&self.build, &self.own, state.position_m);
            let pose = gait.pose(build, own, at_m, heading_rad, phase, speed_mps, twist_rad);
            return Some((pose, state));
        }
        let upper = walk::upper_body(&instant, &self.build, &self.own);
        let mut hips_m = instant.hip_height_m;
        let mut feet = walk::foot_poses(&self.walk, &instant, &self.build);
        let mut holds = match &self.gestures {
            Some(gestures) => gestures.holds(&self.build, time_ns, instant.speed_mps),
            None => self.holds,
        };
        if let Some(sitting) = &self.sitting {
            hips_m -= sitting.sunk_m(time_ns, &self.build);
            feet = sitting.feet(time_ns, instant.heading_rad, feet);
            holds = sitting.holds(time_ns, &self.build).unwrap_or(holds);
        }
        let pelvis = PelvisPose::new(state.position_m, instant.heading_rad, &upper, hips_m);
        Some((Pose::new(&self.build, instant.heading_rad, &upper, &pelvis, &feet, &holds), state))
    }

    /// Who sits rolls along, still.
    fn seated(&self, seat_m: f64, instant: &Instant, state: &PersonState) -> Pose {
        let (heading_rad, still) = (instant.heading_rad, gait::upper_body(0.0, 0.0, &Individual::MEAN));
        let pelvis = PelvisPose::new(state.position_m, heading_rad, &still, seat_m);
        let feet = things::feet_on_rests(&self.build, state.position_m, heading_rad);
        Pose::new(&self.build, heading_rad, &still, &pelvis, &feet, &self.holds)
    }
}

/// Somebody in a wheelchair to be pushed, a body of our own.
fn pushed(seed: u64) -> Things {
    let way = Trajectory {
        person: 0,
        start_ns: 0,
        step_ns: 1_000_000_000,
        positions_m: vec![DVec2::ZERO; 2],
        arrived_ns: None,
        height_m: None,
    };
    let seated = Walker::of_kind(way, stream(seed, "pushed", 0).next_u64(), Kind::Wheelchair);
    let mut vertices = Vec::new();
    seated.upright_mesh(DVec2::ZERO, 0.0, &mut vertices);
    let parts: Vec<_> = seated.surface().parts.iter().map(|(range, _)| range.clone()).collect();
    carried::pushed(&vertices, &seated.surface().triangles, &parts)
}

/// How high the floor is below a body and how it rises, both on the mean along its way: so a step is climbed steadily.
fn underfoot(hall: &Hall, position_m: DVec2, heading_rad: f64) -> (f64, DVec2) {
    let ahead_m = DVec2::from_angle(heading_rad) * CLIMB_M;
    let (from_m, way_m) = (position_m - ahead_m, 2.0 * ahead_m);
    // Between the edges that it crosses all is linear.
    let mut cuts = vec![0.0, 1.0];
    for floor in &hall.floors {
        for [a, b] in floor.edges() {
            cuts.push(((a - from_m).perp_dot(b - a) / way_m.perp_dot(b - a)).clamp(0.0, 1.0));
        }
    }
    cuts.retain(|share| !share.is_nan());
    cuts.sort_by(f64::total_cmp);
    let (mut floor_m, mut slope) = (0.0, DVec2::ZERO);
    for piece in cuts.windows(2).filter(|piece| piece[0] < piece[1]) {
        let middle_m = from_m + way_m * (0.5 * (piece[0] + piece[1]));
        let length = piece[1] - piece[0];
        floor_m += length * hall.floor_m(middle_m);
        let here = hall.floor_at(middle_m);
        slope += length * here.map_or(DVec2::ZERO, |i| DVec2::from_array(hall.floors[i].slope));
    }
    (floor_m, slope)
}
