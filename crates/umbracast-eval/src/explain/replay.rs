//! Runs the paper's stages 2 and 3 on the truth of a scene with a chosen error of stage 1.

use std::collections::{BTreeMap, VecDeque};

use rand::RngExt;
use umbracast::blockage::Caster;
use umbracast::config::{BlockageMethod, BoxKind, ForecastMethod, Rollout};
use umbracast::detect::{Detection, Measurer, Point};
use umbracast::forecast::{Forecast, Forecaster, Gaussian2, Weights};
use umbracast::geometry::{Aabb, DVec2, DVec3, Obb};
use umbracast::track::Track;
use umbracast::{Config, Error, Mode, STEPS, Site};
use umbracast_io::rows::PeopleLinkRow;
use umbracast_sim::body::Walker;
use umbracast_sim::crowd::Crowd;
use umbracast_sim::random::stream;
use umbracast_sim::scene::{Scene, SceneFrame};
use umbracast_sim::truth::BodyMesh;

use crate::oracle::ladder::lasting_errors;
use crate::oracle::replaced::true_track;
use crate::score::counts::Counts;
use crate::score::displacement::Displacement;
use crate::score::instances::{Instance, instances};
use crate::score::scene::{SceneTruth, TruthIndex, note_truth};

/// Every which instant is asked: neighbours are nearly equal.
const EVERY: u64 = 5;
/// Who is lost is lost for a second.
const LOST_FRAMES: u64 = 10;

/// How the tracks that stage 2 is fed with differ from the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// One standard deviation of the position, each axis.
    pub sigma_m: f64,
    /// How much of an error is still there a frame later: 0 is white.
    pub kept: f64,
    /// How long the track runs behind.
    pub late_s: f64,
}

impl Noise {
    /// Of this kind and so many times as large.
    #[must_use]
    pub fn times(self, size: f64) -> Self {
        Self { sigma_m: self.sigma_m * size, late_s: self.late_s * size, ..self }
    }
}

/// The box that stage 3 carries along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxModel {
    /// Along whose axes: extremes of the walking body at `t_e`, in the site's or in its own eigenvectors'.
    pub kind: BoxKind,
    /// Times the true width.
    pub scale: f64,
}

/// What the paper does not tell of its scenes.
#[derive(Debug, Clone)]
pub struct Surroundings {
    /// With the access points that are tried; nothing but people blocks.
    pub site: Site,
    /// How much wider than ours the bodies are whose truth is asked for.
    pub widths: Vec<f64>,
}

/// A scene that has been played.
#[derive(Debug)]
pub struct Replay {
    seed: u64,
    truth: SceneTruth,
    /// By frame and person.
    boxes: BTreeMap<(u64, u32), (Aabb, Obb)>,
    /// By width: what is asked, by frame.
    asked: Vec<BTreeMap<u64, Vec<Instance>>>,
}

/// What stage 2 made of the tracks at one instant.
#[derive(Debug, Clone)]
pub struct Foreseen {
    frame: u64,
    tracks: Vec<Track>,
    forecasts: Vec<Forecast>,
}

impl Replay {
    /// Plays a crowd.
    pub fn new(crowd: Crowd, around: &Surroundings, seed: u64) -> Self {
        let nobody = Site { access_points: Vec::new(), ..around.site.clone() };
        let mut scene = Scene::truth_only(crowd, &nobody, seed);
        let measurer = Measurer::new(&Config::for_mode(Mode::Paper).detect, &around.site);
        let (mut truth, mut boxes) = (SceneTruth::default(), BTreeMap::new());
        let mut mesh = Vec::new();
        let mut links = vec![Vec::new(); around.widths.len()];
        while let Some(frame) = scene.next_frame() {
            note_truth(0, &frame, &mut truth);
            for (links, &width) in links.iter_mut().zip(&around.widths) {
                note_links(scene.walkers(), &frame, &around.site, width, links);
            }
            for walker in scene.walkers().iter().filter(|_| frame.index % EVERY == 0) {
                if walker.mesh_at(frame.time_ns, &mut mesh) {
                    let Detection { aabb, obb, .. } = measure(&measurer, &mesh);
                    boxes.insert((frame.index, walker.trajectory.person), (aabb, obb));
                }
            }
        }
        let ask = |links| {
            let mut asked: BTreeMap<u64, Vec<Instance>> = BTreeMap::new();
            let truth = SceneTruth { people: truth.people.clone(), links };
            for instance in instances(&TruthIndex::new(&truth)) {
                if instance.frame % EVERY == 0 {
                    asked.entry(instance.frame).or_default().push(instance);
                }
            }
            asked
        };
        let asked = links.into_iter().map(ask).collect();
        Self { seed, truth, boxes, asked }
    }

