//! Objects that are put in after the empty scan: small ones that people brush past, stools that are sat on, things that appear
//! where nobody is, and objects as large as a lorry. Nobody should be invented for longer than a moment.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::ffi::OsString;
use std::fmt::Write;
use std::fs;

use super::book::Book;
use super::living::{Row, draws, read, rings, simulated, table, walked, way};
use crate::tools::Result;

/// Seeds of bodies, noise, places and ways, which no other record draws.
const FIRST_SEED: u64 = 151_000;
/// Objects come after so long, all at once.
const COMES_S: f64 = 3.0;
/// From here on, 10 s later, who is invented lasts.
const FROM_FRAME: u32 = 130;
/// Who is there in more than this share of the frames from there on does last.
const LASTS: f64 = 0.2;
/// From here on everybody is to be seen.
const SEEN_FROM_FRAME: u32 = 20;
/// A track this near to a person is the person's.
const GATE_M: f64 = 0.5;
/// A scene of brief things, and one of somebody who sits.
const SCENE_S: f64 = 30.0;
const SITS_S: f64 = 180.0;
const STANDS_S: f64 = 90.0;
/// The surface of an object to the axis of who brushes past.
const BRUSH_M: f64 = 0.4;

/// Boxes on the floor: middle from the object's own, size, turn; degrees.
type Shape = &'static [([f64; 2], [f64; 3], f64)];

/// Things of one kind of scene: each has a place of its own.
const SMALL: [(&str, Shape); 4] = [
    ("stool", &[([0.0; 2], [0.36, 0.36, 0.44], 0.0)]),
    ("chair", &[([0.0; 2], [0.5, 0.5, 0.45], 0.0), ([0.0, -0.22], [0.5, 0.06, 0.95], 0.0)]),
    ("table", &[([0.0; 2], [1.6, 0.8, 0.75], 0.0)]),
    ("bin", &[([0.0; 2], [0.5, 0.5, 1.1], 0.0)]),
];
const BRIEF: [(&str, Shape); 3] = [
    ("door leaf", &[([0.0; 2], [0.9, 0.05, 2.05], 0.0)]),
    (
        "coat rack",
        &[
            ([0.0; 2], [0.9, 0.05, 1.75], 0.0),
            ([-0.25, 0.0], [0.08, 0.3, 1.6], 0.0),
            ([0.0, 0.0], [0.08, 0.35, 1.65], 0.0),
            ([0.25, 0.0], [0.08, 0.3, 1.6], 0.0),
        ],
    ),
    (
        "folding screen",
        &[
            ([-0.55, 0.0], [0.6, 0.04, 1.7], 25.0),
            ([0.0, 0.0], [0.6, 0.04, 1.7], -25.0),
            ([0.55, 0.0], [0.6, 0.04, 1.7], 25.0),
        ],
    ),
];
const LARGE: [(&str, Shape); 4] = [
    ("lorry", &[([0.0; 2], [7.0, 2.5, 3.0], 0.0)]),
    ("car", &[([0.0; 2], [4.4, 1.8, 0.85], 0.0), ([-0.3, 0.0], [2.2, 1.6, 1.45], 0.0)]),
    ("pallet", &[([0.0; 2], [1.2, 0.8, 1.5], 0.0)]),
    ("platform", &[([0.0; 2], [4.0, 3.0, 1.0], 0.0)]),
];

/// What a scene has: an object at a place with a turn, radians, and who walks.
struct Scene {
    things: Vec<Placed>,
    ways: Vec<Vec<(f64, f64)>>,
}

#[derive(Clone, Copy)]
struct Placed {
    /// Place in its row's list.
    kind: usize,
    shape: Shape,
    at_m: [f64; 2],
    turn_rad: f64,
}

/// One table, a line for each object.
pub fn objects(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record objects");
    book.line(&format!(
        "{:<16} {:>7} {:>11} {:>14} {:>10} {:>12} {:>8} {:>10}",
        "put in", "objects", "people-min", "false, late", "that last", "false s each", "seen", "ids a head"
    ));
    let hall = simulated(book, "hall", &["--scenes".to_owned(), "1".to_owned()])?;
    let empty = format!("{hall}/empty.mcap");
    rows(book, &empty, &SMALL.map(|kind| kind.0), 10, "standing", small)?;
    rows(book, &empty, &["stool, sat on"], 3, "sitting", |seed| stayed(SMALL[0], [0.0; 2], SITS_S, seed))?;
    let beside_m = [0.0, 0.5 * SMALL[3].1[0].1[1] + BRUSH_M];
    rows(book, &empty, &["bin, stood at"], 3, "standing", |seed| stayed(SMALL[3], beside_m, STANDS_S, seed))?;
    rows(book, &empty, &BRIEF.map(|kind| kind.0), 8, "standing", |seed| among(&BRIEF, seed))?;
    rows(book, &empty, &LARGE.map(|kind| kind.0), 6, "standing", |seed| among(&LARGE, seed))?;
    book.line(&format!(
        "Default mode, with the empty scan of the hall before. Objects come after {COMES_S:.0} s, all at once. Small ones: each has \
         somebody who walks to and fro {BRUSH_M} m beside it. False, late: confirmed tracks nearer to nobody than {GATE_M} m, from \
         {:.0} s after that on, on the mean of frames; nearest to this object. That last: objects with such a track in more than {LASTS} of \
         those frames. False s each: person-seconds of false tracks from the beginning on, on the mean of objects. Seen, ids a head: \
         of everybody who walks, stands and sits, from {:.0} s on.",
        0.1 * f64::from(FROM_FRAME) - COMES_S,
        0.1 * f64::from(SEEN_FROM_FRAME)
    ));
    Ok(())
}

