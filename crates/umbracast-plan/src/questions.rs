//! What the page asks: a question's name and its JSON to the answer's JSON. Anybody may have written the question.

use std::path::PathBuf;
use std::sync::Mutex;

use serde::Deserialize;
use serde_json::{Value, json};
use umbracast::site::{AccessPoint, Sensor};
use umbracast::{Config, Error, Mode, Site};

use crate::best::{Wanted, best};
use crate::map::map;
use crate::site_file::write_into;

/// Things of one kind in a plan, at most: what is asked ends within seconds.
const THINGS_MOST: usize = 64;
/// Corners of walls and pieces of furniture together.
const CORNERS_MOST: usize = 500;
/// More are not placed at once.
const PLACED_MOST: usize = 8;
/// People in a plan.
const PEOPLE_MOST: f64 = 100_000.0;

/// Where a plan is kept.
#[derive(Debug)]
pub struct Plan {
    /// Where it is written; without one it is only shown.
    pub file: Option<PathBuf>,
    /// What the file says, or nothing.
    pub text: Mutex<String>,
}

#[derive(Deserialize)]
struct Question {
    site: Value,
    #[serde(default = "ten")]
    people: f64,
    #[serde(default = "usual_m")]
    height_m: f64,
    #[serde(default)]
    sensors: usize,
    #[serde(default)]
    access_points: usize,
    #[serde(default)]
    beside: bool,
    #[serde(default)]
    step_m: Option<f64>,
}

fn ten() -> f64 {
    10.0
}
fn usual_m() -> f64 {
    1.75
}

/// Answers `map` (what is seen and blocked), `best` (where to place so many) and `save`.
///
/// # Errors
/// A sentence that says what was expected and found.
pub fn answer(plan: &Plan, name: &str, body: &[u8]) -> Result<String, Error> {
    let question: Question = serde_json::from_slice(body)
        .map_err(|e| Error::new(format!("expected a question as JSON with a site, found {e}")))?;
    let site = checked(&question)?;
    let Question { people, height_m, beside, step_m, .. } = question;
    match name {
        "map" => text(&map(&site, people, height_m, step_m)?),
        "best" => {
            let wanted = |count| Wanted { count, beside };
            let sensors = (question.sensors > 0)
                .then(|| best::<Sensor>(&site, wanted(question.sensors), people, height_m))
                .transpose()?;
            let access_points = (question.access_points > 0)
                .then(|| best::<AccessPoint>(&site, wanted(question.access_points), people, height_m))
                .transpose()?;
            text(&json!({ "sensors": sensors, "access_points": access_points }))
        }
        "save" => save(plan, &site),
        other => Err(Error::new(format!("expected map, best or save, found {other:?}"))),
    }
}

fn text(answer: &impl serde::Serialize) -> Result<String, Error> {
    serde_json::to_string(answer).map_err(|e| Error::new(e.to_string()))
}

/// The site of a question as if it had been read from a file, with the same checks.
fn checked(question: &Question) -> Result<Site, Error> {
    let Question { people, height_m, sensors, access_points, step_m, .. } = question;
    let bounded = |what: &str, found: f64, least: f64, most: f64| match (least..=most).contains(&found) {
        true => Ok(()),
        false => Err(Error::new(format!("{what}: expected {least} to {most}, found {found}"))),
    };
    bounded("people", *people, 0.0, PEOPLE_MOST)?;
    bounded("height_m", *height_m, 0.5, 2.5)?;
    bounded("sensors", *sensors as f64, 0.0, PLACED_MOST as f64)?;
    bounded("access_points", *access_points as f64, 0.0, PLACED_MOST as f64)?;
    step_m.map_or(Ok(()), |step_m| bounded("step_m", step_m, 0.1, 100.0))?;
    let site: Site = serde_json::from_value(question.site.clone())
        .map_err(|e| Error::new(e.to_string()).within("site"))?;
    let things = [site.sensors.len(), site.access_points.len()];
    let corners =
        site.hall.walls().count() + site.pillars.len() + site.furniture.len() + site.hall.floors.len();
    bounded("site: sensors, and access points", things[0].max(things[1]) as f64, 0.0, THINGS_MOST as f64)?;
    bounded("site: corners, pillars and furniture", corners as f64, 0.0, CORNERS_MOST as f64)?;
    #[derive(serde::Serialize)]
    struct Overlay<'a> {
        site: &'a Site,
    }
    let text =
        toml::to_string(&Overlay { site: &site }).map_err(|e| Error::new(e.to_string()).within("site"))?;
    Ok(Config::with_overlay(Mode::Default, &text, "plan")?.site)
}

fn save(plan: &Plan, site: &Site) -> Result<String, Error> {
    let mut kept = plan.text.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let name = plan.file.as_ref().map_or_else(|| "plan".to_owned(), |file| file.display().to_string());
    let written = write_into(&kept, site, &name)?;
    if let Some(file) = &plan.file {
        // Whole or not at all.
        let beside = file.with_extension("toml.new");
        let failed = |e: std::io::Error| Error::new(e.to_string()).within(file.display());
        std::fs::write(&beside, &written).map_err(failed)?;
        std::fs::rename(&beside, file).map_err(failed)?;
        kept.clone_from(&written);
    }
    text(&json!({ "file": plan.file, "text": written }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(name: &str, question: &Value) -> Result<Value, String> {
        let plan = Plan { file: None, text: Mutex::default() };
        let answer =
            answer(&plan, name, question.to_string().as_bytes()).map_err(|error| error.to_string())?;
        Ok(serde_json::from_str(&answer).unwrap())
    }

    #[test]
    fn a_question_is_answered_and_a_wrong_one_is_told_what_was_expected() {
        let site = json!(Config::default().site);
        let map = ask("map", &json!({ "site": site, "people": 20, "step_m": 2.0 })).unwrap();
        let cells = map["floor"]["columns"].as_u64().unwrap() * map["floor"]["rows"].as_u64().unwrap();
        assert_eq!((map["returns"].as_array().unwrap().len() as u64, cells), (cells, 17 * 17));
        let mut moved = site.clone();
        moved["sensors"][0]["position_m"][0] = json!(11.5);
        let saved = ask("save", &json!({ "site": moved })).unwrap();
        assert_eq!((&saved["file"], saved["text"].as_str().unwrap().contains("11.5")), (&Value::Null, true));
        for (name, question, expected) in [
            ("map", json!({}), "expected a question as JSON with a site"),
            ("map", json!({ "site": { "name": 3 } }), "site"),
            ("map", json!({ "site": site, "people": -1 }), "people: expected 0 to 100000, found -1"),
            ("best", json!({ "site": site, "sensors": 9 }), "sensors: expected 0 to 8, found 9"),
            ("dance", json!({ "site": site }), "expected map, best or save, found \"dance\""),
        ] {
            let told = ask(name, &question).unwrap_err();
            assert!(told.contains(expected), "{told}");
        }
    }
}
