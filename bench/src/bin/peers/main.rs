//! Our side of the comparison with named peers: `peers ROW FOLDER` writes what the row works on to FOLDER, so that a peer
//! works on the same, times ours on it, and prints one JSON object. `bench/peers/run.py` calls this, then the peer.
//! Everything runs on one thread.

mod algorithm1;
mod assignment;
mod exchange;
mod bodies;
mod simulate;
mod links;
mod background;
mod forecast;
mod tracking;
mod orca;
mod reading;
mod loss;
mod screens;
mod paths;

use std::path::Path;

use exchange::Answer;

/// What one row does: its inputs go to the folder, its times into the answer.
type Row = fn(&Path) -> Answer;

/// Every row by name, in the order of the table, and the peers that are written in Rust as `ROW-PEER`.
const ROWS: [(&str, Row); 16] = [
    ("simulate", simulate::row),
    ("links", links::row),
    ("background", background::organised),
    ("unorganised", background::unorganised),
    ("tracking", tracking::row),
    ("forecast", forecast::row),
    ("forecast-multiply-adds", forecast::multiply_adds),
    ("algorithm1", algorithm1::row),
    ("algorithm1-listing", algorithm1::listing),
    ("assignment", assignment::row),
    ("assignment-pathfinding", assignment::pathfinding),
    ("orca", orca::row),
    ("orca-dodgy", orca::dodgy),
    ("reading", reading::row),
    ("loss", loss::row),
    ("paths", paths::row),
];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [name, folder] = &words[..] else {
        ROWS.iter().for_each(|(name, _)| println!("{name}"));
        return;
    };
    let row = ROWS.iter().find(|(row, _)| row == name).unwrap_or_else(|| panic!("no row is called {name}")).1;
    println!("{}", row(Path::new(folder)).json());
}
