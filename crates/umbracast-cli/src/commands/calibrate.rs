//! `calibrate`: finds the poses of a site's sensors from walking people, the floor and the walls.

use std::path::Path;

use umbracast::{Config, Error, Frame, Health, Mode};
use umbracast_calibrate::{Calibration, Frame as Held, of_recording, write_into};
use umbracast_io::input::{Input, Inputs};

use crate::args::{Calibrate, Common};
use crate::ending::Ending;
use crate::inputs;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup;

mod picture;

/// Finds the poses and writes them.
pub fn run(args: &Calibrate, common: &Common) -> Result<Ending, Error> {
    let mut config = setup::config(Mode::Default, args.site.site.as_deref())?;
    let site_file = args.site.site.as_deref();
    let Inputs { scenes, empty } =
        inputs::read(&args.recording, &args.captures, site_file, &mut config.site, common)?;
    let [recording] = &scenes[..] else {
        let found = scenes.len();
        return Err(Error::new(format!("expected one scene, found {found}")));
    };
    let watch = Stopwatch::start();
    let (mut health, mut lost) = (Health::default(), Vec::new());
    let empty = if args.no_empty {
        Vec::new()
    } else {
        let (given, captures) = (args.empty.as_deref(), &args.captures);
        let (frames, told) = inputs::empty_frames(given, empty, captures, &config.site, &mut health, common)?;
        lost.extend(told);
        frames
    };
    let found = found(recording, &config, &empty, &mut health, &mut lost)?;
    let text = args.site.site.as_deref().map_or(Ok(String::new()), setup::read_text)?;
    setup::write(&args.out, write_into(&text, &config.site, &found)?)?;
    let picture = args.picture.clone().unwrap_or_else(|| args.out.with_extension("svg"));
    setup::write(&picture, picture::svg(&config.site, &found)?)?;
    RunJson::new("calibrate", &watch)
        .with("sensors", &found.sensors)
        .with("joint_sightings", found.joint_sightings)
        .with("apart_m", found.apart_m)
        .with("weak", &found.weak)
        .with("told", &found.told)
        .with("doubts", &found.doubts)
        .with("health", health)
        .with("lost", &lost)
        .print(common, &told(&found, args, &picture));
    Ok(match (found.doubts.is_empty(), lost.is_empty()) {
        (true, true) => Ending::Done,
        (true, false) => Ending::DataLost(lost.join("; ")),
        (false, _) => Ending::Doubtful(found.doubts.into_iter().chain(lost).collect::<Vec<_>>().join("; ")),
    })
}

fn found(
    recording: &Input,
    config: &Config,
    empty: &[Frame],
    health: &mut Health,
    lost: &mut Vec<String>,
) -> Result<Calibration, Error> {
    let before = *health;
    // The recording may be read twice: what was skipped and lost counts once.
    let mut told = None;
    let found = of_recording(&config.site, empty, |take| {
        *health = before;
        told = recording.frames(&config.site, health, |frame| {
            take(frame);
            Ok(())
        })?;
        Ok(())
    })?;
    lost.extend(told);
    Ok(found)
}

/// A line a sensor, then what holds them all and what is least known.
fn told(found: &Calibration, args: &Calibrate, picture: &Path) -> String {
    let mut lines = Vec::new();
    for of in &found.sensors {
        let number = |value: f64, sigma: Option<f64>, digits: usize| match sigma {
            Some(sigma) => format!("{value:.digits$} +- {sigma:.digits$}"),
            None => format!("{value:.digits$} (as given)"),
        };
        let ([x, y, z], turn, sigma) = (of.position_m, of.rotation_deg, &of.sigma);
        lines.push(format!("{}: moved {:.3} m, turned {:.2} deg", of.sensor, of.moved_m, of.turned_deg));
        lines.push(format!(
            "  x {} m, y {} m, z {} m",
            number(x, sigma.x_m, 3),
            number(y, sigma.y_m, 3),
            number(z, sigma.z_m, 3)
        ));
        lines.push(format!(
            "  yaw {} deg, pitch {} deg, roll {} deg, clock {} ms",
            number(turn.yaw, sigma.yaw_deg, 3),
            number(turn.pitch, sigma.pitch_deg, 3),
            number(turn.roll, sigma.roll_deg, 3),
            number(of.clock_offset_ms, sigma.clock_ms, 1)
        ));
        let with =
            if of.with.is_empty() { "alone".to_owned() } else { format!("with {}", of.with.join(", ")) };
        let held = match of.frame {
            Held::Walls => "walls",
            Held::SiteFile => "the site file",
        };
        lines.push(format!("  {} ways of people, {with}; frame held by {held}", of.people));
    }
    if found.joint_sightings > 0 {
        let apart_cm = 100.0 * found.apart_m;
        lines.push(format!("{} joint sightings, {apart_cm:.1} cm apart", found.joint_sightings));
    }
    for weak in &found.weak {
        let of: Vec<String> = weak.of.iter().map(|(name, share)| format!("{share:+.2} {name}")).collect();
        lines.push(format!("least known: {:.1} mm along {}", 1e3 * weak.sigma_m, of.join(", ")));
    }
    lines.extend(found.told.iter().cloned());
    lines.push(format!("written: {}, {}", args.out.display(), picture.display()));
    lines.join("\n")
}