/// Simulates scenes, each with a hall of its own, and tells one line for each kind of object.
fn rows(
    book: &mut Book,
    empty: &str,
    kinds: &[&str],
    scenes: u64,
    bodies: &str,
    scene: impl Fn(u64) -> Scene,
) -> Result<()> {
    let mut seen = vec![Seen::default(); kinds.len()];
    let mut people = Heads::default();
    for k in 0..scenes {
        let seed = FIRST_SEED + 100 * u64::from(kinds[0].len() as u32) + k;
        let scene = scene(seed);
        let name = format!("{}-{k}", kinds[0].replace([' ', ','], "-"));
        let site = book.scratch(&format!("{name}.toml"));
        fs::write(&site, site_of(&scene)).map_err(|e| e.to_string())?;
        let mut words = walked(book, &name, &[table(&scene.ways)])?;
        let site = site.to_string_lossy().into_owned();
        words.extend(["--site", &site, "--seed", &seed.to_string()].map(str::to_owned));
        if bodies != "standing" {
            words.extend(["--bodies", bodies].map(str::to_owned));
        }
        let sim = simulated(book, &name, &words)?;
        let out = format!("{sim}-out");
        let words = ["run", "--csv", "--out", &out, "--empty", empty, &format!("{sim}/scene-0000.mcap")]
            .map(OsString::from);
        book.quietly(&words)?;
        count(
            &scene,
            &read(&format!("{sim}/people.csv"))?,
            &read(&format!("{out}/tracks.csv"))?,
            &mut seen,
            &mut people,
        );
        fs::remove_dir_all(&sim).map_err(|e| e.to_string())?;
    }
    for (kind, seen) in kinds.iter().zip(&seen) {
        let each = f64::from(seen.objects.max(1));
        book.line(&format!(
            "{kind:<16} {:>7} {:>11.1} {:>14.3} {:>10} {:>12.1} {:>8.4} {:>10.2}",
            seen.objects,
            people.all as f64 / 600.0,
            seen.late_share / each,
            seen.last,
            0.1 * f64::from(seen.frames) / each,
            people.seen as f64 / people.all.max(1) as f64,
            people.ids as f64 / people.heads.max(1) as f64,
        ));
    }
    Ok(())
}

/// What was invented at the objects of one kind.
#[derive(Clone, Default)]
struct Seen {
    objects: u32,
    /// False tracks, summed over frames.
    frames: u32,
    /// Their mean number in late frames, summed over objects.
    late_share: f64,
    last: u32,
}

/// What was seen of people.
#[derive(Default)]
struct Heads {
    all: u64,
    seen: u64,
    ids: u64,
    heads: u64,
}

fn count(scene: &Scene, people: &[Row], tracks: &[Row], seen: &mut [Seen], heads: &mut Heads) {
    let mut people_of: BTreeMap<u32, Vec<&Row>> = BTreeMap::new();
    let mut tracks_of: BTreeMap<u32, Vec<&Row>> = BTreeMap::new();
    let mut ids: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
    people.iter().for_each(|p| people_of.entry(p.frame).or_default().push(p));
    tracks.iter().filter(|t| t.confirmed).for_each(|t| tracks_of.entry(t.frame).or_default().push(t));
    let off_m = |a: &Row, b: &Row| (a.x_m - b.x_m).hypot(a.y_m - b.y_m);
    let near = |a: &Row, b: &Row| off_m(a, b) < GATE_M;
    let mut all = vec![0_u32; scene.things.len()];
    let (mut late, mut last) = (all.clone(), all.clone());
    let mut late_frames = 0;
    for (&frame, here) in &people_of {
        let told = tracks_of.get(&frame).map_or(&[][..], Vec::as_slice);
        late_frames += u32::from(frame >= FROM_FRAME);
        let mut had = vec![false; all.len()];
        for wrong in told.iter().filter(|track| !here.iter().any(|person| near(track, person))) {
            let away_m = |thing: &Placed| (thing.at_m[0] - wrong.x_m).hypot(thing.at_m[1] - wrong.y_m);
            let nearest =
                (0..all.len()).min_by(|&a, &b| away_m(&scene.things[a]).total_cmp(&away_m(&scene.things[b])));
            let Some(k) = nearest else { continue };
            all[k] += 1;
            late[k] += u32::from(frame >= FROM_FRAME);
            had[k] |= frame >= FROM_FRAME;
        }
        had.iter().zip(&mut last).for_each(|(had, last)| *last += u32::from(*had));
        for person in here.iter().filter(|_| frame >= SEEN_FROM_FRAME) {
            heads.all += 1;
            let nearest = told.iter().min_by(|a, b| off_m(a, person).total_cmp(&off_m(b, person)));
            if let Some(track) = nearest.filter(|track| near(track, person)) {
                heads.seen += 1;
                let ids = ids.entry(person.id).or_default();
                if !ids.contains(&track.id) {
                    ids.push(track.id);
                }
            }
        }
    }
    heads.heads += ids.len() as u64;
    heads.ids += ids.values().map(|ids| ids.len() as u64).sum::<u64>();
    for (k, thing) in scene.things.iter().enumerate() {
        let seen = &mut seen[thing.kind];
        seen.objects += 1;
        seen.frames += all[k];
        seen.late_share += f64::from(late[k]) / f64::from(late_frames.max(1));
        seen.last += u32::from(f64::from(last[k]) > LASTS * f64::from(late_frames));
    }
}

