//! A thousand tracks and a thousand detections, each pair with a cost: the assignment of least sum.

use std::path::Path;

use pathfinding::prelude::{Matrix, kuhn_munkres_min};
use umbracast::track::association::{Assignment, FORBIDDEN};

use crate::exchange::{Answer, times, uniform, write_f64};

const SIDE: usize = 1000;
/// People on a square this wide, metres, and how far a detection may be from its track.
const HALL_M: f64 = 130.0;
const GATE_M: f64 = 1.5;
/// The peer with whole numbers gets millionths.
const PARTS: f64 = 1e6;

/// Dense: anything goes with anything. Gated: squared distances, less the gate's, so that only pairs below zero count.
fn cases() -> [(&'static str, Vec<f64>); 2] {
    let mut state = 1;
    let dense = (0..SIDE * SIDE).map(|_| uniform(&mut state) - 2.0).collect();
    let mut places = || -> Vec<[f64; 2]> {
        (0..SIDE).map(|_| [HALL_M * uniform(&mut state), HALL_M * uniform(&mut state)]).collect()
    };
    let (tracks_m, noise) = (places(), places());
    let near = |(t, n): (&[f64; 2], &[f64; 2])| [0, 1].map(|k| t[k] + 0.6 * (n[k] / HALL_M - 0.5));
    let detections_m: Vec<[f64; 2]> = tracks_m.iter().zip(&noise).map(near).collect();
    let cost = |t: &[f64; 2], d: &[f64; 2]| {
        let cost = (t[0] - d[0]).powi(2) + (t[1] - d[1]).powi(2) - GATE_M * GATE_M;
        if cost < 0.0 { cost } else { FORBIDDEN }
    };
    let gated = tracks_m.iter().flat_map(|t| detections_m.iter().map(move |d| cost(t, d))).collect();
    [("dense", dense), ("gated", gated)]
}

fn sum(costs: &[f64], pairs: impl Iterator<Item = (usize, usize)>) -> f64 {
    pairs.map(|(row, column)| costs[row * SIDE + column]).filter(|cost| cost.is_finite()).sum()
}

/// Ours, with the memory that the tracker keeps from frame to frame.
pub fn row(folder: &Path) -> Answer {
    let mut answer = Answer::default();
    for (name, costs) in cases() {
        write_f64(folder, name, &[SIDE, SIDE], &costs);
        let mut assignment = Assignment::default();
        let ms = times(5, || (), |()| assignment.of_matrix(&costs, SIDE));
        let pairs = assignment.column_of.iter().enumerate().filter_map(|(r, c)| c.map(|c| (r, c)));
        answer.case(name, &ms, &[("sum", sum(&costs, pairs))]);
    }
    answer
}

/// The crate `pathfinding`, which knows no forbidden pairs: they cost nothing, and so does a row left alone.
pub fn pathfinding(_: &Path) -> Answer {
    let mut answer = Answer::default();
    for (name, costs) in cases() {
        let whole = costs.iter().map(|cost| (cost.min(0.0) * PARTS).round() as i64).collect();
        let weights = Matrix::from_vec(SIDE, SIDE, whole).expect("the matrix is square");
        let mut columns = Vec::new();
        let ms = times(2, || (), |()| columns = kuhn_munkres_min(&weights).1);
        answer.case(name, &ms, &[("sum", sum(&costs, columns.iter().copied().enumerate()))]);
    }
    answer
}
