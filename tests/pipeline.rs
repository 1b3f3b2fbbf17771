//! The page as a whole.

use umbracast::{Config, Frame, Mode, Pipeline};

#[test]
fn a_frame_that_is_not_later_is_counted_and_gives_nothing() {
    let mut pipeline = Pipeline::new(&Config::for_mode(Mode::Default), None).expect("needs no weights");
    let frame = |index: u64, time_ns: i64| Frame { index, time_ns, scans: Vec::new() };
    pipeline.step(&frame(0, 100_000_000));
    let outcome = pipeline.step(&frame(1, 100_000_000));
    assert_eq!((outcome.frame, outcome.health.frames_out_of_order), (1, 1));
    assert!(outcome.tracks.is_empty() && outcome.blockages.is_empty());
    assert_eq!(pipeline.step(&frame(2, 200_000_000)).health.frames_out_of_order, 1);
}
