//! People who talk with their hands, around a sensor and among each other in small halls: each is one person.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ffi::OsString;
use std::fs;

use super::bare_hall::{BareHall, SMALL_HALL};
use super::book::Book;
use super::living::{Row, draws, read, simulated, table, walked};
use crate::tools::Result;

const SCENES: u64 = 20;
/// People in a scene, and how long it lasts.
const PEOPLE: u32 = 3;
const SECONDS: f64 = 60.0;
/// They come from here, a metre a second, for who never walked is furniture.
const COME_FROM_M: f64 = 11.8;
/// Where they stand, from the sensor; they step about by less than [`ABOUT_M`].
const FROM_M: f64 = 3.5;
const TO_M: f64 = 7.5;
const ABOUT_M: f64 = 0.4;
/// A track this near to a person is the person's.
const GATE_M: f64 = 0.5;
/// Somebody's track stays that one's where another is not nearer by more.
const KEPT_M: f64 = 0.3;
/// Sensors on a stand in the middle of the default hall: model and height.
const SENSORS: [(&str, f64); 3] = [("vlp-16", 1.5), ("hdl-32e", 2.5), ("os0-32", 1.8)];

/// Halls in which ten stop, queue and meet.
const HALLS: [BareHall; 3] = [
    BareHall { length_m: 30.0, width_m: 18.0, height_m: 6.0, sensors_up_m: 5.0, sensors_down_deg: 19.0 },
    SMALL_HALL,
    BareHall { length_m: 9.0, width_m: 7.0, height_m: 3.0, sensors_up_m: 2.4, sensors_down_deg: 27.0 },
];
const PEOPLE_IN_HALL: u32 = 10;
/// No other record draws these.
const HALL_SEED: &str = "233000";

/// Two tables: tracks that are nobody's.
pub fn gestures(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record gestures");
    around_a_sensor(book)?;
    book.line("");
    among_others(book)?;
    book.line(
        "Default mode, with an empty scan. False: a confirmed track that in half of its frames or more is nobody's, where each person \
         has one at most, within 0.5 m. Seen: share of the frames in which a person has one.",
    );
    Ok(())
}

fn head(book: &mut Book, [first, second]: [&str; 2]) {
    book.line(&format!(
        "{first:<12} {second:>9} {:<10} {:>7} {:>9} {:>12} {:>21} {:>10}",
        "bodies", "people", "seen", "false tracks", "a minute and a person", "ids a head"
    ));
}

fn among_others(book: &mut Book) -> Result<()> {
    head(book, ["hall, m", "crowd"]);
    for hall in HALLS {
        let size = format!("{} x {}", hall.length_m, hall.width_m);
        let site = book.scratch(&format!("hall-{size}.toml").replace(' ', ""));
        fs::write(&site, hall.site(&["hdl-32e", "hdl-32e"])).map_err(|e| e.to_string())?;
        for bodies in ["gesturing", "plain"] {
            let mut words: Vec<String> =
                ["--scenes", &SCENES.to_string(), "--seed", HALL_SEED, "--preset", "mixed"]
                    .map(str::to_owned)
                    .to_vec();
            words.extend(["--site", &site.to_string_lossy(), "--bodies", bodies].map(str::to_owned));
            let sim = simulated(book, &format!("{size}-{bodies}").replace(' ', ""), &words)?;
            row(book, &format!("{size:<12} {:>9} {bodies:<10}", "mixed"), &sim, PEOPLE_IN_HALL)?;
        }
    }
    Ok(())
}

fn around_a_sensor(book: &mut Book) -> Result<()> {
    head(book, ["sensor", "height, m"]);
    let ways: Vec<String> = (0..SCENES).map(scene).collect();
    for (model, height_m) in SENSORS {
        let site = book.scratch(&format!("{model}.toml"));
        let text = format!(
            "[[site.sensors]]\nname = \"stand\"\nmodel = \"{model}\"\nposition_m = [0.0, 0.0, {height_m:.1}]\n\
             rotation_deg = {{ yaw = 0.0, pitch = 0.0, roll = 0.0 }}\n"
        );
        fs::write(&site, text).map_err(|e| e.to_string())?;
        for bodies in ["gesturing", "plain"] {
            let name = format!("{model}-{bodies}");
            let more = ["--site", &site.to_string_lossy(), "--bodies", bodies].map(str::to_owned);
            let words: Vec<String> = more.into_iter().chain(walked(book, &name, &ways)?).collect();
            let sim = simulated(book, &name, &words)?;
            row(book, &format!("{model:<12} {height_m:>9.1} {bodies:<10}"), &sim, PEOPLE)?;
        }
    }
    Ok(())
}