/// The default hall with the objects of a scene in it.
fn site_of(scene: &Scene) -> String {
    let mut text = format!("[site.simulation.put_in]\nafter_s = {COMES_S:.1}\n");
    for thing in &scene.things {
        for &([x_m, y_m], [l, w, h], yaw_deg) in thing.shape {
            let [x_m, y_m] = turned([x_m, y_m], thing);
            let yaw_deg = (yaw_deg + thing.turn_rad.to_degrees()) % 360.0;
            let _ = write!(
                text,
                "[[site.simulation.put_in.furniture]]\nposition_m = [{x_m:.4}, {y_m:.4}]\nsize_m = [{l}, {w}, {h}]\nyaw_deg = {yaw_deg:.2}\n"
            );
        }
    }
    text
}

/// A place beside an object in the hall's frame.
fn turned([x_m, y_m]: [f64; 2], thing: &Placed) -> [f64; 2] {
    let (sin, cos) = thing.turn_rad.sin_cos();
    [thing.at_m[0] + cos * x_m - sin * y_m, thing.at_m[1] + sin * x_m + cos * y_m]
}

/// Objects evenly about the middle, this far away.
fn placed(
    kinds: &[(&str, Shape)],
    draw: &mut impl FnMut() -> f64,
    [least_m, most_m]: [f64; 2],
) -> Vec<Placed> {
    let first_rad = TAU * draw();
    let place = |(kind, &(_, shape)): (usize, &(&str, Shape))| {
        let angle_rad = first_rad + TAU / kinds.len() as f64 * (kind as f64 + 0.3 * draw());
        let radius_m = least_m + (most_m - least_m) * draw();
        let at_m = [radius_m * angle_rad.cos(), radius_m * angle_rad.sin()];
        Placed { kind, shape, at_m, turn_rad: TAU * draw() }
    };
    kinds.iter().enumerate().map(place).collect()
}

/// Small objects, and for each somebody who walks to and fro beside it.
fn small(seed: u64) -> Scene {
    let mut draw = draws(seed);
    let things = placed(&SMALL, &mut draw, [4.0, 8.0]);
    let ways = things
        .iter()
        .map(|thing| {
            let aside_m = 0.5 * thing.shape[0].1[1] + BRUSH_M;
            let end = |x_m: f64| turned([x_m, aside_m], thing).into();
            let (near, far): ((f64, f64), (f64, f64)) = (end(-3.0 - draw()), end(3.0));
            let stops: Vec<_> = (0..12).map(|k| if k % 2 == 0 { near } else { far }).collect();
            way(&stops, 2.0 * draw(), 0.8 + 0.5 * draw(), SCENE_S)
        })
        .collect();
    Scene { things, ways }
}

/// Four of one kind, four who come and stay at this place beside it, or on it, and two who walk about.
fn stayed(kind: (&'static str, Shape), beside_m: [f64; 2], seconds: f64, seed: u64) -> Scene {
    let mut draw = draws(seed);
    let mut things = placed(&[kind; 4], &mut draw, [4.0, 8.0]);
    things.iter_mut().for_each(|thing| thing.kind = 0);
    let mut ways: Vec<_> = things
        .iter()
        .map(|thing| {
            let angle_rad = TAU * draw();
            let from = (11.9 * angle_rad.cos(), 11.9 * angle_rad.sin());
            let stops = [from, turned(beside_m, thing).into()];
            way(&stops, 1.0 + 6.0 * draw(), 0.9 + 0.5 * draw(), seconds + 15.0)
        })
        .collect();
    ways.extend(rings(seconds + 15.0, &[(2, 2.0, 0.8)]));
    Scene { things, ways }
}

/// Objects where nobody is, and people who walk about between them.
fn among(kinds: &[(&str, Shape)], seed: u64) -> Scene {
    let mut draw = draws(seed);
    let things = placed(kinds, &mut draw, [6.5, 8.0]);
    Scene { things, ways: rings(SCENE_S, &[(3, 12.2, 1.2), (2, 1.5, 0.8)]) }
}
