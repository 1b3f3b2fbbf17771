//! From arguments to scenes: drawn crowds or recorded people.

use std::path::PathBuf;

use umbracast::Error;
use umbracast_eval::chain::{People, SceneSpec};
use umbracast_io::trajectories::{self, Options};
use umbracast_sim::crowd::replay::{Recorded, replay};

use crate::args::Replay;

/// One scene a file of recorded people; scene i has the seed `first_seed` + i. `group` names what scenes are
/// pooled with; without it each file stands alone.
pub fn recorded_scenes(
    files: &[PathBuf],
    replayed: &Replay,
    first_seed: u64,
    group: Option<&str>,
) -> Result<Vec<SceneSpec>, Error> {
    let options = Options { fps: replayed.fps, unit: Some(replayed.unit) };
    files
        .iter()
        .zip(first_seed..)
        .map(|(file, seed)| {
            let people = trajectories::read(file, options)?;
            let recorded: Vec<Recorded> =
                people.iter().map(|p| Recorded { samples: &p.samples, height_m: p.height_m }).collect();
            let crowd = replay(&recorded, replayed.smooth).map_err(|e| e.within(file.display()))?;
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Ok(SceneSpec { group: group.map_or(stem, str::to_owned), seed, people: People::Replayed(crowd) })
        })
        .collect()
}
