//! `same-tables`: whether a revision and the working tree write the same tables, byte for byte. It shows that moved
//! code still does the same.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::tools::{Result, argument, built, data, files_below, output, root, target};

const MODES: [&str; 3] = ["hdl", "paper", "default"];

/// What is simulated and run. Tuning seeds: nobody learns a score here.
struct Case {
    name: &'static str,
    /// For `simulate`, or for `run` where there are clouds.
    words: Vec<OsString>,
    /// A folder of clouds in place of a simulation.
    clouds: Option<PathBuf>,
}

/// A command and the tree that it reads its files from: each revision has its own.
struct Version {
    umbracast: PathBuf,
    tree: PathBuf,
    out: PathBuf,
}

/// Builds both, runs both, compares.
pub fn run(revision: &str) -> Result<()> {
    let folder = target().join("same-tables");
    let (then, now) = (version_at(revision, &folder)?, version_here(&folder)?);
    let mut tables = 0;
    for case in cases() {
        let (one, other) = std::thread::scope(|scope| {
            let one = scope.spawn(|| make(&then, &case));
            let other = make(&now, &case);
            (one.join().unwrap_or_else(|_| Err("a thread panicked".to_owned())), other)
        });
        one.and(other).map_err(|error| format!("{}: {error}", case.name))?;
        tables += compare(&then.out, &now.out).map_err(|error| format!("{}: {error}", case.name))?;
        println!("{}: the same", case.name);
    }
    println!("{tables} tables, the same bytes at {revision} and here");
    Ok(())
}

fn cases() -> Vec<Case> {
    let words = |text: &str| text.split_whitespace().map(OsString::from).collect::<Vec<OsString>>();
    let simulated = |name, text: &str| Case { name, words: words(text), clouds: None };
    let mut cases = vec![
        simulated("orca-03", "--scenes 2 --preset orca-03 --seed 100000"),
        simulated("mixed", "--preset mixed --seed 100010"),
        simulated("pairs, sensors at 6 m", "--preset pairs --seed 100020 --site config/sites/height-6.toml"),
    ];
    let Some(data) = data() else {
        println!("UMBRACAST_DATA is not set: no real walkers, no clouds of a real sensor");
        return cases;
    };
    let mut walkers = words("--seed 100030 --centre --unit cm --fps 25 --trajectories");
    walkers.push(argument(data.join("circle_antipode/circle-10m-16-2.txt")));
    cases.push(Case { name: "real walkers", words: walkers, clouds: None });
    let site = words("--site config/sites/logictronix.toml");
    cases.push(Case { name: "a real VLP-16", words: site, clouds: Some(data.join("logictronix_vlp16/pcd")) });
    cases
}

/// The command at a revision, from a working tree of its own; what was built once is not built again.
fn version_at(revision: &str, folder: &Path) -> Result<Version> {
    let root = root();
    let hash = output(&root, "git", &["rev-parse", "--short=10", &format!("{revision}^{{commit}}")])?;
    let tree = folder.join("tree");
    let place = tree.to_string_lossy().into_owned();
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    output(&root, "git", &["worktree", "prune"])?;
    if tree.exists() {
        output(&tree, "git", &["checkout", "--quiet", "--force", "--detach", &hash])?;
    } else {
        output(&root, "git", &["worktree", "add", "--quiet", "--force", "--detach", &place, &hash])?;
    }
    let umbracast = folder.join(format!("umbracast-{hash}"));
    if !umbracast.exists() {
        // A build folder of its own: cargo tells path packages apart by their place within the workspace, which is the
        // same in both trees.
        let built = built(&tree, &folder.join("build"))?;
        fs::copy(&built, &umbracast).map_err(|e| format!("{}: {e}", built.display()))?;
    }
    Ok(Version { umbracast, tree, out: folder.join("then") })
}

fn version_here(folder: &Path) -> Result<Version> {
    Ok(Version { umbracast: built(&root(), &target())?, tree: root(), out: folder.join("now") })
}

/// Simulates a case and runs every mode on it, into an empty folder.
fn make(version: &Version, case: &Case) -> Result<()> {
    let out = &version.out;
    let _ = fs::remove_dir_all(out);
    fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    let input = match &case.clouds {
        Some(clouds) => clouds.clone(),
        None => {
            let mut words = vec![OsString::from("simulate")];
            words.extend(case.words.iter().cloned());
            words.extend(["--out".into(), argument(out.join("sim"))]);
            umbracast(version, words)?;
            out.join("sim")
        }
    };
    for mode in MODES {
        let mut words = vec!["run".into(), argument(&input), "--mode".into(), mode.into()];
        if case.clouds.is_some() {
            words.extend(case.words.iter().cloned());
        }
        words.extend(["--out".into(), argument(out.join(mode))]);
        umbracast(version, words)?;
    }
    Ok(())
}

fn umbracast(version: &Version, words: Vec<OsString>) -> Result<()> {
    let mut command = Command::new(&version.umbracast);
    command.args(&words).args(["--quiet", "--threads", "1"]).current_dir(&version.tree);
    let done = command.output().map_err(|e| format!("{}: {e}", version.umbracast.display()))?;
    match done.status.code() {
        Some(0 | 3) => Ok(()),
        _ => Err(format!("{words:?}: {}\n{}", done.status, String::from_utf8_lossy(&done.stderr))),
    }
}

/// How many tables there are; an error names the first that differs.
fn compare(then: &Path, now: &Path) -> Result<usize> {
    let tables = |folder: &Path| -> BTreeSet<PathBuf> {
        let found = files_below(folder, ".parquet");
        found.iter().filter_map(|path| path.strip_prefix(folder).ok()).map(Path::to_path_buf).collect()
    };
    let (of_then, of_now) = (tables(then), tables(now));
    if let Some(lacking) = of_then.symmetric_difference(&of_now).next() {
        return Err(format!("{}: expected on both sides, found on one", lacking.display()));
    }
    if of_then.is_empty() {
        return Err("expected tables, found none".to_owned());
    }
    for table in &of_then {
        let bytes =
            |folder: &Path| fs::read(folder.join(table)).map_err(|e| format!("{}: {e}", table.display()));
        let (one, other) = (bytes(then)?, bytes(now)?);
        if one != other {
            let at = one.iter().zip(&other).position(|(a, b)| a != b).unwrap_or(one.len().min(other.len()));
            return Err(format!(
                "{} differs from byte {at} on; both are in {}",
                table.display(),
                then.parent().unwrap_or(then).display()
            ));
        }
    }
    Ok(of_then.len())
}
