use super::*;
use crate::geometry::{DVec2, DVec3};

const LIGHT_MPS: f64 = 299_792_458.0;

/// Test vectors of 3GPP's model B at 28, 60 and 140 GHz, printed to 0.001 dB; three programs agree on them.
#[test]
fn model_b_is_that_of_the_standard() {
    let (ap_m, ue_m) = (DVec3::new(10.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 1.2));
    let at = |y: f64| Passage::new(ap_m, ue_m, DVec2::new(1.0, y), 0.0).unwrap();
    let cases = [
        (0.0, 0.3, 1.7, [11.957, 15.006, 18.520], [11.830, 14.871, 18.380]),
        (0.1, 0.3, 1.7, [9.023, 11.527, 14.674], [8.944, 11.446, 14.590]),
        (0.2, 0.3, 1.7, [1.849, 1.438, 1.012], [1.839, 1.433, 1.010]),
        (0.0, 0.5, 1.75, [15.217, 18.372, 21.948], [15.050, 18.198, 21.769]),
    ];
    for (y, width_m, top_m, leaning, upright) in cases {
        for (i, ghz) in [28.0, 60.0, 140.0].into_iter().enumerate() {
            let loss = |stand| model_b(LIGHT_MPS / (ghz * 1e9), &at(y), width_m, top_m, stand);
            assert!((loss(Stand::Leaning) - leaning[i]).abs() < 6e-4, "{y} {ghz}");
            assert!((loss(Stand::Upright) - upright[i]).abs() < 6e-4, "{y} {ghz}");
        }
    }
}

#[test]
fn a_body_beside_the_path_costs_nothing_far_away() {
    let (ap_m, ue_m) = (DVec3::new(10.0, 0.0, 3.0), DVec3::new(0.0, 0.0, 1.2));
    let passage = Passage::new(ap_m, ue_m, DVec2::new(5.0, 3.0), 0.0).unwrap();
    let wavelength_m = LIGHT_MPS / 28e9;
    let parts = [passage.rectangle(0.28, 0.0, 1.41), passage.rectangle(0.1, 1.41, 1.72)];
    assert!(model_b(wavelength_m, &passage, 0.5, 1.75, Stand::Upright) < 0.01);
    assert!(kirchhoff_mean(wavelength_m, &passage, &parts, 0.04).abs() < 0.02);
    assert!(double_knife_edge(wavelength_m, &passage, 0.5, Sum::Power).abs() < 0.2);
}

#[test]
fn edges_that_are_far_apart_lose_what_one_edge_does() {
    let (ap_m, ue_m) = (DVec3::new(4.0, 0.0, 1.2), DVec3::new(0.0, 0.0, 1.2));
    let passage = Passage::new(ap_m, ue_m, DVec2::new(2.0, 5.0), 0.0).unwrap();
    let wavelength_m = LIGHT_MPS / 60e9;
    // The path grazes the right edge of a screen that is ten metres wide.
    let of_edge = knife_edge(0.0);
    assert!((double_knife_edge(wavelength_m, &passage, 10.0, Sum::Coherent) - of_edge).abs() < 0.05);
    assert!((three_edges(wavelength_m, &passage, 10.0, 50.0, ThreeEdges::Average) - of_edge).abs() < 0.05);
    assert!(
        three_edges(wavelength_m, &passage, 10.0, 50.0, ThreeEdges::Minimum)
            <= three_edges(wavelength_m, &passage, 10.0, 50.0, ThreeEdges::Average)
    );
}
