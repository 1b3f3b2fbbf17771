//! The body at rest: upright, arms hanging, on the floor under the origin, looking along x. Closed parts that
//! overlap at the joints, each carried by one bone or bent between two.

use std::ops::Range;
use std::sync::Arc;

use umbracast::geometry::DVec3;

use super::build::{ANKLE_SHARE, BALL_SHARE, Build};
use super::loft::{self, Along, Ring, rounded, smooth};
use super::meshes::Skin;
use super::skeleton::Bone;

/// One closed surface, carried by one bone or bent between two.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The second where a ring's share of it is 1.
    pub bones: [Bone; 2],
    /// Of the resting body.
    pub form: Form,
}

/// What closed surfaces there are.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// Stretched over rings, in either order, of so many points.
    Loft(Along, Vec<Ring>, usize),
    /// A wheel's rim and tyre about an axle along y: middle, radius to the middle of the tyre, half its width.
    Hoop(DVec3, f64, f64),
    /// Vertices and triangles as they are.
    Ready(Vec<DVec3>, Vec<[u32; 3]>),
}

/// By so much what is carried may go farther from the axis than at rest.
const SWAYS_M: f64 = 0.15;

/// What every mesh of a body has in common.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Corner indices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The closed parts (trunk, neck, head, limbs, then what the person carries): vertices and triangles.
    pub parts: Vec<(Range<usize>, Range<usize>)>,
}

/// One body at rest.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// Rest position and how far the vertex follows the part's second bone, part after part.
    vertices: Vec<(DVec3, f64)>,
    bones: Vec<[Bone; 2]>,
    /// In place of a body's parts, with vertices before all others.
    skin: Option<Arc<Skin>>,
    surface: Surface,
}

impl Shape {
    /// Lofts the body of a build, and what the person has.
    pub fn new(build: &Build, things: Vec<Part>) -> Self {
        let mut shape = Self::default();
        body(build).into_iter().chain(things).for_each(|part| shape.add(part));
        shape
    }

    /// Somebody else's body, and what the person has.
    pub fn of_skin(skin: Arc<Skin>, things: Vec<Part>) -> Self {
        let mut shape = Self { surface: skin.surface.clone(), skin: Some(skin), ..Self::default() };
        things.into_iter().for_each(|part| shape.add(part));
        shape
    }

    /// Moves every vertex with its bones; `posed(bone, rest)` says where a point of a bone comes to lie.
    pub fn skin(&self, posed: impl Fn(Bone, DVec3) -> DVec3, out: &mut Vec<DVec3>) {
        out.clear();
        let mut parts = self.surface.parts.as_slice();
        if let Some(skin) = &self.skin {
            skin.posed(&posed, out);
            parts = &parts[skin.surface.parts.len()..];
        }
        let before = out.len();
        for ([first, second], (range, _)) in self.bones.iter().zip(parts) {
            out.extend(self.vertices[range.start - before..range.end - before].iter().map(
                |&(rest, share)| match share {
                    0.0 => posed(*first, rest),
                    1.0 => posed(*second, rest),
                    _ => posed(*first, rest).lerp(posed(*second, rest), share),
                },
            ));
        }
    }

    /// How far from the body axis anything may be that follows trunk or ground: more than what is carried is at rest.
    pub fn reach_m(&self) -> f64 {
        let far = self.vertices.iter().map(|(at, _)| at.truncate().length()).fold(0.0, f64::max);
        far + SWAYS_M
    }

    /// How the vertices hang together.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    fn add(&mut self, part: Part) {
        let before = self.skin.as_ref().map_or(0, |skin| skin.vertices());
        let (from, first) = (before + self.vertices.len(), self.surface.triangles.len());
        match part.form {
            Form::Loft(along, mut rings, points) => {
                // Limbs are listed from the top; rings are stacked upward.
                if rings[0].at_m > rings[rings.len() - 1].at_m {
                    rings.reverse();
                }
                loft::vertices(along, &rings, points, &mut self.vertices);
                loft::triangles(rings.len(), points, from, &mut self.surface.triangles);
            }
            Form::Hoop(middle_m, radius_m, half_m) => {
                loft::hoop(
                    middle_m,
                    radius_m,
                    half_m,
                    before,
                    &mut self.vertices,
                    &mut self.surface.triangles,
                );
            }
            Form::Ready(vertices, triangles) => {
                self.vertices.extend(vertices.into_iter().map(|at| (at, 0.0)));
                self.surface.triangles.extend(triangles.iter().map(|t| t.map(|corner| from as u32 + corner)));
            }
        }
        self.bones.push(part.bones);
        self.surface.parts.push((from..before + self.vertices.len(), first..self.surface.triangles.len()));
    }
}

