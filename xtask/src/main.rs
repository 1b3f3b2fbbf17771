//! `cargo xtask NAME`: the repository's own tasks. Nothing here is part of the program.

mod tools;
mod fit;
mod answers;
mod record;
mod quote;
mod same_tables;
mod structure;

use std::process::ExitCode;

const USAGE: &str = "\
cargo xtask record NAME...    make these files of record/ anew; `all` makes those of an earlier program, but none that is by name only
    --dirty                       from a tree with changes; the record says so
    --again                       with `all`: also those that are of the present program already
cargo xtask record            list the names: how long each takes on two cores, whether it is of the present program
cargo xtask quote             cut every block of figures in README.md and docs/ anew from its record
cargo xtask answers           whether the program answers what record/answers.txt keeps of it
    --write                       keep what it answers now: records of before are then of an earlier program
cargo xtask same-tables REV   whether a git revision and the working tree write the same tables, byte for byte
cargo xtask fit [NAME...]     fit anew what the program learns from data, in order: pose, outline, residual, body; about half an hour on two cores
cargo xtask structure         files and imports as a picture, docs/structure.svg, and in words
    --check                       write nothing; fail where the picture is stale or files of src/ use one another in a circle";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let result = match words.as_slice() {
        ["record", names @ ..] => record::run(names),
        ["quote"] => quote::run(),
        ["answers"] => record::answers(false),
        ["answers", "--write"] => record::answers(true),
        ["same-tables", revision] => same_tables::run(revision),
        ["fit", names @ ..] => fit::run(names),
        ["structure"] => structure::run(false),
        ["structure", "--check"] => structure::run(true),
        [] | ["--help" | "-h" | "help"] => {
            println!("{USAGE}");
            Ok(())
        }
        other => Err(format!("expected one of these, found {:?}\n{USAGE}", other.join(" "))),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error}");
            ExitCode::FAILURE
        }
    }
}
