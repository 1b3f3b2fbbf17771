//! From a person at rest to a build with this person's joints, and to a skin over our own resting bones: arms hanging, legs
//! upright, feet side by side.

use glam::DQuat;
use umbracast::Error;
use umbracast::geometry::{DMat3, DVec3};

use super::skin::Skin;
use super::{Person, Vertex};
use crate::body::build::{ANKLE_SHARE, BALL_SHARE, Build, Joints};
use crate::body::skeleton::{BONES, Bone};

/// Toes bend over this length behind the ball: ahead of it they lie flat.
const BENDS_M: f64 = 0.03;
/// Soles go this far up; they follow foot and toes alone.
const SOLE_M: f64 = 0.055;
const SIDES: [f64; 2] = [1.0, -1.0];
/// Hips and chest: levels as shares of the height, and how far ahead of the axis the middle of our own trunks is there (`shape`).
const TRUNK: [(f64, f64, f64); 2] = [(0.50, 0.54, -0.01), (0.70, 0.76, 0.004)];
const TRUNK_BONES: [Bone; 4] = [Bone::Pelvis, Bone::Thorax, Bone::ThighLeft, Bone::ThighRight];

/// Head's top over the floor once the legs are upright, shoes included.
pub(super) fn height_m(person: &Person) -> f64 {
    person.vertices.iter().map(|vertex| vertex.at_m.z).fold(0.0, f64::max) + Legs::of(person).rise_m
}

/// # Errors
/// A person who does not stand on two legs below a trunk, or far off an adult's or a child's height.
pub(super) fn check(person: &Person) -> Result<(), Error> {
    let legs = Legs::of(person);
    let height_m = height_m(person);
    let built = legs.thigh_m > 0.1 && legs.shank_m > 0.1 && legs.ankle_m > 0.02 && legs.hip_offset_m > 0.02;
    if (0.6..2.4).contains(&height_m) && built {
        return Ok(());
    }
    Err(Error::new(format!(
        "glTF: expected people of 0.6 to 2.4 m who stand on the floor, y up, in metres; found a height of {height_m:.2} m"
    )))
}

/// Measures of upright legs.
struct Legs {
    thigh_m: f64,
    shank_m: f64,
    ankle_m: f64,
    hip_offset_m: f64,
    /// By this the trunk is higher over upright legs than over those of the file.
    rise_m: f64,
}

impl Legs {
    fn of(person: &Person) -> Self {
        let both = |left: Bone| [0, 1].map(|side| person.joints_m[left as usize + side]);
        let [hips, knees, ankles] = [Bone::ThighLeft, Bone::ShankLeft, Bone::FootLeft].map(both);
        let apart = |a: [DVec3; 2], b: [DVec3; 2]| 0.5 * (a[0].distance(b[0]) + a[1].distance(b[1]));
        let (thigh_m, shank_m, ankle_m) =
            (apart(hips, knees), apart(knees, ankles), 0.5 * (ankles[0].z + ankles[1].z));
        Self {
            thigh_m,
            shank_m,
            ankle_m,
            hip_offset_m: 0.5 * (hips[0].y - hips[1].y),
            rise_m: thigh_m + shank_m + ankle_m - 0.5 * (hips[0].z + hips[1].z),
        }
    }
}

/// The measures of a person, `scale` times as large, and the skin.
pub(super) fn fitted(person: &Person, scale: f64) -> (Build, Skin) {
    let placed = Placed::new(person);
    let skin = placed.skin(scale);
    (placed.build(scale), skin)
}

/// A person over our resting bones.
struct Placed<'a> {
    person: &'a Person,
    legs: Legs,
    /// From the file's rest to ours, for each bone: turn, then shift.
    ours: [(DMat3, DVec3); BONES],
    sole_m: f64,
    joints: Joints,
}