/// `people` in each scene.
fn row(book: &mut Book, what: &str, sim: &str, people: u32) -> Result<()> {
    let out = format!("{sim}-out");
    let mut words: Vec<OsString> =
        ["run", "--csv", "--out", &out, "--empty", &format!("{sim}/empty.mcap")].map(OsString::from).to_vec();
    words.extend((0..SCENES).map(|scene| format!("{sim}/scene-{scene:04}.mcap").into()));
    book.quietly(&words)?;
    let counted = count(&read(&format!("{sim}/people.csv"))?, &read(&format!("{out}/tracks.csv"))?);
    let minutes = f64::from(counted.frames) / 600.0;
    book.line(&format!(
        "{what} {:>7} {:>9.4} {:>12} {:>21.3} {:>10.2}",
        people * SCENES as u32,
        f64::from(counted.seen) / f64::from(counted.frames),
        counted.falsely,
        f64::from(counted.falsely) / minutes,
        f64::from(counted.ids) / (f64::from(people) * SCENES as f64),
    ));
    Ok(())
}

struct Counted {
    /// Of people.
    frames: u32,
    seen: u32,
    falsely: u32,
    ids: u32,
}

/// Gives each person the nearest track of a frame, the one before where it may be, nearest first.
fn count(people: &[Row], tracks: &[Row]) -> Counted {
    let mut tracks_of: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
    let known = tracks.iter().filter(|track| track.confirmed);
    known.for_each(|track| tracks_of.entry((track.scene, track.frame)).or_default().push(track));
    let mut people_of: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
    people.iter().for_each(|p| people_of.entry((p.scene, p.frame)).or_default().push(p));
    let mut own: BTreeMap<(u32, u64), u64> = BTreeMap::new();
    let mut ids: Vec<(u32, u64, u64)> = Vec::new();
    // Frames of each track, and in how many of them it was nobody's.
    let mut frames: BTreeMap<(u32, u64), (u32, u32)> = BTreeMap::new();
    let mut seen = 0;
    for (key, here) in &people_of {
        let tracks = tracks_of.get(key).map_or(&[][..], Vec::as_slice);
        let mut pairs = Vec::new();
        for person in here {
            for track in tracks {
                let off_m = (person.x_m - track.x_m).hypot(person.y_m - track.y_m);
                let kept_m = if own.get(&(key.0, person.id)) == Some(&track.id) { KEPT_M } else { 0.0 };
                if off_m < GATE_M {
                    pairs.push((off_m - kept_m, person.id, track.id));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut found, mut given) = (Vec::new(), Vec::new());
        for (_, person, track) in pairs {
            if !found.contains(&person) && !given.contains(&track) {
                found.push(person);
                given.push(track);
                own.insert((key.0, person), track);
                ids.push((key.0, person, track));
            }
        }
        seen += found.len() as u32;
        for track in tracks {
            let (all, nobodys) = frames.entry((key.0, track.id)).or_default();
            *all += 1;
            *nobodys += u32::from(!given.contains(&track.id));
        }
    }
    ids.sort_unstable();
    ids.dedup();
    Counted {
        frames: people.len() as u32,
        seen,
        falsely: frames.values().filter(|(all, nobodys)| 2 * nobodys >= *all).count() as u32,
        ids: ids.len() as u32,
    }
}

/// `t_s,id,x_m,y_m` of people who come, stand around the middle and take a small step every few seconds.
fn scene(seed: u64) -> String {
    let mut draw = draws(seed);
    let mut people = Vec::new();
    for person in 0..PEOPLE {
        let angle = TAU / f64::from(PEOPLE) * f64::from(person) + 1.2 * draw();
        let radius_m = FROM_M + (TO_M - FROM_M) * draw();
        let on_ray = |radius_m: f64| (radius_m * angle.cos(), radius_m * angle.sin());
        let (home, comes_s) = (on_ray(radius_m), COME_FROM_M - radius_m);
        let (mut at, mut goal, mut step_s) = (on_ray(COME_FROM_M), home, comes_s + 1.0 + 2.0 * draw());
        let way = (0..=(10.0 * SECONDS) as u32).map(|k| {
            let (now, time_s) = (at, 0.1 * f64::from(k));
            if time_s >= step_s {
                let (turn, far_m) = (TAU * draw(), 0.1 + 0.2 * draw());
                let near = |home_m: f64, to_m: f64| home_m + (to_m - home_m).clamp(-ABOUT_M, ABOUT_M);
                goal = (near(home.0, at.0 + far_m * turn.cos()), near(home.1, at.1 + far_m * turn.sin()));
                step_s = time_s + 2.0 + 3.0 * draw();
            }
            let most_m = if time_s < comes_s { 0.1 } else { 0.04 };
            let share = most_m / (goal.0 - at.0).hypot(goal.1 - at.1).max(most_m);
            at = (at.0 + (goal.0 - at.0) * share, at.1 + (goal.1 - at.1) * share);
            now
        });
        people.push(way.collect());
    }
    table(&people)
}
