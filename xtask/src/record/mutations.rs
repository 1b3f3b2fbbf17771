//! Damaged input, thousands a format: to the command, which must end with one of its exit codes, and in one process to all that
//! reads bytes, whose promises must be kept (`crates/umbracast-fuzz`).

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::book::Book;
use crate::tools::{self, Result, root};

#[path = "../../../crates/umbracast-fuzz/src/mutate.rs"]
mod mutate;

use mutate::{Random, damage};

/// Address space of a command, kilobytes.
const MEMORY_KB: u64 = 6 << 20;
/// A command that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(60);
/// Damaged files of a format that the command is only asked to read, and of one behind which it simulates or runs all stages.
const FILES: u64 = 100_000;
const FILES_OF_SLOW: u64 = 500;
/// So many are read by one process, which would else take longer to begin than to read.
const BATCH: u64 = 50;
/// Inputs in one process: packets of a family, frames through all stages in sixes, anything else.
const PACKETS: u64 = 100_000_000;
const SIXES: u64 = 170_000;
const INPUTS: u64 = 100_000;

/// One format: whole files, and the words that read a damaged one; `{}` stands for it, `{out}` for a folder.
struct Format {
    name: &'static str,
    wholes: Vec<Vec<u8>>,
    ending: &'static str,
    words: &'static str,
}

/// What became of the files of a format.
#[derive(Default)]
struct Tally {
    done: AtomicU64,
    refused: AtomicU64,
    lost: AtomicU64,
    ended: AtomicU64,
    hung: AtomicU64,
    first: Mutex<Option<String>>,
}

