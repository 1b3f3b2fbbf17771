//! The command `umbracast`. Thin: it reads arguments, opens files, shows progress, and calls the crates.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong arguments, 3 done but data was lost or skipped (counted and named).

mod args;
mod ending;
mod setup;
mod say;
mod inputs;
mod run_json;
mod progress;
mod crowds;
mod flags;
mod page;
mod outward;
#[cfg(feature = "node")]
mod alive;
mod signal;
mod commands;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};

use args::{Cli, Command};
use ending::Ending;

/// Zenoh is 200 crates, which most users need not build.
#[cfg(not(feature = "node"))]
const NO_NODES: &str = "this program was built without the feature `node`, which stages on several hosts need; build it with \
                        `cargo build --release --features node`";

fn main() -> ExitCode {
    // SAFETY: nothing has begun yet, so there is no other thread.
    #[cfg(feature = "node")]
    unsafe {
        umbracast_node::runtime::widen();
    }
    let given = Cli::command().get_matches();
    let cli = Cli::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    if let Some((name, given)) = given.subcommand() {
        flags::without_effect(name, given).iter().for_each(|told| say::note(told));
    }
    let result = match cli.command.unwrap_or_default() {
        Command::Demo(args) => commands::demo::run(&args, &cli.common),
        Command::Simulate(args) => commands::simulate::run(&args, &cli.common),
        Command::Run(args) => commands::run::run(&args, &cli.common),
        Command::Cast(args) => commands::cast::run(&args, &cli.common),
        Command::Export(args) => commands::export::run(&args, &cli.common),
        Command::Live(args) => commands::live::run(&args, &cli.common),
        #[cfg(feature = "node")]
        Command::Node(args) => commands::node::run(&args, &cli.common),
        #[cfg(feature = "node")]
        Command::Fleet(args) => commands::fleet::run(&args, &cli.common),
        #[cfg(not(feature = "node"))]
        Command::Node(_) | Command::Fleet(_) => Err(umbracast::Error::new(NO_NODES)),
        Command::Check(args) => commands::check::run(&args, &cli.common),
        Command::Calibrate(args) => commands::calibrate::run(&args, &cli.common),
        Command::View(args) => commands::view::run(&args, &cli.common),
        Command::Replay(args) => commands::replay::run(&args, &cli.common),
        Command::Evaluate(args) => commands::evaluate::run(&args, &cli.common),
        Command::Compare(args) => commands::compare::run(&args, &cli.common),
        Command::Ablate(args) => commands::ablate::run(&args, &cli.common),
        Command::Coverage(args) => commands::coverage::run(&args, &cli.common),
        Command::Plan(args) => commands::plan::run(&args, &cli.common),
        Command::Network(args) => commands::network::run(&args, &cli.common),
        Command::Reproduce(args) => commands::reproduce::run(&args, &cli.common),
        Command::Inspect(args) => commands::inspect::run(&args, &cli.common),
        Command::Config(args) => commands::config::run(&args),
        Command::Train(args) => commands::train::run(&args, &cli.common),
    };
    match result {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Wrong) => ExitCode::FAILURE,
        Ok(Ending::Doubtful(what)) => {
            eprintln!("umbracast: done, but look at this before you use the result: {what}");
            ExitCode::from(3)
        }
        Ok(Ending::DataLost(what)) => {
            eprintln!("umbracast: done, but data was lost: {what}");
            ExitCode::from(3)
        }
        Err(error) => {
            eprintln!("umbracast: {error}");
            ExitCode::FAILURE
        }
    }
}
