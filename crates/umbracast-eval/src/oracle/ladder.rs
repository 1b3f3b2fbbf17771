//! The ladder of oracles: the score of stage 3 with each kind of body, future and position, if everything else were
//! known. The upright body is its best body. A prediction scores above it only if it knows more of the body, such as
//! the gait.
//!
//! Works on scenes, not on tables, because it needs the bodies. Who counts is the same as everywhere.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use umbracast::blockage::body::EllipticCylinder;
use umbracast::geometry::{Aabb, DMat3, DVec2, DVec3, Obb, slab};
use umbracast::{STEP_NS, STEP_S, STEPS, Site};
use umbracast_sim::body::{PersonState, Surface, Walker};
use umbracast_sim::random::stream;
use umbracast_sim::scene::Scene;
use umbracast_sim::truth::BodyMesh;

use crate::score::instances::instances;
use crate::score::link_counts::{LinkCounts, Prediction};
use crate::score::links::Said;
use crate::score::scene::{SceneTruth, TruthIndex};

/// What a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Body {
    /// The axis-aligned box of the walking body at `t_e` (paper).
    Aabb,
    /// A box of 0.28 x 0.46 m turned with the heading.
    Obb,
    /// An elliptic cylinder of 0.30 x 0.50 m, full height.
    Cylinder,
    /// A trunk of 0.26 x 0.56 m to the shoulders and a head.
    TrunkAndHead,
    /// The person's own mesh, standing.
    UprightMesh,
}

/// What is known of the coming second.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Future {
    /// Everything.
    Known,
    /// The true state at `t_e`, carried on evenly.
    ConstantVelocity,
    /// The same with errors per axis that hang together over time, and a height wrong by 0.03 m.
    Noisy { position_m: f64, velocity_mps: f64 },
}

/// One rung.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Oracle {
    name: &'static str,
    body: Body,
    future: Future,
}

const ORACLES: [Oracle; 10] = [
    Oracle { name: "true future, AABB of the walking body", body: Body::Aabb, future: Future::Known },
    Oracle { name: "true future, OBB 0.28 x 0.46 m", body: Body::Obb, future: Future::Known },
    Oracle { name: "true future, cylinder 0.30 x 0.50 m", body: Body::Cylinder, future: Future::Known },
    Oracle { name: "true future, trunk and head", body: Body::TrunkAndHead, future: Future::Known },
    Oracle { name: "true future, upright body", body: Body::UprightMesh, future: Future::Known },
    Oracle {
        name: "trunk and head, constant velocity",
        body: Body::TrunkAndHead,
        future: Future::ConstantVelocity,
    },
    noisy("the same, errors 0.02 m, 0.05 m/s", 0.02, 0.05),
    noisy("the same, errors 0.03 m, 0.10 m/s", 0.03, 0.10),
    noisy("the same, errors 0.05 m, 0.13 m/s", 0.05, 0.13),
    noisy("the same, errors 0.08 m, 0.20 m/s", 0.08, 0.20),
];

const fn noisy(name: &'static str, position_m: f64, velocity_mps: f64) -> Oracle {
    Oracle { name, body: Body::TrunkAndHead, future: Future::Noisy { position_m, velocity_mps } }
}

const BOX_M: [f64; 2] = [0.28, 0.46];
const CYLINDER_M: [f64; 2] = [0.30, 0.50];
const TRUNK_M: [f64; 2] = [0.26, 0.56];
const HEAD_M: [f64; 2] = [0.20, 0.20];
/// Top of the shoulders, share of the height.
const SHOULDER_SHARE: f64 = 0.82;
/// Error of the height in the noisy rungs.
const HEIGHT_ERROR_M: f64 = 0.03;
/// How much of an error is still there a frame later.
const ERROR_KEPT: f64 = 0.9;

/// One scene on the ladder: sums to be pooled.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SceneLadder {
    /// By rung, then by access point.
    pub rungs: Vec<Vec<LinkCounts>>,
}

