//! The scores of the modes, and the paper's experiment.

use std::ffi::OsString;
use std::path::PathBuf;

use super::book::Book;
use super::keep;
use crate::tools::{Result, argument, root};

/// The default mode on 100 test scenes.
pub fn headline(book: &mut Book) -> Result<()> {
    let out = book.scratch("headline");
    evaluate(book, &["--scenes", "100", "--preset", "orca-03", "--mode", "default"], out.into())
}

/// Every mode on 40 test scenes. The page holds baselines, error budget and ladder too.
pub fn modes(book: &mut Book) -> Result<()> {
    let out = book.scratch("orca");
    evaluate(book, &["--scenes", "20", "--preset", "orca-03,orca-06"], argument(&out))?;
    keep(book, &out.join("report.html"), "orca-40-scenes.html")
}

/// Real walkers, every mode.
pub fn antipode(book: &mut Book) -> Result<()> {
    let walkers = ["circle-10m-08-2.txt", "circle-10m-16-2.txt"];
    let walkers = walkers.map(|name| book.data(&format!("circle_antipode/{name}")));
    let mut words: Vec<OsString> =
        ["evaluate", "--centre", "--unit", "cm", "--fps", "25", "--out"].map(Into::into).into();
    words.extend([argument(book.scratch("walkers")), "--trajectories".into()]);
    for walkers in walkers {
        words.push(walkers?);
    }
    book.umbracast_says(words)
}

/// Why the paper's figures are what they are. Tuning scenes, without data.
pub fn explain(book: &mut Book) -> Result<()> {
    let line = "cargo run --release --quiet -p umbracast-eval --example explain -- 2 record/explain.svg";
    super::house::script(book, line, line)
}

/// What the program learned of ten bodies after ten seconds.
pub fn bodies(book: &mut Book) -> Result<()> {
    let line = "cargo run --release --quiet -p umbracast-eval --example bodies -- record/bodies.svg";
    super::house::script(book, line, line)
}

/// Each mechanism of the default mode off alone.
pub fn ablation(book: &mut Book) -> Result<()> {
    let out = book.scratch("ablation");
    let words = ["ablate", "--scenes", "5", "--out"].map(OsString::from);
    book.umbracast_says(words.into_iter().chain([argument(&out)]))?;
    keep(book, &out.join("ablation.csv"), "ablation.csv")?;
    keep(book, &out.join("ablation.svg"), "ablation.svg")
}

/// The paper's experiment in 40 scenes, with the LSTM that ships.
pub fn reproduce_quick(book: &mut Book) -> Result<()> {
    let out = book.scratch("reproduce");
    let line = format!("time umbracast reproduce --quick --out {} --quiet", out.display());
    book.command(&line);
    let said = book.bash(&root(), &line)?;
    book.line(&said);
    Ok(())
}

/// The paper's experiment whole, training first: half an hour on two cores. `REPRODUCE` names a folder in which an earlier
/// try is gone on with.
pub fn reproduce(book: &mut Book) -> Result<()> {
    let out = std::env::var_os("REPRODUCE").map_or_else(|| book.scratch("reproduce"), PathBuf::from);
    let trained = book.scratch("trained");
    let weights = trained.join("paper_lstm.safetensors");
    let recorded = |text: &str| text.replace(&*out.to_string_lossy(), "/tmp/reproduce");
    for line in [
        format!(
            "cargo run --release --quiet --manifest-path train/Cargo.toml -- --quiet --out {}",
            trained.display()
        ),
        format!("time umbracast reproduce --weights {} --out {} --quiet", weights.display(), out.display()),
    ] {
        book.command(&recorded(&line));
        let said = book.bash(&root(), &line)?;
        book.line(&recorded(&said));
    }
    keep(book, &out.join("boxes.svg"), "reproduce-boxes.svg")
}

fn evaluate(book: &mut Book, words: &[&str], out: OsString) -> Result<()> {
    let words = [&["evaluate"], words, &["--out"]].concat().into_iter().map(OsString::from);
    book.umbracast_says(words.chain([out]))
}
