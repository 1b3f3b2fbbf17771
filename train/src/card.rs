//! The card beside a weights file.

use umbracast::STEPS;
use umbracast::forecast::lstm::{RHO_LIMIT, SIGMA_FLOOR_M, SIGMA_SCALE_M};
use umbracast_sim::crowd::Preset;
use umbracast_train::score::Scores;

use crate::train::TrainOptions;

/// The card as Markdown.
pub fn write(options: &TrainOptions, losses: &[[f64; 2]], scores: &[(Preset, Scores)]) -> String {
    let presets: Vec<&str> = options.presets.iter().map(|preset| preset.name()).collect();
    let epochs: String = losses
        .iter()
        .enumerate()
        .map(|(epoch, [training, validation])| {
            format!("| {} | {training:.3} | {validation:.3} |\n", epoch + 1)
        })
        .collect();
    format!(
        "# Trajectory LSTM\n\n\
         The network of the paper's section IV-B: embedding {embedded}, hidden {units}, one LSTM cell, one linear \
         head; input metres per frame of 100 ms; nine observed displacements, then fed with its own mean.\n\n\
         - Tensors: PyTorch's names and order of gates (i f g o), f32.\n\
         - Head: mu_x, mu_y, then sigma = {floor} + {scale} softplus(raw) m for x and y, rho = {limit} tanh(raw).\n\
         - Data: ORCA ways without bodies or sensors, presets {presets} in turn, {people} people on a circle of \
         {radius} m, scene seeds {first} to {last}; the first 60 % of the scenes trained on, the others validated on.\n\
         - Noise on observed positions, up to: white {white} m, lasting {lasting} m.\n\
         - Training: seed {seed}, {count} epochs of {windows} windows drawn at random, batches of {batch}, negative \
         log-likelihood, Adam from {rate} to zero along half a cosine, gradients clipped at {clip}.\n\
         - Commit: {commit}.\n\n\
         ## Scores on validation windows, exact positions\n\n\
         | step | {steps} |\n|---|{rule}|\n{tables}\n\
         ## Negative log-likelihood of a displacement\n\n\
         | epoch | training | validation |\n|---|---|---|\n{epochs}",
        embedded = options.size.embedded,
        units = options.size.units,
        floor = SIGMA_FLOOR_M,
        scale = SIGMA_SCALE_M,
        limit = RHO_LIMIT,
        presets = presets.join(", "),
        people = options.people,
        radius = options.radius_m,
        first = options.scenes.start,
        last = options.scenes.end - 1,
        white = options.noise.white_m,
        lasting = options.noise.lasting_m,
        seed = options.seed,
        count = losses.len(),
        windows = options.windows_per_epoch,
        batch = options.batch,
        rate = options.learning_rate,
        clip = options.clip,
        commit = if options.commit.is_empty() { "unknown" } else { &options.commit },
        steps = (1..=STEPS).map(|i| i.to_string()).collect::<Vec<_>>().join(" | "),
        rule = ["---"; STEPS].join("|"),
        tables = scores.iter().map(|(preset, scores)| table(preset.name(), scores)).collect::<String>(),
    )
}

fn table(preset: &str, scores: &Scores) -> String {
    format!(
        "| {preset}: displacement error, mm | {} |\n\
         | {preset}: last displacement repeated, mm | {} |\n\
         | {preset}: displacements within the 90 % ellipse | {} |\n",
        row(&scores.displacement_m, 1000.0, 1),
        row(&scores.repeated_m, 1000.0, 1),
        row(&scores.within_90, 1.0, 2),
    )
}

fn row(values: &[f64], scale: f64, digits: usize) -> String {
    values.iter().map(|value| format!("{:.digits$}", value * scale)).collect::<Vec<_>>().join(" | ")
}
