//! A look at scenes and recordings that chose nothing. It is taken at the end of a piece of work, never to choose.
//! Every look is kept: removing a bad one would make the rest look too good.

use super::book::Book;
use super::crowds::{bodies, recorded};
use crate::tools::{Result, output, root};

/// Seeds that no tuning, no test and no training uses (docs/CONVENTIONS.md gives theirs). The same at every look, so that
/// looks can be compared.
const FIRST_SEED: u64 = 300_000;

/// A captured gait that nothing else uses.
const GAIT: &str = "cmu_walk/scaled_131_02.bvh";

/// Fifteen minutes of one core.
pub fn look(book: &mut Book) -> Result<()> {
    book.adds = true;
    book.command("cargo xtask record locked");
    book.line(&format!("# {}", output(&root(), "date", &["-u", "+%Y-%m-%d %H:%M UTC"])?));
    let seed = |number: u64| (FIRST_SEED + 1000 * number).to_string();
    book.score("orca-03", ["--scenes", "20", "--preset", "orca-03", "--seed", &seed(0)])?;
    book.score("mixed", ["--scenes", "20", "--preset", "mixed", "--seed", &seed(1)])?;
    bodies(book, &["--scenes", "4", "--preset", "orca-03", "--seed", &seed(2)], GAIT)?;
    // The residual learned from 1B, 2C and 2D; 1A, 1C and 2F are shown in the documents.
    let street = ["2A", "2B", "2E"].map(|name| format!("madras/Topview_{name}.csv"));
    recorded(
        book,
        "madras",
        &["--centre", "--seed", &seed(3), "--seconds", "15", "--trajectories"],
        &street,
    )?;
    book.compare()
}
