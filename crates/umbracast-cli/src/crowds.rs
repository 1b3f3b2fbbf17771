//! From arguments to scenes: drawn crowds or recorded people.

use std::path::PathBuf;
use std::sync::Arc;

use umbracast::Error;
use umbracast_eval::chain::{People, SceneSpec};
use umbracast_io::bvh;
use umbracast_io::trajectories::{self, Options};
use umbracast_sim::body::Gait;
use umbracast_sim::body::kind::Bodies;
use umbracast_sim::crowd::replay::{Recorded, replay};

use crate::args::{BodyArgs, Replay};

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
        if let Some(seconds) = replayed.seconds {
            trajectories::keep_middle(&mut people, seconds);
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