    /// Stage 2 of the paper on tracks with this error.
    ///
    /// # Errors
    /// None once the weights are read.
    pub fn foresee(
        &self,
        noise: &Noise,
        rollout: Rollout,
        weights: &Weights,
    ) -> Result<Vec<Foreseen>, Error> {
        let index = TruthIndex::new(&self.truth);
        let frames = index.frames.last().map_or(0, |last| *last as usize + 1);
        let errors: Vec<Vec<[f64; 2]>> =
            lasting_errors(frames, index.persons.len(), noise.kept, stream(self.seed, "track errors", 0));
        let mut config = Config::for_mode(Mode::Paper).forecast;
        (config.method, config.rollout) = (ForecastMethod::Lstm, rollout);
        let mut forecaster = Forecaster::new(&config, Some(weights))?;
        let track = |frame: u64, place: usize, person: u32| {
            let row = index.person(frame, person)?;
            let mut track = true_track(&index, row, *self.boxes.get(&(frame, person))?);
            for (back, then) in track.observed.iter_mut().rev().enumerate() {
                let error = DVec2::from_array(errors[frame as usize - back][place]);
                then.position_m += noise.sigma_m * error - noise.late_s * then.velocity_mps;
            }
            let error_m = track.observed.back()?.position_m - track.position_m;
            track.position_m += error_m;
            track.aabb = track.aabb.moved_by(error_m);
            track.obb = track.obb.moved_by(error_m, 0.0);
            Some(track)
        };
        let foreseen = self.asked[0].keys().map(|&frame| {
            let people = index.persons.iter().enumerate();
            let tracks: Vec<Track> = people.filter_map(|(place, &p)| track(frame, place, p)).collect();
            let mut forecasts = Vec::new();
            forecaster.forecast(&tracks, &mut forecasts);
            Foreseen { frame, tracks, forecasts }
        });
        Ok(foreseen.collect())
    }

    /// How far people go: the displacement of a forecast that they stand still.
    pub fn standing_still(&self) -> Displacement {
        let index = TruthIndex::new(&self.truth);
        Displacement::of(&index, |frame, person| {
            let row = index.person(frame, person).filter(|_| frame % EVERY == 0)?;
            let mean_m = DVec2::new(row.x_m, row.y_m);
            Some([Gaussian2 { mean_m, ..Gaussian2::default() }; STEPS])
        })
    }

    /// How far the forecasts end from where people went.
    pub fn displacement(&self, foreseen: &[Foreseen]) -> Displacement {
        let steps: BTreeMap<(u64, u64), &[Gaussian2; STEPS]> = foreseen
            .iter()
            .flat_map(|at| at.forecasts.iter().map(|f| ((at.frame, f.track), &f.steps)))
            .collect();
        let of = |frame: u64, person: u32| steps.get(&(frame, u64::from(person))).map(|steps| **steps);
        Displacement::of(&TruthIndex::new(&self.truth), of)
    }

