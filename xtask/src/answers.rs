//! What the program answers to a fixed handful of questions, kept in `record/answers.txt`: scenes of two crowds in three modes,
//! real walkers, real captures. A record names the digest of that file, so that everybody sees whether its figures are of the
//! present program. Questions about radios stand in a file of their own, `record/answers-radio.txt`: only records of radios depend on
//! them, and name the digest of both files.
//!
//! The answers are scores and counts as they are printed, not bytes of tables: another processor may round a last bit otherwise.
//! For the same reason the present answers are compared with those that are kept within a tolerance, and the digest is that of
//! the file. It changes only when somebody writes the file anew because answers moved.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Numbers that differ by less are the same answer.
const SAME: f64 = 0.0021;
/// One question: its name, whether it needs the real data, and the words that `umbracast` is asked with. `DATA` stands for the
/// folder of the real data, `OUT` and `SIM` for ones to write to.
type Question = (&'static str, bool, &'static [&'static str]);

/// Questions whose answers are kept in one file.
pub struct Asked {
    /// Below the repository's folder.
    pub file: &'static str,
    questions: &'static [Question],
}

/// What every record depends on, and what records of radios do.
pub const ASKED: [Asked; 2] = [
    Asked { file: "record/answers.txt", questions: &QUESTIONS },
    Asked { file: "record/answers-radio.txt", questions: &RADIO },
];

const RADIO: [Question; 4] = [
    (
        "losses",
        false,
        &[
            "network",
            "--losses",
            "--scenes",
            "1",
            "--people",
            "8",
            "--seconds",
            "25",
            "--seed",
            "100800",
            "--carrier",
            "28,140",
            "--truth",
            "edges",
        ],
    ),
    (
        "policies",
        false,
        &[
            "network",
            "--scenes",
            "1",
            "--people",
            "8",
            "--seconds",
            "30",
            "--seed",
            "100810",
            "--carrier",
            "28",
            "--margin",
            "15",
            "--truth",
            "edges",
            "--own-body",
            "--policies",
            "conditional-60-40,forecast,forecast-with-beams,oracle",
        ],
    ),
    (
        "devices",
        false,
        &[
            "network",
            "--dataset",
            "SIM",
            "--scenes",
            "1",
            "--people",
            "6",
            "--seconds",
            "20",
            "--seed",
            "100820",
            "--carrier",
            "28",
            "--truth",
            "edges",
        ],
    ),
    ("power heard", false, &["network", "--measured", "SIM", "--reports", "SIM/reports.parquet"]),
];

const QUESTIONS: [Question; 9] = [
    (
        "crossing",
        false,
        &["evaluate", "--scenes", "1", "--people", "6", "--preset", "orca-03", "--seed", "100500"],
    ),
    (
        "mixed",
        false,
        &["evaluate", "--scenes", "1", "--preset", "mixed", "--seed", "100600", "--mode", "default"],
    ),
    (
        "walkers",
        true,
        &[
            "evaluate",
            "--mode",
            "default",
            "--centre",
            "--unit",
            "cm",
            "--fps",
            "25",
            "--seconds",
            "6",
            "--trajectories",
            "DATA/circle_antipode/circle-10m-08-1x.txt",
        ],
    ),
    (
        "people from the first frame on",
        false,
        &[
            "simulate",
            "--preset",
            "orca-03",
            "--scenes",
            "1",
            "--people",
            "5",
            "--seed",
            "100700",
            "--site",
            "config/sites/l-hall.toml",
            "--out",
            "SIM",
        ],
    ),
    (
        "without an empty scan",
        false,
        &["run", "--no-empty", "--mode", "default", "--out", "OUT", "SIM/scene-0000.mcap"],
    ),
    ("their scores", false, &["evaluate", "OUT", "--truth", "SIM"]),
    ("capture", true, &["inspect", "DATA/hdl32e/hdl32_example.pcap"]),
    (
        "clouds",
        true,
        &[
            "run",
            "DATA/logictronix_vlp16/pcd",
            "--site",
            "config/sites/logictronix.toml",
            "--mode",
            "default",
            "--out",
            "OUT",
        ],
    ),
    ("labels", true, &["evaluate", "OUT", "--labels", "DATA/logictronix_vlp16/labels.csv"]),
];

/// What a program answers now, question by question; those that need the data only where there is some.
pub fn ask(asked: &Asked, umbracast: &Path, root: &Path, data: Option<&Path>) -> Result<String, String> {
    let name = asked.file.trim_start_matches("record/").trim_end_matches(".txt");
    let out = std::env::temp_dir().join(format!("umbracast-{name}-{}", std::process::id()));
    let sim = out.with_extension("sim");
    let mut text = String::new();
    for (name, needs_data, words) in
        asked.questions.iter().filter(|(_, needs_data, _)| !needs_data || data.is_some())
    {
        let data = data.map(|data| data.display().to_string()).unwrap_or_default();
        let [sim, out_name] = [&sim, &out].map(|path| path.display().to_string());
        let words = words
            .iter()
            .map(|word| word.replace("DATA", &data).replace("OUT", &out_name).replace("SIM", &sim));
        let done = Command::new(umbracast).args(words).arg("--quiet").current_dir(root).output();
        let done = done.map_err(|e| format!("{}: {e}", umbracast.display()))?;
        if !matches!(done.status.code(), Some(0 | 3)) {
            return Err(format!("{name}: {}: {}", done.status, String::from_utf8_lossy(&done.stderr)));
        }
        text += &format!("{name}{}\n", if *needs_data { ", real data" } else { "" });
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        for line in said.lines().filter(|line| tells(line)) {
            let line = without(&without(line, &data, "DATA"), &sim, "SIM");
            let line = without(&line, &out_name, "OUT");
            let line = line.split("; ").filter(|part| !takes(part)).collect::<Vec<_>>().join("; ");
            text += &format!("  {}\n", line.split_whitespace().collect::<Vec<_>>().join(" "));
        }
    }
    let _ = (fs::remove_dir_all(out), fs::remove_dir_all(&sim));
    Ok(text)
}

/// The line with a folder's name in place of its path; without real data there is no path.
fn without(line: &str, path: &str, name: &str) -> String {
    if path.is_empty() { line.to_owned() } else { line.replace(path, name) }
}

/// Everything but how long something took.
fn tells(line: &str) -> bool {
    let is_time = !line.contains("; ") && takes(line);
    !line.trim().is_empty() && !is_time && !line.contains(" frames in ")
}

fn takes(part: &str) -> bool {
    part.contains(" ms a frame")
}

/// The first lines that differ by more than the tolerance, or whose words differ. Questions that were not asked now, for there is
/// no real data here, are passed over.
pub fn differences(kept: &str, found: &str) -> Vec<String> {
    let mut told = Vec::new();
    for (name, lines) in parts(found) {
        let Some((_, before)) = parts(kept).into_iter().find(|(of, _)| *of == name) else {
            told.push(format!("{name}: not asked before"));
            continue;
        };
        if lines.len() != before.len() {
            told.push(format!("{name}: expected {} lines, found {}", before.len(), lines.len()));
        }
        let moved = before.iter().zip(&lines).filter(|(before, now)| !same(before, now));
        told.extend(moved.map(|(before, now)| format!("{name}: expected {before:?}, found {now:?}")));
    }
    told
}

fn parts(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut parts: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in text.lines() {
        match (line.strip_prefix("  "), parts.last_mut()) {
            (Some(line), Some((_, lines))) => lines.push(line),
            _ => parts.push((line, Vec::new())),
        }
    }
    parts
}

fn same(before: &str, now: &str) -> bool {
    let bare = |word: &str| word.trim_matches(|c: char| "[](),;:%".contains(c)).to_owned();
    let (before, now): (Vec<&str>, Vec<&str>) = (before.split(' ').collect(), now.split(' ').collect());
    before.len() == now.len()
        && before.iter().zip(&now).all(|(a, b)| match (bare(a).parse::<f64>(), bare(b).parse::<f64>()) {
            (Ok(a), Ok(b)) => (a - b).abs() <= SAME.max(0.005 * a.abs()),
            _ => a == b,
        })
}

/// Ten hexadecimal digits: FNV-1a of the kept answers.
pub fn digest(kept: &str) -> String {
    let fold = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    format!("{:010x}", kept.bytes().fold(0xcbf2_9ce4_8422_2325, fold) >> 24)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEPT: &str =
        "crossing\n  side 300 ms F1 0.944 [0.939, 0.948]\n  recall 0.996\nwalkers, real data\n  F1 0.89\n";

    #[test]
    fn a_last_digit_is_the_same_answer_and_a_hundredth_is_not() {
        let rounded = "crossing\n  side 300 ms F1 0.945 [0.939, 0.949]\n  recall 0.996\n";
        assert!(differences(KEPT, rounded).is_empty(), "{:?}", differences(KEPT, rounded));
        let moved = KEPT.replace("0.944", "0.954");
        assert_eq!(differences(KEPT, &moved).len(), 1);
        assert_eq!(differences(KEPT, "crossing\n  recall 0.996\n").len(), 2);
        assert_eq!(differences(KEPT, &KEPT.replace("recall", "precision")).len(), 1);
    }

    #[test]
    fn without_real_data_a_line_stays_as_it_is() {
        assert_eq!(without("recall 0.9", "", "DATA"), "recall 0.9");
        assert_eq!(without("/x/a.pcap: 3 packets", "/x", "DATA"), "DATA/a.pcap: 3 packets");
    }

    #[test]
    fn a_digest_is_that_of_the_kept_answers() {
        assert_eq!(digest(KEPT).len(), 10);
        assert_ne!(digest(KEPT), digest(&KEPT.replace("0.996", "0.997")));
    }
}