/// One figure of the report.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LadderRow {
    /// What is known.
    pub oracle: &'static str,
    /// The access point's name.
    pub access_point: String,
    /// Steps in the window.
    pub window: usize,
    /// Share of blocked instances.
    pub base_rate: Option<f64>,
    /// Precision over all instances.
    pub precision: Option<f64>,
    /// Recall over all instances.
    pub recall: Option<f64>,
    /// Over all instances.
    pub f1: Option<f64>,
    /// Over those in sight at `t_e`.
    pub onset_f1: Option<f64>,
}

/// Lets every oracle say its word on a scene that has been played; `truth` is what was so. `seed` is that of the
/// errors, the same for every rung, so that rungs differ by their sizes alone.
pub fn climb(scene: &Scene, truth: &SceneTruth, site: &Site, seed: u64) -> SceneLadder {
    let moments: Vec<Moment> =
        (1..=scene.frames() as i64).map(|k| Moment::new(scene.walkers(), k * STEP_NS)).collect();
    let rng = stream(seed, "ladder errors", 0);
    let errors = lasting_errors(moments.len(), scene.walkers().len(), ERROR_KEPT, rng);
    let play = Play { site, walkers: scene.walkers(), moments, errors };
    let instances = instances(&TruthIndex::new(truth));
    let counts = |oracle: &Oracle| {
        let said = play.ask(oracle).of_persons(&instances);
        LinkCounts::each(&instances, &said, site.access_points.len() as u32)
    };
    SceneLadder { rungs: ORACLES.iter().map(counts).collect() }
}

/// The figures of many scenes together.
pub fn rows(scenes: &[&SceneLadder], site: &Site) -> Vec<LadderRow> {
    let mut rows = Vec::new();
    for (rung, oracle) in ORACLES.iter().enumerate() {
        for (ap, access_point) in site.access_points.iter().enumerate() {
            let pooled = LinkCounts::pooled(&scenes.iter().map(|s| &s.rungs[rung][ap]).collect::<Vec<_>>());
            rows.extend(pooled.windows.iter().enumerate().map(|(i, counts)| LadderRow {
                oracle: oracle.name,
                access_point: access_point.name.clone(),
                window: i + 1,
                base_rate: counts.all.base_rate(),
                precision: counts.all.precision(),
                recall: counts.all.recall(),
                f1: counts.all.f1(),
                onset_f1: counts.onset.f1(),
            }));
        }
    }
    rows
}

/// Everybody at one instant; the index is the walker's.
struct Moment {
    states: Vec<Option<PersonState>>,
    /// Boxes of the walking bodies, seen from the ground point of each.
    boxes: Vec<Aabb>,
}

impl Moment {
    fn new(walkers: &[Walker], time_ns: i64) -> Self {
        let states: Vec<_> = walkers.iter().map(|walker| walker.state_at(time_ns)).collect();
        let mut mesh = Vec::new();
        let boxes = walkers.iter().zip(&states).map(|(walker, state)| {
            walker.mesh_at(time_ns, &mut mesh);
            let around = Aabb::around(mesh.iter().copied());
            state.map_or(Aabb::EMPTY, |state| around.moved_by(-state.position_m))
        });
        Self { boxes: boxes.collect(), states }
    }
}

/// Errors of one person's state in units of the rung's sizes: x, y, vx, vy, height.
type StateError = [f64; 5];

/// By frame, then by walker: normal with unit variance, of which the share `kept` is still there a frame later.
pub fn lasting_errors<const N: usize>(
    frames: usize,
    walkers: usize,
    kept: f64,
    mut rng: impl Rng,
) -> Vec<Vec<[f64; N]>> {
    let mut draw = || std::array::from_fn(|_| rng.sample(StandardNormal));
    let mut errors: Vec<Vec<[f64; N]>> = vec![(0..walkers).map(|_| draw()).collect()];
    let fresh = (1.0 - kept * kept).sqrt();
    for k in 1..frames {
        let later = errors[k - 1].iter().map(|old| {
            let new: [f64; N] = draw();
            std::array::from_fn(|i| kept * old[i] + fresh * new[i])
        });
        let later = later.collect();
        errors.push(later);
    }
    errors
}