/// The parts of every body, in the order of their vertices and triangles.
fn body(b: &Build) -> Vec<Part> {
    let part = |first, second, along, rings, points| Part {
        bones: [first, second],
        form: Form::Loft(along, rings, points),
    };
    let of = |bone, rings, points| part(bone, bone, Along::Z, rings, points);
    vec![
        part(Bone::Pelvis, Bone::Thorax, Along::Z, trunk(b), 20),
        of(Bone::Head, neck(b), 12),
        of(Bone::Head, head(b), 16),
        of(Bone::UpperArmLeft, upper_arm(b, 1.0), 12),
        of(Bone::UpperArmRight, upper_arm(b, -1.0), 12),
        of(Bone::ForearmLeft, forearm(b, 1.0), 12),
        of(Bone::ForearmRight, forearm(b, -1.0), 12),
        of(Bone::ThighLeft, thigh(b, 1.0), 12),
        of(Bone::ThighRight, thigh(b, -1.0), 12),
        of(Bone::ShankLeft, shank(b, 1.0), 12),
        of(Bone::ShankRight, shank(b, -1.0), 12),
        part(Bone::FootLeft, Bone::ToesLeft, Along::X, foot(b, 1.0), 12),
        part(Bone::FootRight, Bone::ToesRight, Along::X, foot(b, -1.0), 12),
    ]
}

/// A box with its edges a little rounded, upright: middle and size.
pub fn case(bone: Bone, middle_m: DVec3, size_m: DVec3) -> Part {
    let half = size_m * 0.5;
    let level = |share: f64, across: f64| Ring {
        at_m: middle_m.z + share * half.z,
        center_m: [middle_m.x, middle_m.y],
        half_m: [across * half.x, across * half.y],
        power: 8.0,
        second: 0.0,
    };
    let rings = vec![level(-1.0, 0.9), level(-0.9, 1.0), level(0.9, 1.0), level(1.0, 0.9)];
    Part { bones: [bone, bone], form: Form::Loft(Along::Z, rings, 24) }
}

fn ring(at_m: f64, center_m: [f64; 2], half_m: [f64; 2]) -> Ring {
    Ring { at_m, center_m, half_m, power: 2.0, second: 0.0 }
}

/// Crotch to the root of the neck. Girths of trunks are larger than those of the ellipses inside their breadth
/// and depth (tape over ellipse: hip 1.09, waist 1.05, chest 1.2): so the rings are squarish.
fn trunk(b: &Build) -> Vec<Ring> {
    let [hip, waist, chest] =
        [b.hip_m, b.waist_m, b.chest_m].map(|[breadth, depth]| [depth / 2.0, breadth / 2.0]);
    let acromion = b.biacromial_m / 2.0;
    let neck = b.neck_radius_m;
    let level = |share: f64, x_m: f64, half_m: [f64; 2], power: f64, second: f64| Ring {
        at_m: b.level_m(share),
        center_m: [x_m, 0.0],
        half_m,
        power,
        second,
    };
    let mid = |a: [f64; 2], b: [f64; 2], u: f64| [a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])];
    let wide = |[x, y]: [f64; 2], of_x: f64, of_y: f64| [x * of_x, y * of_y];
    let keys = [
        level(0.470, -0.005, wide(hip, 0.55, 0.60), 2.2, 0.0),
        level(0.490, -0.01, wide(hip, 0.90, 0.92), 2.3, 0.0),
        level(0.520, -0.01, hip, 2.4, 0.0),
        level(0.560, -0.005, mid(hip, waist, 0.4), 2.4, 0.05),
        level(0.601, 0.01, waist, 2.3, 0.3),
        level(0.660, 0.01, mid(waist, chest, 0.5), 2.6, 0.7),
        level(0.727, 0.005, chest, 3.0, 1.0),
        level(0.765, 0.0, wide(chest, 0.97, 1.06), 3.0, 1.0),
        level(0.795, -0.005, [0.80 * chest[0], acromion - 0.01], 2.6, 1.0),
        level(0.820, -0.012, [0.60 * chest[0], 0.85 * acromion], 2.3, 1.0),
        level(0.842, -0.015, [0.48 * chest[0] + 0.1 * neck, 0.25 * acromion + 0.6 * neck], 2.0, 1.0),
        level(0.866, -0.01, [0.85 * neck, 0.9 * neck], 2.0, 1.0),
    ];
    smooth(&keys, 1)
}

