//! `record`: every figure that a document quotes comes from a file of `record/`, and this makes those files. Each
//! begins with the command it comes from and the commit it was made from.

mod bare_hall;
mod book;
mod calibrate;
mod crowds;
mod gestures;
mod glass;
mod house;
mod live;
mod living;
mod locked;
mod logictronix;
mod mutations;
mod nodes;
mod objects;
mod scores;
mod standing;
mod walls;

use std::fs;

use crate::answers::{self, ASKED};
use crate::quote::{self, Digests};
use crate::tools::{Result, Scratch, built, data, output, root, target};
pub use book::{ANSWERS, COMMIT, MACHINE, TOOK};
use book::{Bench, Book, took_s};

/// One file of `record/`, `NAME.txt`, with the pictures that belong to it.
struct Job {
    name: &'static str,
    /// What it holds.
    what: &'static str,
    /// About how long it takes on two cores, until a record says how long it took.
    minutes: u32,
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

const fn job(
    name: &'static str,
    what: &'static str,
    minutes: u32,
    needs: Needs,
    make: fn(&mut Book) -> Result<()>,
) -> Job {
    Job { name, what, minutes, needs, make }
}

#[rustfmt::skip]
const JOBS: [Job; 57] = [
    job("orca-03-100-scenes", "what the default mode scores on 100 test scenes", 8, Needs::Nothing, scores::headline),
    job("orca-40-scenes", "40 test scenes, every mode, baselines, error budget, oracles", 8, Needs::Nothing, scores::modes),
    job("coverage", "what the sensors see of a standing person", 1, Needs::Nothing, house::coverage),
    job("sites", "other heights, a lost sensor, more people, pairs", 10, Needs::Nothing, crowds::sites),
    job("shapes", "three halls of other shapes, devices in the hand: what blocks, by cause", 4, Needs::Nothing, crowds::shapes),
    job("hands", "the same halls: devices in the hands of who stops and meets, and of who carries or sits", 4, Needs::Nothing, crowds::hands),
    job("shedding", "what the samples cost that a crowd leaves out", 25, Needs::Nothing, crowds::shedding),
    job("strangers", "bodies of another maker, and what people carry and push", 15, Needs::Nothing, crowds::strangers),
    job("people", "other bodies, real walkers, dense crowds", 6, Needs::Data, crowds::people),
    job("walkers", "16 real walkers, ten draws of bodies, error budget and oracles", 3, Needs::Data, crowds::walkers),
    job("circle-antipode", "8 and 16 real walkers, every mode", 2, Needs::Data, scores::antipode),
    job("forecasts", "the residual beside a constant velocity", 4, Needs::Data, crowds::forecasts),
    job("calibrate", "sensors that hang elsewhere than the file says, found again", 15, Needs::Nothing, calibrate::calibrate),
    job("following", "a sensor screwed on askew, one that slips", 5, Needs::Nothing, calibrate::following),
    job("rooms", "floors of random rooms, found or told, with every sensor model", 10, Needs::Nothing, calibrate::rooms),
    job("walls", "site files with one wall half a metre off", 10, Needs::Nothing, walls::walls),
    job("clocks", "sensors' clocks apart, found while people walk", 5, Needs::Nothing, calibrate::clocks),
    job("tripods", "from two sensors on tripods to warnings, command by command", 2, Needs::Nothing, calibrate::tripods),
    job("logictronix", "real people before a real VLP-16", 1, Needs::Data, logictronix::logictronix),
    job("speed", "how long a frame takes, in every mode", 1, Needs::Nothing, house::speed),
    job("growth", "how long a step takes with more people, sensors and access points", 11, Needs::Nothing, house::growth),
    job("peers", "the same work by other programs", 15, Needs::Asking, house::peers),
    job("instructions", "how many instructions a frame takes", 10, Needs::Program("valgrind"), house::instructions),
    job("soak", "a day of people, as fast as it goes, and an hour live: memory, time, numbers", 35, Needs::Asking, live::soak),
    job("living", "furniture put in, people who stand, no empty scan", 15, Needs::Nothing, living::living),
    job("objects", "objects put in after the empty scan: who is invented, for how long", 6, Needs::Nothing, objects::objects),
    job("standing", "people who stand or sit from the first frame on", 25, Needs::Nothing, standing::standing),
    job("glass", "glass, mirrors, biased ranges, edges, dark cloth: together and each alone", 5, Needs::Nothing, glass::glass),
    job("gestures", "people who talk with their hands around a sensor, and ten among each other", 10, Needs::Nothing, gestures::gestures),
    job("cut", "what a frame gains that closes as soon as the part with people has", 3, Needs::Nothing, crowds::cut),
    job("network", "what forecasts gain a network: outage, changes, the gap to the oracle", 20, Needs::Nothing, crowds::network),
    job("network-sweeps", "the same over margins, procedures, crowds, access points and models", 10, Needs::Nothing, crowds::network_sweeps),
    job("network-losses", "the dB told about fades, and the shape of real ones", 8, Needs::Data, crowds::network_losses),
    job("bindings", "which device is carried by whom, from the power heard", 4, Needs::Nothing, crowds::bindings),
    job("heard", "what power that is heard adds to the probabilities of links", 8, Needs::Nothing, crowds::heard),
    job("live", "ten minutes live, four times over, the page open or not", 44, Needs::Asking, live::live),
    job("nodes", "stages on three hosts: the same bytes, what the wire adds, what fails", 33, Needs::Asking, nodes::nodes),
    job("halls", "1 to 96 halls on one host", 8, Needs::Asking, nodes::halls),
    job("deployed", "the files for containers and clusters, run here", 2, Needs::Asking, nodes::deployed),
    job("faults", "a live run in which something fails", 9, Needs::Nothing, live::faults),
    job("kills", "a recording run killed at twenty moments", 3, Needs::Nothing, live::kills),
    job("mutations", "damaged files of every format, given to the command", 60, Needs::Nothing, mutations::mutations),
    job("same-bytes", "the same seed on one thread and on two", 1, Needs::Nothing, house::same_bytes),
    job("resume", "an experiment killed and gone on with", 3, Needs::Nothing, house::resume),
    job("bodies", "what is learned of ten bodies, beside their meshes", 1, Needs::Nothing, scores::bodies),
    job("explain", "why the paper's figures are what they are", 4, Needs::Nothing, scores::explain),
    job("ablation", "each mechanism off alone", 45, Needs::Data, scores::ablation),
    job("reproduce-quick", "the paper's experiment in 40 scenes", 6, Needs::Nothing, scores::reproduce_quick),
    job("reproduce", "the paper's experiment whole, training first: half an hour", 30, Needs::Asking, scores::reproduce),
    job("slurm", "the job files on a Slurm of this one machine", 3, Needs::Program("slurmctld"), house::slurm),
    job("kubernetes", "the job files as a cluster would read them", 3, Needs::Program("python3"), house::kubernetes),
    job("tests", "CI on a fresh clone, nothing built, step by step", 16, Needs::Asking, house::tests),
    job("chores", "what CI does apart: nodes, Python, other formats, the training framework, licences, benchmarks", 60, Needs::Asking, house::chores),
    job("python", "from a clone to a link in Python, and the benchmark of predictors", 12, Needs::Asking, house::python),
    job("fresh-clone", "the first command on a fresh clone, nothing built", 4, Needs::Asking, house::fresh_clone),
    job("structure", "files, imports, circles, in words", 1, Needs::Nothing, house::structure),
    job("locked", "scenes and recordings that nothing was chosen by: every look is kept", 8, Needs::Asking, locked::look),
];

/// Those whose figures depend on radios, too.
pub const RADIO: [&str; 5] = ["network", "network-sweeps", "network-losses", "bindings", "heard"];

/// Other names of the same.
const ALIASES: [(&str, &str); 3] =
    [("headline", "orca-03-100-scenes"), ("modes", "orca-40-scenes"), ("antipode", "circle-antipode")];

/// Makes the named files.
pub fn run(words: &[&str]) -> Result<()> {
    let (flags, names): (Vec<&str>, Vec<&str>) = words.iter().partition(|word| word.starts_with("--"));
    if let Some(unknown) = flags.iter().find(|flag| !["--dirty", "--again"].contains(flag)) {
        return Err(format!("record: expected --dirty or --again, found {unknown}"));
    }
    let digests = Digests::present()?;
    if names.is_empty() {
        for job in &JOBS {
            let by_name = if job.needs == Needs::Asking { " (by name only)" } else { "" };
            let (minutes, state) = (minutes(job), state(job, &digests));
            println!("{:20} {minutes:>4} min  {state:16} {}{by_name}", job.name, job.what);
        }
        return Ok(());
    }
    let all = names.contains(&"all");
    let jobs = to_do(named(&names)?, all, flags.contains(&"--again"), &digests)?;
    println!(
        "{} records to make, about {} min",
        jobs.len(),
        jobs.iter().map(|job| minutes(job)).sum::<u32>()
    );
    if jobs.is_empty() {
        return Ok(());
    }
    let commit = commit(flags.contains(&"--dirty"))?;
    let umbracast = built(&root(), &target())?;
    let moved = moved(&umbracast)?;
    if !moved.is_empty() {
        return Err(format!(
            "record: answers moved: `cargo xtask answers --write` first\n{}",
            moved.join("\n")
        ));
    }
    let mut failed = Vec::new();
    for job in jobs {
        let bench = Bench { umbracast: umbracast.clone(), scratch: Scratch::new(job.name)? };
        let mut book = Book::new(job.name, &commit, digests.of(job.name), bench);
        match (job.make)(&mut book).and_then(|()| book.close()) {
            Ok(told) => println!("{told}"),
            // One that fails costs its own record, not those of the night after it.
            Err(error) => {
                eprintln!("{}: {error}", job.name);
                failed.push(job.name);
            }
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(format!("record: not made: {}", failed.join(", "))) }
}

/// What is left of these jobs. With `all`, what was stopped goes on where it was: a record of the present program stays,
/// and so does one for which this machine lacks something.
fn to_do(jobs: Vec<&'static Job>, all: bool, again: bool, digests: &Digests) -> Result<Vec<&'static Job>> {
    let mut left = Vec::new();
    for job in jobs {
        if all && !again && made(job).is_some_and(|record| quote::is_of(&record, digests.of(job.name))) {
            println!("{}: of the present program", job.name);
            continue;
        }
        let missing = match job.needs {
            Needs::Data => data().is_none().then_some("UMBRACAST_DATA"),
            Needs::Program(program) => output(&root(), "which", &[program]).is_err().then_some(program),
            Needs::Nothing | Needs::Asking => None,
        };
        match missing {
            Some(missing) if all => println!("{}: left as it is, no {missing}", job.name),
            Some(missing) => return Err(format!("{}: expected {missing}, found none", job.name)),
            None => left.push(job),
        }
    }
    Ok(left)
}

/// The record of a job as it stands.
fn made(job: &Job) -> Option<String> {
    fs::read_to_string(root().join("record").join(format!("{}.txt", job.name))).ok()
}

/// Which program the record of a job is of.
fn state(job: &Job, digests: &Digests) -> &'static str {
    match made(job) {
        None => "not made",
        Some(record) if quote::is_of(&record, digests.of(job.name)) => "present",
        Some(record) if record.lines().any(|line| line.starts_with(COMMIT)) => "earlier program",
        Some(_) => "no commit",
    }
}

/// How long a job takes: what its record says that it took, else what is thought.
fn minutes(job: &Job) -> u32 {
    let seconds = made(job).and_then(|record| took_s(&record));
    seconds.map_or(job.minutes, |seconds| (seconds / 60.0).ceil() as u32)
}

/// Whether the program answers as is kept; `write` keeps what it answers now.
pub fn answers(write: bool) -> Result<()> {
    let umbracast = built(&root(), &target())?;
    let moved = moved(&umbracast)?;
    if !moved.is_empty() && !write {
        return Err(format!("answers moved:\n{}", moved.join("\n")));
    }
    if !moved.is_empty() {
        let data =
            data().ok_or("expected UMBRACAST_DATA, for half of the questions are asked of it, found none")?;
        for asked in &ASKED {
            let found = answers::ask(asked, &umbracast, &root(), Some(&data))?;
            let kept = fs::read_to_string(root().join(asked.file)).unwrap_or_default();
            // Answers within the tolerance stay, and with them the digest.
            if !answers::differences(&kept, &found).is_empty() {
                fs::write(root().join(asked.file), &found).map_err(|e| format!("{}: {e}", asked.file))?;
            }
        }
    }
    let digests = Digests::present()?;
    println!("answers {}, with radios {}", digests.of("speed"), digests.of(RADIO[0]));
    Ok(())
}

/// Where the program's answers are not those that are kept.
fn moved(umbracast: &std::path::Path) -> Result<Vec<String>> {
    let mut moved = Vec::new();
    for asked in &ASKED {
        let kept = fs::read_to_string(root().join(asked.file)).unwrap_or_default();
        let found = answers::ask(asked, umbracast, &root(), data().as_deref())?;
        moved.extend(answers::differences(&kept, &found));
    }
    Ok(moved)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A night: who changes the program sees all of its figures the next morning.
    #[test]
    fn all_records_together_take_at_most_eight_hours() {
        let all = JOBS.iter().filter(|job| job.needs != Needs::Asking);
        let minutes: u32 = all.map(minutes).sum();
        assert!(minutes <= 8 * 60, "{minutes} min");
    }

    #[test]
    fn a_record_of_the_present_program_is_made_again_only_if_asked() {
        let job = JOBS.iter().find(|job| job.needs == Needs::Nothing && made(job).is_some()).unwrap();
        let record = made(job).unwrap();
        let digest = record.lines().find_map(|line| line.strip_prefix("# answers ")).unwrap_or("none");
        let left =
            |all, again, digest: &str| to_do(vec![job], all, again, &Digests::both(digest)).unwrap().len();
        assert_eq!(left(true, false, digest), usize::from(digest == "none"));
        assert_eq!((left(true, true, digest), left(false, false, digest)), (1, 1));
        assert_eq!(left(true, false, "another program"), 1);
    }

    #[test]
    fn every_job_is_named_once_and_says_how_long_it_takes() {
        for (k, job) in JOBS.iter().enumerate() {
            assert!(job.minutes > 0 && !job.what.is_empty(), "{}", job.name);
            assert!(JOBS[..k].iter().all(|other| other.name != job.name), "{} twice", job.name);
        }
    }
}
