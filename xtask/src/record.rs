//! `record`: every figure that a document quotes comes from a file of `record/`, and this makes those files. Each
//! begins with the command it comes from and the commit it was made from.

mod book;
mod calibrate;
mod crowds;
mod gestures;
mod glass;
mod house;
mod live;
mod living;
mod locked;
mod mutations;
mod nodes;
mod scores;
mod standing;
mod walls;

use std::fs;

use crate::answers;
use crate::quote;
use crate::tools::{Result, Scratch, built, data, output, root, target};
use book::{Bench, Book};

/// One file of `record/`, `NAME.txt`, with the pictures that belong to it.
struct Job {
    name: &'static str,
    /// What it holds.
    what: &'static str,
    /// What is needed beside this repository.
    needs: Needs,
    make: fn(&mut Book) -> Result<()>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Needs {
    Nothing,
    /// `UMBRACAST_DATA`.
    Data,
    /// These programs, or modules of Python, on this machine.
    Program(&'static str),
    /// To be asked for by name: `all` leaves it out.
    Asking,
}

const fn job(name: &'static str, what: &'static str, needs: Needs, make: fn(&mut Book) -> Result<()>) -> Job {
    Job { name, what, needs, make }
}

#[rustfmt::skip]
const JOBS: [Job; 43] = [
    job("orca-03-100-scenes", "what the default mode scores on 100 test scenes", Needs::Nothing, scores::headline),
    job("orca-40-scenes", "40 test scenes, every mode, baselines, error budget, oracles", Needs::Nothing, scores::modes),
    job("coverage", "what the sensors see of a standing person", Needs::Nothing, house::coverage),
    job("sites", "other heights, a lost sensor, more people, pairs", Needs::Nothing, crowds::sites),
    job("shapes", "three halls of other shapes, devices in the hand: what blocks, by cause", Needs::Nothing, crowds::shapes),
    job("people", "other bodies, real walkers, dense crowds", Needs::Data, crowds::people),
    job("walkers", "16 real walkers, ten draws of bodies, error budget and oracles", Needs::Data, crowds::walkers),
    job("circle-antipode", "8 and 16 real walkers, every mode", Needs::Data, scores::antipode),
    job("forecasts", "the residual beside a constant velocity", Needs::Data, crowds::forecasts),
    job("calibrate", "sensors that hang elsewhere than the file says, found again", Needs::Nothing, calibrate::calibrate),
    job("following", "a sensor screwed on askew, one that slips", Needs::Nothing, calibrate::following),
    job("rooms", "floors of random rooms, found or told, with every sensor model", Needs::Nothing, calibrate::rooms),
    job("walls", "site files with one wall half a metre off", Needs::Nothing, walls::walls),
    job("clocks", "sensors' clocks apart, found while people walk", Needs::Nothing, calibrate::clocks),
    job("tripods", "from two sensors on tripods to warnings, command by command", Needs::Nothing, calibrate::tripods),
    job("logictronix", "real people before a real VLP-16", Needs::Data, crowds::logictronix),
    job("speed", "how long a frame takes, in every mode", Needs::Nothing, house::speed),
    job("growth", "how long a step takes with more people and access points", Needs::Nothing, house::growth),
    job("living", "furniture put in, people who stand, no empty scan", Needs::Nothing, living::living),
    job("standing", "people who stand or sit from the first frame on", Needs::Nothing, standing::standing),
    job("glass", "glass, mirrors, biased ranges, edges, dark cloth: together and each alone", Needs::Nothing, glass::glass),
    job("gestures", "people who talk with their hands beside a sensor", Needs::Nothing, gestures::gestures),
    job("cut", "what a frame gains that closes as soon as the part with people has", Needs::Nothing, crowds::cut),
    job("network", "what forecasts gain a network: outage, changes, the gap to the oracle", Needs::Nothing, crowds::network),
    job("live", "ten minutes live, three times over, the page open", Needs::Asking, live::live),
    job("nodes", "stages on three hosts: the same bytes, what the wire adds, what fails", Needs::Asking, nodes::nodes),
    job("halls", "1 to 64 halls on one host", Needs::Asking, nodes::halls),
    job("deployed", "the files for containers and clusters, run here", Needs::Asking, nodes::deployed),
    job("faults", "a live run in which something fails", Needs::Nothing, live::faults),
    job("kills", "a recording run killed at twenty moments", Needs::Nothing, live::kills),
    job("mutations", "damaged files of every format, given to the command", Needs::Nothing, mutations::mutations),
    job("same-bytes", "the same seed on one thread and on two", Needs::Nothing, house::same_bytes),
    job("resume", "an experiment killed and gone on with", Needs::Nothing, house::resume),
    job("explain", "why the paper's figures are what they are", Needs::Nothing, scores::explain),
    job("ablation", "each mechanism off alone", Needs::Data, scores::ablation),
    job("reproduce-quick", "the paper's experiment in 40 scenes", Needs::Nothing, scores::reproduce_quick),
    job("reproduce", "the paper's experiment whole, training first: an hour", Needs::Asking, scores::reproduce),
    job("slurm", "the job files on a Slurm of this one machine", Needs::Program("slurmctld"), house::slurm),
    job("kubernetes", "the job files as a cluster would read them", Needs::Program("python3"), house::kubernetes),
    job("tests", "CI on a fresh clone, nothing built", Needs::Asking, house::tests),
    job("fresh-clone", "the first command on a fresh clone, nothing built", Needs::Asking, house::fresh_clone),
    job("structure", "files, imports, circles, in words", Needs::Nothing, house::structure),
    job("locked", "scenes and recordings that nothing was chosen by: every look is kept", Needs::Asking, locked::look),
];

/// Other names of the same.
const ALIASES: [(&str, &str); 3] =
    [("headline", "orca-03-100-scenes"), ("modes", "orca-40-scenes"), ("antipode", "circle-antipode")];

/// Makes the named files.
pub fn run(words: &[&str]) -> Result<()> {
    let (flags, names): (Vec<&str>, Vec<&str>) = words.iter().partition(|word| word.starts_with("--"));
    if let Some(unknown) = flags.iter().find(|flag| !["--dirty", "--again"].contains(flag)) {
        return Err(format!("record: expected --dirty or --again, found {unknown}"));
    }
    if names.is_empty() {
        for job in &JOBS {
            println!("{:20} {}", job.name, job.what);
        }
        return Ok(());
    }
    let jobs = named(&names)?;
    let commit = commit(flags.contains(&"--dirty"))?;
    let umbracast = built(&root(), &target())?;
    let digest = quote::present_digest()?;
    let moved = moved(&umbracast)?;
    if !moved.is_empty() {
        return Err(format!(
            "record: answers moved: `cargo xtask answers --write` first\n{}",
            moved.join("\n")
        ));
    }
    for job in jobs {
        // What was stopped goes on where it was.
        let made = fs::read_to_string(root().join("record").join(format!("{}.txt", job.name)));
        if names.contains(&"all")
            && !flags.contains(&"--again")
            && made.is_ok_and(|made| quote::is_of(&made, &digest))
        {
            println!("{}: of the present program", job.name);
            continue;
        }
        let missing = match job.needs {
            Needs::Data => data().is_none().then_some("UMBRACAST_DATA"),
            Needs::Program(program) => output(&root(), "which", &[program]).is_err().then_some(program),
            Needs::Nothing | Needs::Asking => None,
        };
        match missing {
            Some(missing) if names.contains(&"all") => println!("{}: left as it is, no {missing}", job.name),
            Some(missing) => return Err(format!("{}: expected {missing}, found none", job.name)),
            None => {
                let bench = Bench { umbracast: umbracast.clone(), scratch: Scratch::new(job.name)? };
                let mut book = Book::new(job.name, &commit, &digest, bench);
                (job.make)(&mut book).map_err(|error| format!("{}: {error}", job.name))?;
                println!("{}", book.close()?);
            }
        }
    }
    Ok(())
}

/// Whether the program answers as `record/answers.txt` says; `write` keeps what it answers now.
pub fn answers(write: bool) -> Result<()> {
    let umbracast = built(&root(), &target())?;
    let moved = moved(&umbracast)?;
    match (moved.is_empty(), write) {
        (true, _) => println!("{} answers {}", answers::FILE, quote::present_digest()?),
        (false, false) => return Err(format!("answers moved:\n{}", moved.join("\n"))),
        (false, true) => {
            let data = data()
                .ok_or("expected UMBRACAST_DATA, for half of the questions are asked of it, found none")?;
            let found = answers::ask(&umbracast, &root(), Some(&data))?;
            fs::write(root().join(answers::FILE), &found).map_err(|e| format!("{}: {e}", answers::FILE))?;
            println!("{} answers {}", answers::FILE, answers::digest(&found));
        }
    }
    Ok(())
}

/// Where the program's answers are not those that are kept.
fn moved(umbracast: &std::path::Path) -> Result<Vec<String>> {
    let kept = fs::read_to_string(root().join(answers::FILE)).unwrap_or_default();
    Ok(answers::differences(&kept, &answers::ask(umbracast, &root(), data().as_deref())?))
}

fn named(names: &[&str]) -> Result<Vec<&'static Job>> {
    let mut jobs = Vec::new();
    for name in names {
        let full = ALIASES.iter().find(|(alias, _)| alias == name).map_or(*name, |(_, full)| full);
        match JOBS.iter().find(|job| job.name == full) {
            Some(job) => jobs.push(job),
            None if *name == "all" => jobs.extend(JOBS.iter().filter(|job| job.needs != Needs::Asking)),
            None => return Err(format!("record: no job {name:?}; `cargo xtask record` lists them")),
        }
    }
    Ok(jobs)
}

/// The commit that the tree holds. Changes in `record/` alone do not count: a record does not read another.
fn commit(dirty: bool) -> Result<String> {
    let root = root();
    let hash = output(&root, "git", &["rev-parse", "--short=10", "HEAD"])?;
    let changes = output(&root, "git", &["status", "--porcelain", "--", ".", ":!record"])?;
    match (changes.is_empty(), dirty) {
        (true, _) => Ok(hash),
        (false, true) => Ok(format!("{hash} and changes")),
        (false, false) => Err(format!(
            "record: expected a tree without changes, so that the commit says what was run; found\n{changes}\n\
             commit them, or say --dirty"
        )),
    }
}

/// Copies a file that a job made into `record/`, scrubbed where it is text.
fn keep(book: &Book, from: &std::path::Path, name: &str) -> Result<()> {
    let place = root().join("record").join(name);
    let bytes = fs::read(from).map_err(|e| format!("{}: {e}", from.display()))?;
    let bytes = match String::from_utf8(bytes) {
        Ok(text) => book.scrubbed(&text).into_bytes(),
        Err(bytes) => bytes.into_bytes(),
    };
    fs::write(&place, bytes).map_err(|e| format!("{}: {e}", place.display()))
}
