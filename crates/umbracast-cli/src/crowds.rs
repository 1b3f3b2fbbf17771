//! From arguments to scenes: drawn crowds or recorded people.

use std::path::PathBuf;
use std::sync::Arc;

use umbracast::geometry::DVec2;
use umbracast::{Error, Site};
use umbracast_eval::run::chain::{People, SceneSpec};
use umbracast_io::bvh;
use umbracast_io::trajectories::{self, Options};
use umbracast_sim::body::Bodies;
use umbracast_sim::body::Gait;
use umbracast_sim::crowd::replay::{Recorded, replay};

use crate::args::{BodyArgs, Replay};
use crate::say;

/// Who walks this near to the site's middle, on the whole, is taken to be placed already: the middle of an
/// experiment is known better than that of noisy tracks.
const PLACED_M: f64 = 0.5;

/// Scenes, and what was done to them in words: a line each.
pub type Told = (Vec<SceneSpec>, Vec<String>);

/// One scene a file of recorded people, a group each; scene i has the seed `first_seed` + i. People who walk
/// elsewhere are moved to the middle of the site.
pub fn recorded_scenes(files: &[PathBuf], replayed: &Replay, first_seed: u64) -> Result<Told, Error> {
    if let Some(seconds) = replayed.seconds.filter(|seconds| seconds.is_nan() || *seconds <= 0.0) {
        return Err(Error::new(format!("--seconds: expected more than 0, found {seconds}")));
    }
    let scene = |(file, seed): (&PathBuf, u64)| {
        let options = Options { fps: replayed.fps, unit: replayed.unit };
        let mut people = trajectories::read(file, options)?;
        trajectories::without_effect(file, options)?.iter().for_each(|told| say::note(told));
        if let Some(seconds) = replayed.seconds {
            trajectories::keep_middle(&mut people, seconds);
            if people.is_empty() {
                let story = format!("expected people in its middle {seconds} s (--seconds), found nobody");
                return Err(Error::new(story).within(file.display()));
            }
        }
        let [x_m, y_m] = trajectories::middle_m(&people).unwrap_or_default();
        let moved = x_m.hypot(y_m) > PLACED_M;
        if moved {
            trajectories::shift(&mut people, [-x_m, -y_m]);
        }
        let recorded: Vec<Recorded> =
            people.iter().map(|p| Recorded { samples: &p.samples, height_m: p.height_m }).collect();
        let crowd = replay(&recorded, replayed.smooth).map_err(|e| e.within(file.display()))?;
        let group = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let place = match moved {
            true => format!("moved by ({:.2}, {:.2}) m to the middle of the site", -x_m, -y_m),
            false => "where they were recorded".to_owned(),
        };
        let told = format!(
            "{group}, seed {seed}: {} people, {:.1} s, {place}",
            people.len(),
            crowd.duration_ns as f64 * 1e-9
        );
        Ok((SceneSpec { group, seed, people: People::Replayed(crowd), bodies: Bodies::default() }, told))
    };
    Ok(files.iter().zip(first_seed..).map(scene).collect::<Result<Vec<_>, Error>>()?.into_iter().unzip())
}

/// Who walks where the site has none, in words: a line for each scene where somebody does. Sensors see them there, and
/// walls hide them, which no recording meant.
pub fn through_walls(scenes: &[SceneSpec], site: &Site) -> Vec<String> {
    let half_m = 0.5 * DVec2::new(site.hall.length_m, site.hall.width_m);
    let outside = |at: DVec2| at.abs().cmpgt(half_m).any();
    let in_pillar = |at: DVec2| {
        site.pillars.iter().any(|pillar| at.distance(DVec2::from_array(pillar.position_m)) < pillar.radius_m)
    };
    let in_furniture = |at: DVec2| {
        site.furniture.iter().any(|box_| {
            let turned = DVec2::from_angle(-box_.yaw_deg.to_radians());
            let from_middle = turned.rotate(at - DVec2::from_array(box_.position_m));
            from_middle.abs().cmplt(0.5 * DVec2::new(box_.size_m[0], box_.size_m[1])).all()
        })
    };
    let told = |scene: &SceneSpec| {
        let crowd = scene.crowd();
        let count = |hits: &dyn Fn(DVec2) -> bool| {
            crowd.trajectories.iter().filter(|way| way.positions_m.iter().any(|at| hits(*at))).count()
        };
        let found = [
            (count(&outside), "leave the hall"),
            (count(&in_pillar), "walk through a pillar"),
            (count(&in_furniture), "walk through furniture"),
        ];
        let found = found.iter().filter(|(people, _)| *people > 0);
        let found: Vec<String> = found.map(|(people, where_)| format!("{people} {where_}")).collect();
        let (group, seed, people) = (&scene.group, scene.seed, crowd.trajectories.len());
        (!found.is_empty()).then(|| format!("{group}, seed {seed}: of {people} people {}", found.join(", ")))
    };
    scenes.iter().filter_map(told).collect()
}

/// Gives everybody in every scene a body of these kinds, and tells it.
pub fn dressed((mut scenes, mut told): Told, args: &BodyArgs) -> Result<Told, Error> {
    let gait = match &args.gait {
        None => None,
        Some(file) => {
            let motion = bvh::read(file)?;
            let gait = Gait::new(motion.frame_s, &motion.joints, &motion.positions);
            Some(Arc::new(gait.map_err(|e| e.within(file.display()))?))
        }
    };
    let bodies = Bodies::new(args.bodies.clone(), gait).map_err(|e| e.within("--bodies"))?;
    if !bodies.is_plain() {
        let shares = args.bodies.iter().map(|(kind, share)| format!("{}={share}", kind.name()));
        let mut shares = shares.collect::<Vec<_>>().join(",");
        if let Some(file) = args.gait.as_ref().and_then(|file| file.file_stem()) {
            shares += &format!(" of {}", file.to_string_lossy());
        }
        for scene in &mut scenes {
            scene.group += &format!(" {shares}");
            scene.bodies = bodies.clone();
        }
        told.push(format!("bodies by share: {shares}"));
    }
    Ok((scenes, told))
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;
    use umbracast_eval::run::chain::drawn_scenes;
    use umbracast_sim::crowd::Preset;

    #[test]
    fn who_walks_through_walls_is_counted() {
        let site = Config::default().site;
        let scenes = |samples: &[[f64; 3]]| {
            let crowd = replay(&[Recorded { samples, height_m: None }], 0.0).unwrap();
            let (group, bodies) = ("file".to_owned(), Bodies::default());
            [SceneSpec { group, seed: 7, people: People::Replayed(crowd), bodies }]
        };
        let out = scenes(&[[0.0, 14.0, 0.0], [4.0, 18.0, 0.0]]);
        assert_eq!(through_walls(&out, &site), ["file, seed 7: of 1 people 1 leave the hall"]);
        let things = scenes(&[[0.0, 11.5, 10.0], [4.0, 11.5, 12.0], [14.0, 16.0, 9.0]]);
        let told = ["file, seed 7: of 1 people 1 walk through a pillar, 1 walk through furniture"];
        assert_eq!(through_walls(&things, &site), told);
        let drawn = drawn_scenes(&[Preset::Orca03, Preset::Mixed], 2, 10, 200_000);
        assert!(through_walls(&drawn, &site).is_empty(), "crowds are drawn into the hall");
    }
}
