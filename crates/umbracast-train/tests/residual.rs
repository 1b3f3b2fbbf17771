//! The residual network learns what can be learned, and runtime and trainer give the same values.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use umbracast::STEPS;
use umbracast::forecast::Residual;
use umbracast::forecast::inputs::Seen;
use umbracast::geometry::DVec2;
use umbracast_train::departures::Score;
use umbracast_train::residual::{FitOptions, Network, fit};
use umbracast_train::samples::Sample;

fn seen(rng: &mut Pcg64) -> Seen {
    let inputs = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
    Seen { ahead: DVec2::X, inputs, sigmas: [0.02, 0.02, 0.1, 0.1] }
}

/// People who speed up by half of what the first input says, whose track errs as the filter thinks.
fn sample(rng: &mut Pcg64) -> Sample {
    let seen = seen(rng);
    let mut draw = |sigma: f64| -> f64 { sigma * Distribution::<f64>::sample(&StandardNormal, &mut *rng) };
    let errors = seen.sigmas.map(&mut draw);
    let departure_m = std::array::from_fn(|step| {
        let t = step as f64 * 0.1;
        let along = 0.5 * f64::from(seen.inputs[0]) * t * t;
        [(along + errors[0] + errors[2] * t) as f32, (errors[1] + errors[3] * t) as f32]
    });
    Sample { seen, departure_m }
}

#[test]
fn a_law_is_learned_and_the_spread_is_honest() {
    let mut rng = Pcg64::seed_from_u64(1);
    let samples: Vec<Sample> = (0..4096).map(|_| sample(&mut rng)).collect();
    let held_out: Vec<Sample> = (0..2048).map(|_| sample(&mut rng)).collect();
    let weights = fit(&samples, FitOptions { seed: 1, epochs: 60 }, |_| {}).unwrap();
    // The samples keep to their law; the runtime believes half of what it learned of drawn crowds.
    let network = Residual::from_safetensors(&weights).unwrap().believing(1.0);
    let score = Score::of(&network, &held_out);
    let last = STEPS - 1;
    // 0.16 m of 0.20 m can be foreseen along; what the track errs cannot.
    assert!(score.displacement_m[last] < 0.8 * score.carried_on_m[last], "{score:?}");
    for step in 0..STEPS {
        assert!((score.within[0][step] - 0.5).abs() < 0.06, "{score:?}");
        assert!((score.within[1][step] - 0.9).abs() < 0.04, "{score:?}");
    }
}

#[test]
fn the_runtime_says_what_the_trainer_says() {
    let network = Network::fresh(3);
    let runtime = Residual::from_safetensors(&network.to_safetensors().unwrap()).unwrap();
    let seen = seen(&mut Pcg64::seed_from_u64(2));
    let signs = umbracast::forecast::inputs::mirror();
    let one = network.outputs(&seen.inputs.map(f64::from));
    let other = network.outputs(&std::array::from_fn(|i| f64::from(seen.inputs[i] * signs[i])));
    for (i, found) in runtime.outputs(&seen).into_iter().enumerate() {
        let mirrored = if (3..6).contains(&i) { -other[i] } else { other[i] };
        let expected = 0.5 * (one[i] + mirrored);
        assert!((f64::from(found) - expected).abs() < 1e-5, "output {i}: {found} and {expected}");
    }
}
