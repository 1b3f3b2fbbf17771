//! The closed loop on a few tuning scenes.

use std::error::Error;

use rayon::prelude::*;
use umbracast::site::{AccessPoint, Handover, LossModel, Radio};
use umbracast::{Config, Mode};
use umbracast_network::device::{Network, Tally};
use umbracast_network::policy::Policy;
use umbracast_network::score::{Stage, bounds, judge};
use umbracast_network::truth::TruthModel;
use umbracast_sim::crowd::{Preset, strolling};

fn main() -> Result<(), Box<dyn Error>> {
    let number = |n: usize, usual: f64| std::env::args().nth(n).and_then(|a| a.parse().ok()).unwrap_or(usual);
    let (carrier_ghz, scenes, people, price_ms) =
        (number(1, 28.0), number(2, 3.0) as u64, number(3, 20.0) as usize, number(4, 30.0));
    let spread = number(5, 1.0) > 0.5;
    let model = match number(6, 0.0) as i32 {
        0 => LossModel::Kirchhoff,
        1 => LossModel::ModelBBody,
        2 => LossModel::ThreeEdges,
        _ => LossModel::ModelB,
    };
    let mut config = Config::for_mode(Mode::Default);
    let radio = Radio { carrier_ghz, fade_spread: spread, loss_model: model, ..Radio::default() };
    config.site.access_points = [[14.0, 0.0, 2.0], [0.0, 14.0, 3.0], [-14.0, 0.0, 3.0], [0.0, -14.0, 3.0]]
        .into_iter()
        .enumerate()
        .map(|(i, position_m)| AccessPoint { name: format!("ap{i}"), position_m, radio: Some(radio) })
        .collect();
    let stage = Stage::new(&config)?;
    let played: Vec<_> = (0..scenes)
        .into_par_iter()
        .map(|i| {
            let seed = 110_000 + i;
            let crowd = strolling(Preset::Orca03, people, 12.5, seed, 40);
            stage.play(crowd, seed, &TruthModel::ALL).map_err(|e| e.to_string())
        })
        .collect::<Result<_, _>>()?;
    for (i, (conditional, price_ms)) in
        [(true, 30.0), (true, 0.0), (true, 80.0), (false, 30.0), (false, 0.0), (false, 80.0)]
            .into_iter()
            .enumerate()
    {
        let brief = i > 0;
        let _ = price_ms;
        println!("conditional {conditional} price {price_ms}");
        let handover =
            Handover { price_ms: Some(price_ms), conditional: Some(conditional), ..Handover::default() };
        config.site.handover = Some(handover);
        for truth in 0..TruthModel::ALL.len() {
            println!("truth {}", TruthModel::ALL[truth].name());
            let row = |name: &str, tally: &Tally| {
                let minutes = tally.ticks as f64 / 6000.0;
                let mut rates = tally.rates_bps.clone();
                rates.sort_by(f32::total_cmp);
                let worst = rates.get(rates.len() / 100).copied().unwrap_or(0.0) / 1e9;
                println!(
                    "{name:20} outage {:5.2} % handovers {:5.2} recoveries {:5.2} lost {:5.2} pingpong {:5.2} needless {:4.2} worst {:.2}",
                    100.0 * tally.outage(),
                    tally.handovers as f64 / minutes,
                    tally.recoveries as f64 / minutes,
                    tally.lost_commands as f64 / minutes,
                    tally.ping_pongs as f64 / minutes,
                    tally.needless as f64 / tally.handovers.max(1) as f64,
                    worst
                );
                tally.outage()
            };
            let network = Network {
                radios: config.site.access_points.iter().map(|ap| ap.radio).collect(),
                costs: handover.costs(),
                seed: 1,
            };
            let sum = |of: &(dyn Fn(usize) -> Tally + Sync)| {
                let all: Vec<Tally> = (0..played.len()).into_par_iter().map(of).collect();
                all.iter().fold(Tally::default(), |mut sum, tally| {
                    sum.add(tally);
                    sum
                })
            };
            let mut outage = std::collections::BTreeMap::new();
            let policies = if brief {
                vec![
                    Policy::A3 { filter_s: 0.06, trigger_s: 0.04 },
                    Policy::Conditional { filter_s: 0.06, trigger_s: 0.04 },
                    Policy::Foreseen,
                ]
            } else {
                Policy::ALL.to_vec()
            };
            for policy in policies {
                let tally =
                    sum(&|s| judge(&network, &config, &played[s].traces[truth].1, &played[s].frames, policy));
                outage.insert(policy.name(), row(&policy.name(), &tally));
            }
            let best = row("oracle", &sum(&|s| bounds(&network, &played[s].traces[truth].1)[0].clone()));
            row("all at once", &sum(&|s| bounds(&network, &played[s].traces[truth].1)[1].clone()));
            let gap = |from: &str| (outage[from] - outage["forecast"]) / (outage[from] - best);
            println!("gap closed: A3 {:.2} conditional {:.2}", gap("A3 60/40"), gap("conditional 60/40"));
        }
    }
    Ok(())
}
