//! A simulated scene through the stages, for the fits that learn from what they make of it.

use umbracast::config::Config;
use umbracast::lidar::{Assembler, Frame};
use umbracast::{Error, Health, Outcome, Pipeline};
use umbracast_eval::run::chain::{empty_frames, push};
use umbracast_sim::scene::{Scene, SceneFrame};

/// Runs a scene through a pipeline that has learned the empty hall; `seed` is that of the noise in it. `truth` is called with every
/// frame as it is simulated, `see` with what the stages make of it.
///
/// # Errors
/// A setting that cannot work.
pub(crate) fn run(
    mut scene: Scene,
    config: &Config,
    seed: u64,
    mut truth: impl FnMut(&SceneFrame),
    mut see: impl FnMut(&Frame, &Outcome),
) -> Result<(), Error> {
    let mut pipeline = Pipeline::new(config, None)?;
    empty_frames(&config.site, seed)?.iter().for_each(|frame| pipeline.learn_empty(frame));
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    while let Some(now) = scene.next_frame() {
        truth(&now);
        push(&mut assembler, &now.packets, &mut health);
        while let Some(frame) = assembler.pop() {
            see(&frame, pipeline.step(&frame));
        }
    }
    Ok(())
}
