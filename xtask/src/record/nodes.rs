//! Stages on three hosts, as network namespaces of this one.

use super::book::Book;
use crate::tools::{Result, argument, root};

/// Ten minutes of ten people against one process, to the byte; what the wires carry and add; what happens when something
/// fails. Needs root: the namespaces.
pub fn nodes(book: &mut Book) -> Result<()> {
    // The command of the other records is built without Zenoh.
    let command = argument(book.scratch("umbracast")).to_string_lossy().into_owned();
    let target = crate::tools::target().display().to_string();
    let build = format!(
        "cargo build --release --quiet --package umbracast-cli --features node && \
         cp {target}/release/umbracast {command}"
    );
    let said = book.bash(&root(), &build)?;
    let faults = "cargo run --release --quiet --package umbracast-node --example node_faults --";
    book.command(&format!("{faults} /tmp/umbracast 600 30"));
    book.line(&said);
    let said = book.bash(&root(), &format!("{faults} {command} 600 30"))?;
    book.line(&said);
    Ok(())
}
