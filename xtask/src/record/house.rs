//! What the program promises beside its scores: speed, same bytes, going on after a stop, other machines, fresh clones.

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

/// A step of the default mode on one core as people and access points grow.
pub fn growth(book: &mut Book) -> Result<()> {
    let picture = book.scratch("growth.svg");
    let run = |picture: &str| {
        format!("cargo run --release --quiet --manifest-path bench/Cargo.toml --bin growth -- {picture}")
    };
    script(book, &run("growth.svg"), &run(&picture.display().to_string()))?;
    keep(book, &picture, "growth.svg")
}

/// A live run in which something fails.
pub fn faults(book: &mut Book) -> Result<()> {
    let faults = "cargo run --release --quiet --package umbracast-live --example faults";
    script(book, faults, faults)
}

/// Ten minutes of simulated sensors over loopback, recorded, the page open: what was lost, how late warnings came, and
/// how much memory it took in the first minute and in the last.
pub fn live(book: &mut Book) -> Result<()> {
    let ouster = book.scratch("ouster.toml");
    let site = "[[site.sensors]]\nname = \"lidar\"\nmodel = \"os0-128\"\nposition_m = [16.0, 0.0, 9.0]\n\
                rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\nrange_noise_m = 0.02\n";
    std::fs::write(&ouster, site).map_err(|e| format!("{}: {e}", ouster.display()))?;
    live_run(book, "10", None)?;
    live_run(book, "40", None)?;
    live_run(book, "10", Some(&ouster))?;
    book.line(&format!("# ouster.toml:\n{site}"));
    Ok(())
}

fn live_run(book: &mut Book, people: &str, site: Option<&Path>) -> Result<()> {
    const SECONDS: u64 = 600;
    let folder = book.scratch("live");
    let mut words: Vec<OsString> =
        ["live", "--demo", "--people", people, "--seconds"].map(OsString::from).into();
    words.push(SECONDS.to_string().into());
    if let Some(site) = site {
        words.extend(["--site".into(), argument(site)]);
    }
    words.extend(["--json".into(), "--quiet".into(), "--serve".into(), "127.0.0.1:8600".into()]);
    words.extend(["--record".into(), argument(&folder)]);
    let said: Vec<_> = words.iter().map(|word| word.to_string_lossy()).collect();
    book.command(&format!("umbracast {} & nice -n 19 chromium --headless ...", said.join(" ")));
    let mut live = Command::new(book.umbracast());
    let live = live.args(&words).stdout(Stdio::piped()).stderr(Stdio::null());
    let live = live.spawn().map_err(|e| format!("umbracast: {e}"))?;
    sleep(Duration::from_secs(2));
    // Who looks has a computer of his own: here he takes what is left.
    let mut browser = Command::new("nice");
    browser.args([
        "-n",
        "19",
        "chromium",
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--remote-debugging-port=0",
    ]);
    browser.arg("http://127.0.0.1:8600/").stdout(Stdio::null()).stderr(Stdio::null());
    let page = browser.spawn();
    let mut resident_kb = Vec::new();
    while let Some(kb) = resident(live.id()) {
        resident_kb.push(kb);
        sleep(Duration::from_secs(1));
    }
    match page {
        Ok(mut page) => page.kill().and_then(|()| page.wait().map(drop)).map_err(|e| e.to_string())?,
        Err(_) => book.line("no chromium: nobody looked at the page"),
    }
    let output = live.wait_with_output().map_err(|e| e.to_string())?;
    let said = String::from_utf8_lossy(&output.stdout);
    book.line(said.trim_end());
    let minute = resident_kb.len().min(60);
    let mean = |kb: &[u64]| kb.iter().sum::<u64>() as f64 / kb.len().max(1) as f64 / 1024.0;
    let (first, last) = (mean(&resident_kb[..minute]), mean(&resident_kb[resident_kb.len() - minute..]));
    let grown = 100.0 * (last / first - 1.0);
    book.line(&format!(
        "resident, mean of the first minute and of the last: {first:.1} MiB, {last:.1} MiB ({grown:+.1} %)\n"
    ));
    std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))
}

/// KiB that a process holds; `None` once it has ended.
fn resident(id: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches(" kB").trim().parse().ok()
}

/// A recording run killed at twenty moments, drawn by chance: what each file still holds.
pub fn kills(book: &mut Book) -> Result<()> {
    const KILLS: u64 = 20;
    book.command(
        "umbracast live --demo --people 4 --no-serve --record /tmp/live, killed (SIGKILL) twenty times",
    );
    book.line("killed after, s   bytes      `umbracast inspect`  frames with results   seconds of them");
    // A row of numbers that nobody chose, the same in every record.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    for _ in 0..KILLS {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let after = Duration::from_millis(1500 + (state >> 33) % 5000);
        let folder = book.scratch("live");
        let mut live = Command::new(book.umbracast());
        live.args(["live", "--demo", "--people", "4", "--no-serve", "--quiet", "--record"]).arg(&folder);
        let live = live.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let mut live = live.map_err(|e| format!("umbracast: {e}"))?;
        sleep(after);
        live.kill().and_then(|()| live.wait()).map_err(|e| e.to_string())?;
        let files = files_below(&folder, ".mcap");
        let [file] = &files[..] else { return Err(format!("expected one recording, found {}", files.len())) };
        let bytes = std::fs::metadata(file).map_err(|e| e.to_string())?.len();
        let looked = Command::new(book.umbracast()).arg("inspect").arg(file).output();
        let looked = looked.map_err(|e| format!("umbracast: {e}"))?;
        let said = String::from_utf8_lossy(&looked.stdout).into_owned();
        let results = said.lines().find(|line| line.contains("/umbracast/blockages"));
        let messages = results.and_then(|line| line.split_whitespace().rev().nth(1)).unwrap_or("0");
        let frames: u32 =
            messages.parse().map_err(|_| format!("expected a number of messages, found {messages}"))?;
        let opened = match looked.status.code() {
            Some(0) => "opens whole".to_owned(),
            Some(3) => "opens, end cut".to_owned(),
            code => format!("fails: {code:?}"),
        };
        let lived = after.as_secs_f64();
        book.line(&format!(
            "{lived:15.3} {bytes:11}   {opened:20} {frames:18} {:17.1}",
            f64::from(frames) * 0.1
        ));
        std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
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
    let said = in_fresh_clone(book, "time bash .ci/run")?;
    let kept = |line: &&str| {
        ["Running ", "Doc-tests ", "test result: ", "skipped: ", "real", "user", "sys"]
            .iter()
            .any(|start| line.trim_start().starts_with(start))
    };
    for line in said.lines().filter(kept) {
        book.line(line.trim_start());
    }
    all_passed(&said)
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

fn script(book: &mut Book, shown: &str, line: &str) -> Result<()> {
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

fn all_passed(said: &str) -> Result<()> {
    let failed: Vec<&str> =
        said.lines().filter(|line| line.contains("FAILED") || line.starts_with("error")).collect();
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}
