//! From arguments to scenes: drawn crowds or recorded people.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use umbracast::geometry::DVec2;
use umbracast::{Error, Site};
use umbracast_eval::run::chain::{self, People, SceneSpec};
use umbracast_io::motion;
use umbracast_io::trajectories::{self, Options};
use umbracast_sim::body::Bodies;
use umbracast_sim::body::Gait;
use umbracast_sim::body::Meshes;
use umbracast_sim::crowd::Preset;
use umbracast_sim::crowd::floor::from_piece_m;
use umbracast_sim::crowd::{Recorded, move_apart, replay};

use crate::args::{BodyArgs, Replay};
use crate::say;

/// With `--centre`, who walks this near to the hall's middle, on the whole, is taken to be placed already: the middle of
/// an experiment is known better than that of noisy tracks.
const PLACED_M: f64 = 0.5;

/// Scenes, and what was done to them in words: a line each.
pub type Told = (Vec<SceneSpec>, Vec<String>);

/// Scenes of drawn crowds in the hall of a site.
pub fn drawn_scenes(
    site: &Site,
    presets: &[Preset],
    scenes: usize,
    people: usize,
    seed: u64,
) -> Result<Told, Error> {
    Ok((chain::scenes_in(site, presets, scenes, people, seed)?, Vec::new()))
}