/// Damages files of every format in every way. `MUTATIONS` in the environment is the share of the usual counts.
pub fn mutations(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record mutations");
    let share: f64 = std::env::var("MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(1.0);
    let of = |count: u64| ((count as f64 * share) as u64).max(1);
    book.line("a few bytes changed, cut, inserted, repeated, or numbers made extreme");
    book.line(&format!("files to the command, {} GB of memory each:", MEMORY_KB >> 20));
    book.line("format            files     read  refused  data lost  ended the program  hung");
    let mutator = mutator()?;
    for format in formats(book, &mutator)? {
        let files = of(if format.words == INSPECT { FILES } else { FILES_OF_SLOW });
        let tally = damaged_files(book, &format, files)?;
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        book.line(&format!(
            "{:16} {files:6} {:8} {:8} {:10} {:18} {:5}",
            format.name,
            count(&tally.done),
            count(&tally.refused),
            count(&tally.lost),
            count(&tally.ended),
            count(&tally.hung),
        ));
        if let Some(first) = tally.first.lock().map_err(|e| e.to_string())?.take() {
            book.line(&format!("  the first: {first}"));
        }
    }
    book.line("in one process (`step`: six frames an input):");
    let names = tools::output(&root(), &mutator.to_string_lossy(), &["--list"])?;
    for (number, name) in names.lines().enumerate() {
        let inputs = match name {
            "step" => SIXES,
            name if name.starts_with("packets") => PACKETS,
            _ => INPUTS,
        };
        // A promise that was broken belongs in the record, so what the program ends with is not looked at.
        let said = book.bash(&root(), &format!("'{}' {name} --inputs {}", mutator.display(), of(inputs)))?;
        said.lines().skip(usize::from(number > 0)).for_each(|line| book.line(line));
    }
    Ok(())
}

/// The mutator of one process.
fn mutator() -> Result<PathBuf> {
    let words = ["build", "--release", "--quiet", "--package", "umbracast-fuzz"];
    tools::output(&root(), "cargo", &words)?;
    Ok(tools::target().join("release").join(format!("umbracast-fuzz{}", std::env::consts::EXE_SUFFIX)))
}

/// What reads a file and no more.
const INSPECT: &str = "inspect {}";

/// Whole files: those of the mutator, and tables and a recording of a simulated scene.
fn formats(book: &Book, mutator: &Path) -> Result<Vec<Format>> {
    let made = book.scratch("whole");
    fs::create_dir_all(&made).map_err(|e| e.to_string())?;
    let at = |name: &str| made.join(name);
    let read = |file: PathBuf| fs::read(&file).map_err(|e| format!("{}: {e}", file.display()));
    let (sim, run) = (at("sim").display().to_string(), at("run").display().to_string());
    book.quietly(&["simulate", "--people", "2", "--stroll", "1", "--out", &sim].map(Into::into))?;
    book.quietly(&["run", &sim, "--out", &run].map(Into::into))?;
    tools::output(&root(), &mutator.to_string_lossy(), &["--corpus", &made.display().to_string()])?;
    let corpus = |target: &str| {
        tools::files_below(&at(target), "").into_iter().map(read).collect::<Result<Vec<Vec<u8>>>>()
    };
    let format = |name, wholes, ending, words| Format { name, wholes, ending, words };
    // The last of the weights is no weights' file, but one of another network.
    let mut weights = corpus("weights")?;
    weights.truncate(2);
    let simulated = read(at("sim/scene-0000.mcap"))?;
    let tables = |names: &[&str]| {
        names.iter().map(|name| read(at(&format!("run/{name}.parquet")))).collect::<Result<_>>()
    };
    let simulate = "simulate --trajectories {} --out {out}";
    Ok(vec![
        format("mcap", corpus("mcap")?, "mcap", INSPECT),
        format("parquet", tables(&["detections", "links", "tracks"])?, "parquet", INSPECT),
        format("csv", corpus("csv")?, "csv", INSPECT),
        format("ndjson", corpus("ndjson")?, "ndjson", INSPECT),
        format("petrack", corpus("petrack")?, "txt", INSPECT),
        format("bvh", corpus("bvh")?, "bvh", INSPECT),
        format("pcap", corpus("pcap")?, "pcap", INSPECT),
        format("pcd", corpus("pcd")?, "pcd", INSPECT),
        format("toml", corpus("toml")?, "toml", INSPECT),
        format("weights", weights.clone(), "safetensors", INSPECT),
        // As a recorder leaves it that was killed: the first chunk and the beginning of the next.
        format(
            "mcap, run",
            vec![simulated[..simulated.len().min(200_000)].to_vec()],
            "mcap",
            "run {} --out {out}",
        ),
        format("tables, evaluate", tables(&["tracks"])?, "parquet", "evaluate {out} --truth SIM"),
        format("csv, simulate", corpus("csv")?, "csv", simulate),
        format("ndjson, simulate", corpus("ndjson")?, "ndjson", simulate),
        format("petrack, simulate", corpus("petrack")?, "txt", simulate),
        format("weights, run", weights, "safetensors", "run SIM --mode paper --weights {} --out {out}"),
    ])
}

fn damaged_files(book: &Book, format: &Format, files: u64) -> Result<Tally> {
    let (tally, next) = (Tally::default(), AtomicU64::new(0));
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    let batch = if format.words == INSPECT { BATCH } else { 1 };
    std::thread::scope(|scope| {
        let worker = |thread: usize| {
            let (tally, next) = (&tally, &next);
            move || -> Result<()> {
                let folder = book.scratch(&format!("worker-{thread}"));
                fs::create_dir_all(folder.join("out")).map_err(|e| e.to_string())?;
                loop {
                    let from = next.fetch_add(batch, Ordering::Relaxed);
                    if from >= files {
                        return Ok(());
                    }
                    let seeds: Vec<u64> = (from..files.min(from + batch)).collect();
                    let damaged = written(format, &folder, &seeds)?;
                    // Where a process ends or hangs, each file is given to one of its own.
                    if batch == 1 || !tally.note_batch(&told(book, format, &folder, &damaged)?) {
                        for (seed, file) in seeds.iter().zip(&damaged) {
                            tally.note(*seed, &told(book, format, &folder, std::slice::from_ref(file))?);
                        }
                    }
                }
            }
        };
        let handles: Vec<_> = (0..threads).map(|thread| scope.spawn(worker(thread))).collect();
        handles
            .into_iter()
            .try_for_each(|handle| handle.join().map_err(|_| "a worker panicked".to_owned())?)
    })?;
    Ok(tally)
}

/// The damaged files of these seeds.
fn written(format: &Format, folder: &Path, seeds: &[u64]) -> Result<Vec<PathBuf>> {
    let mut bytes = Vec::new();
    let write = |(place, seed): (usize, &u64)| {
        let whole = &format.wholes[*seed as usize % format.wholes.len()];
        damage(whole, &mut Random::new(*seed), &mut bytes);
        let file = folder.join(format!("damaged-{place}.{}", format.ending));
        fs::write(&file, &bytes).map_err(|e| e.to_string())?;
        Ok(file)
    };
    seeds.iter().enumerate().map(write).collect()
}

/// What a process came to: its exit code, none where a signal ended it; what it said.
struct Told {
    hung: bool,
    code: Option<i32>,
    out: String,
    err: String,
}

fn told(book: &Book, format: &Format, folder: &Path, files: &[PathBuf]) -> Result<Told> {
    let (whole, out) = (book.scratch("whole"), folder.join("out"));
    if format.words.starts_with("evaluate") {
        for entry in fs::read_dir(whole.join("run")).map_err(|e| e.to_string())?.flatten() {
            let _ = fs::copy(entry.path(), out.join(entry.file_name()));
        }
        fs::copy(&files[0], out.join("tracks.parquet")).map_err(|e| e.to_string())?;
    }
    let words = format.words.split(' ').flat_map(|word| match word {
        "{}" => files.to_vec(),
        "{out}" => vec![out.clone()],
        "SIM" => vec![whole.join("sim")],
        other => vec![other.into()],
    });
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\"")]).arg(book.umbracast());
    let [said_out, said_err] = ["out.txt", "err.txt"].map(|name| folder.join(name));
    let create = |file: &Path| fs::File::create(file).map_err(|e| e.to_string());
    command.args(words).arg("--quiet").current_dir(root()).stdin(Stdio::null());
    command.stdout(create(&said_out)?).stderr(create(&said_err)?);
    let mut child = command.spawn().map_err(|e| format!("sh: {e}"))?;
    let text = |file: &Path| String::from_utf8_lossy(&fs::read(file).unwrap_or_default()).into_owned();
    #[allow(clippy::disallowed_methods)] // Nothing but the clock of this machine tells that a command hangs.
    let begun = Instant::now();
    let mut pause = Duration::from_micros(500);
    loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            return Ok(Told { hung: false, code: status.code(), out: text(&said_out), err: text(&said_err) });
        }
        if begun.elapsed() > LONGEST {
            let _ = child.kill();
            let _ = child.wait();
            return Ok(Told { hung: true, code: None, out: String::new(), err: String::new() });
        }
        std::thread::sleep(pause);
        pause = (pause * 5 / 4).min(Duration::from_millis(50));
    }
}