fn neck(b: &Build) -> Vec<Ring> {
    let r = b.neck_radius_m;
    [(0.835, -0.015, 1.1), (0.865, -0.008, 1.0), (0.885, 0.002, 1.0), (0.905, 0.01, 0.95)]
        .map(|(share, x, of)| ring(b.level_m(share), [x, 0.0], [1.03 * of * r, 0.97 * of * r]))
        .to_vec()
}

/// Chin to vertex, .130 H (BT); widest above the ears, which lie 13 cm below the vertex.
fn head(b: &Build) -> Vec<Ring> {
    let [half_y, half_x] = b.head_m.map(|size| size / 2.0);
    let (chin, vertex) = (b.level_m(0.870), b.height_m());
    let keys = [
        (0.0, 0.045, 0.30, 0.38),
        (0.10, 0.033, 0.50, 0.60),
        (0.25, 0.020, 0.74, 0.80),
        (0.42, 0.013, 0.93, 0.95),
        (0.60, 0.010, 1.0, 1.0),
        (0.78, 0.008, 0.90, 0.92),
        (0.92, 0.006, 0.58, 0.62),
    ]
    .map(|(share, x, of_x, of_y)| {
        ring(chin + share * (vertex - chin), [x, 0.0], [of_x * half_x, of_y * half_y])
    });
    let mut rings = smooth(&keys[..5], 1);
    rings.extend(&keys[5..]);
    let crown = keys[6];
    rings.push(Ring { at_m: vertex - 0.004, half_m: crown.half_m.map(|h| 0.45 * h), ..crown });
    rings.push(Ring { at_m: vertex, half_m: crown.half_m.map(|h| 0.12 * h), ..crown });
    rings
}

/// Rings along a limb: share of the way from `from_m` to `to_m`, shift of the middle and half axes.
fn limb<const N: usize>(
    [from_m, to_m]: [f64; 2],
    middle_m: [f64; 2],
    keys: [(f64, [f64; 2], [f64; 2]); N],
) -> Vec<Ring> {
    keys.map(|(share, shift, half_m)| {
        ring(from_m + share * (to_m - from_m), [middle_m[0] + shift[0], middle_m[1] + shift[1]], half_m)
    })
    .to_vec()
}

/// A limb with round ends: its first ring is the upper one.
fn with_round_ends(rings: Vec<Ring>, rise_top_m: f64, rise_bottom_m: f64) -> Vec<Ring> {
    let top = rounded(rings[0], rise_top_m);
    let bottom = rounded(rings[rings.len() - 1], -rise_bottom_m);
    [top[1], top[0]].into_iter().chain(rings).chain(bottom).collect()
}

fn upper_arm(b: &Build, side: f64) -> Vec<Ring> {
    let (y, shoulder) = b.shoulder_m();
    let r = b.arm_radius_m;
    // The deltoid reaches out to the bideltoid breadth.
    let deltoid = (b.bideltoid_m / 2.0 - y).clamp(0.9 * r, 1.6 * r);
    let elbow = 0.9 * b.forearm_radius_m;
    let keys = [
        (0.0, [0.0, 0.0], [1.05 * r, 0.96 * deltoid]),
        (0.2, [0.0, 0.0], [1.08 * r, deltoid]),
        (0.45, [0.0, 0.0], [1.05 * r, 0.6 * r + 0.4 * deltoid]),
        (0.75, [0.0, 0.0], [0.95 * r, 0.92 * r]),
        (1.0, [0.0, 0.0], [elbow, elbow]),
    ];
    with_round_ends(limb([shoulder, b.elbow_height_m()], [0.0, side * y], keys), 0.045, 0.8 * elbow)
}

