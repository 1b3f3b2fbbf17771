//! One frame through each stage and through all, with 10 and with 40 people who have been followed for two seconds.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use umbracast::Config;
use umbracast_bench::simulated::crossing;
use umbracast_bench::{Stages, pipeline};

/// The last of these is measured.
const FRAMES: usize = 21;

type Stage = (&'static str, fn(&mut Stages, &umbracast::Frame));

const STAGES: [Stage; 6] = [
    ("foreground", |stages, frame| stages.foreground(frame)),
    ("clusters", |stages, _| stages.clusters()),
    ("detections", |stages, _| stages.detections()),
    ("track update", |stages, frame| stages.update(frame)),
    ("forecast", |stages, _| stages.forecast()),
    ("cast", |stages, _| stages.cast()),
];

fn stages(criterion: &mut Criterion) {
    for people in [10, 40] {
        let config = Config::default();
        let hall = crossing(&config.site, people, 12.5, FRAMES).expect("the default site is simulated");
        let (before, frame) = (&hall.frames[..FRAMES - 1], &hall.frames[FRAMES - 1]);
        let mut stages = Stages::new(&config, &hall.empty).expect("the defaults work");
        before.iter().for_each(|frame| stages.step(frame));
        let whole = pipeline(&config, None, &hall.empty, before).expect("the defaults work");

        // Each stage begins where the one before has ended, from a copy, for it remembers.
        stages.expect(frame);
        let mut group = criterion.benchmark_group(format!("{people} people"));
        for (name, stage) in STAGES {
            group.bench_function(name, |bencher| {
                bencher.iter_batched_ref(
                    || stages.clone(),
                    |stages| stage(stages, frame),
                    BatchSize::PerIteration,
                );
            });
            stage(&mut stages, frame);
        }
        assert!(stages.tracks.len() >= people / 2, "people are followed");
        group.bench_function("step", |bencher| {
            bencher.iter_batched_ref(
                || whole.clone(),
                |pipeline| pipeline.step(frame).blockages.len(),
                BatchSize::PerIteration,
            );
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(30);
    targets = stages
}
criterion_main!(benches);
