//! The loss models beside 2457 vectors that another program made (numpy and scipy).

mod real_data;

use std::collections::BTreeMap;

use umbracast::geometry::{DVec2, DVec3};
use umbracast::radio::models::{
    Stand, Sum, double_knife_edge, kirchhoff, kirchhoff_mean, model_b, model_b_of,
};
use umbracast::radio::{KnifeEdges, Passage};

#[test]
fn every_vector_is_met_to_a_thousandth_of_a_db() {
    let Some(path) = real_data::real_data("knife_edge/vectors.csv") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let cell = |name: &str| cells[names.iter().position(|n| *n == name).unwrap()];
        let number = |name: &str| cell(name).parse::<f64>().unwrap();
        let point = |end: &str| DVec3::from(["x", "y", "z"].map(|axis| number(&format!("{end}_{axis}_m"))));
        let foot_m = DVec2::new(number("body_x_m"), number("body_y_m"));
        let passage = Passage::new(point("tx"), point("rx"), foot_m, 0.0).unwrap();
        let wavelength_m = 299_792_458.0 / number("frequency_hz");
        let width_m = number("width_m");
        let parts = || {
            let (top_m, head_m) = (number("top_m"), 0.5 * number("head_width_m"));
            [
                passage.rectangle(0.5 * width_m, 0.0, top_m),
                passage.rectangle(head_m, top_m, number("head_top_m")),
            ]
        };
        let screen = |stand| model_b(wavelength_m, &passage, width_m, number("top_m"), stand);
        let two = |sum| double_knife_edge(wavelength_m, &passage, width_m, sum);
        let kind = cell("kind");
        let loss_db = match kind {
            "model_b_leaning" => screen(Stand::Leaning),
            "model_b_upright" => screen(Stand::Upright),
            "dked_coherent" => two(Sum::Coherent),
            "dked_power" => two(Sum::Power),
            "dked_max" => two(Sum::Stronger),
            "kirchhoff_trunk_head" => kirchhoff(wavelength_m, &passage, &parts()),
            "kirchhoff_trunk_head_mean_8cm" => kirchhoff_mean(wavelength_m, &passage, &parts(), 0.04),
            "model_b_trunk_head" => model_b_of(wavelength_m, &passage, &parts()),
            other => panic!("a kind that this test does not know: {other}"),
        };
        let expected_db = number("loss_db");
        assert!((loss_db - expected_db).abs() < 1e-3, "{line}: found {loss_db}");
        if kind == "dked_power" {
            let mut of_many_db = Vec::new();
            KnifeEdges { wavelength_m, width_m, top_m: None }.losses_db([Some(passage)], &mut of_many_db);
            assert!((of_many_db[0] - expected_db).abs() < 1e-3, "{line}: found {of_many_db:?}");
        }
        *counts.entry(kind.to_owned()).or_default() += 1;
    }
    assert_eq!(counts.values().sum::<usize>(), 2457, "{counts:?}");
    assert_eq!(counts.len(), 8, "{counts:?}");
}
