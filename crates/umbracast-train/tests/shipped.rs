//! The weights in `models/` are as good as their card says.

use umbracast::forecast::Weights;
use umbracast_sim::crowd::Preset;
use umbracast_train::Noise;
use umbracast_train::score::score;
use umbracast_train::windows::Ways;

#[test]
fn the_shipped_network_errs_as_its_card_says() {
    let weights =
        Weights::from_safetensors(include_bytes!("../../../models/paper_lstm.safetensors")).unwrap();
    // Scenes of the validation part, where the card has 1.8 mm at step 1 and 26.6 mm at step 9.
    let ways = Ways::simulate(&[(402, Preset::Orca03), (404, Preset::Orca03)], 10, 12.5);
    let scores = score(&weights, &ways.draw(1000, Noise { white_m: 0.0, lasting_m: 0.0 }, 1));
    assert!(scores.displacement_m[0] < 0.005, "{:?}", scores.displacement_m);
    assert!(scores.displacement_m[8] < 0.045, "{:?}", scores.displacement_m);
}
