//! Bones and their poses: a rigid motion for each, and legs bent so that the feet reach their places.

use umbracast::geometry::{DMat3, DVec2, DVec3};

use super::build::{ANKLE_SHARE, BALL_SHARE, Build};
use super::gait::UpperBody;

/// What carries the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Bone {
    Pelvis,
    Thorax,
    Head,
    UpperArmLeft,
    UpperArmRight,
    ForearmLeft,
    ForearmRight,
    ThighLeft,
    ThighRight,
    ShankLeft,
    ShankRight,
    FootLeft,
    FootRight,
    ToesLeft,
    ToesRight,
    /// No bone: the ground below the body axis, turned as the body looks. What rolls follows it.
    Ground,
}

impl Bone {
    /// Those of the body, in the order of their numbers.
    pub const ALL: [Self; BONES] = [
        Self::Pelvis,
        Self::Thorax,
        Self::Head,
        Self::UpperArmLeft,
        Self::UpperArmRight,
        Self::ForearmLeft,
        Self::ForearmRight,
        Self::ThighLeft,
        Self::ThighRight,
        Self::ShankLeft,
        Self::ShankRight,
        Self::FootLeft,
        Self::FootRight,
        Self::ToesLeft,
        Self::ToesRight,
    ];
}

/// How many bones a body has.
pub const BONES: usize = 15;

/// The motion of one bone: takes its points at rest to the site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    rotation: DMat3,
    shift_m: DVec3,
}

impl Motion {
    /// The motion that turns a bone and brings its joint from `rest_m` to `joint_m`.
    fn about(rotation: DMat3, rest_m: DVec3, joint_m: DVec3) -> Self {
        Self { rotation, shift_m: joint_m - rotation * rest_m }
    }

    /// Where a point of the bone comes to lie.
    pub fn point(&self, rest_m: DVec3) -> DVec3 {
        self.rotation * rest_m + self.shift_m
    }

    fn then(&self, turn: &DMat3, shift_m: DVec3) -> Self {
        Self { rotation: *turn * self.rotation, shift_m: *turn * self.shift_m + shift_m }
    }
}

/// How a foot stands: ankle joint, direction, and pitch of the foot and of its toes (toes up positive).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootPose {
    /// The ankle joint in the site.
    pub ankle_m: DVec3,
    /// Where the toes point.
    pub yaw_rad: f64,
    /// Of the foot.
    pub pitch_rad: f64,
    /// Of the toes.
    pub toe_pitch_rad: f64,
}

/// How the pelvis stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PelvisPose {
    /// The middle between the hip joints in the site.
    pub hips_m: DVec3,
    /// Its turn and roll.
    pub rotation: DMat3,
}

impl PelvisPose {
    /// The pelvis over the body axis, the hip joints `hip_height_m` above the floor.
    pub fn new(position_m: DVec2, heading_rad: f64, upper: &UpperBody, hip_height_m: f64) -> Self {
        let sway =
            DVec2::from_angle(heading_rad).rotate(DVec2::new(upper.pelvis_forward_m, upper.pelvis_left_m));
        Self {
            hips_m: (position_m + sway).extend(hip_height_m),
            rotation: DMat3::from_rotation_z(heading_rad + upper.pelvis_yaw_rad)
                * DMat3::from_rotation_x(upper.pelvis_list_rad),
        }
    }

    /// The hip joint of a side, 1 left, -1 right.
    pub fn hip_m(&self, build: &Build, side: f64) -> DVec3 {
        self.hips_m + self.rotation * DVec3::new(0.0, side * build.hip_offset_m(), 0.0)
    }
}

/// What a hand is at, in place of swinging.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    /// Where: a point of this bone at rest.
    pub bone: Bone,
    /// See `bone`.
    pub at_m: DVec3,
    /// Which part of the hand is there: 0 the wrist, 1 the fingertips.
    pub grip: f64,
    /// Where the elbow points, at rest.
    pub elbow: DVec3,
}

/// Left hand, right hand; `None` hangs and swings.
pub type Holds = [Option<Hold>; 2];

/// Every bone's motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The ground comes last.
    bones: [Motion; BONES + 1],
}

