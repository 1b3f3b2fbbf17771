//! `demo`: one scene, every stage, every mode, scores and report.

use umbracast::{Config, Error, Mode};
use umbracast_eval::report;
use umbracast_eval::run::chain;

use crate::args::{Common, Demo};
use crate::commands::evaluate;
use crate::ending::Ending;
use crate::say;
use crate::setup::{self, TEST_SEED};

/// Simulates one test scene in memory and reports on it.
pub fn run(args: &Demo, common: &Common) -> Result<Ending, Error> {
    let configs = Mode::ALL
        .into_iter()
        .map(|mode| setup::config(mode, args.site.site.as_deref()))
        .collect::<Result<Vec<Config>, _>>()?;
    let seed = args.crowd.seed.unwrap_or(TEST_SEED);
    if !common.json {
        let (preset, people) = (args.crowd.preset.name(), args.crowd.people);
        let sensors = configs[0].site.sensors.len();
        say::line(format_args!(
            "One scene ({preset}, seed {seed}): {people} people walk, {sensors} LiDAR(s) see them, every mode predicts which \
             links they block.\n"
        ));
    }
    let scenes = chain::scenes_in(&configs[0].site, &[args.crowd.preset], 1, args.crowd.people, seed)?;
    let weights = setup::weights(None)?;
    let scores = evaluate::in_memory(configs, weights, (scenes, Vec::new()), Some(&args.out), common)?;
    if !common.json
        && let Some(verdict) = report::verdict(&scores)
    {
        say::line(format_args!("\n{verdict}"));
    }
    if !common.json && cfg!(feature = "serve") {
        say::line("\nTo see people move and links break as they do: umbracast live --demo");
    }
    Ok(Ending::Done)
}