impl<'a> Placed<'a> {
    fn new(person: &'a Person) -> Self {
        let legs = Legs::of(person);
        let joint = |bone: Bone, side: usize| person.joints_m[bone as usize + side];
        let middle = |bone: Bone| 0.5 * (joint(bone, 0) + joint(bone, 1));
        let shoulders = middle(Bone::UpperArmLeft);
        let [hips_ahead_m, chest_ahead_m] = TRUNK.map(|level| trunk_ahead_m(person, &legs, level));
        let hip_m = legs.thigh_m + legs.shank_m + legs.ankle_m;
        let mut ours = [(DMat3::IDENTITY, DVec3::ZERO); BONES];
        let up = DVec3::Z * legs.rise_m;
        // The body axis runs through the middle of the trunk, as it does in our own bodies, not through the joints, which lie
        // behind it.
        ours[Bone::Pelvis as usize].1 = up - DVec3::X * hips_ahead_m;
        ours[Bone::Thorax as usize].1 = up - DVec3::X * chest_ahead_m;
        ours[Bone::Head as usize].1 = up - DVec3::X * chest_ahead_m;
        let shoulder = (
            0.5 * (joint(Bone::UpperArmLeft, 0).y - joint(Bone::UpperArmLeft, 1).y),
            shoulders.z + legs.rise_m,
        );
        let length =
            |a: Bone, b: Bone| 0.5 * (joint(a, 0).distance(joint(b, 0)) + joint(a, 1).distance(joint(b, 1)));
        let upper_arm_m = length(Bone::UpperArmLeft, Bone::ForearmLeft);
        let wrists = person.wrists_m;
        let forearm_m = 0.5
            * (joint(Bone::ForearmLeft, 0).distance(wrists[0])
                + joint(Bone::ForearmLeft, 1).distance(wrists[1]));
        let mut sole_m: f64 = 0.0;
        let feet = [0, 1].map(|side| Foot::of(person, side));
        feet.iter().for_each(|foot| sole_m = sole_m.max(foot.length_m));
        for (i, side) in SIDES.into_iter().enumerate() {
            let mut hang = |bone: Bone, end: DVec3, to: DVec3| {
                let from = joint(bone, i);
                let turn = DMat3::from_quat(DQuat::from_rotation_arc((end - from).normalize(), -DVec3::Z));
                ours[bone as usize + i] = (turn, to - turn * from);
            };
            let elbow = joint(Bone::ForearmLeft, i);
            let at = |z: f64, y: f64| DVec3::new(0.0, side * y, z);
            hang(Bone::UpperArmLeft, elbow, at(shoulder.1, shoulder.0));
            hang(Bone::ForearmLeft, wrists[i], at(shoulder.1 - upper_arm_m, shoulder.0));
            hang(Bone::ThighLeft, joint(Bone::ShankLeft, i), at(hip_m, legs.hip_offset_m));
            hang(Bone::ShankLeft, joint(Bone::FootLeft, i), at(hip_m - legs.thigh_m, legs.hip_offset_m));
            let foot = &feet[i];
            let to =
                DVec3::new(-ANKLE_SHARE * sole_m - foot.heel_m, side * legs.hip_offset_m, -foot.lowest_m);
            let place = (foot.turn, to - foot.turn * joint(Bone::FootLeft, i).with_z(0.0));
            ours[Bone::FootLeft as usize + i] = place;
            ours[Bone::ToesLeft as usize + i] = place;
        }
        let joints = Joints {
            ankle_m: legs.ankle_m,
            hip_offset_m: legs.hip_offset_m,
            hip_height_m: hip_m,
            thigh_m: legs.thigh_m,
            shank_m: legs.shank_m,
            shoulder_m: shoulder,
            elbow_height_m: shoulder.1 - upper_arm_m,
            forearm_m,
            waist_m: joint(Bone::Thorax, 0).z + legs.rise_m,
            neck_m: joint(Bone::Head, 0).z + legs.rise_m,
            sole_m,
        };
        Self { person, legs, ours, sole_m, joints }
    }

    fn at(&self, bone: Bone, at_m: DVec3) -> DVec3 {
        let (turn, shift_m) = self.ours[bone as usize];
        turn * at_m + shift_m
    }

