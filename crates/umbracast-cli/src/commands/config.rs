//! `config`: the commented default, the complete values of a mode, or a check of a file.

use umbracast::Error;
use umbracast::config::DEFAULT_TOML;

use super::live;
use crate::ending::Ending;
use crate::{args, say, setup};

/// Prints or checks.
pub fn run(args: &args::Config) -> Result<Ending, Error> {
    if let Some(file) = &args.check {
        // A file is of the mode asked for, else of the one it names.
        let config = match args.mode {
            Some(mode) => setup::config(mode, Some(file))?,
            None => setup::config_of_file(file)?,
        };
        say::line(format_args!("{}: understood", file.display()));
        // Recordings need no more, but sensors do.
        if let Err(error) = live::doors(&config.site, None, false) {
            say::note(&format!("`live` and `check` ask for more than `run`: {error}"));
        }
    } else if let Some(mode) = args.mode {
        say::text(&setup::config(mode, None)?.to_toml());
    } else {
        say::text(DEFAULT_TOML);
    }
    Ok(Ending::Done)
}