impl Pose {
    /// A body with the given pelvis and feet (left, right); trunk, arms and legs follow.
    pub fn new(
        build: &Build,
        heading_rad: f64,
        upper: &UpperBody,
        pelvis: &PelvisPose,
        feet: &[FootPose; 2],
        holds: &Holds,
    ) -> Self {
        let hips_rest = DVec3::new(0.0, 0.0, build.hip_height_m());
        let pelvis_motion = Motion::about(pelvis.rotation, hips_rest, pelvis.hips_m);

        let facing = DMat3::from_rotation_z(heading_rad);
        let thorax_turn =
            facing * DMat3::from_rotation_z(upper.thorax_yaw_rad) * DMat3::from_rotation_y(upper.tilt_rad);
        let waist_rest = DVec3::new(0.0, 0.0, build.waist_height_m());
        let thorax = Motion::about(thorax_turn, waist_rest, pelvis_motion.point(waist_rest));
        let neck_rest = DVec3::new(-0.01, 0.0, build.neck_height_m());
        // The head looks ahead and stays upright.
        let head = Motion::about(facing, neck_rest, thorax.point(neck_rest));

        let mut bones = [pelvis_motion; BONES + 1];
        let sway =
            DVec2::from_angle(heading_rad).rotate(DVec2::new(upper.pelvis_forward_m, upper.pelvis_left_m));
        let axis_m = (pelvis.hips_m.truncate() - sway).extend(0.0);
        bones[Bone::Ground as usize] = Motion::about(facing, DVec3::ZERO, axis_m);
        bones[Bone::Thorax as usize] = thorax;
        bones[Bone::Head as usize] = head;
        for (i, side) in [1.0, -1.0].into_iter().enumerate() {
            let arm = match &holds[i] {
                Some(hold) => holding(build, side, &thorax, hold, &bones[hold.bone as usize]),
                None => arm(build, side, &thorax, upper, i),
            };
            bones[Bone::UpperArmLeft as usize + i] = arm[0];
            bones[Bone::ForearmLeft as usize + i] = arm[1];
            let leg = leg(build, side, pelvis.hip_m(build, side), heading_rad, &feet[i]);
            bones[Bone::ThighLeft as usize + i] = leg[0];
            bones[Bone::ShankLeft as usize + i] = leg[1];
            bones[Bone::FootLeft as usize + i] = leg[2];
            bones[Bone::ToesLeft as usize + i] = leg[3];
        }
        Self { bones }
    }

    /// Where a point of a bone at rest comes to lie.
    pub fn point(&self, bone: Bone, rest_m: DVec3) -> DVec3 {
        self.bones[bone as usize].point(rest_m)
    }

    /// The same pose turned about the vertical at `from_m` and moved over the floor to `to_m`.
    #[must_use]
    pub fn moved(&self, from_m: DVec2, turn_rad: f64, to_m: DVec2) -> Self {
        let turn = DMat3::from_rotation_z(turn_rad);
        let shift = to_m.extend(0.0) - turn * from_m.extend(0.0);
        Self { bones: self.bones.map(|bone| bone.then(&turn, shift)) }
    }
}

/// Upper arm and forearm, swung forward in the thorax's frame. The upper arm is spread just enough for the
/// forearm to hang clear of the hips.
fn arm(build: &Build, side: f64, thorax: &Motion, upper: &UpperBody, i: usize) -> [Motion; 2] {
    let (shoulder_rad, elbow_rad) = (upper.shoulder_rad[i], upper.elbow_rad[i]);
    let (offset, level) = build.shoulder_m();
    let shoulder_rest = DVec3::new(0.0, side * offset, level);
    let elbow_rest = DVec3::new(0.0, side * offset, build.elbow_height_m());
    let clear = (build.hip_m[0] / 2.0 + 0.02).max(build.waist_m[0] / 2.0 + build.forearm_radius_m) - offset;
    let spread =
        (clear / (level - build.elbow_height_m())).clamp(0.07, 0.30).asin() + upper.arm_spread_rad[i];
    let upper_turn =
        thorax.rotation * DMat3::from_rotation_x(side * spread) * DMat3::from_rotation_y(-shoulder_rad);
    let upper = Motion::about(upper_turn, shoulder_rest, thorax.point(shoulder_rest));
    let fore_turn = thorax.rotation
        * DMat3::from_rotation_x(side * 0.2 * spread)
        * DMat3::from_rotation_y(-shoulder_rad - elbow_rad);
    [upper, Motion::about(fore_turn, elbow_rest, upper.point(elbow_rest))]
}

