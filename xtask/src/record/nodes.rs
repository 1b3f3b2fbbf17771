//! Stages as nodes: on three hosts, many halls on one, and what the deployment files make of three.

use super::book::Book;
use super::keep;
use crate::tools::{Result, root};

/// Seconds that each number of halls is looked at.
const SECONDS: u64 = 30;
const BUILD: &str = "cargo build --release --quiet --package umbracast-cli --features node";

/// Two minutes of ten people on three hosts against one process, to the byte; what the wires carry and add; what happens
/// when something fails. Needs root: the hosts are network namespaces of this one.
pub fn nodes(book: &mut Book) -> Result<()> {
    built_with_nodes(book)?;
    let run = |command: &str| {
        format!(
            "cargo run --release --quiet --package umbracast-node --example node_faults -- {command} 120 30"
        )
    };
    book.command(&run("umbracast"));
    let command = book.umbracast().display().to_string();
    let said = book.bash(&root(), &run(&command))?;
    book.line(&said);
    Ok(())
}

/// 1 to 64 halls of ten people, two sensors each: front ends simulated, everything behind them one process a hall.
pub fn halls(book: &mut Book) -> Result<()> {
    built_with_nodes(book)?;
    let picture = book.scratch("halls.svg");
    let run = |command: &str, picture: &str| {
        format!(
            "cargo run --release --quiet --package umbracast-node --example halls -- {command} {SECONDS} {picture} \
             1 2 4 8 16 32 64 96"
        )
    };
    book.command(&run("umbracast", "halls.svg"));
    let command = book.umbracast().display().to_string();
    let said = book.bash(&root(), &run(&command, &picture.display().to_string()))?;
    book.line(&said);
    keep(book, &picture, "halls.svg")
}

/// The deployment files as a container engine and a cluster would read them.
pub fn deployed(book: &mut Book) -> Result<()> {
    built_with_nodes(book)?;
    for kind in ["compose", "kubernetes"] {
        book.command(&format!("deploy/nodes/try.py umbracast {kind}"));
        let said = book.bash(&root(), &format!("deploy/nodes/try.py \"$(command -v umbracast)\" {kind}"))?;
        book.line(&said);
    }
    Ok(())
}

fn built_with_nodes(book: &mut Book) -> Result<()> {
    book.command(BUILD);
    let said = book.bash(&root(), BUILD)?;
    if said.trim().is_empty() { Ok(()) } else { Err(said) }
}