    /// Stage 3 of the paper, scored: by width, then by access point, then by window. Of the people the share
    /// `missed` is lost; they block nobody and count as predicted "not blocked".
    pub fn cast(
        &self,
        foreseen: &[Foreseen],
        body: &BoxModel,
        missed: f64,
        site: &Site,
    ) -> Vec<Vec<[Counts; STEPS]>> {
        let mut config = Config::for_mode(Mode::Paper).blockage;
        (config.method, config.person_box) = (BlockageMethod::Algorithm1, body.kind);
        let mut caster = Caster::new(&config, site);
        let mut counts = vec![vec![[Counts::default(); STEPS]; site.access_points.len()]; self.asked.len()];
        let mut blockages = Vec::new();
        for at in foreseen {
            let carried = |track: &Track| Track {
                confirmed: !self.misses(track.id, at.frame, missed),
                aabb: widened(&track.aabb, body.scale),
                obb: widened_obb(&track.obb, body.scale),
                observed: VecDeque::new(),
                ..track.clone()
            };
            let tracks: Vec<Track> = at.tracks.iter().map(carried).collect();
            caster.cast(&tracks, &at.forecasts, &mut blockages);
            let said: BTreeMap<(u32, u32), [bool; STEPS]> =
                blockages.iter().map(|b| ((b.access_point as u32, b.track as u32), b.blocked)).collect();
            for (counts, asked) in counts.iter_mut().zip(&self.asked) {
                for instance in asked.get(&at.frame).into_iter().flatten() {
                    let key = (instance.access_point, instance.person);
                    let said = said.get(&key).copied().unwrap_or([false; STEPS]);
                    for (w, counts) in (1..).zip(&mut counts[instance.access_point as usize]) {
                        counts.count(instance.blocked_within(w), said[w - 1]);
                    }
                }
            }
        }
        counts
    }

    /// Whether a person is lost, of whom a share is: for a second at a time.
    fn misses(&self, person: u64, frame: u64, share: f64) -> bool {
        let second = frame / LOST_FRAMES;
        stream(self.seed, "missed", person << 32 | second).random::<f64>() < share
    }
}

/// The links of a frame if everybody were `width` times as wide: arms and legs farther from the axis.
fn note_links(
    walkers: &[Walker],
    frame: &SceneFrame,
    site: &Site,
    width: f64,
    links: &mut Vec<PeopleLinkRow>,
) {
    let wider = |walker: &Walker| {
        let state = walker.state_at(frame.time_ns)?;
        let axis_m = state.position_m.extend(0.0);
        let mut mesh = BodyMesh::new();
        mesh.update(walker.surface(), |vertices| {
            walker.mesh_at(frame.time_ns, vertices);
            vertices.iter_mut().for_each(|v| *v = axis_m + (*v - axis_m) * DVec3::new(width, width, 1.0));
        });
        Some((mesh, walker.ue_m_at(&site.ue, frame.time_ns)?))
    };
    let bodies: Vec<_> = walkers.iter().map(wider).collect();
    for (access_point, at) in site.access_points.iter().enumerate() {
        for (own, walker) in walkers.iter().enumerate() {
            let Some((_, ue_m)) = &bodies[own] else { continue };
            let cuts = |(other, body): (usize, &Option<(BodyMesh, DVec3)>)| {
                let blocks = |(mesh, _): &(BodyMesh, DVec3)| {
                    mesh.blocks(walkers[other].surface(), at.position(), *ue_m)
                };
                other != own && body.as_ref().is_some_and(blocks)
            };
            links.push(PeopleLinkRow {
                scene: 0,
                frame: frame.index,
                time_ns: frame.time_ns,
                access_point: access_point as u32,
                person: walker.trajectory.person,
                blocked: bodies.iter().enumerate().any(cuts),
                static_blocked: false,
                self_blocked: None,
            });
        }
    }
}

/// The paper's boxes of a body, however many points and however large.
fn measure(measurer: &Measurer, mesh: &[DVec3]) -> Detection {
    let points: Vec<Point> =
        mesh.iter().map(|&position_m| Point { position_m, time_ns: 0, sensor: 0 }).collect();
    let all: Vec<u32> = (0..mesh.len() as u32).collect();
    measurer.detection(&points, &all, &[])
}

/// A box as high as it was and `scale` times as wide.
fn widened(aabb: &Aabb, scale: f64) -> Aabb {
    let (center_m, half_m) = (aabb.center_m(), aabb.size_m() / 2.0 * DVec3::new(scale, scale, 1.0));
    Aabb { min_m: center_m - half_m, max_m: center_m + half_m }
}

