//! The mutator on the command line.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use umbracast_fuzz::bounded::Bounded;
use umbracast_fuzz::run::{Until, checked, input, run};
use umbracast_fuzz::{TARGETS, Target, target};

#[global_allocator]
static MEMORY: Bounded = Bounded;

/// Gives damaged inputs to everything that reads bytes, and says which promises they broke.
///
/// Each input has a number, its seed: the same seed is the same input. Exit code 1 says that a promise was broken.
#[derive(Debug, Parser)]
#[command(name = "umbracast-fuzz")]
struct Args {
    /// Targets. Default: all.
    #[arg(value_name = "TARGET")]
    targets: Vec<String>,
    /// Seconds in all, shared out evenly among the targets.
    #[arg(long, default_value_t = 60.0, value_name = "S", conflicts_with = "inputs")]
    seconds: f64,
    /// Inputs of each target, however long they take.
    #[arg(long, value_name = "N")]
    inputs: Option<u64>,
    /// The first seed.
    #[arg(long, default_value_t = 0, value_name = "SEED")]
    from: u64,
    /// Threads. Default: one for each core.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Check this file alone, such as one that libFuzzer left behind.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Write the whole inputs of every target into folders of this one, for libFuzzer to begin from, and check nothing.
    #[arg(long, value_name = "DIR")]
    corpus: Option<PathBuf>,
    /// List the targets, and check nothing.
    #[arg(long)]
    list: bool,
    /// Folder for inputs that broke a promise.
    #[arg(long, default_value = "target/broken", value_name = "DIR")]
    keep: PathBuf,
}

fn main() -> ExitCode {
    match all(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("umbracast-fuzz: {error}");
            ExitCode::from(2)
        }
    }
}

/// Whether every promise was kept.
fn all(args: &Args) -> Result<bool, String> {
    let known = || TARGETS.map(|target| target.name).join(", ");
    let named =
        |name: &String| target(name).ok_or_else(|| format!("expected one of {}, found {name:?}", known()));
    let targets: Vec<&'static Target> = match args.targets.is_empty() {
        true => TARGETS.iter().collect(),
        false => args.targets.iter().map(named).collect::<Result<_, _>>()?,
    };
    if args.list {
        targets.iter().for_each(|target| println!("{}", target.name));
        return Ok(true);
    }
    if let Some(folder) = &args.corpus {
        return targets
            .iter()
            .try_for_each(|target| write_corpus(target, &folder.join(target.name)))
            .map(|()| true);
    }
    if let Some(file) = &args.input {
        let bytes = fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
        // All of them are asked, also after one that is broken.
        return Ok(targets.iter().filter(|target| !one(target, &bytes)).count() == 0);
    }
    let threads = args.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(2, usize::from));
    let until = match args.inputs {
        Some(inputs) => Until::Inputs(inputs),
        None => Until::Seconds(args.seconds / targets.len() as f64),
    };
    println!("{:18} {:>12} {:>12}  broken", "target", "inputs", "understood");
    let mut kept = true;
    for target in targets {
        let hangs = |seed| {
            eprintln!("{}, seed {seed}: takes half a minute", target.name);
            std::process::exit(1);
        };
        let tally = run(target, args.from, until, threads, hangs);
        println!("{:18} {:12} {:12}  {}", target.name, tally.inputs, tally.understood, tally.broken.len());
        for (place, (seed, story)) in tally.broken {
            kept = false;
            println!("  seed {seed}: {place}: {story}");
            keep(target, seed, &args.keep)?;
        }
    }
    Ok(kept)
}

fn one(target: &'static Target, bytes: &[u8]) -> bool {
    match checked(target, 0, bytes) {
        Ok(understood) => println!("{}: {}", target.name, if understood { "understood" } else { "refused" }),
        Err((place, story)) => {
            println!("{}: {place}: {story}", target.name);
            return false;
        }
    }
    true
}

fn keep(target: &Target, seed: u64, folder: &PathBuf) -> Result<(), String> {
    let mut bytes = Vec::new();
    input(&(target.corpus)(), seed, &mut bytes);
    let file = folder.join(format!("{}-{seed}", target.name));
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&file, bytes))
        .map_err(|e| format!("{}: {e}", file.display()))
}

fn write_corpus(target: &Target, folder: &PathBuf) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    for (number, whole) in (target.corpus)().iter().enumerate() {
        fs::write(folder.join(format!("whole-{number}")), whole).map_err(failed)?;
    }
    Ok(())
}
