//! What a million bodies cost a million links, in dB, from the places of both: the knife edges of ITU-R P.526 round the two
//! sides of a body, and round its sides and over its top.
//!
//! Ours is the public form of two models for many bodies, which is that of their formulas to 1e-4 dB; the losses of a frame come
//! from a table that is rougher and faster, and that the library keeps to itself. One peer is the same formula on arrays. The
//! other, Sionna RT, works on scenes and not on pairs, and has cases of its own (`screens.rs`).

use std::path::Path;

use umbracast::geometry::{DVec2, DVec3};
use umbracast::radio::{KnifeEdges, Passage};

use crate::exchange::{Answer, times, uniform, write_f64};
use crate::screens;

const PAIRS: usize = 1_000_000;
const TRIES: usize = 5;
/// Of 28 GHz.
pub const WAVELENGTH_M: f64 = 0.299_792_458 / 28.0;
/// A trunk with its arms, and how high a person is.
pub const WIDTH_M: f64 = 0.56;
pub const TOP_M: f64 = 1.72;
/// The hall is so wide and the access points hang so high; devices are held between these heights.
const HALL_M: f64 = 30.0;
pub const AP_M: f64 = 3.0;
pub const DEVICE_M: [f64; 2] = [0.9, 1.5];
/// Bodies stand so far beside the path, metres, and no nearer to its ends than this share of it.
pub const BESIDE_M: f64 = 1.0;
const END: f64 = 0.05;

struct Pair {
    tx_m: DVec3,
    rx_m: DVec3,
    foot_m: DVec2,
}

fn pairs() -> Vec<Pair> {
    let mut state = 1;
    let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut state);
    let mut pair = || {
        let tx_m = DVec3::new(between(0.0, HALL_M), between(0.0, HALL_M), AP_M);
        let rx_m = DVec3::new(between(0.0, HALL_M), between(0.0, HALL_M), between(DEVICE_M[0], DEVICE_M[1]));
        let way_m = (tx_m - rx_m).truncate();
        let aside = way_m.normalize_or(DVec2::X).perp() * between(-BESIDE_M, BESIDE_M);
        let foot_m = rx_m.truncate() + between(END, 1.0 - END) * way_m + aside;
        Pair { tx_m, rx_m, foot_m }
    };
    (0..PAIRS).map(|_| pair()).collect()
}

pub fn row(folder: &Path) -> Answer {
    let pairs = pairs();
    let flat = |of: fn(&Pair) -> Vec<f64>| -> Vec<f64> { pairs.iter().flat_map(of).collect() };
    write_f64(folder, "tx", &[PAIRS, 3], &flat(|pair| pair.tx_m.to_array().to_vec()));
    write_f64(folder, "rx", &[PAIRS, 3], &flat(|pair| pair.rx_m.to_array().to_vec()));
    write_f64(folder, "foot", &[PAIRS, 2], &flat(|pair| pair.foot_m.to_array().to_vec()));
    write_f64(folder, "constants", &[3], &[WAVELENGTH_M, WIDTH_M, TOP_M]);
    let mut answer = Answer::default();
    case(&mut answer, folder, "two edges", &pairs, None);
    case(&mut answer, folder, "three edges", &pairs, Some(TOP_M));
    screens::cases(&mut answer, folder);
    answer
}

/// A body that is not between the ends of a link costs it nothing.
fn case(answer: &mut Answer, folder: &Path, name: &str, pairs: &[Pair], top_m: Option<f64>) {
    let edges = KnifeEdges { wavelength_m: WAVELENGTH_M, width_m: WIDTH_M, top_m };
    let mut losses_db = Vec::new();
    let ms = times(
        TRIES,
        || (),
        |()| {
            losses_db.clear();
            let passage = |pair: &Pair| Passage::new(pair.tx_m, pair.rx_m, pair.foot_m, 0.0);
            edges.losses_db(pairs.iter().map(passage), &mut losses_db);
        },
    );
    write_f64(folder, name, &[PAIRS], &losses_db);
    let mean_db = losses_db.iter().sum::<f64>() / PAIRS as f64;
    answer.case(name, &ms, &[("mean, dB", mean_db), ("greatest difference, dB", 0.0)]);
}