    /// What a vertex follows over our bones.
    fn follows(&self, vertex: &Vertex, scale: f64) -> Vec<(Bone, f64, DVec3)> {
        let foot =
            |bone: Bone| (Bone::FootLeft as usize..=Bone::ToesRight as usize).contains(&(bone as usize));
        let on_foot: f64 = vertex.bones.iter().filter(|share| foot(share.0)).map(|share| share.1).sum();
        let mut shares = vertex.bones.clone();
        if on_foot > 0.0 {
            let is_left = vertex.at_m.y > 0.0;
            let side = usize::from(!is_left);
            let (foot_bone, toes) =
                [(Bone::FootLeft, Bone::ToesLeft), (Bone::FootRight, Bone::ToesRight)][side];
            let at = self.at(foot_bone, vertex.at_m);
            let ball_m = (BALL_SHARE - ANKLE_SHARE) * self.sole_m;
            let ahead = ((at.x - ball_m + BENDS_M) / BENDS_M).clamp(0.0, 1.0);
            let whole = if at.z < SOLE_M { 1.0 } else { on_foot };
            shares.retain(|share| !foot(share.0));
            shares.iter_mut().for_each(|share| {
                share.1 *= if on_foot < 1.0 { (1.0 - whole) / (1.0 - on_foot) } else { 0.0 }
            });
            shares.extend([(foot_bone, whole * (1.0 - ahead)), (toes, whole * ahead)]);
            shares.retain(|share| share.1 > 0.0);
        }
        shares.into_iter().map(|(bone, share)| (bone, share, scale * self.at(bone, vertex.at_m))).collect()
    }

    /// The surface, cut into parts by the bone that a triangle follows most.
    fn skin(&self, scale: f64) -> Skin {
        let follows: Vec<_> = self.person.vertices.iter().map(|vertex| self.follows(vertex, scale)).collect();
        let most = |triangle: &[u32; 3]| {
            let mut shares = [0.0; BONES];
            let of_corners = triangle.iter().flat_map(|corner| &follows[*corner as usize]);
            of_corners.for_each(|(bone, share, _)| shares[*bone as usize] += share);
            (0..BONES).max_by(|a, b| shares[*a].total_cmp(&shares[*b]))
        };
        let mut skin = Skin::default();
        for bone in 0..BONES {
            let mut place = vec![None; follows.len()];
            let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
            for triangle in self.person.triangles.iter().filter(|triangle| most(triangle) == Some(bone)) {
                triangles.push(triangle.map(|corner| {
                    *place[corner as usize].get_or_insert_with(|| {
                        vertices.push(follows[corner as usize].as_slice());
                        vertices.len() as u32 - 1
                    })
                }));
            }
            if !triangles.is_empty() {
                skin.add(&vertices, &triangles);
            }
        }
        skin
    }

