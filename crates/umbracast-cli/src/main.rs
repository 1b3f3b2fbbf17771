//! The command `umbracast`.

fn main() {}
