//! Tests that no answer uses the future.

use umbracast::config::ForecastMethod;
use umbracast::lidar::{Assembler, Frame};
use umbracast::{Config, Health, Mode, Outcome, Pipeline};
use umbracast_eval::run::chain::{TEST_SEEDS, empty_frames, push};
use umbracast_sim::crowd::{Preset, circle_crossing};
use umbracast_sim::scene::Scene;

const FRAMES: usize = 30;
const CHANGED_FROM: usize = 22;

/// The frames of a crossing of six people.
fn frames(config: &Config, seed: u64) -> Vec<Frame> {
    let mut scene = Scene::new(circle_crossing(Preset::Orca03, 6, 5.0, seed), &config.site, seed).unwrap();
    let mut assembler = Assembler::new(&config.site).unwrap();
    for _ in 0..FRAMES {
        let frame = scene.next_frame().unwrap();
        push(&mut assembler, &frame.packets, &mut Health::default());
    }
    assembler.finish();
    std::iter::from_fn(|| assembler.pop()).take(FRAMES).collect()
}

fn outcomes(config: &Config, empty: &[Frame], frames: &[Frame]) -> Vec<Outcome> {
    let mut pipeline = Pipeline::new(config, None).unwrap();
    empty.iter().for_each(|frame| pipeline.learn_empty(frame));
    frames.iter().map(|frame| pipeline.step(frame).clone()).collect()
}

#[test]
fn other_frames_later_change_nothing_before() {
    let mut config = Config::for_mode(Mode::Default);
    config.forecast.method = ForecastMethod::Residual;
    let empty = empty_frames(&config.site, TEST_SEEDS).unwrap();
    let (one, mut other) = (frames(&config, 100_001), frames(&config, 100_002));
    other.splice(..CHANGED_FROM, one[..CHANGED_FROM].iter().cloned());
    let (expected, found) = (outcomes(&config, &empty, &one), outcomes(&config, &empty, &other));
    assert!(expected[CHANGED_FROM - 1].blockages.len() >= 10, "everybody is followed by then");
    for (k, (expected, found)) in expected.iter().zip(&found).enumerate() {
        assert_eq!(expected == found, k < CHANGED_FROM, "frame {k}");
    }
}
