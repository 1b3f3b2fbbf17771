//! `config`: the commented default, the complete values of a mode, or a check of a file.

use umbracast::config::DEFAULT_TOML;
use umbracast::{Error, Mode};

use crate::{Ending, args, say, setup};

pub fn run(args: &args::Config) -> Result<Ending, Error> {
    match (&args.check, args.mode) {
        (Some(file), mode) => {
            setup::config(mode.unwrap_or(Mode::Default), Some(file))?;
            say::line(format_args!("{}: understood", file.display()));
        }
        (None, Some(mode)) => say::text(&setup::config(mode, None)?.to_toml()),
        (None, None) => say::text(DEFAULT_TOML),
    }
    Ok(Ending::Done)
}
