//! `fleet`: what runs where.

use std::time::Duration;

use umbracast::Error;
use umbracast_node::fleet;
use umbracast_node::keys::chunk;
use umbracast_node::network::Network;

use crate::args::{self, Common};
use crate::ending::Ending;
use crate::{say, setup};

/// Lists every hall with its nodes, and what is wrong with each.
pub fn run(args: &args::Fleet, common: &Common) -> Result<Ending, Error> {
    let mut network = match &args.site.site {
        Some(path) => Network::of_site_file(&setup::read_text(path)?, path)?,
        None => Network::default(),
    };
    if let Some(hall) = &args.hall {
        chunk(hall).map_err(|e| e.within("--hall"))?;
    }
    if !args.connect.is_empty() {
        network.connect.clone_from(&args.connect);
    }
    let session = network.visit()?;
    let halls = fleet::look(&session, args.hall.as_deref(), Duration::from_secs_f64(args.seconds))?;
    match common.json {
        true => say::line(format_args!("{:#}", fleet::json(&halls))),
        false => say::line(fleet::text(&halls).trim_end()),
    }
    let well = halls.values().any(|hall| !hall.nodes.is_empty()) && halls.values().all(fleet::Hall::is_well);
    Ok(if well { Ending::Done } else { Ending::Wrong })
}
