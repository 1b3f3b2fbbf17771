//! `plan`: a hall before anybody hangs a sensor, on a page, or the best places on the terminal.

use std::path::Path;
use std::sync::Mutex;

use serde_json::json;
use umbracast::site::{AccessPoint, Sensor};
use umbracast::{Config, Error, Mode, Site};
use umbracast_plan::{Best, Placed, Wanted, best, versus_random};

use crate::args::{Common, Plan};
use crate::ending::Ending;
use crate::{say, setup};

/// The seed of random placements.
const SEED: u64 = 1;

/// Serves the page, or prints what was asked for.
pub fn run(args: &Plan, common: &Common) -> Result<Ending, Error> {
    let text = args.site.site.as_deref().map(setup::read_text).transpose()?.unwrap_or_default();
    let name = args.site.site.as_deref().unwrap_or(Path::new("the default site")).display().to_string();
    // A sensor's own calibration is not planned: the file keeps its name.
    let site = Config::with_overlay(Mode::Default, &text, &name)?.site;
    if args.sensors + args.access_points == 0 {
        return page(args, site, text, &name);
    }
    let sensors = placed::<Sensor>(&site, args.sensors, args, common)?;
    let access_points = placed::<AccessPoint>(&site, args.access_points, args, common)?;
    if common.json {
        say::line(format_args!(
            "{:#}",
            json!({ "site": site.name, "sensors": sensors, "access_points": access_points })
        ));
    }
    Ok(Ending::Done)
}

#[cfg(feature = "serve")]
fn page(args: &Plan, site: Site, text: String, name: &str) -> Result<Ending, Error> {
    use std::sync::atomic::Ordering;

    let file = args.out.clone().or_else(|| args.site.site.clone());
    let plan = umbracast_plan::Plan { file, text: Mutex::new(text) };
    let asked = crate::signal::asked_to_end()?;
    let page = crate::page::Page::plan(&args.page, site, name, move |question, body| {
        umbracast_plan::answer(&plan, question, body)
    })?;
    while !asked.load(Ordering::Relaxed) {
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    page.close();
    Ok(Ending::Done)
}

#[cfg(not(feature = "serve"))]
fn page(_: &Plan, _: Site, text: String, name: &str) -> Result<Ending, Error> {
    let _ = Mutex::new(text);
    let story = "expected --sensors or --access-points: this program was built without the feature `serve`, which the page needs";
    Err(Error::new(story).within(name))
}

/// The best places of one kind, told; none where none are asked for.
fn placed<T: Placed + serde::Serialize>(
    site: &Site,
    count: u8,
    args: &Plan,
    common: &Common,
) -> Result<Option<serde_json::Value>, Error> {
    if count == 0 {
        return Ok(None);
    }
    let (count, people, height_m) = (usize::from(count), args.people, args.height);
    let compute = || {
        let best = best::<T>(site, Wanted { count, beside: args.beside }, people, height_m)?;
        let random = match args.against {
            0 => None,
            placements => {
                Some(versus_random::<T>(site, count, people, height_m, (placements as usize, SEED))?)
            }
        };
        Ok::<_, Error>((best, random))
    };
    let (best, random) = setup::with_threads(common.threads, compute)??;
    if !common.json {
        tell(site, &best, random, args);
    }
    Ok(Some(
        json!({ "best": best, "random_best": random.map(|r| r[0]), "random_mean": random.map(|r| r[1]) }),
    ))
}

fn tell<T: Placed + serde::Serialize>(site: &Site, best: &Best<T>, random: Option<[f64; 2]>, args: &Plan) {
    let sees = if T::STEM == "lidar" { "a person is seen" } else { "some link of a person is free" };
    say::line(format_args!(
        "{}: share of time in which {sees}, mean over the floor, {} people",
        site.name, args.people
    ));
    for (one, value) in best.placed.iter().zip(&best.values) {
        let text = serde_json::to_value(one).unwrap_or_default();
        let turn = text
            .get("rotation_deg")
            .map(|turn| format!(", yaw {}, pitch {} degrees", turn["yaw"], turn["pitch"]));
        say::line(format_args!(
            "  {:.4} with {} at {} m{}",
            value,
            one.name(),
            text["position_m"],
            turn.unwrap_or_default()
        ));
    }
    let how = match best.exact {
        true => {
            format!("the best choice of {} places, then moved to better ones beside them", best.candidates)
        }
        false => format!(
            "chosen one by one of {} places; no choice of them reaches {:.4}",
            best.candidates, best.bound
        ),
    };
    say::line(format_args!("  {how}"));
    let further: Vec<String> = best.further.iter().map(|value| format!("{value:.4}")).collect();
    say::line(format_args!("  with one, two, three more: {}", further.join(", ")));
    if let Some([most, mean]) = random {
        say::line(format_args!(
            "  {} random placements reach {most:.4} at best, {mean:.4} in the mean",
            args.against
        ));
    }
}