/// The same along its own axes: the one nearest to the vertical keeps its length.
fn widened_obb(obb: &Obb, scale: f64) -> Obb {
    let up = [obb.site_from_box.x_axis.z, obb.site_from_box.y_axis.z, obb.site_from_box.z_axis.z];
    let is_up = |axis: usize| up[axis].abs() > 0.8;
    let factor = DVec3::from_array(std::array::from_fn(|axis| if is_up(axis) { 1.0 } else { scale }));
    Obb { half_m: obb.half_m * factor, ..*obb }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::chain::CIRCLE_M;
    use umbracast::Config;
    use umbracast_sim::crowd::{Preset, circle_crossing};

    const WEIGHTS: &[u8] = include_bytes!("../../../../models/paper_lstm.safetensors");

    fn short_replay() -> (Replay, Surroundings) {
        let mut crowd = circle_crossing(Preset::Orca03, 5, CIRCLE_M, 100_001);
        crowd.duration_ns = 15_000_000_000;
        let mut site = Config::default().site;
        site.access_points.truncate(1);
        let around = Surroundings { site, widths: vec![1.0, 3.0] };
        (Replay::new(crowd, &around, 100_001), around)
    }

    const EXACT: Noise = Noise { sigma_m: 0.0, kept: 0.0, late_s: 0.0 };

    #[test]
    fn tracks_that_run_behind_err_by_the_way_walked_meanwhile() {
        let (replay, _) = short_replay();
        let weights = Weights::from_safetensors(WEIGHTS).unwrap();
        let off = |noise: &Noise| {
            let foreseen = replay.foresee(noise, Rollout::Mean, &weights).unwrap();
            replay.displacement(&foreseen).mean_m(1).unwrap()
        };
        let (exact, late) = (off(&EXACT), off(&Noise { late_s: 0.2, ..EXACT }));
        let walked = replay.standing_still().mean_m(2).unwrap();
        assert!(exact < 0.02 && (late - walked).abs() < 0.03, "{exact} {late} {walked}");
    }

    #[test]
    fn wider_bodies_block_more_and_who_is_lost_is_never_said_to_be_blocked() {
        let (replay, around) = short_replay();
        let weights = Weights::from_safetensors(WEIGHTS).unwrap();
        let foreseen = replay.foresee(&EXACT, Rollout::Mean, &weights).unwrap();
        let body = |scale| BoxModel { kind: BoxKind::Aabb, scale };
        let seen = replay.cast(&foreseen, &body(1.0), 0.0, &around.site);
        assert!(seen[0][0][8].base_rate() < seen[1][0][8].base_rate(), "{seen:?}");
        let said = |counts: &Counts| counts.true_positive + counts.false_positive;
        let wide = replay.cast(&foreseen, &body(3.0), 0.0, &around.site);
        assert!(said(&wide[0][0][8]) > said(&seen[0][0][8]));
        let lost = replay.cast(&foreseen, &body(3.0), 1.0, &around.site);
        assert_eq!(said(&lost[0][0][8]), 0);
    }

    #[test]
    fn a_widened_box_keeps_its_height_and_its_middle() {
        let upright = Obb {
            center_m: DVec3::new(1.0, 2.0, 0.9),
            half_m: DVec3::new(0.9, 0.2, 0.3),
            // The first axis is the vertical one.
            site_from_box: umbracast::geometry::DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y),
        };
        assert_eq!(widened_obb(&upright, 2.0).half_m, DVec3::new(0.9, 0.4, 0.6));
        let aabb = Aabb { min_m: DVec3::new(0.0, 0.0, 0.0), max_m: DVec3::new(0.4, 0.6, 1.8) };
        let wide = widened(&aabb, 0.5);
        assert!((wide.size_m() - DVec3::new(0.2, 0.3, 1.8)).length() < 1e-12);
        assert!((wide.center_m() - aabb.center_m()).length() < 1e-12);
    }
}