/// Thigh, shank, foot and toes: two bones bent at the knee so that the ankle lies where the foot wants it.
fn leg(build: &Build, side: f64, hip: DVec3, heading_rad: f64, foot: &FootPose) -> [Motion; 4] {
    let (thigh, shank, y) = (build.thigh_m(), build.shank_m(), side * build.hip_offset_m());
    let hip_rest = DVec3::new(0.0, y, build.hip_height_m());
    let knee_rest = hip_rest - DVec3::new(0.0, 0.0, thigh);
    let ankle_rest = DVec3::new(0.0, y, build.ankle_m());
    // The knee bends forward, between where the body and the foot look.
    let ahead = DVec2::from_angle(heading_rad) + DVec2::from_angle(foot.yaw_rad);
    let [hinge, knee, ankle] = bent(hip, foot.ankle_m, [thigh, shank], ahead.extend(0.0));
    let foot_yaw = DMat3::from_rotation_z(foot.yaw_rad);
    let ball_rest = ball_rest(build, y);
    let foot_motion = Motion::about(foot_yaw * DMat3::from_rotation_y(-foot.pitch_rad), ankle_rest, ankle);
    let toes = Motion::about(
        foot_yaw * DMat3::from_rotation_y(-foot.toe_pitch_rad),
        ball_rest,
        foot_motion.point(ball_rest),
    );
    [
        Motion::about(turned(hip, knee, hinge), hip_rest, hip),
        Motion::about(turned(knee, ankle, hinge), knee_rest, knee),
        foot_motion,
        toes,
    ]
}

/// Upper arm and forearm of a hand that holds something.
fn holding(build: &Build, side: f64, thorax: &Motion, hold: &Hold, to: &Motion) -> [Motion; 2] {
    let (offset, level) = build.shoulder_m();
    let shoulder_rest = DVec3::new(0.0, side * offset, level);
    let elbow_rest = DVec3::new(0.0, side * offset, build.elbow_height_m());
    let lengths = [level - build.elbow_height_m(), build.forearm_m + hold.grip * build.hand_m];
    let shoulder = thorax.point(shoulder_rest);
    let [hinge, elbow, hand] = bent(shoulder, to.point(hold.at_m), lengths, to.rotation * hold.elbow);
    // Elbows bend against knees.
    [
        Motion::about(turned(shoulder, elbow, -hinge), shoulder_rest, shoulder),
        Motion::about(turned(elbow, hand, -hinge), elbow_rest, elbow),
    ]
}

/// Two bones of these lengths from `root` to `goal`, or as far as they reach, their joint towards `ahead`: the
/// axis of the joint, the joint and the end.
fn bent(root: DVec3, goal: DVec3, [upper, lower]: [f64; 2], ahead: DVec3) -> [DVec3; 3] {
    let span = goal - root;
    let reach = span.length().clamp((upper - lower).abs() + 0.05, 0.9999 * (upper + lower));
    let down = span.normalize();
    let end = root + down * reach;
    let hinge = ahead.cross(down).normalize();
    let bend = down.cross(hinge);
    let along = (reach * reach + upper * upper - lower * lower) / (2.0 * reach);
    let out = (upper * upper - along * along).max(0.0).sqrt();
    [hinge, root + down * along + bend * out, end]
}

/// The turn of a bone that hangs at rest, once it runs from `upper` to `lower` with its y axis along `hinge`.
fn turned(upper: DVec3, lower: DVec3, hinge: DVec3) -> DMat3 {
    let up = (upper - lower).normalize();
    let y_axis = (hinge - up * hinge.dot(up)).normalize();
    DMat3::from_cols(y_axis.cross(up), y_axis, up)
}

/// Where toes bend: the ball of the foot, on the floor.
fn ball_rest(build: &Build, y_m: f64) -> DVec3 {
    DVec3::new((BALL_SHARE - ANKLE_SHARE) * build.sole_m(), y_m, 0.0)
}
