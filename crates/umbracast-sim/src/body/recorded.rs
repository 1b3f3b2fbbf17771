//! A recorded gait: one stride of a motion capture, looped, drives pelvis, trunk, arms and legs.
//!
//! Joint positions are enough. Arms and trunk take the recorded angles; each ankle lies to its hip joint as recorded,
//! in units of the leg's length, so that hips and knees bend as they did. The stride grows with the leg, the cadence
//! with the speed. Feet slide as far as the recorded ones do, and while the body starts and stops.

use std::f64::consts::PI;

use umbracast::Error;
use umbracast::geometry::{DMat3, DVec2, DVec3};

use super::build::Build;
use super::feet;
use super::gait::{UpperBody, above_zero};
use super::individual::Individual;
use super::skeleton::{FootPose, Holds, PelvisPose, Pose};

/// Joints by their names in two common skeletons: left, then right where there is a `{}`.
const JOINTS: [[&str; 2]; 9] = [
    ["Hips", "Hips"],
    ["Neck", "Neck1"],
    ["{}Hip", "{}UpLeg"],
    ["{}Knee", "{}Leg"],
    ["{}Ankle", "{}Foot"],
    ["{}Toe", "{}ToeBase"],
    ["{}Arm", "{}Shoulder"],
    ["{}ForeArm", "{}Elbow"],
    ["{}Hand", "{}Wrist"],
];
/// Strides last so long, seconds.
const STRIDE_S: [f64; 2] = [0.8, 1.6];
/// And no longer than this where somebody dawdles.
const SLOW_STRIDE_S: f64 = 2.6;
/// A stride closes whose ends are apart by less than this, squares of all joints together, in squares of the leg.
const CLOSED: f64 = 0.25;
/// Cosine of the widest angle between where somebody faces and walks.
const AHEAD: f64 = 0.7;
/// The looped stride is at least this fast, as a share of the fastest one.
const BRISK: f64 = 0.6;
/// Slower than this the recorded gait fades out; at 0 the body stands.
const FADE_MPS: f64 = 0.3;

/// One instant in a body's own frame: ahead, left, up; lengths in units of the leg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Instant([f64; 18]);

/// One stride.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gait {
    instants: Vec<Instant>,
    /// Way of a stride in units of the leg.
    stride: f64,
    /// About what the arms swing.
    shoulders_rad: [f64; 2],
}

/// The joints of one frame: root and neck, then pairs (left, right) of hip, knee, ankle, toe, shoulder, elbow, wrist.
struct Figure {
    root: DVec3,
    neck: DVec3,
    pairs: [[DVec3; 2]; 7],
}

impl Gait {
    /// Finds the stride that closes best among the brisk ones. `frames` holds by frame and joint x, y (up), z; the
    /// figure looks along z at rest.
    ///
    /// # Errors
    /// A joint that is not there, a clip that is too short or does not walk.
    pub fn new(frame_s: f64, joints: &[String], frames: &[Vec<[f64; 3]>]) -> Result<Self, Error> {
        let find = |names: &[&str; 2], side: &str| {
            let wanted = names.map(|name| name.replace("{}", side));
            let place = wanted.iter().find_map(|name| joints.iter().position(|joint| joint == name));
            place.ok_or_else(|| {
                Error::new(format!("expected a joint {} or {}, found none", wanted[0], wanted[1]))
            })
        };
        let [root, neck] = [find(&JOINTS[0], "")?, find(&JOINTS[1], "")?];
        let mut pairs = [[0; 2]; 7];
        for (pair, names) in pairs.iter_mut().zip(&JOINTS[2..]) {
            *pair = [find(names, "Left")?, find(names, "Right")?];
        }
        let figures: Vec<Figure> = frames
            .iter()
            .map(|frame| {
                // Ahead, left, up.
                let at = |joint: usize| DVec3::new(frame[joint][2], frame[joint][0], frame[joint][1]);
                Figure { root: at(root), neck: at(neck), pairs: pairs.map(|pair| pair.map(at)) }
            })
            .collect();
        let (first, last) = best_loop(frame_s, &figures)?;
        Ok(looped(&figures[first..=last]))
    }

