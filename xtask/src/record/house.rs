//! Records of what the program promises besides its scores: speed, same bytes, resuming after a stop, other machines,
//! fresh clones.

use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use super::book::Book;
use super::keep;
use crate::tools::{Result, argument, files_below, root};

/// What the sensors see of a standing person, and the floor plan.
pub fn coverage(book: &mut Book) -> Result<()> {
    let out = book.scratch("coverage");
    book.umbracast_says(["coverage".into(), "--out".into(), argument(&out)])?;
    keep(book, &out.join("coverage.svg"), "coverage.svg")
}

/// One scene of 10 people with two HDL-32E on one core, and a frame through every mode.
pub fn speed(book: &mut Book) -> Result<()> {
    let recording = book.scratch("sim");
    book.umbracast_says(simulate("1", "1", &recording))?;
    for mode in ["default", "paper", "hdl"] {
        book.umbracast_says(run(&recording, mode, "1", &book.scratch(mode)))?;
    }
    Ok(())
}

/// A step of the default mode on one core as people and access points grow: the best of three tries, and the middle one.
pub fn growth(book: &mut Book) -> Result<()> {
    let picture = book.scratch("growth.svg");
    let run = |picture: &str| {
        format!("cargo run --release --quiet --manifest-path bench/Cargo.toml --bin growth -- {picture}")
    };
    script(book, &run("growth.svg"), &run(&picture.display().to_string()))?;
    keep(book, &picture, "growth.svg")
}

/// Others' programs on the same work, one core each.
pub fn peers(book: &mut Book) -> Result<()> {
    book.command("bench/peers/install.sh");
    book.bash(&root(), "bench/peers/install.sh")?;
    script(book, "python3 bench/peers/run.py", "python3 bench/peers/run.py")
}

/// Instructions of a frame of ten people, which do not depend on what else a machine does, beside those of the record before.
pub fn instructions(book: &mut Book) -> Result<()> {
    let before = std::fs::read_to_string(root().join("record/instructions.txt")).unwrap_or_default();
    let build = "cargo build --release --quiet --manifest-path bench/Cargo.toml --bin frame";
    let count = "valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='*counted*' \
                 bench/target/release/frame";
    book.command(&format!("{build} && {count} MODE"));
    book.bash(&root(), build)?;
    book.line("mode     million instructions a frame, ten people    change");
    for mode in ["default", "paper", "hdl"] {
        let said = book.bash(&root(), &format!("{count} {mode} 2>&1"))?;
        let collected = said.lines().find_map(|line| line.split_once("Collected : "));
        let collected = collected.and_then(|(_, count)| count.trim().parse::<f64>().ok());
        let frames = said.lines().find_map(|line| line.split_once(" frames, ")?.0.parse::<f64>().ok());
        let (Some(collected), Some(frames)) = (collected, frames) else { return Err(said) };
        let millions = 1e-6 * collected / frames;
        let told = |line: &str| line.strip_prefix(mode)?.split_whitespace().next()?.parse::<f64>().ok();
        let change = before.lines().find_map(told).map(|before| 100.0 * (millions / before - 1.0));
        let change = change.map_or("-".to_owned(), |percent| format!("{percent:+.1} %"));
        book.line(&format!("{mode:8} {millions:42.2} {change:>9}"));
    }
    Ok(())
}

/// The same seed twice, on one thread and on two.
pub fn same_bytes(book: &mut Book) -> Result<()> {
    let of_threads = [("one", "1"), ("two", "2")];
    for (name, threads) in of_threads {
        book.umbracast_says(simulate("2", threads, &book.scratch(name)))?;
    }
    for mode in ["default", "paper", "hdl"] {
        for (name, threads) in of_threads {
            let recording = book.scratch(name);
            book.umbracast_says(run(&recording, mode, threads, &recording.join(mode)))?;
        }
    }
    compare_folders(book, "one", "two")
}

