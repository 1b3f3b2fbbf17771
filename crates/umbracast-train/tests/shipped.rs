//! The weights in `models/` are as good as their card says: no worse, and no better either, for a network that errs less than its
//! card is another network.

use umbracast::STEPS;
use umbracast::forecast::Weights;
use umbracast_sim::crowd::Preset;
use umbracast_train::Noise;
use umbracast_train::score::{Scores, score};
use umbracast_train::windows::Ways;

const CARD: &str = include_str!("../../../models/paper_lstm.md");
/// How far windows of ten scenes may be from the card's, which are of two hundred: a share of the card's error. Repeating the last
/// step errs a fifth to two thirds as much as the network, so neither passes for the other where they differ most.
const SHARE: f64 = 0.5;
/// With noise the network errs by half as much as repeating the last step.
const WORTH: f64 = 0.7;
/// The card has tenths of a millimetre.
const ROUNDED_M: f64 = 0.0001;

/// Of scenes of the part that the network was validated on.
fn scores(noise: Noise) -> Scores {
    let weights =
        Weights::from_safetensors(include_bytes!("../../../models/paper_lstm.safetensors")).unwrap();
    let scenes: Vec<(u64, Preset)> = (0..10).map(|k| (402 + 2 * k, Preset::Orca03)).collect();
    score(&weights, &Ways::simulate(&scenes, 10, 12.5).draw(500, noise, 1))
}

/// A line of the card's table, millimetres, in metres.
fn card(name: &str) -> [f64; STEPS] {
    let line = CARD.lines().find_map(|line| line.strip_prefix(&format!("| orca-03: {name}, mm |")));
    let cells: Vec<f64> = line
        .unwrap()
        .split('|')
        .filter_map(|cell| cell.trim().parse().ok())
        .map(|mm: f64| mm / 1000.0)
        .collect();
    cells.try_into().unwrap()
}

#[test]
fn the_shipped_network_errs_as_its_card_says_and_so_does_repeating_the_last_step() {
    let found = scores(Noise { white_m: 0.0, lasting_m: 0.0 });
    for (name, found) in
        [("displacement error", found.displacement_m), ("last displacement repeated", found.repeated_m)]
    {
        for (step, (found, card)) in found.iter().zip(card(name)).enumerate() {
            let apart = (found - card).abs();
            assert!(apart < SHARE * card + ROUNDED_M, "{name}, step {}: {found}, card {card}", step + 1);
        }
    }
}

/// On exact positions repeating the last step is hard to beat, and the network does not: its card says so. A tracker's positions
/// are not exact, and there the network must be worth having.
#[test]
fn on_positions_as_a_tracker_gives_them_the_shipped_network_beats_repeating_the_last_step() {
    let found = scores(Noise { white_m: 0.03, lasting_m: 0.0 });
    for (step, (network, repeated)) in found.displacement_m.iter().zip(found.repeated_m).enumerate() {
        assert!(*network < WORTH * repeated, "step {}: {network}, repeated {repeated}", step + 1);
    }
}