    /// How far a body with these legs gets in a stride that is as long for them as the recorded one.
    pub fn stride_m(&self, build: &Build) -> f64 {
        self.stride * (build.thigh_m() + build.shank_m())
    }

    /// The body over `position_m`, `phase` strides after the loop's first frame, as far as `own` makes the motion somebody
    /// else's; who stands has turned the trunk by `twist_rad`.
    pub(super) fn pose(
        &self,
        build: &Build,
        own: &Individual,
        position_m: DVec2,
        heading_rad: f64,
        phase: f64,
        speed_mps: f64,
        twist_rad: f64,
    ) -> Pose {
        let share = (speed_mps / FADE_MPS).min(1.0);
        let fade = share * share * (3.0 - 2.0 * share);
        let Instant(now) = self.at(phase);
        let leg_m = build.thigh_m() + build.shank_m();
        let upper = UpperBody {
            pelvis_forward_m: fade * leg_m * own.sway * now[0],
            pelvis_left_m: fade * leg_m * own.sway * now[1],
            pelvis_yaw_rad: fade * own.pelvis_turn * now[2],
            pelvis_list_rad: fade * own.pelvis_list * now[3],
            tilt_rad: fade * now[4] + own.lean_rad,
            thorax_yaw_rad: fade * own.thorax_turn * now[5] + twist_rad,
            shoulder_rad: [0, 1].map(|arm| {
                let middle_rad = self.shoulders_rad[arm];
                fade * (middle_rad + own.arm_swing[arm] * (now[6 + arm] - middle_rad))
            }),
            elbow_rad: [0, 1].map(|arm| fade * above_zero(now[8 + arm] + own.elbow_rad[arm])),
            arm_spread_rad: own.arm_spread_rad,
        };
        let level = PelvisPose::new(position_m, heading_rad, &upper, 0.0);
        let facing = DMat3::from_rotation_z(heading_rad);
        let rest = feet::at_rest(build, own);
        let mut lowest_m = f64::INFINITY;
        let feet: [FootPose; 2] = std::array::from_fn(|i| {
            let side = if i == 0 { 1.0 } else { -1.0 };
            let hip = DVec3::new(0.0, side * build.hip_offset_m(), build.hip_height_m() - 0.006);
            let recorded = leg_m * DVec3::new(own.stride * now[10 + 4 * i], now[11 + 4 * i], now[12 + 4 * i]);
            let ankle = (rest[i].ankle_m - hip).lerp(recorded, fade).clamp_length_max(0.9998 * leg_m);
            let pitch_rad = fade * now[13 + 4 * i];
            let toe_pitch_rad = pitch_rad.max(0.0);
            let ankle_m = level.hip_m(build, side) + facing * ankle;
            lowest_m = lowest_m.min(ankle_m.z + feet::lowest_m(build, pitch_rad, toe_pitch_rad));
            FootPose { ankle_m, yaw_rad: heading_rad + (rest[i].yaw_rad), pitch_rad, toe_pitch_rad }
        });
        // The lower foot carries the body.
        let feet = feet.map(|foot| FootPose { ankle_m: foot.ankle_m - DVec3::Z * lowest_m, ..foot });
        let pelvis = PelvisPose::new(position_m, heading_rad, &upper, -lowest_m);
        Pose::new(build, heading_rad, &upper, &pelvis, &feet, &Holds::default())
    }

    fn at(&self, phase: f64) -> Instant {
        let n = self.instants.len();
        let offset = phase.rem_euclid(1.0) * n as f64;
        let (i, u) = (offset as usize % n, offset.fract());
        let (Instant(a), Instant(b)) = (&self.instants[i], &self.instants[(i + 1) % n]);
        Instant(std::array::from_fn(|k| a[k] + u * (b[k] - a[k])))
    }
}

