//! Flags without effect beside the other flags. The command notes them and goes on.

use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory};
use umbracast_sim::body::kind::Kind;

use crate::args::Cli;

/// A line for each flag of a command that was given in vain.
pub fn without_effect(name: &str, command: &ArgMatches) -> Vec<String> {
    // The matches know which flags there are in debug builds alone.
    let cli = Cli::command();
    let flags: Vec<&str> = cli
        .find_subcommand(name)
        .into_iter()
        .flat_map(|c| c.get_arguments().map(|flag| flag.get_id().as_str()))
        .collect();
    let takes = |flag: &str| flags.contains(&flag);
    let given = |flag: &str| takes(flag) && command.value_source(flag) == Some(ValueSource::CommandLine);
    let mut told = Vec::new();
    let mut idle = |flags: &[&str], why: &str| {
        let in_vain = flags.iter().filter(|flag| given(flag));
        told.extend(in_vain.map(|flag| format!("--{} has no effect {why}", flag.replace('_', "-"))));
    };
    const REPLAY: [&str; 5] = ["fps", "unit", "smooth", "seconds", "centre"];
    if given("dir") {
        let done = "on a run that is done: nothing is simulated";
        idle(&["preset", "people", "seed", "bodies", "gait", "meshes"], done);
        idle(&REPLAY, done);
        if command.get_one::<PathBuf>("dir").is_some_and(|dir| dir.join("config.toml").is_file()) {
            idle(&["mode", "site"], "where config.toml beside the tables says what the run was of");
        }
        if given("labels") {
            idle(&["out", "weights"], "with --labels");
        }
        return told;
    }
    match given("trajectories") {
        true => idle(&["preset", "people"], "with --trajectories: recorded people walk"),
        false if takes("trajectories") => idle(&REPLAY, "without --trajectories"),
        false => {}
    }
    if given("gait") {
        let mut kinds = command.get_many::<(Kind, f64)>("bodies").into_iter().flatten();
        if !kinds.any(|(kind, _)| *kind == Kind::CmuWalk) {
            idle(&["gait"], "without people of the kind cmu-walk (--bodies)");
        }
    }
    if given("packets") && !given("out") {
        idle(&["clouds", "csv"], "without --out: nothing is written");
    }
    if given("no_empty") {
        idle(&["empty"], "with --no-empty");
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(arguments: &str) -> String {
        let given = Cli::command().get_matches_from(arguments.split(' '));
        let (name, given) = given.subcommand().unwrap();
        without_effect(name, given).join("; ")
    }

    #[test]
    fn flags_given_in_vain_are_told_and_the_others_are_not() {
        for (arguments, story) in [
            ("u simulate --fps 25 --out o", "--fps has no effect without --trajectories"),
            ("u simulate --trajectories a.csv --fps 25 --out o", ""),
            ("u live --demo --seconds 5", ""),
            (
                "u simulate --trajectories a.csv --preset mixed --people 3 --out o",
                "--preset has no effect with --trajectories: recorded people walk; \
                 --people has no effect with --trajectories: recorded people walk",
            ),
            (
                "u evaluate --scenes 1 --bodies child --gait walk.bvh",
                "--gait has no effect without people of the kind cmu-walk (--bodies)",
            ),
            ("u evaluate --scenes 1 --bodies child,cmu-walk=0.5 --gait walk.bvh", ""),
            ("u run a.mcap --empty e.mcap --no-empty --out o", "--empty has no effect with --no-empty"),
            (
                "u evaluate no/such/run --truth sim --seed 3 --mode default",
                "--seed has no effect on a run that is done: nothing is simulated",
            ),
            (
                "u simulate --packets udp:127.0.0.1:2368 --clouds",
                "--clouds has no effect without --out: nothing is written",
            ),
            ("u simulate --packets pcap --clouds --out o", ""),
            ("u coverage --step 1", ""),
        ] {
            assert_eq!(told(arguments), story, "{arguments}");
        }
    }
}
