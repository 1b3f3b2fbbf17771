//! Steps of one mode, for counting their instructions: `frame MODE` runs them and prints how many frames and links there were.
//! `valgrind --tool=callgrind --toggle-collect='*counted*'` counts what happens in [`counted`] alone.

use umbracast::forecast::Weights;
use umbracast::{Config, Frame, Mode, Pipeline};
use umbracast_bench::pipeline;
use umbracast_bench::simulated::crossing;

/// People are followed after so many frames; the rest are counted.
const BEFORE: usize = 30;
const FRAMES: usize = 50;

fn main() {
    let word = std::env::args().nth(1).expect("a mode");
    let mode = Mode::ALL.into_iter().find(|mode| mode.name() == word).expect("hdl, paper or default");
    let config = Config::for_mode(mode);
    let weights = (mode != Mode::Default).then(|| {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/paper_lstm.safetensors");
        Weights::from_safetensors(&std::fs::read(file).expect("the weights are there"))
            .expect("they are weights")
    });
    let hall = crossing(&config.site, 10, 12.5, FRAMES).expect("the default site is simulated");
    let (before, frames) = hall.frames.split_at(BEFORE);
    let mut pipeline = pipeline(&config, weights.as_ref(), &hall.empty, before).expect("the defaults work");
    let links = frames.iter().map(|frame| counted(&mut pipeline, frame)).sum::<usize>();
    println!("{} frames, {links} links", FRAMES - BEFORE);
}

#[inline(never)]
fn counted(pipeline: &mut Pipeline, frame: &Frame) -> usize {
    pipeline.step(frame).blockages.len()
}
