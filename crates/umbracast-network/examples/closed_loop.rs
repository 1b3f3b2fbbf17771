//! What forecasts of blockage gain a network: outage, changes, lost commands and recoveries of twenty people's devices under each
//! policy, and the share of the gap to the oracle that each policy closes.
//!
//! ```sh
//! cargo run --release -p umbracast-network --example closed_loop -- 120000 4 20
//! ```
//!
//! First seed, scenes, people. Radio truth is made by another model than the one that forecasts.

use std::error::Error;

use rand::RngExt;
use rayon::prelude::*;
use umbracast::site::{AccessPoint, Handover, Radio};
use umbracast::{Config, Mode};
use umbracast_network::device::{Network, Tally};
use umbracast_network::policy::Policy;
use umbracast_network::score::{Played, Stage, bounds, judge};
use umbracast_network::truth::TruthModel;
use umbracast_sim::crowd::{Preset, strolling};
use umbracast_sim::random::stream;

const CARRIERS_GHZ: [f64; 3] = [28.0, 60.0, 140.0];
const PLACES_M: [[f64; 3]; 4] = [[14.0, 0.0, 2.0], [0.0, 14.0, 3.0], [-14.0, 0.0, 3.0], [0.0, -14.0, 3.0]];
const SECONDS: u64 = 40;
const RADIUS_M: f64 = 12.5;
const RESAMPLED: usize = 2000;

/// A row of the table: one tally for each scene.
struct Row {
    name: String,
    scenes: Vec<Tally>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let number = |n: usize, usual: u64| std::env::args().nth(n).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (first, scenes, people) = (number(1, 120_000), number(2, 4), number(3, 20) as usize);
    println!(
        "{scenes} scenes of {people} people who stroll for {SECONDS} s, seeds from {first}, four access points; out from 10 dB \
         on, changes of 25 ms"
    );
    for carrier_ghz in CARRIERS_GHZ {
        let config = config(carrier_ghz);
        let stage = Stage::new(&config)?;
        let played: Vec<Played> = (first..first + scenes)
            .into_par_iter()
            .map(|seed| {
                let crowd = strolling(Preset::Orca03, people, RADIUS_M, seed, SECONDS);
                stage.play(crowd, seed, &[TruthModel::ModelB, TruthModel::Edges]).map_err(|e| e.to_string())
            })
            .collect::<Result<_, _>>()?;
        for truth in 0..played[0].traces.len() {
            println!("\n{carrier_ghz} GHz, truth by {}", played[0].traces[truth].0.name());
            table(&rows(&config, &played, truth));
        }
    }
    Ok(())
}

fn config(carrier_ghz: f64) -> Config {
    let mut config = Config::for_mode(Mode::Default);
    let radio = Some(Radio { carrier_ghz, ..Radio::default() });
    let place =
        |(i, position_m): (usize, [f64; 3])| AccessPoint { name: format!("ap{i}"), position_m, radio };
    config.site.access_points = PLACES_M.into_iter().enumerate().map(place).collect();
    config.site.handover = Some(Handover::default());
    config
}

fn rows(config: &Config, played: &[Played], truth: usize) -> Vec<Row> {
    let network = |config: &Config| Network {
        radios: config.site.access_points.iter().map(|ap| ap.radio).collect(),
        costs: config.site.handover.unwrap_or_default().costs(),
        seed: 1,
    };
    let row = |name: &str, of: &(dyn Fn(&Played) -> Tally + Sync)| Row {
        name: name.to_owned(),
        scenes: played.par_iter().map(of).collect(),
    };
    let by = |config: &Config, name: &str, policy: Policy| {
        let network = network(config);
        row(name, &|scene| judge(&network, config, &scene.traces[truth].1, &scene.frames, policy))
    };
    let mut commands = config.clone();
    commands.site.handover = Some(Handover { conditional: Some(false), ..Handover::default() });
    let mut rows: Vec<Row> = Policy::ALL.iter().map(|policy| by(config, &policy.name(), *policy)).collect();
    rows.push(by(&commands, "forecast, commands", Policy::Foreseen));
    for (i, name) in ["oracle", "all at once"].into_iter().enumerate() {
        let network = network(config);
        rows.push(row(name, &|scene| bounds(&network, &scene.traces[truth].1)[i].clone()));
    }
    rows
}

fn table(rows: &[Row]) {
    println!(
        "policy                outage %  changes  recoveries  lost commands  ping-pongs  needless  worst 1 % Gb/s  \
         gap to A3 closed      to conditional"
    );
    for row in rows {
        let mut all = Tally::default();
        row.scenes.iter().for_each(|tally| all.add(tally));
        let a_minute = |count: usize| count as f64 / (all.ticks as f64 / 6000.0);
        let mut rates = all.rates_bps.clone();
        rates.sort_by(f32::total_cmp);
        let worst = rates.get(rates.len() / 100).map_or("-".to_owned(), |bps| format!("{:.2}", bps / 1e9));
        let of = |name: &str| rows.iter().find(|row| row.name == name).map(|row| row.scenes.as_slice());
        let gap = |from: &str| match (of(from), of("oracle")) {
            (Some(from), Some(best)) => told(&gap_closed(from, &row.scenes, best)),
            _ => String::new(),
        };
        println!(
            "{:20} {:9.2} {:8.1} {:11.2} {:14.2} {:11.2} {:9.2} {:>15}  {:20} {}",
            row.name,
            100.0 * all.outage(),
            a_minute(all.handovers),
            a_minute(all.recoveries),
            a_minute(all.lost_commands),
            a_minute(all.ping_pongs),
            all.needless as f64 / all.handovers.max(1) as f64,
            worst,
            gap("A3 60/40"),
            gap("conditional 60/40"),
        );
    }
    println!(
        "changes, recoveries, lost commands and ping-pongs a device and minute; needless: share of changes"
    );
}

/// The share of the gap from one policy to the oracle that another closes, and its 95 % interval over scenes.
fn gap_closed(from: &[Tally], with: &[Tally], best: &[Tally]) -> [f64; 3] {
    let out = |of: &[Tally], picked: &[usize]| picked.iter().map(|&i| of[i].out_ticks as f64).sum::<f64>();
    let share =
        |picked: &[usize]| (out(from, picked) - out(with, picked)) / (out(from, picked) - out(best, picked));
    let all: Vec<usize> = (0..from.len()).collect();
    let mut rng = stream(1, "bootstrap", 0);
    let mut shares: Vec<f64> = (0..RESAMPLED)
        .map(|_| share(&all.iter().map(|_| rng.random_range(0..all.len())).collect::<Vec<_>>()))
        .collect();
    shares.sort_by(f64::total_cmp);
    [share(&all), shares[RESAMPLED / 40], shares[RESAMPLED - 1 - RESAMPLED / 40]]
}

fn told([share, low, high]: &[f64; 3]) -> String {
    format!("{share:.2} [{low:.2}, {high:.2}]")
}