/// The paper's experiment in small, killed in its midst and started again, against one that ran through.
pub fn resume(book: &mut Book) -> Result<()> {
    let words = |name: &str, book: &Book| -> Vec<OsString> {
        ["reproduce", "--scenes", "8", "--out"]
            .map(OsString::from)
            .into_iter()
            .chain([argument(book.scratch(name))])
            .collect()
    };
    book.command("umbracast reproduce --scenes 8 --out /tmp/through");
    book.quietly(&words("through", book))?;

    book.line("$ umbracast reproduce --scenes 8 --out /tmp/killed, killed after its third scene");
    let mut command = Command::new(book.umbracast());
    command.args(words("killed", book)).arg("--quiet").stdout(Stdio::null());
    let mut running = command.spawn().map_err(|e| format!("umbracast: {e}"))?;
    let killed = book.scratch("killed");
    while files_below(&killed, ".sums").len() < 3 {
        if let Some(status) = running.try_wait().map_err(|e| e.to_string())? {
            return Err(format!(
                "expected an experiment that could be killed, found one that ended: {status}"
            ));
        }
        sleep(Duration::from_millis(100));
    }
    running.kill().and_then(|()| running.wait()).map_err(|e| e.to_string())?;
    for file in files_below(&killed, "") {
        book.line(&file.strip_prefix(&killed).unwrap_or(&file).display().to_string());
    }
    book.line("$ umbracast reproduce --scenes 8 --out /tmp/killed");
    book.quietly(&words("killed", book))?;
    compare_folders(book, "through", "killed")
}

/// The job files on a Slurm of this one machine.
pub fn slurm(book: &mut Book) -> Result<()> {
    script(book, "deploy/slurm/try.sh", "deploy/slurm/try.sh")
}

/// The job files as a cluster would read them.
pub fn kubernetes(book: &mut Book) -> Result<()> {
    script(book, "deploy/kubernetes/try.py umbracast", "deploy/kubernetes/try.py \"$(command -v umbracast)\"")
}

/// CI on a fresh clone.
pub fn tests(book: &mut Book) -> Result<()> {
    let said = in_fresh_clone(book, "time bash .ci/run && echo passed")?;
    let kept = |line: &&str| {
        ["step: ", "Running ", "Doc-tests ", "test result: ", "skipped: ", "real", "user", "sys"]
            .iter()
            .any(|start| line.trim_start().starts_with(start))
    };
    for line in said.lines().filter(kept) {
        book.line(line.trim_start());
    }
    if said.lines().any(|line| line == "passed") { Ok(()) } else { Err(said) }
}