impl Tally {
    /// Counts the files of a process that read several; false where it ended before it was through.
    fn note_batch(&self, told: &Told) -> bool {
        if !matches!(told.code, Some(0 | 1 | 3)) {
            return false;
        }
        let count = |what: &str| told.out.lines().filter(|line| line.starts_with(what)).count() as u64;
        let (refused, lost) = (count("  not understood  "), count("  lost  "));
        let files = told.out.lines().filter(|line| !line.starts_with("  ")).count() as u64;
        self.refused.fetch_add(refused, Ordering::Relaxed);
        self.lost.fetch_add(lost, Ordering::Relaxed);
        self.done.fetch_add(files - refused - lost, Ordering::Relaxed);
        true
    }

    /// Counts the file of a process of its own.
    fn note(&self, seed: u64, told: &Told) {
        let of = match told.code {
            _ if told.hung => &self.hung,
            Some(0) => &self.done,
            Some(1 | 2) => &self.refused,
            Some(3) => &self.lost,
            _ => &self.ended,
        };
        of.fetch_add(1, Ordering::Relaxed);
        if (std::ptr::eq(of, &self.ended) || told.hung)
            && let Ok(mut first) = self.first.lock()
        {
            let last = told.err.trim().lines().rev().take(2).collect::<Vec<_>>().join(" | ");
            first.get_or_insert_with(|| format!("seed {seed}, code {:?}: {last}", told.code));
        }
    }
}
