//! What commands read: scenes on their site, and the hall without people.

use std::path::{Path, PathBuf};

use umbracast::{Error, Frame, Health, Site};
use umbracast_io::input::{self, Given, Input, Inputs};
use umbracast_io::reports::{Reports, Tabled};

use crate::args::{CaptureArgs, Common};
use crate::say;

/// Somebody who walks has shown it after so many frames, and the background is known.
const FRAMES_MIN: u64 = 20;

/// What it means that nobody has shown the empty hall, in a scene of so many frames.
pub fn no_empty_hall(frames: u64) -> String {
    let of_frames = match frames {
        0..FRAMES_MIN => format!(
            "; in {frames} frame(s) nobody was seen to walk, so any of those found may be a piece of furniture"
        ),
        _ => String::new(),
    };
    format!(
        "no empty hall was given, so the background was learned on the way: people who stand from the start cannot be told from \
         furniture, and the first frames cannot be trusted{of_frames}. Record two seconds without people and give them with --empty"
    )
}

/// The scenes that arguments name. Without a site file the site is that of the recordings. Says of each capture which sensor
/// it is of.
pub fn read(
    paths: &[PathBuf],
    captures: &CaptureArgs,
    site_file: Option<&Path>,
    site: &mut Site,
    common: &Common,
) -> Result<Inputs, Error> {
    let given = Given::of(paths)?;
    if site_file.is_none()
        && let Some(recorded) = given.site()?
    {
        *site = recorded;
    }
    let inputs = given.of_site(site, &captures.told)?;
    inputs.scenes.iter().for_each(|scene| tell_captures(scene, site, common));
    Ok(inputs)
}

/// The frames of the hall without people, and what was lost of them: from the path that is given, or else what was found beside
/// the scenes. None, if there is neither.
pub fn empty_frames(
    given: Option<&Path>,
    found: Option<Input>,
    captures: &CaptureArgs,
    site: &Site,
    health: &mut Health,
    common: &Common,
) -> Result<(Vec<Frame>, Option<String>), Error> {
    let empty = match given {
        Some(path) => Some(input::empty_hall(&[path.to_owned()], site, &captures.told)?),
        None => found,
    };
    let Some(empty) = empty else { return Ok((Vec::new(), None)) };
    tell_captures(&empty, site, common);
    let all: Vec<usize> = (0..site.sensors.len()).collect();
    empty.empty_frames(site, &all, health)
}

/// What access points heard in a scene: as a table has it, else as the recording holds it.
pub fn heard(scene: u32, input: &Input, table: Option<&Tabled>, site: &Site) -> Result<Reports, Error> {
    match (table, input) {
        (Some(table), _) => Ok(table.of_scene(scene)),
        (None, Input::Recording(file)) if site.has_radio() => Reports::recorded(file, site),
        _ => Ok(Reports::default()),
    }
}

fn tell_captures(input: &Input, site: &Site, common: &Common) {
    if !common.quiet {
        input.matched(site).iter().for_each(|line| say::note(line));
    }
}