/// First and last frame of the stride at whose ends the limbs are most alike. Where no brisk stride closes, a slower one may
/// last longer.
fn best_loop(frame_s: f64, figures: &[Figure]) -> Result<(usize, usize), Error> {
    let [shortest, longest, slowest] =
        [STRIDE_S[0], STRIDE_S[1], SLOW_STRIDE_S].map(|seconds| (seconds / frame_s).round() as usize);
    let way = |a: usize, b: usize| (figures[b].root - figures[a].root).truncate().length();
    let speed = |a: usize, b: usize| way(a, b) / (b - a) as f64;
    let ends = |a: usize, longest: usize| {
        (a + shortest..=a + longest).take_while(|&b| b < figures.len()).map(move |b| (a, b))
    };
    // Who walks sideways or turns about is no model of a walk ahead.
    let goes_ahead = |&(a, b): &(usize, usize)| {
        let way = (figures[b].root - figures[a].root).truncate().normalize_or_zero();
        [a, (a + b) / 2, b].iter().all(|&k| way.dot(facing(&figures[k])) > AHEAD)
    };
    let all = |longest: usize| (0..figures.len()).flat_map(move |a| ends(a, longest));
    let fastest = all(longest).filter(goes_ahead).map(|(a, b)| speed(a, b)).fold(0.0, f64::max);
    let moves = all(longest).any(|(a, b)| speed(a, b) > 0.0);
    if !moves {
        let length_s = frame_s * figures.len() as f64;
        return Err(Error::new(format!(
            "expected a walk of {} s or longer, found {length_s} s without a step",
            STRIDE_S[0]
        )));
    }
    // Limbs as the body has them, wherever it looks: a walk may turn.
    let own = |f: &Figure| {
        let turn = DMat3::from_rotation_z(-facing(f).to_angle());
        f.pairs.map(|pair| pair.map(|joint| turn * (joint - f.root)))
    };
    let limbs: Vec<_> = figures.iter().map(own).collect();
    let apart = |a: usize, b: usize| -> f64 {
        let pairs = limbs[a].as_flattened().iter().zip(limbs[b].as_flattened());
        pairs.map(|(a, b)| a.distance_squared(*b)).sum()
    };
    // Both the places and how they change shall meet.
    let cost = |&(a, b): &(usize, usize)| {
        apart(a, b) + apart(a + shortest / 8, (b + shortest / 8).min(figures.len() - 1))
    };
    let best = |longest: usize| {
        let brisk = all(longest).filter(|&(a, b)| speed(a, b) >= BRISK * fastest).filter(goes_ahead);
        brisk.map(|pair| (cost(&pair), pair)).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let within = best(longest);
    let closed = within.is_some_and(|(cost, _)| cost < CLOSED * legs(&figures[0]).powi(2));
    let found = if closed { within } else { best(slowest) };
    let found = found.ok_or_else(|| Error::new("expected somebody who walks ahead, found nobody"))?;
    Ok(found.1)
}

/// Where the pelvis of a figure faces, seen from above.
fn facing(figure: &Figure) -> DVec2 {
    let [left, right] = figure.pairs[0];
    -(left - right).truncate().perp().normalize_or_zero()
}

/// How long the legs of a figure are on the mean.
fn legs(figure: &Figure) -> f64 {
    let [hip, knee, ankle] = [figure.pairs[0], figure.pairs[1], figure.pairs[2]];
    (0..2).map(|i| hip[i].distance(knee[i]) + knee[i].distance(ankle[i])).sum::<f64>() / 2.0
}

/// The frames of a stride in the body's frame, the gap between its ends spread over it.
fn looped(figures: &[Figure]) -> Gait {
    let (first, last) = (&figures[0], &figures[figures.len() - 1]);
    let way = (last.root - first.root).truncate();
    let turn = DMat3::from_rotation_z(-way.to_angle());
    let steps = (figures.len() - 1) as f64;
    let leg = legs(first);
    let flat = flat_foot(figures);
    let mut instants: Vec<Instant> = figures
        .iter()
        .enumerate()
        .map(|(k, figure)| {
            let even = first.root + (last.root - first.root) * (k as f64 / steps);
            instant(figure, even, &turn, leg, flat)
        })
        .collect();
    let gap: [f64; 18] = std::array::from_fn(|i| instants[instants.len() - 1].0[i] - instants[0].0[i]);
    for (k, Instant(values)) in instants.iter_mut().enumerate() {
        for (value, gap) in values.iter_mut().zip(gap) {
            *value -= gap * (k as f64 / steps - 0.5);
        }
    }
    instants.pop();
    let mean = |value: usize| instants.iter().map(|i| i.0[value]).sum::<f64>() / instants.len() as f64;
    let shoulders_rad = [mean(6), mean(7)];
    Gait { instants, stride: way.length() / leg, shoulders_rad }
}

/// How far toes point down while the foot is flat: the middle value of the frames in which its ankle is low.
fn flat_foot(figures: &[Figure]) -> [f64; 2] {
    [0, 1].map(|side| {
        let mut feet: Vec<(f64, f64)> = figures
            .iter()
            .map(|f| (f.pairs[2][side].z, pitch_rad(f.pairs[3][side] - f.pairs[2][side])))
            .collect();
        feet.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut low: Vec<f64> = feet[..feet.len().div_ceil(3)].iter().map(|foot| foot.1).collect();
        low.sort_by(f64::total_cmp);
        low[low.len() / 2]
    })
}

fn pitch_rad(foot: DVec3) -> f64 {
    foot.z.atan2(foot.truncate().length())
}

fn instant(figure: &Figure, even_root: DVec3, turn: &DMat3, leg: f64, flat: [f64; 2]) -> Instant {
    let own = |v: DVec3| *turn * v;
    let [hips, _, ankles, toes, shoulders, elbows, wrists] = &figure.pairs;
    let sway = own(figure.root - even_root) / leg;
    // From right to left, along y when the body looks ahead.
    let [hip_line, shoulder_line] = [hips, shoulders].map(|pair| own(pair[0] - pair[1]));
    let yaw = |line: DVec3| (-line.x).atan2(line.y);
    let spine = own(figure.neck - figure.root);
    let mut values = [0.0; 18];
    values[0] = sway.x;
    values[1] = sway.y;
    values[2] = yaw(hip_line);
    values[3] = pitch_rad(hip_line);
    values[4] = spine.x.atan2(spine.z);
    values[5] = yaw(shoulder_line);
    for side in 0..2 {
        let upper = own(elbows[side] - shoulders[side]);
        let lower = own(wrists[side] - elbows[side]);
        // Turned with the thorax, whose lean the arm's angle is counted from.
        values[6 + side] = upper.x.atan2(-upper.z) + values[4];
        values[8 + side] = upper.angle_between(lower).min(0.8 * PI);
        let ankle = own(ankles[side] - hips[side]) / leg;
        let at = 10 + 4 * side;
        values[at..at + 3].copy_from_slice(&ankle.to_array());
        values[at + 3] = (pitch_rad(toes[side] - ankles[side]) - flat[side]).clamp(-1.2, 0.5);
    }
    Instant(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Walker;
    use crate::crowd::Trajectory;
    use std::sync::Arc;

    fn names() -> Vec<String> {
        let sides = |name: &str| ["Left", "Right"].map(|side| name.replace("{}", side));
        let pairs = JOINTS[2..].iter().flat_map(|names| sides(names[1]));
        ["Hips".to_owned(), "Neck".to_owned()].into_iter().chain(pairs).collect()
    }

    /// Stiff legs of 0.8 m that swing by `swing` like a compass, a stride a second; the left arm stays bent.
    fn clip(swing: f64) -> Vec<Vec<[f64; 3]>> {
        let frame = |k: usize| {
            let t = k as f64 / 100.0;
            let speed = 4.0 * 0.8 * swing.sin();
            let ahead = speed * t;
            let mut joints = vec![[0.0, 0.9, ahead], [0.0, 1.4, ahead]];
            let mut pair = |at: &dyn Fn(f64, f64) -> [f64; 3]| {
                joints.extend([1.0, -1.0].map(|side| {
                    let leg = swing * side * (std::f64::consts::TAU * t).sin();
                    let [x, y, z] = at(side, leg);
                    [x, y, z + ahead]
                }));
            };
            pair(&|side, _| [0.1 * side, 0.9, 0.0]);
            pair(&|side, leg| [0.1 * side, 0.9 - 0.4 * leg.cos(), 0.4 * leg.sin()]);
            pair(&|side, leg| [0.1 * side, 0.9 - 0.8 * leg.cos(), 0.8 * leg.sin()]);
            pair(&|side, leg| [0.1 * side, 0.85 - 0.8 * leg.cos(), 0.15 + 0.8 * leg.sin()]);
            pair(&|side, _| [0.2 * side, 1.35, 0.0]);
            pair(&|side, _| [0.2 * side, 1.1, 0.0]);
            pair(&|side, _| if side > 0.0 { [0.2, 1.1, 0.25] } else { [-0.2, 0.85, 0.0] });
            joints
        };
        (0..300).map(frame).collect()
    }

    fn walker(gait: Gait) -> Walker {
        let positions_m = (0..500).map(|i| DVec2::new(0.0, 0.012 * f64::from(i))).collect();
        let way = Trajectory {
            person: 0,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m,
            arrived_ns: None,
            height_m: None,
        };
        Walker::new(way, 4).with_gait(Arc::new(gait))
    }

    #[test]
    fn the_loop_is_a_whole_stride_with_the_recorded_angles() {
        let gait = Gait::new(0.01, &names(), &clip(0.3)).unwrap();
        assert_eq!(gait.instants.len(), 100);
        assert!((gait.stride - 4.0 * 0.3_f64.sin()).abs() < 1e-9, "{}", gait.stride);
        let reach = gait.instants.iter().map(|Instant(v)| v[10]).fold(0.0, f64::max);
        assert!((reach - 0.3_f64.sin()).abs() < 1e-3, "{reach}");
        for Instant(values) in &gait.instants {
            assert!((values[8] - PI / 2.0).abs() < 1e-9 && values[9].abs() < 1e-9, "elbows {values:?}");
        }
    }

    #[test]
    fn a_walker_with_a_recorded_gait_stays_on_the_floor_and_keeps_its_pace() {
        let gait = Gait::new(0.01, &names(), &clip(0.3)).unwrap();
        let walker = walker(gait.clone());
        let own = Individual::draw(4, walker.build.male);
        let strides = walker.walk.at(4_000_000_000).phase - walker.walk.at(1_000_000_000).phase;
        assert!((strides * own.stride * gait.stride_m(&walker.build) - 3.6).abs() < 0.01, "{strides}");
        let mut mesh = Vec::new();
        for i in 0..490 {
            assert!(walker.mesh_at(i * 10_000_000, &mut mesh));
            let lowest = mesh.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
            assert!(lowest.abs() < 1e-8, "{lowest} at {i}");
        }
        // The elbow that was bent is bent here, too: its hand is ahead of the body all the time.
        let (hands, _) = walker.surface().parts[5].clone();
        assert!(mesh[hands].iter().map(|v| v.y).fold(f64::MIN, f64::max) > 0.012 * 489.0 + 0.3);
    }

    #[test]
    fn clips_without_a_walk_or_a_joint_are_refused() {
        let refused = |names: &[String], frames: &[Vec<[f64; 3]>]| {
            Gait::new(0.01, names, frames).unwrap_err().to_string()
        };
        assert!(refused(&names()[1..], &clip(0.3)).contains("expected a joint Hips"));
        assert!(refused(&names(), &clip(0.3)[..50]).contains("found 0.5 s without a step"));
        let sideways: Vec<Vec<[f64; 3]>> =
            clip(0.3).iter().map(|frame| frame.iter().map(|&[x, y, z]| [-z, y, x]).collect()).collect();
        assert!(Gait::new(0.01, &names(), &sideways).is_ok(), "whole bodies turned walk ahead still");
        let ahead = |k: usize| 4.0 * 0.8 * 0.3_f64.sin() * k as f64 / 100.0;
        let backward = clip(0.3).into_iter().enumerate();
        let backward =
            backward.map(|(k, frame)| frame.iter().map(|&[x, y, z]| [x, y, z - 2.0 * ahead(k)]).collect());
        let backward: Vec<Vec<[f64; 3]>> = backward.collect();
        assert!(refused(&names(), &backward).contains("walks ahead, found nobody"));
    }
}
