//! Which sensor a capture is of, where it does not tell by itself.

use std::path::PathBuf;

use clap::Args;
use umbracast::Error;
use umbracast_io::input::Told;

/// What commands that read captures understand.
#[derive(Debug, Clone, Args)]
pub struct CaptureArgs {
    /// The capture FILE, one of those that are given, is of the site's sensor NAME. By default captures find their sensors by
    /// port, address and form of their packets, and by the sensor's name in the file's name.
    #[arg(long = "sensor", value_name = "NAME=FILE", value_parser = told)]
    pub told: Vec<Told>,
}

fn told(text: &str) -> Result<Told, Error> {
    match text.split_once('=') {
        Some((sensor, file)) if !sensor.is_empty() && !file.is_empty() => {
            Ok(Told { sensor: sensor.to_owned(), file: PathBuf::from(file) })
        }
        _ => Err(Error::new(format!("expected NAME=FILE, found {text:?}"))),
    }
}
