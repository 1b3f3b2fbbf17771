//! Everything that the program learns from data, fitted anew in order: the pose of a body, outlines, the forecast's residual, stage 3's body. Each fit runs the program with what was fitted before it, so the program is built again in between.

use std::fs;
use std::path::Path;

use crate::tools::{Result, Scratch, built, data, output, root, target};

const OUTLINE_HEAD: &str = "# What outlines of usual bodies look like; see outline.md.\n";
const BODY_HEAD: &str = "# The body that a ray meets, in shares of the standing height; see body.md.\n";

/// Recorded people from whom the residual learns.
const RECORDED: [&str; 4] = [
    "pedpy/traj_UNI_CORR_500_01.txt",
    "madras/Topview_1B.csv",
    "madras/Topview_2C.csv",
    "madras/Topview_2D.csv",
];

/// A fit: what it is called, and what makes its model and card from the commit that the card names, in a folder of its own.
type Fit = (&'static str, fn(&str, &Path) -> Result<()>);
const ALL: [Fit; 4] = [("pose", pose), ("outline", outline), ("residual", residual), ("body", body)];

/// Fits these, or all; needs a clean tree, for the cards name its commit.
pub fn run(names: &[&str]) -> Result<()> {
    if let Some(name) = names.iter().find(|name| !ALL.iter().any(|(known, _)| known == *name)) {
        return Err(format!("fit: expected pose, outline, residual or body, found {name:?}"));
    }
    let changed = output(&root(), "git", &["status", "--porcelain", "--untracked-files=no"])?;
    if !changed.is_empty() {
        return Err(format!(
            "fit: expected a tree without changes, for cards name the commit, found\n{changed}"
        ));
    }
    let commit = output(&root(), "git", &["rev-parse", "--short=10", "HEAD"])?;
    for (name, fit) in ALL.iter().filter(|(name, _)| names.is_empty() || names.contains(name)) {
        eprintln!("fit {name}");
        fit(&commit, &Scratch::new(&format!("fit-{name}"))?.0)?;
    }
    Ok(())
}

fn pose(commit: &str, folder: &Path) -> Result<()> {
    umbracast(&["train", "pose", "--commit", commit, "--out", text(folder)?])?;
    ["pose.safetensors", "pose.md"].iter().try_for_each(|name| take(&folder.join(name), name))
}

fn outline(commit: &str, _: &Path) -> Result<()> {
    let fitted = umbracast(&["train", "outline", "--scenes", "32", "--quiet"])?;
    write("outline.toml", &format!("{OUTLINE_HEAD}{fitted}\n"))?;
    name_commit("outline.md", commit)
}

fn residual(commit: &str, folder: &Path) -> Result<()> {
    let data =
        data().ok_or("fit residual: expected the folder of the real data in UMBRACAST_DATA, found none")?;
    let recorded: Vec<String> = RECORDED.iter().map(|file| data.join(file).display().to_string()).collect();
    let mut words = vec!["train", "residual", "--scenes", "96", "--centre", "--commit", commit];
    words.extend(["--out", text(folder)?, "--trajectories"]);
    words.extend(recorded.iter().map(String::as_str));
    umbracast(&words)?;
    ["residual.safetensors", "residual.md"].iter().try_for_each(|name| take(&folder.join(name), name))
}

fn body(commit: &str, _: &Path) -> Result<()> {
    let fitted = umbracast(&["train", "body", "--scenes", "30", "--quiet"])?;
    write("body.toml", &format!("{BODY_HEAD}{fitted}\n"))?;
    name_commit("body.md", commit)
}

/// What the command prints, built from the models as they are now.
fn umbracast(words: &[&str]) -> Result<String> {
    let program = built(&root(), &target())?;
    output(&root(), &program.display().to_string(), words)
}

fn text(path: &Path) -> Result<&str> {
    path.to_str().ok_or_else(|| format!("{}: expected a path in UTF-8", path.display()))
}

fn take(from: &Path, name: &str) -> Result<()> {
    let bytes = fs::read(from).map_err(|e| format!("{}: {e}", from.display()))?;
    let to = root().join("models").join(name);
    fs::write(&to, bytes).map_err(|e| format!("{}: {e}", to.display()))
}

fn write(name: &str, text: &str) -> Result<()> {
    let to = root().join("models").join(name);
    fs::write(&to, text).map_err(|e| format!("{}: {e}", to.display()))
}

/// In a card that is written by hand.
fn name_commit(card: &str, commit: &str) -> Result<()> {
    const BEFORE: &str = "at commit `";
    let path = root().join("models").join(card);
    let old = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (head, rest) = old
        .split_once(BEFORE)
        .ok_or_else(|| format!("{}: expected {BEFORE:?}, found none", path.display()))?;
    let (_, tail) = rest.split_once('`').unwrap_or_default();
    write(card, &format!("{head}{BEFORE}{commit}`{tail}"))
}
