//! Scores of a run whose rows are there already, of one scene or several.

use std::collections::BTreeMap;

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Health};

use crate::run::pooled::{Scores, pool};
use crate::run::scene_score::{ModeRun, SceneScore, score_scene};
use crate::score::scene::{SceneRun, SceneTruth};

/// The rows of each scene.
pub type Scenes = BTreeMap<u32, (SceneTruth, SceneRun)>;

/// Rows of several scenes, sorted by their numbers.
///
/// # Errors
/// A scene of the run without its truth.
pub fn by_scene(truth: SceneTruth, run: SceneRun) -> Result<Scenes, Error> {
    let mut scenes = Scenes::new();
    for row in truth.people {
        scenes.entry(row.scene).or_default().0.people.push(row);
    }
    for row in truth.links {
        scenes.entry(row.scene).or_default().0.links.push(row);
    }
    for row in run.tracks {
        scenes.entry(row.scene).or_default().1.tracks.push(row);
    }
    for row in run.links {
        scenes.entry(row.scene).or_default().1.links.push(row);
    }
    match scenes.iter().find(|(_, (truth, _))| truth.people.is_empty()) {
        None => Ok(scenes),
        Some((number, _)) => {
            Err(Error::new(format!("expected the truth of every scene, found none of scene {number}")))
        }
    }
}

/// Their scores. What the whole run skipped (`health`) is told with its first scene.
///
/// # Errors
/// A mode whose forecast needs weights that do not fit.
pub fn score_scenes(
    config: &Config,
    scenes: &Scenes,
    mut health: Health,
    weights: &Weights,
) -> Result<Scores, Error> {
    let of_scene = |(&number, (truth, rows)): (&u32, &(SceneTruth, SceneRun))| {
        let run = ModeRun { config, rows, health: std::mem::take(&mut health) };
        score_scene(number, "recorded", truth, &[run], Some(weights), None)
    };
    let scores = scenes.iter().map(of_scene).collect::<Result<Vec<SceneScore>, _>>()?;
    let names: Vec<String> = config.site.access_points.iter().map(|ap| ap.name.clone()).collect();
    Ok(pool(&scores.iter().collect::<Vec<_>>(), &names))
}