/// A body where an oracle expects it.
enum Shape {
    Aabb(Aabb),
    Obb(Obb),
    Cylinder(EllipticCylinder),
    TrunkAndHead([EllipticCylinder; 2]),
    Mesh(BodyMesh),
}

impl Shape {
    fn blocks(&self, surface: &Surface, start: DVec3, end: DVec3) -> bool {
        match self {
            Self::Aabb(aabb) => slab::hit_aabb(aabb, start, end).is_some(),
            Self::Obb(obb) => slab::hit_obb(obb, start, end).is_some(),
            Self::Cylinder(cylinder) => cylinder.hit(start, end).is_some(),
            Self::TrunkAndHead(parts) => parts.iter().any(|part| part.hit(start, end).is_some()),
            Self::Mesh(mesh) => mesh.blocks(surface, start, end),
        }
    }
}

/// A scene with all its moments.
struct Play<'a> {
    site: &'a Site,
    walkers: &'a [Walker],
    moments: Vec<Moment>,
    errors: Vec<Vec<StateError>>,
}

impl Play<'_> {
    /// What an oracle says of every link at every instant that has its whole window.
    fn ask(&self, oracle: &Oracle) -> Said {
        // What an oracle of the known future says of an instant does not depend on when it is asked, unless it
        // carries along the box of `t_e`.
        let timeless = oracle.future == Future::Known && oracle.body != Body::Aabb;
        let at: Vec<Vec<bool>> = match timeless {
            true => (0..self.moments.len()).map(|k| self.cast(oracle, k, 0)).collect(),
            false => Vec::new(),
        };
        let mut said = Said::default();
        for now in 0..self.moments.len().saturating_sub(STEPS) {
            let steps: [Vec<bool>; STEPS] = std::array::from_fn(|i| match timeless {
                true => at[now + i + 1].clone(),
                false => self.cast(oracle, now, i + 1),
            });
            for (link, _) in steps[0].iter().enumerate() {
                let (ap, person) = (link / self.walkers.len(), link % self.walkers.len());
                let who = u64::from(self.walkers[person].trajectory.person);
                let blocked_at = steps.each_ref().map(|step| step[link]);
                said.add_link(now as u64, ap as u32, who, Prediction::from_steps(blocked_at));
            }
        }
        said
    }

    /// Which links the oracle expects to be blocked `step` steps after frame `now`: access points first, then
    /// walkers.
    fn cast(&self, oracle: &Oracle, now: usize, step: usize) -> Vec<bool> {
        let states: Vec<_> =
            (0..self.walkers.len()).map(|i| self.expected(oracle.future, now, step, i)).collect();
        let shapes: Vec<_> = states
            .iter()
            .enumerate()
            .map(|(i, state)| state.map(|state| self.shape(oracle.body, now, i, &state)))
            .collect();
        let mut blocked = Vec::with_capacity(self.site.access_points.len() * states.len());
        for access_point in &self.site.access_points {
            for (q, state) in states.iter().enumerate() {
                let ue = state.map(|s| {
                    let on_body = self.site.ue.on_body(s.position_m, s.heading_rad, s.height_m);
                    on_body + DVec3::Z * s.floor_m
                });
                let cut_by = |(p, shape): (usize, &Option<Shape>)| {
                    p != q
                        && shape.as_ref().zip(ue).is_some_and(|(shape, ue)| {
                            shape.blocks(self.walkers[p].surface(), access_point.position(), ue)
                        })
                };
                blocked.push(shapes.iter().enumerate().any(cut_by));
            }
        }
        blocked
    }

    /// Where an oracle expects a person who is there now.
    fn expected(&self, future: Future, now: usize, step: usize, walker: usize) -> Option<PersonState> {
        let state = self.moments[now].states[walker]?;
        let carried = |s: PersonState| PersonState {
            position_m: s.position_m + s.velocity_mps * (step as f64 * STEP_S),
            ..s
        };
        match future {
            Future::Known => self.moments.get(now + step)?.states[walker],
            Future::ConstantVelocity => Some(carried(state)),
            Future::Noisy { position_m, velocity_mps } => {
                let [x, y, vx, vy, height] = self.errors[now][walker];
                Some(carried(PersonState {
                    position_m: state.position_m + position_m * DVec2::new(x, y),
                    velocity_mps: state.velocity_mps + velocity_mps * DVec2::new(vx, vy),
                    height_m: state.height_m + HEIGHT_ERROR_M * height,
                    ..state
                }))
            }
        }
    }

    fn shape(&self, body: Body, now: usize, walker: usize, state: &PersonState) -> Shape {
        let cylinder = |[depth_m, width_m]: [f64; 2], bottom_m: f64, top_m: f64| EllipticCylinder {
            center_m: state.position_m,
            ahead: DVec2::from_angle(state.heading_rad),
            half_depth_m: depth_m / 2.0,
            half_width_m: width_m / 2.0,
            bottom_m: state.floor_m + bottom_m,
            top_m: state.floor_m + top_m,
        };
        match body {
            Body::Aabb => Shape::Aabb(self.moments[now].boxes[walker].moved_by(state.position_m)),
            Body::Obb => Shape::Obb(Obb {
                center_m: state.position_m.extend(state.floor_m + state.height_m / 2.0),
                half_m: DVec3::new(BOX_M[0], BOX_M[1], state.height_m) / 2.0,
                site_from_box: DMat3::from_rotation_z(state.heading_rad),
            }),
            Body::Cylinder => Shape::Cylinder(cylinder(CYLINDER_M, 0.0, state.height_m)),
            Body::TrunkAndHead => {
                let shoulder_m = SHOULDER_SHARE * state.height_m;
                let head = cylinder(HEAD_M, shoulder_m, state.height_m);
                Shape::TrunkAndHead([cylinder(TRUNK_M, 0.0, shoulder_m), head])
            }
            Body::UprightMesh => {
                let mut mesh = BodyMesh::new();
                mesh.update(self.walkers[walker].surface(), |vertices| {
                    self.walkers[walker].upright_mesh(state.position_m, state.heading_rad, vertices);
                });
                Shape::Mesh(mesh)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::scene::note_truth;
    use umbracast::Config;
    use umbracast_sim::crowd::{Preset, circle_crossing};

    #[test]
    fn knowing_more_of_the_body_scores_higher_and_errors_score_lower() {
        let site = Config::default().site;
        let mut scene = Scene::truth_only(circle_crossing(Preset::Orca03, 10, 12.5, 100_001), &site, 100_001);
        let mut truth = SceneTruth::default();
        while let Some(frame) = scene.next_frame() {
            note_truth(0, &frame, &mut truth);
        }
        let rows = rows(&[&climb(&scene, &truth, &site, 1)], &site);
        let f1 = |name: &str| {
            let found = |r: &&LadderRow| r.oracle.contains(name) && r.access_point == "side" && r.window == 3;
            rows.iter().find(found).unwrap().f1.unwrap()
        };
        assert!(f1("AABB") < f1("true future, trunk") && f1("true future, trunk") < f1("upright"));
        assert!(f1("0.08 m") < f1("0.03 m") && f1("0.03 m") < f1("constant velocity"));
        assert!(f1("upright") > 0.9, "{}", f1("upright"));
    }

    #[test]
    fn errors_have_unit_variance_and_hang_together() {
        let errors = lasting_errors::<5>(4000, 5, ERROR_KEPT, stream(3, "errors", 0));
        let mean = |of: &dyn Fn(usize, usize) -> f64| {
            (0..3999).flat_map(|k| (0..5).map(move |i| (k, i))).map(|(k, i)| of(k, i)).sum::<f64>() / 19_995.0
        };
        let variance = mean(&|k, i| errors[k][i][0].powi(2));
        let kept = mean(&|k, i| errors[k][i][2] * errors[k + 1][i][2]);
        assert!((variance - 1.0).abs() < 0.1 && (kept - 0.9).abs() < 0.1, "{variance} {kept}");
    }
}