/// What CI does apart from `.ci/run`: nodes, the Python package, other formats, the training framework, licences and advisories,
/// benchmarks.
pub fn chores(book: &mut Book) -> Result<()> {
    let bench = "cargo bench --manifest-path bench/Cargo.toml -- --test";
    let mut failed = Vec::new();
    let (deny, advisories) = ("cargo deny check bans licenses sources", "cargo deny check advisories");
    for line in [".ci/nodes", ".ci/python", ".ci/formats", ".ci/train", deny, advisories, bench] {
        book.command(&format!("time {line}"));
        if line.starts_with("cargo deny") && book.bash(&root(), "command -v cargo-deny")?.is_empty() {
            book.line("not run: cargo-deny is not on this machine");
            continue;
        }
        let said = book.bash(&root(), &format!("time {line} && echo passed"))?;
        if said.contains("failed to fetch advisory database") {
            book.line("not run: the list of advisories is out of this machine's reach");
            continue;
        }
        let kept = |line: &&str| {
            let starts = [
                "step: ",
                "skipped: ",
                "test result: ",
                "Success",
                "Testing ",
                "advisories ",
                "bans ",
                "real",
                "passed",
            ];
            starts.iter().any(|start| line.trim_start().starts_with(start)) || line.contains(" passed in ")
        };
        said.lines().filter(kept).for_each(|line| book.line(line.trim_start()));
        if !said.lines().any(|line| line == "passed") {
            failed.push(format!("{line}\n{said}"));
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

/// The first command on a fresh clone.
pub fn fresh_clone(book: &mut Book) -> Result<()> {
    let said = in_fresh_clone(book, "time cargo run --release")?;
    let building = |line: &&str| {
        ["Compiling ", "Downloading ", "Downloaded ", "Updating ", "Running ", "Locking "]
            .iter()
            .any(|start| line.trim_start().starts_with(start))
    };
    for line in said.lines().filter(|line| !building(line)) {
        book.line(line.trim_start_matches(' '));
    }
    Ok(())
}

/// From a clone to the first picture of a link in Python, and what the benchmark's predictors stand beside.
pub fn python(book: &mut Book) -> Result<()> {
    const DONE: &str = "all is done";
    let first =
        "awk '/^```python/ { block++; next } /^```/ { if (block) exit } block' docs/PYTHON.md > first.py";
    let line = format!(
        "python3 -m venv env && . env/bin/activate && {first} && time pip install -q . matplotlib \
         && time python first.py && test -s link.png && time python notebooks/benchmark.py && echo {DONE}"
    );
    let said = in_fresh_clone(book, &line)?;
    let table: Vec<&str> = said
        .lines()
        .skip_while(|line| !line.starts_with("predictor"))
        .take_while(|line| *line != DONE)
        .collect();
    let times = said.lines().filter(|line| line.starts_with("real"));
    let what = ["pip install . matplotlib", "first.py, a link beside its truth", "benchmark.py"];
    let times: Vec<String> = times.zip(what).map(|(time, what)| format!("{time}   {what}")).collect();
    if times.len() != what.len() || !said.lines().any(|line| line == DONE) {
        return Err(said);
    }
    times.iter().for_each(|time| book.line(time));
    let table = table.iter().take_while(|line| !line.is_empty());
    table.for_each(|line| book.line(line));
    Ok(())
}

/// Files, imports and circles in words.
pub fn structure(book: &mut Book) -> Result<()> {
    book.command("cargo xtask structure");
    book.line(&crate::structure::in_words()?);
    Ok(())
}

fn simulate(scenes: &str, threads: &str, out: &Path) -> Vec<OsString> {
    let words = ["simulate", "--scenes", scenes, "--threads", threads, "--out"].map(OsString::from);
    words.into_iter().chain([argument(out)]).collect()
}

fn run(recording: &Path, mode: &str, threads: &str, out: &Path) -> Vec<OsString> {
    let words = ["--mode", mode, "--threads", threads, "--out"].map(OsString::from);
    ["run".into(), argument(recording)].into_iter().chain(words).chain([argument(out)]).collect()
}

fn compare_folders(book: &mut Book, one: &str, other: &str) -> Result<()> {
    let (a, b) = (book.scratch(one), book.scratch(other));
    let line = format!("diff -rq --exclude run.json {} {} && echo the same", a.display(), b.display());
    let said = book.bash(&root(), &line)?;
    book.command(&line);
    book.line(&said);
    if said.trim() == "the same" { Ok(()) } else { Err(format!("expected the same bytes, found\n{said}")) }
}

/// A line of bash as it is shown, and what it prints.
pub fn script(book: &mut Book, shown: &str, line: &str) -> Result<()> {
    book.command(shown);
    let said = book.bash(&root(), line)?;
    book.line(&said);
    Ok(())
}

/// What a line prints in a clone of the repository; nothing is built there.
fn in_fresh_clone(book: &mut Book, line: &str) -> Result<String> {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    book.command(&format!(
        "git clone . /tmp/fresh && cd /tmp/fresh && {line}   # {cores} cores, nothing built"
    ));
    let clone = book.scratch("fresh");
    let cloned = book.bash(&root(), &format!("git clone --quiet . {0} && test -d {0}", clone.display()))?;
    if !clone.is_dir() {
        return Err(cloned);
    }
    book.bash(&clone, &format!("unset CARGO_TARGET_DIR RUSTUP_TOOLCHAIN; {line}"))
}