/// One scene a file of recorded people, a group each; scene i has the seed `first_seed` + i. They keep their places and
/// their numbers; with `--centre` people who walk elsewhere are moved to the middle of the site's hall.
pub fn recorded_scenes(
    site: &Site,
    files: &[PathBuf],
    replayed: &Replay,
    first_seed: u64,
) -> Result<Told, Error> {
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
        let middle_m = trajectories::middle_m(&people).unwrap_or_default();
        let by_m = site.hall.middle_m() - DVec2::from_array(middle_m);
        let moved = replayed.centre && by_m.length() > PLACED_M;
        if moved {
            trajectories::shift(&mut people, by_m.to_array());
        }
        let recorded: Vec<Recorded> =
            people.iter().map(|p| Recorded { samples: &p.samples, height_m: p.height_m }).collect();
        let mut crowd = replay(&recorded, replayed.smooth).map_err(|e| e.within(file.display()))?;
        let apart_m = move_apart(&mut crowd);
        let numbers = people.iter().map(|person| u32::try_from(person.id));
        let numbers: Result<Vec<u32>, _> = numbers.collect();
        match numbers {
            Ok(numbers) => {
                crowd.trajectories.iter_mut().zip(numbers).for_each(|(way, number)| way.person = number)
            }
            Err(_) => say::note(&format!(
                "{}: people are numbered from 0: expected ids from 0 to {}, found others",
                file.display(),
                u32::MAX
            )),
        }
        let group = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let place = match moved {
            true => format!("moved by ({:.2}, {:.2}) m to the middle of the site", by_m.x, by_m.y),
            false => "where they were recorded".to_owned(),
        };
        // Below a centimetre nobody would see it.
        let room = match apart_m < 0.01 {
            true => String::new(),
            false => format!(", moved apart by up to {apart_m:.2} m, so that bodies do not overlap"),
        };
        let told = format!(
            "{group}, seed {seed}: {} people, {:.1} s, {place}{room}",
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
    let outside = |at: DVec2| !site.hall.contains(at);
    let in_pillar = |at: DVec2| {
        site.pillars.iter().any(|pillar| at.distance(DVec2::from_array(pillar.position_m)) < pillar.radius_m)
    };
    let in_furniture = |at: DVec2| site.furniture.iter().any(|piece| from_piece_m(piece, at) < 0.0);
    let told = |scene: &SceneSpec| {
        let crowd = scene.crowd();
        let count = |hits: &dyn Fn(DVec2) -> bool| {
            crowd.trajectories.iter().filter(|way| way.positions_m.iter().any(|at| hits(*at))).count()
        };
        let found = [
            (count(&outside), "leave the hall"),
            (count(&in_pillar), "walk through a pillar"),
            (count(&in_furniture), "walk through furniture"),
            (crowd.trajectories.iter().filter(|way| way.positions_m.is_empty()).count(), "never come in"),
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
    let gait = |file: &PathBuf| {
        let motion = motion::read(file)?;
        let gait = Gait::new(motion.frame_s, &motion.joints, &motion.positions);
        Ok(Arc::new(gait.map_err(|e| e.within(file.display()))?))
    };
    let gaits = args.gait.iter().map(gait).collect::<Result<Vec<_>, Error>>()?;
    let bodies = Bodies::new(args.bodies.clone(), gaits).map_err(|e| e.within("--bodies"))?;
    let meshes = meshes(&args.meshes)?;
    if !bodies.is_plain() {
        let shares = args.bodies.iter().map(|(kind, share)| format!("{}={share}", kind.name()));
        let mut shares = shares.collect::<Vec<_>>().join(",");
        let stem = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match args.gait.as_slice() {
            [] => {}
            [file] => shares += &format!(" of {}", stem(file)),
            [first, .., last] => {
                shares += &format!(" of {} from {} to {}", args.gait.len(), stem(first), stem(last));
            }
        }
        for scene in &mut scenes {
            scene.group += &format!(" {shares}");
            scene.bodies = bodies.clone();
        }
        told.push(format!("bodies by share: {shares}"));
    }
    if let Some(meshes) = meshes.map(Arc::new) {
        for scene in &mut scenes {
            scene.group += &format!(" meshes {}", meshes.name);
            scene.bodies = scene.bodies.clone().of(Arc::clone(&meshes));
        }
        told.push(format!("bodies by mesh: {} people of {}", meshes.len(), meshes.name));
    }
    Ok((scenes, told))
}

/// Whose bodies people have; `None` where measures are drawn.
fn meshes(name: &str) -> Result<Option<Meshes>, Error> {
    match name {
        "own" => Ok(None),
        "a" | "b" => Ok(Some(Meshes::family(name)?)),
        file => {
            let bytes = std::fs::read(file).map_err(|e| {
                Error::new(format!("--meshes: expected own, a, b or a file, found {file:?}: {e}"))
            })?;
            let stem = Path::new(file).file_stem().unwrap_or_default().to_string_lossy();
            Ok(Some(Meshes::read(&stem, &bytes).map_err(|e| e.within(file))?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    #[test]
    fn meshes_are_own_a_family_or_a_file_and_change_nobody_else() {
        let site = Config::default().site;
        let dressed = |meshes: &str| {
            let drawn = drawn_scenes(&site, &[Preset::Orca03], 1, 3, 200_000).unwrap();
            dressed(drawn, &BodyArgs { bodies: Vec::new(), gait: Vec::new(), meshes: meshes.to_owned() })
        };
        let (own, told) = dressed("own").unwrap();
        assert!(
            own[0].bodies == Bodies::default() && own[0].group == "orca-03" && told.is_empty(),
            "{told:?}"
        );
        let (b, told) = dressed("b").unwrap();
        assert_eq!(
            (b[0].group.as_str(), told),
            ("orca-03 meshes b", vec!["bodies by mesh: 16 people of b".to_owned()])
        );
        assert_ne!(b[0].bodies, own[0].bodies);
        let refused = dressed("no/such.glb").unwrap_err().to_string();
        assert!(refused.contains("expected own, a, b or a file, found \"no/such.glb\""), "{refused}");
    }

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
        let (drawn, _) = drawn_scenes(&site, &[Preset::Orca03, Preset::Mixed], 2, 10, 200_000).unwrap();
        assert!(through_walls(&drawn, &site).is_empty(), "crowds are drawn into the hall");
    }

    #[test]
    fn a_hall_that_the_circle_does_not_fit_has_its_people_within() {
        let mut site = Config::default().site;
        (site.hall.length_m, site.hall.width_m) = (20.0, 12.0);
        site.pillars.iter_mut().for_each(|pillar| pillar.position_m = pillar.position_m.map(|m| 0.3 * m));
        site.furniture.truncate(1);
        site.furniture[0].position_m = [0.0, 5.0];
        let (scenes, _) = drawn_scenes(&site, &[Preset::Orca03, Preset::Mixed], 2, 10, 200_000).unwrap();
        assert_eq!(through_walls(&scenes, &site), [""; 0]);
        let told = drawn_scenes(&site, &[Preset::Mixed], 1, 1000, 7).unwrap_err().to_string();
        assert!(told.contains("people: expected") && told.contains("found 1000"), "{told}");
    }
}
