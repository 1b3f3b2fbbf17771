//! `reproduce` as a user and a cluster meet it: whole, stopped, spread and merged, and the job files that do it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

mod common;

use common::folder;

/// Two people who cross in front of the `side` access point, for three seconds.
const CROSSING: &str = "t_s,id,x_m,y_m,height_m\n\
    0.0,1,6.0,-2.0,1.80\n1.0,1,6.0,-0.7,1.80\n2.0,1,6.0,0.6,1.80\n3.0,1,6.0,1.9,1.80\n\
    0.0,2,1.0,0.3,1.70\n1.0,2,0.0,0.3,1.70\n2.0,2,-1.0,0.3,1.70\n3.0,2,-2.0,0.3,1.70\n";

/// `reproduce` on two scenes of the crossing.
fn reproduce(folder: &Path, out: &str, more: &[&str]) -> Output {
    let crossing = folder.join("crossing.csv");
    fs::write(&crossing, CROSSING).expect("writes");
    Command::new(env!("CARGO_BIN_EXE_umbracast"))
        .arg("reproduce")
        .arg("--trajectories")
        .args([&crossing, &crossing])
        .args(["--quiet", "--out"])
        .arg(folder.join(out))
        .args(more)
        .output()
        .expect("starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn done(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", said(output));
    said(output)
}

/// Every file below, without `run.json`, which holds times and machine.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.is_dir() {
                true => folders.push(path),
                false => files.push(path),
            }
        }
    }
    files.retain(|path| path.file_name().is_some_and(|name| name != "run.json"));
    files.sort();
    files.iter().map(|p| (p.strip_prefix(folder).unwrap().to_owned(), fs::read(p).unwrap())).collect()
}

#[test]
fn shards_and_a_merge_write_what_one_run_writes() {
    let folder = folder("shards");
    let text = done(&reproduce(&folder, "whole", &[]));
    assert!(text.contains("AABB") && text.contains("OBB") && text.contains("epochs by its card"), "{text}");
    done(&reproduce(&folder, "a", &["--shard", "0/2"]));
    done(&reproduce(&folder, "b", &["--shard", "1/2"]));
    assert!(!folder.join("a/report.html").exists(), "a shard writes no report");
    let (a, b) = (folder.join("a"), folder.join("b"));
    let (a, b) = (a.to_str().unwrap(), b.to_str().unwrap());
    let too_few = reproduce(&folder, "merged", &["--merge", a]);
    assert_eq!(too_few.status.code(), Some(1));
    assert!(said(&too_few).contains("missing: 1"), "{}", said(&too_few));
    assert_eq!(done(&reproduce(&folder, "merged", &["--merge", a, b])).replace("merged", "whole"), text);
    let (whole, merged) = (contents(&folder.join("whole")), contents(&folder.join("merged")));
    assert!(whole.iter().any(|(name, _)| name.ends_with("scores.csv")) && whole.len() > 10);
    assert_eq!(
        whole.iter().map(|f| &f.0).collect::<Vec<_>>(),
        merged.iter().map(|f| &f.0).collect::<Vec<_>>()
    );
    whole.iter().zip(&merged).for_each(|(a, b)| assert!(a.1 == b.1, "{} differs", a.0.display()));
    // What is there already is not run again, and what belongs to another experiment is refused.
    let again = done(&reproduce(&folder, "whole", &["--json"]));
    assert!(again.starts_with("{\"groups\""), "{again:.40}");
    let other = reproduce(&folder, "whole", &["--seed", "9"]);
    assert_eq!(other.status.code(), Some(1));
    assert!(said(&other).contains("scene-0000.sums") && said(&other).contains("another"), "{}", said(&other));
}

#[test]
fn the_job_files_use_flags_that_exist() {
    let help = Command::new(env!("CARGO_BIN_EXE_umbracast")).args(["reproduce", "--help"]).output().unwrap();
    let help = said(&help);
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    for (file, index) in [
        ("slurm/reproduce.sbatch", "SLURM_ARRAY_TASK_ID"),
        ("kubernetes/reproduce.yaml", "JOB_COMPLETION_INDEX"),
    ] {
        let text = fs::read_to_string(deploy.join(file)).expect(file);
        assert!(text.contains(index), "{file}");
        let commands = text.lines().filter(|line| {
            !line.trim_start().starts_with('#')
                && (line.contains(" reproduce ") || line.contains("\"${reproduce[@]}\""))
        });
        let flags: Vec<String> = commands
            .flat_map(str::split_whitespace)
            .map(|word| word.trim_matches(['\'', ']', '"', ')']).to_owned())
            .filter(|word| word.starts_with("--"))
            .collect();
        for needed in ["--shard", "--merge", "--out", "--threads"] {
            assert!(flags.iter().any(|flag| flag == needed), "{file}: {needed} is not used: {flags:?}");
        }
        for flag in &flags {
            assert!(help.contains(&format!("{flag} ")), "{file}: {flag} does not exist");
        }
    }
}
