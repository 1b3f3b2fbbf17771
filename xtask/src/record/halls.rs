//! Many halls on one host: how many it carries, and what gives first.

use super::book::Book;
use super::keep;
use crate::tools::{Result, root};

/// Seconds that each number of halls is looked at.
const SECONDS: u64 = 30;

/// 1 to 64 halls of ten people, two sensors each: front ends simulated, everything behind them one process a hall.
pub fn halls(book: &mut Book) -> Result<()> {
    let picture = book.scratch("halls.svg");
    let build = "cargo build --release --quiet --package umbracast-cli --features node";
    let run = |picture: &str, command: &str| {
        format!(
            "cargo run --release --quiet --package umbracast-node --example halls -- {command} {SECONDS} {picture} 1 2 4 8 16 32 64"
        )
    };
    book.command(build);
    let built = book.bash(&root(), build)?;
    book.line(&built);
    book.command(&run("halls.svg", "target/release/umbracast"));
    let command = book.umbracast().display().to_string();
    let said = book.bash(&root(), &run(&picture.display().to_string(), &command))?;
    book.line(&said);
    keep(book, &picture, "halls.svg")
}
