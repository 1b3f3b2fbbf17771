//! Reflections of halls without people beside the ray tracer Sionna RT 2.2, by examples/sionna/reflections.py: at 28 GHz, slabs as
//! thick as half spaces, mean power of both polarisations.

use umbracast::Config;
use umbracast::geometry::DVec3;
use umbracast::radio::{Surface, reflections};
use umbracast::site::{Hall, Material, Reflections};

const TABLE: &str = include_str!("data/sionna_reflections.csv");
const LIGHT_M_PER_NS: f64 = 0.299_792_458;

fn hall(name: &str) -> (Hall, Reflections) {
    use Material::{Brick, CeilingBoard, Chipboard, Concrete, Marble, Plasterboard, Plywood, Wood};
    let (outline_m, height_m, [walls, ceiling, floor]): (&[[f64; 2]], f64, _) = match name {
        "hall" => {
            (&[[-10.0, -6.0], [10.0, -6.0], [10.0, 6.0], [-10.0, 6.0]], 4.0, [Concrete, CeilingBoard, Wood])
        }
        "corridor" => {
            (&[[0.0, 0.0], [30.0, 0.0], [30.0, 3.0], [0.0, 3.0]], 2.8, [Plasterboard, Plywood, Marble])
        }
        _ => (
            &[[0.0, 0.0], [14.0, 0.0], [14.0, 5.0], [5.0, 5.0], [5.0, 12.0], [0.0, 12.0]],
            3.5,
            [Brick, Concrete, Chipboard],
        ),
    };
    let hall = Hall { outline_m: outline_m.to_vec(), height_m, ..Config::default().site.hall };
    (hall, Reflections { walls, ceiling, floor })
}

#[test]
fn delays_are_those_of_a_ray_tracer_within_a_tenth_of_a_nanosecond_and_gains_within_half_a_decibel() {
    let mut compared = [0; 2];
    for line in TABLE.lines().skip(1) {
        let (name, numbers) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        let (ap_m, ue_m) = (DVec3::from_slice(&numbers[..3]), DVec3::from_slice(&numbers[3..6]));
        let (hall, of) = hall(name);
        let ways = reflections(&hall, of, ap_m, ue_m);
        let agrees = |length_m: f64, excess_db: f64| {
            (length_m / LIGHT_M_PER_NS - numbers[6]).abs() < 0.1 && (excess_db - numbers[7]).abs() < 0.5
        };
        let ours = ways.iter().find(|way| agrees(way.length_m, way.excess_db));
        let Some(ours) = ours else { panic!("{line}: {ways:?}") };
        compared[usize::from(matches!(ours.surface, Surface::Wall(_)))] += 1;
        // Every way that we know is one that the tracer found.
        let places = &line[..line.rmatch_indices(',').nth(1).unwrap().0];
        let found = TABLE.lines().filter(|other| other.starts_with(places)).count();
        assert_eq!(found, ways.len(), "{line}: {ways:?}");
    }
    assert!(compared[0] >= 20 && compared[1] >= 40, "{compared:?}");
}
