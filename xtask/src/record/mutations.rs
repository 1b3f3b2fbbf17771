//! Damaged files given to the command, thousands a format: each must end with one of its exit codes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::book::Book;
use crate::tools::{Result, root};

/// Address space of a command, kilobytes.
const MEMORY_KB: u64 = 6 << 20;
/// A command that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(60);
/// Damaged files of a format that is read within milliseconds, and of one that a simulation or a network reads.
const FILES: u64 = 100_000;
const FILES_OF_SLOW: u64 = 10_000;

/// One format: a whole file, and the words that read it; `{}` stands for the damaged one, `{out}` for a folder.
struct Format {
    name: &'static str,
    whole: PathBuf,
    words: Vec<String>,
    files: u64,
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

/// Damages a file of every format in every way and lets the command read it. `MUTATIONS` in the environment is the share of the
/// usual counts.
pub fn mutations(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record mutations");
    let share: f64 = std::env::var("MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(1.0);
    book.line(&format!(
        "a few bytes changed, cut, inserted, or numbers made extreme; {} GB each",
        MEMORY_KB >> 20
    ));
    book.line("format        files   read  refused  data lost  ended the program  hung");
    for format in formats(book)? {
        let files = ((format.files as f64 * share) as u64).max(1);
        let tally = damage(book, &format, files)?;
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
        book.line(&format!(
            "{:10} {files:8} {:6} {:8} {:10} {:18} {:5}",
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
    Ok(())
}

/// Whole files, made small.
fn formats(book: &Book) -> Result<Vec<Format>> {
    let made = book.scratch("whole");
    fs::create_dir_all(&made).map_err(|e| e.to_string())?;
    let at = |name: &str| made.join(name);
    let save = |name: &str, text: &str| fs::write(at(name), text).map_err(|e| format!("{name}: {e}"));
    let sim = at("sim").display().to_string();
    let run = at("run").display().to_string();
    book.quietly(&["simulate", "--people", "2", "--stroll", "1", "--out", &sim].map(Into::into))?;
    book.quietly(&["run", &sim, "--out", &run].map(Into::into))?;
    let recording = fs::read(at("sim/scene-0000.mcap")).map_err(|e| e.to_string())?;
    // As a recorder leaves it that was killed: the first chunk and the beginning of the next.
    fs::write(at("cut.mcap"), &recording[..recording.len().min(200_000)]).map_err(|e| e.to_string())?;
    let steps = || (0..25).map(|i| (f64::from(i) * 0.1, f64::from(i) * 0.1));
    save(
        "walk.csv",
        &steps().fold("t_s,id,x_m,y_m\n".to_owned(), |text, (t, x)| text + &format!("{t:.1},1,{x:.2},0.5\n")),
    )?;
    let track =
        |i: usize, x: f64| format!("{{\"track\": {{\"f\": {i}, \"p\": 1, \"x\": {x:.2}, \"y\": 0.5}}}}\n");
    let scene = "{\"scene\": {\"id\": 0, \"p\": 1, \"s\": 0, \"e\": 24, \"fps\": 10}}\n".to_owned();
    save("walk.ndjson", &steps().enumerate().fold(scene, |text, (i, (_, x))| text + &track(i, x)))?;
    save(
        "walk.txt",
        &steps().enumerate().fold("# framerate: 10\n".to_owned(), |text, (i, (_, x))| {
            text + &format!("1 {i} {x:.2} 0.5 1.7\n")
        }),
    )?;
    let points = (0..64).fold(String::new(), |text, i| text + &format!("{}.5 {} 1.25\n", i % 8, i / 8));
    save(
        "cloud.pcd",
        &format!(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 64\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 64\nDATA ascii\n{points}"
        ),
    )?;
    fs::write(at("capture.pcap"), capture()).map_err(|e| e.to_string())?;
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let format = |name, whole: PathBuf, line: &str, files| Format { name, whole, words: words(line), files };
    Ok(vec![
        format("mcap", at("cut.mcap"), "inspect {}", FILES),
        format("mcap, run", at("cut.mcap"), "run {} --out {out}", FILES_OF_SLOW),
        format("parquet", at("run/links.parquet"), "inspect {}", FILES),
        format("tables", at("run/tracks.parquet"), "evaluate {out} --truth SIM", FILES_OF_SLOW),
        format("pcap", at("capture.pcap"), "inspect {}", FILES),
        format("pcd", at("cloud.pcd"), "inspect {}", FILES),
        format("toml", root().join("config/sites/glass.toml"), "config --check {}", FILES),
        format("csv", at("walk.csv"), "simulate --trajectories {} --out {out}", FILES_OF_SLOW),
        format("ndjson", at("walk.ndjson"), "simulate --trajectories {} --out {out}", FILES_OF_SLOW),
        format("petrack", at("walk.txt"), "simulate --trajectories {} --out {out}", FILES_OF_SLOW),
        format(
            "weights",
            root().join("models/paper_lstm.safetensors"),
            "run SIM --mode paper --weights {} --out {out}",
            FILES_OF_SLOW,
        ),
    ])
}

/// A capture of three packets of an HDL-32E.
fn capture() -> Vec<u8> {
    let mut bytes =
        vec![0xd4, 0xc3, 0xb2, 0xa1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 1, 0, 0, 0];
    for k in 0..3_u8 {
        let mut datagram = vec![9_u8, 64, 9, 64]; // Ports 2368.
        datagram.extend(1214_u16.to_be_bytes());
        datagram.extend([0, 0]);
        for block in 0..12_u16 {
            datagram.extend([0xff, 0xee]);
            datagram.extend((block * 20 + u16::from(k) * 240).to_le_bytes());
            datagram.extend([0x10, 0x27, 9].repeat(32));
        }
        datagram.extend([k, 0, 0, 0, 0x37, 0x21]);
        let mut packet = [[2_u8; 12].as_slice(), &[8, 0, 0x45, 0]].concat();
        packet.extend((20 + datagram.len() as u16).to_be_bytes());
        packet.extend([0, 0, 0, 0, 64, 17, 0, 0, 192, 168, 1, 201, 255, 255, 255, 255]);
        packet.extend(datagram);
        let length = (packet.len() as u32).to_le_bytes();
        bytes.extend([0, 0, 0, 0, k, 0, 0, 0]);
        bytes.extend([length, length].concat());
        bytes.extend(packet);
    }
    bytes
}

fn damage(book: &Book, format: &Format, files: u64) -> Result<Tally> {
    let whole = fs::read(&format.whole).map_err(|e| format!("{}: {e}", format.whole.display()))?;
    let ending = format.whole.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = book.scratch("undamaged");
    fs::create_dir_all(folder.join("out")).map_err(|e| e.to_string())?;
    match read(book, format, &folder, &format.whole)? {
        Some((Some(0 | 3), _)) => {}
        other => return Err(format!("{}: expected the whole file to be read, found {other:?}", format.name)),
    }
    let (tally, next) = (Tally::default(), AtomicU64::new(0));
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    std::thread::scope(|scope| {
        let worker = |thread: usize| {
            let (tally, next, whole, ending) = (&tally, &next, &whole, &ending);
            move || -> Result<()> {
                let folder = book.scratch(&format!("worker-{thread}"));
                fs::create_dir_all(folder.join("out")).map_err(|e| e.to_string())?;
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= files {
                        return Ok(());
                    }
                    let bytes = damaged(whole, &mut Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1));
                    let file = folder.join(format!("damaged.{ending}"));
                    fs::write(&file, &bytes).map_err(|e| e.to_string())?;
                    let told = read(book, format, &folder, &file)?;
                    tally.note(seed, told);
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

/// The exit code and what was said last; no code where a signal ended the command, no answer where it hung.
fn read(book: &Book, format: &Format, folder: &Path, file: &Path) -> Result<Option<(Option<i32>, String)>> {
    let whole = book.scratch("whole");
    let out = folder.join("out");
    if format.name == "tables" {
        for entry in fs::read_dir(whole.join("run")).map_err(|e| e.to_string())?.flatten() {
            let _ = fs::copy(entry.path(), out.join(entry.file_name()));
        }
        fs::copy(file, out.join("tracks.parquet")).map_err(|e| e.to_string())?;
    }
    let sim = whole.join("sim");
    let words = format.words.iter().map(|word| match word.as_str() {
        "{}" => file.to_path_buf(),
        "{out}" => out.clone(),
        "SIM" => sim.clone(),
        other => other.into(),
    });
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\"")])
        .arg(book.umbracast())
        .args(words);
    let quiet = !matches!(format.name, "toml");
    let said = folder.join("said");
    let stderr = fs::File::create(&said).map_err(|e| e.to_string())?;
    command.args(quiet.then_some("--quiet")).current_dir(root()).stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(stderr).spawn().map_err(|e| format!("sh: {e}"))?;
    #[allow(clippy::disallowed_methods)] // Nothing but the clock of this machine tells that a command hangs.
    let begun = Instant::now();
    let mut pause = Duration::from_micros(500);
    loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            let said = fs::read(&said).unwrap_or_default();
            return Ok(Some((status.code(), String::from_utf8_lossy(&said).trim().to_owned())));
        }
        if begun.elapsed() > LONGEST {
            let _ = child.kill();
            let _ = child.wait();
            return Ok(None);
        }
        std::thread::sleep(pause);
        pause = (pause * 5 / 4).min(Duration::from_millis(50));
    }
}

impl Tally {
    fn note(&self, seed: u64, told: Option<(Option<i32>, String)>) {
        let of = match &told {
            None => &self.hung,
            Some((Some(0), _)) => &self.done,
            Some((Some(1 | 2), _)) => &self.refused,
            Some((Some(3), _)) => &self.lost,
            Some(_) => &self.ended,
        };
        of.fetch_add(1, Ordering::Relaxed);
        if let (true, Some((code, said))) = (std::ptr::eq(of, &self.ended), told)
            && let Ok(mut first) = self.first.lock()
        {
            let last = said.lines().rev().take(2).collect::<Vec<_>>().join(" | ");
            first.get_or_insert_with(|| format!("seed {seed}, code {code:?}: {last}"));
        }
    }
}

/// A file with one to four damages.
fn damaged(whole: &[u8], random: &mut Random) -> Vec<u8> {
    const EXTREME: [u64; 8] = [0, 1, 0x7f, 0xff, 0x7fff_ffff, 0xffff_ffff, 1 << 62, u64::MAX];
    let mut bytes = whole.to_vec();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            break;
        }
        // Heads and tails hold the lengths: half of the damage is done there.
        let at = match random.below(4) {
            0 => random.below(bytes.len().min(512)),
            1 => bytes.len() - 1 - random.below(bytes.len().min(512)),
            _ => random.below(bytes.len()),
        };
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at),
            3 => drop(
                bytes.splice(at..at, (0..random.below(16)).map(|_| random.next() as u8).collect::<Vec<_>>()),
            ),
            4 => drop(bytes.drain(at..(at + random.below(16)).min(bytes.len()))),
            _ => {
                let width = [1, 2, 4, 8][random.below(4)].min(bytes.len() - at);
                let number = EXTREME[random.below(EXTREME.len())].to_le_bytes();
                bytes[at..at + width].copy_from_slice(&number[..width]);
            }
        }
    }
    bytes
}

/// Marsaglia's xorshift. The same seed gives the same damage.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, most: usize) -> usize {
        (self.next() >> 16) as usize % most.max(1)
    }
}
