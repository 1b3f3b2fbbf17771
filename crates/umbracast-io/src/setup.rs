//! Turns names of files into what a run needs: configuration, weights, text.
//!
//! Every function fails with an error that names the file.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use umbracast::forecast::Weights;
use umbracast::{Config, Error, Mode};

/// The paper's LSTM as `umbracast-train-lstm` made it; its card lies beside the file.
const PAPER_LSTM: &[u8] = include_bytes!("../../../models/paper_lstm.safetensors");
/// Where the embedded weights come from.
pub const PAPER_LSTM_CARD: &str = include_str!("../../../models/paper_lstm.md");

/// The mode's values with the user's file laid over them.
pub fn config(mode: Mode, site: Option<&Path>) -> Result<Config, Error> {
    let Some(path) = site else { return Ok(Config::for_mode(mode)) };
    let config = Config::with_overlay(mode, &read_text(path)?, &path.display().to_string())?;
    with_calibrations(config, path)
}

/// The configuration of a file, of the mode that it names.
pub fn config_of_file(path: &Path) -> Result<Config, Error> {
    let config = Config::of_run(&read_text(path)?, &path.display().to_string())?;
    with_calibrations(config, path)
}

/// With the sensors' own files, whose paths go from the site file's folder.
fn with_calibrations(config: Config, site: &Path) -> Result<Config, Error> {
    let folder = site.parent().unwrap_or(Path::new(""));
    config.with_calibrations(|file| read_text(&folder.join(file))).map_err(|e| e.within(site.display()))
}

/// The configuration that a run wrote into its folder.
pub fn config_of_run(folder: &Path) -> Result<Config, Error> {
    config_of_file(&folder.join("config.toml"))
}

/// The weights given, or the embedded ones.
pub fn weights(file: Option<&Path>) -> Result<Weights, Error> {
    let bytes = weights_file(file)?;
    Weights::from_safetensors(&bytes).map_err(|e| match file {
        Some(path) => e.within(path.display()),
        None => e,
    })
}

/// The bytes of the weights given, or of the embedded ones.
pub fn weights_file(file: Option<&Path>) -> Result<Cow<'static, [u8]>, Error> {
    file.map_or(Ok(Cow::Borrowed(PAPER_LSTM)), |path| read(path).map(Cow::Owned))
}

/// A file's bytes, or an error that names it.
pub fn read(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|e| Error::new(e.to_string()).within(path.display()))
}

/// A file's text, or an error that names it.
pub fn read_text(path: &Path) -> Result<String, Error> {
    String::from_utf8(read(path)?)
        .map_err(|e| Error::new(format!("expected UTF-8 text, found {e}")).within(path.display()))
}

/// Writes a file whole.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Error> {
    fs::write(path, bytes).map_err(|e| Error::new(e.to_string()).within(path.display()))
}

/// Makes a folder for output.
pub fn make_dir(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(|e| Error::new(e.to_string()).within(path.display()))
}

/// Files of a folder that end in `.extension`, in natural order: `2.pcd` before `10.pcd`.
pub fn files_with_extension(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, Error> {
    let entries = fs::read_dir(folder).map_err(|e| Error::new(e.to_string()).within(folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .collect();
    sort_naturally(&mut files);
    Ok(files)
}

/// `2.pcd` before `10.pcd`, names without a number last.
pub fn sort_naturally(files: &mut [PathBuf]) {
    files.sort_by_key(|path| (number_of(path).unwrap_or(u64::MAX), path.clone()));
}

/// The number that a file is named by: 70 of `70.pcd`.
pub fn number_of(path: &Path) -> Option<u64> {
    path.file_stem()?.to_str()?.parse().ok()
}