    /// Measures taken from the surface; where it does not tell, those of a usual body of this stature.
    fn build(&self, scale: f64) -> Build {
        let person = self.person;
        let height_m = height_m(person);
        let stature_m = height_m - person.shoe_m;
        let size = |bones: &[Bone], from: f64, to: f64| {
            let level = |share: f64| person.shoe_m + share * stature_m - self.legs.rise_m;
            let near = person.vertices.iter().filter(|vertex| bones.contains(&vertex.bones[0].0));
            let near = near.map(|vertex| vertex.at_m).filter(|at| (level(from)..level(to)).contains(&at.z));
            let (least, most) = near.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(least, most), at| {
                (least.min(at), most.max(at))
            });
            let size = (most - least).max(DVec3::splat(0.1));
            [scale * size.y, scale * size.x]
        };
        // About a bone that hangs: the mean distance of the surface from it.
        let radius = |bone: Bone, from: f64, to: f64| {
            let top = self.at(bone, person.joints_m[bone as usize]);
            let own = person.vertices.iter().filter(|vertex| vertex.bones[0].0 == bone);
            let own =
                own.map(|vertex| self.at(bone, vertex.at_m) - top).filter(|at| (from..to).contains(&-at.z));
            let (count, sum) = own.fold((0, 0.0), |(n, sum), at| (n + 1, sum + at.truncate().length()));
            scale * if count > 2 { sum / f64::from(count) } else { 0.05 }
        };
        let trunk = [Bone::Pelvis, Bone::Thorax];
        let chest_m = size(&trunk, 0.70, 0.76);
        let hands = person.vertices.iter().filter(|vertex| vertex.bones[0].0 == Bone::ForearmLeft);
        let wrist_m = self.at(Bone::ForearmLeft, person.wrists_m[0]);
        let tip_m = hands.map(|vertex| self.at(Bone::ForearmLeft, vertex.at_m).z).fold(wrist_m.z, f64::min);
        let forearm_radius_m = radius(Bone::ForearmLeft, 0.03, 0.12);
        let arm_radius_m = radius(Bone::UpperArmLeft, 0.08, 0.2);
        let shoulder_m = scale * self.joints.shoulder_m.0;
        Build {
            male: person.male,
            stature_m: scale * stature_m,
            shoe_m: scale * person.shoe_m,
            bmi: person.bmi,
            biacromial_m: 2.0 * shoulder_m + 0.04,
            bideltoid_m: 2.0 * (shoulder_m + arm_radius_m),
            chest_m,
            waist_m: size(&trunk, 0.58, 0.63),
            hip_m: size(&[Bone::Pelvis, Bone::ThighLeft, Bone::ThighRight], 0.50, 0.54),
            thigh_radius_m: radius(Bone::ThighLeft, 0.1, 0.25),
            calf_radius_m: radius(Bone::ShankLeft, 0.08, 0.2),
            arm_radius_m,
            forearm_radius_m,
            neck_radius_m: 0.06 * scale,
            head_m: size(&[Bone::Head], 0.92, 0.96),
            forearm_m: scale * self.joints.forearm_m,
            hand_m: scale * (wrist_m.z - tip_m).max(0.1),
            foot_m: [scale * self.sole_m - 0.02, 0.09 * scale],
            legs: 1.0,
            chin: crate::body::build::CHIN,
            joints: Some(self.joints.scaled(scale)),
        }
    }
}

/// How far ahead of x = 0 the trunk's middle is at a level (`TRUNK`) more than in our own bodies.
fn trunk_ahead_m(person: &Person, legs: &Legs, (from, to, own_m): (f64, f64, f64)) -> f64 {
    let height_m = height_m(person);
    let level = |share: f64| share * height_m - legs.rise_m;
    let near = person.vertices.iter().filter(|vertex| TRUNK_BONES.contains(&vertex.bones[0].0));
    let near = near.map(|vertex| vertex.at_m).filter(|at| (level(from)..level(to)).contains(&at.z));
    let (least_m, most_m) =
        near.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (least.min(at.x), most.max(at.x)));
    if least_m <= most_m { 0.5 * (least_m + most_m) - own_m } else { 0.0 }
}

/// A foot in the file's rest: turned so that it points ahead, where its sole lies from the ankle.
struct Foot {
    turn: DMat3,
    heel_m: f64,
    lowest_m: f64,
    length_m: f64,
}

impl Foot {
    fn of(person: &Person, side: usize) -> Self {
        let (foot, toes) = (Bone::FootLeft as usize + side, Bone::ToesLeft as usize + side);
        let ankle_m = person.joints_m[foot];
        let ahead = (person.joints_m[toes] - ankle_m).truncate();
        let turn = DMat3::from_rotation_z(-ahead.to_angle());
        let own = person.vertices.iter().filter(|vertex| {
            let bone = vertex.bones[0].0 as usize;
            bone == foot || bone == toes
        });
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for vertex in own {
            let at = turn * (vertex.at_m - ankle_m.with_z(0.0));
            (least, most) = (least.min(at), most.max(at));
        }
        Self { turn, heel_m: least.x, lowest_m: least.z, length_m: (most.x - least.x).max(0.1) }
    }
}