/// Forearm and hand: the palm looks at the thigh.
fn forearm(b: &Build, side: f64) -> Vec<Ring> {
    let (y, _) = b.shoulder_m();
    let r = b.forearm_radius_m;
    let elbow = b.elbow_height_m();
    let wrist = elbow - b.forearm_m;
    let thick = b.stature_m / 1.756;
    let arm = limb(
        [elbow, wrist],
        [0.0, side * y],
        [
            (0.0, [0.0, 0.0], [0.9 * r, 0.9 * r]),
            (0.22, [0.0, 0.0], [r, r]),
            (0.55, [0.0, 0.0], [0.84 * r, 0.8 * r]),
            (0.97, [0.0, 0.0], [0.032 * thick, 0.024 * thick]),
        ],
    );
    let hand = limb(
        [wrist, wrist - b.hand_m],
        [0.0, side * y],
        [
            (0.22, [0.004, 0.0], [0.043 * thick, 0.019 * thick]),
            (0.45, [0.006, 0.0], [0.046 * thick, 0.018 * thick]),
            (0.72, [0.006, -0.006 * side], [0.039 * thick, 0.015 * thick]),
            (0.93, [0.006, -0.014 * side], [0.028 * thick, 0.011 * thick]),
            (1.0, [0.006, -0.017 * side], [0.012 * thick, 0.006 * thick]),
        ],
    );
    let top = rounded(arm[0], 0.8 * 0.9 * r);
    [top[1], top[0]].into_iter().chain(arm).chain(hand).collect()
}

fn thigh(b: &Build, side: f64) -> Vec<Ring> {
    let r = b.thigh_radius_m;
    let knee = 1.02 * b.calf_radius_m;
    let hip = b.hip_height_m();
    let keys = [
        (0.0, [-0.005, 0.0], [1.0 * r, 0.85 * r]),
        (0.2, [-0.005, 0.0], [1.06 * r, 0.92 * r]),
        (0.4, [0.0, 0.0], [0.98 * r, 0.9 * r]),
        (0.6, [0.003, 0.0], [0.86 * r, 0.82 * r]),
        (0.82, [0.005, 0.0], [0.69 * r, 0.67 * r]),
        (1.0, [0.005, 0.0], [knee, 0.97 * knee]),
    ];
    let rings = limb([hip, hip - b.thigh_m()], [0.0, side * b.hip_offset_m()], keys);
    with_round_ends(rings, 0.06, 0.8 * knee)
}

fn shank(b: &Build, side: f64) -> Vec<Ring> {
    let r = b.calf_radius_m;
    let ankle = 0.62 * r;
    let knee = b.hip_height_m() - b.thigh_m();
    let keys = [
        (0.0, [0.003, 0.0], [0.98 * r, 0.94 * r]),
        (0.15, [-0.004, 0.0], [0.98 * r, 0.95 * r]),
        (0.32, [-0.01, 0.0], [1.03 * r, 0.97 * r]),
        (0.6, [-0.008, 0.0], [0.83 * r, 0.8 * r]),
        (0.85, [-0.004, 0.0], [0.66 * r, 0.62 * r]),
        (1.0, [0.0, 0.0], [1.1 * ankle, ankle]),
    ];
    let rings = limb([knee, knee - b.shank_m()], [0.0, side * b.hip_offset_m()], keys);
    // Down to the shoe only: the ankle must not pierce the sole.
    with_round_ends(rings, 0.8 * r, 0.4 * b.ankle_m())
}

/// A shoe, heel to toe, flat on the floor; in front of the ball it bends with the toes.
fn foot(b: &Build, side: f64) -> Vec<Ring> {
    let length = b.sole_m();
    let half_breadth = b.foot_m[1] / 2.0 + 0.005;
    let ankle = b.ankle_m();
    [
        (0.0, 0.45, 0.035, 0.0),
        (0.03, 0.62, 0.55 * ankle, 0.0),
        (0.12, 0.72, 0.9 * ankle, 0.0),
        (0.28, 0.76, 1.12 * ankle, 0.0),
        (0.50, 0.88, 0.085, 0.0),
        (BALL_SHARE, 1.0, 0.060, 0.5),
        (0.86, 0.97, 0.050, 1.0),
        (0.96, 0.75, 0.042, 1.0),
        (1.0, 0.45, 0.030, 1.0),
    ]
    .map(|(share, breadth, top, second)| Ring {
        at_m: (share - ANKLE_SHARE) * length,
        center_m: [side * b.hip_offset_m(), top / 2.0],
        half_m: [breadth * half_breadth, top / 2.0],
        power: 3.5,
        second,
    })
    .to_vec()
}
