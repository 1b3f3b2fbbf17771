//! People who stand or sit where they are when the recording begins, by beams and by clouds.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

use super::bare_hall::SMALL_HALL;
use super::book::Book;
use super::living::{Row, draws, read, rings, simulated, stools, table, walked, way, with_stools};
use crate::tools::{Result, argument, root};

const SCENES: u64 = 20;
/// So many at a time: recordings of five minutes take gigabytes.
const BATCH: usize = 4;
/// Seeds of bodies and noise, and of the ways, which no other record draws.
const FIRST_SEED: u64 = 240_000;
const FIRST_WAY: u64 = 1000;
/// Who stands does so from the first frame on for this long.
const STANDS_S: f64 = 300.0;
/// From here on everybody is to be seen.
const FROM_FRAME: u32 = 10;
/// A track this near to a person is the person's.
const GATE_M: f64 = 0.5;
/// Ids below this are of those who stand.
const STANDING: u64 = 4;
/// Clouds are large: fewer and shorter scenes.
const CLOUD_SCENES: u64 = 8;
const CLOUDS_S: f64 = 20.0;

/// One table: the share of frames in which those who stand or sit are followed.
pub fn standing(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record standing");
    book.line(&format!(
        "{:<36} {:>6} {:<10} {:>15} {:>7} {:>9} {:>10}",
        "from the first frame on", "scenes", "empty scan", "person-frames", "seen", "precision", "ids a head"
    ));
    let site = |name: &str, text: &str| {
        let file = book.scratch(name);
        fs::write(&file, text).map_err(|e| e.to_string()).map(|()| file.to_string_lossy().into_owned())
    };
    let small = site("small.toml", &SMALL_HALL.site(&["hdl-32e", "hdl-32e"]))?;
    let beams = site("one.toml", &SMALL_HALL.site(&["hdl-32e"]))?;
    let clouds = site("points.toml", &SMALL_HALL.site(&["points"]))?;
    let stools = site("stools.toml", &with_stools()?)?;

    let beams_and_clouds = ["--clouds", "--site", beams.as_str()];
    let no_scan = ["--site", clouds.as_str(), "--no-empty"];
    let from_clouds: &Rows = &|book, sim, scenes, seen| {
        seen[0].add(book, sim, scenes, &no_scan)?;
        for (k, files) in as_pcd(book, sim)?.iter().enumerate() {
            seen[1].add_scene(book, sim, k as u32, files, &no_scan)?;
        }
        Ok(())
    };
    let scanned = |site: Option<&'static str>, file: &str| {
        let site: Vec<String> = site.into_iter().chain(site.map(|_| file)).map(str::to_owned).collect();
        move |book: &mut Book, sim: &str, scenes: &[PathBuf], seen: &mut [Seen; 2]| {
            let site: Vec<&str> = site.iter().map(String::as_str).collect();
            let empty = format!("{sim}/empty.mcap");
            seen[0].add(book, sim, scenes, &[&site[..], &["--empty", &empty]].concat())?;
            seen[1].add(book, sim, scenes, &[&site[..], &["--no-empty"]].concat())
        }
    };
    let ways: Vec<String> = (0..SCENES).map(in_default_hall).collect();
    let seen = batches(book, &ways, &[], &scanned(None, ""))?;
    tell(book, ["four stand, default hall"; 2], ["known", "none"], SCENES, &seen);

    let ways: Vec<String> = (0..SCENES).map(in_small_hall).collect();
    let seen = batches(book, &ways, &["--site", &small], &scanned(Some("--site"), &small))?;
    tell(book, ["four stand, hall of 20 x 12 m"; 2], ["known", "none"], SCENES, &seen);

    let ways: Vec<String> = (0..SCENES).map(on_stools).collect();
    let seen = batches(book, &ways, &["--bodies", "sitting", "--site", &stools], &scanned(None, ""))?;
    tell(book, ["four sit, default hall"; 2], ["known", "none"], SCENES, &seen);

    let ways: Vec<String> = (0..CLOUD_SCENES).map(for_clouds).collect();
    let seen = batches(book, &ways, &beams_and_clouds, from_clouds)?;
    let names = ["two stand, `points`, PointCloud2", "two stand, `points`, PCD"];
    tell(book, names, ["none"; 2], CLOUD_SCENES, &seen);
    book.line(&format!(
        "Default mode. Four stand or sit for {STANDS_S:.0} s while three to six walk about them; before the clouds two \
         stand for 4 and 7 s and then walk. Seen: share of the frames from 1 s on in which each of them has a confirmed \
         track within {GATE_M} m. Precision: of all confirmed tracks from 1 s on. PCD: unorganised, ASCII, 8 bytes a number."
    ));
    Ok(())
}

/// What is asked of the scenes of a batch, for two rows.
type Rows<'a> = dyn Fn(&mut Book, &str, &[PathBuf], &mut [Seen; 2]) -> Result<()> + 'a;

/// Simulates a few scenes at a time, which take gigabytes, and asks the rows of each batch.
fn batches(book: &mut Book, ways: &[String], how: &[&str], rows: &Rows) -> Result<[Seen; 2]> {
    let mut seen = [Seen::default(), Seen::default()];
    for (k, ways) in ways.chunks(BATCH).enumerate() {
        let name = format!("batch-{k}");
        let mut words = walked(book, &name, ways)?;
        words.extend(how.iter().map(|word| (*word).to_owned()));
        words.extend(["--seed".to_owned(), (FIRST_SEED + (BATCH * k) as u64).to_string()]);
        let sim = simulated(book, &name, &words)?;
        rows(book, &sim, &scenes_of(&sim)?, &mut seen)?;
        fs::remove_dir_all(&sim).map_err(|e| e.to_string())?;
    }
    Ok(seen)
}

fn tell(book: &mut Book, what: [&str; 2], known: [&str; 2], scenes: u64, seen: &[Seen; 2]) {
    for ((what, known), seen) in what.iter().zip(known).zip(seen) {
        let share = |part: u64, all: u64| part as f64 / all as f64;
        book.line(&format!(
            "{what:<36} {scenes:>6} {known:<10} {:>15} {:>7.4} {:>9.4} {:>10.2}",
            seen.all,
            share(seen.seen, seen.all),
            share(seen.right, seen.told),
            share(seen.ids, seen.heads),
        ));
    }
}

#[derive(Default)]
struct Seen {
    all: u64,
    seen: u64,
    told: u64,
    right: u64,
    /// Different tracks, summed over those who were seen.
    ids: u64,
    heads: u64,
}

impl Seen {
    /// Runs and counts these scenes.
    fn add(&mut self, book: &mut Book, sim: &str, scenes: &[PathBuf], how: &[&str]) -> Result<()> {
        let tracks = run(book, sim, scenes, how)?;
        self.count(&read(&format!("{sim}/people.csv"))?, &tracks);
        Ok(())
    }

    /// The same of a folder of clouds, which is one scene.
    fn add_scene(
        &mut self,
        book: &mut Book,
        sim: &str,
        scene: u32,
        files: &PathBuf,
        how: &[&str],
    ) -> Result<()> {
        let mut tracks = run(book, sim, std::slice::from_ref(files), how)?;
        tracks.iter_mut().for_each(|track| track.scene = scene);
        let mut people = read(&format!("{sim}/people.csv"))?;
        people.retain(|person| person.scene == scene);
        self.count(&people, &tracks);
        fs::remove_dir_all(files).map_err(|e| e.to_string())
    }

    fn count(&mut self, people: &[Row], tracks: &[Row]) {
        let mut people_of: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
        let mut tracks_of: BTreeMap<(u32, u32), Vec<&Row>> = BTreeMap::new();
        let mut ids: BTreeMap<(u32, u64), Vec<u64>> = BTreeMap::new();
        let late = |row: &&Row| row.frame >= FROM_FRAME;
        people.iter().filter(late).for_each(|p| people_of.entry((p.scene, p.frame)).or_default().push(p));
        let tracks = tracks.iter().filter(|track| track.confirmed).filter(late);
        tracks.for_each(|t| tracks_of.entry((t.scene, t.frame)).or_default().push(t));
        let is_near = |a: &Row, b: &Row| (a.x_m - b.x_m).hypot(a.y_m - b.y_m) < GATE_M;
        for (key, here) in &people_of {
            let tracks = tracks_of.get(key).map_or(&[][..], Vec::as_slice);
            self.told += tracks.len() as u64;
            self.right += tracks.iter().filter(|t| here.iter().any(|p| is_near(t, p))).count() as u64;
            for person in here.iter().filter(|person| person.id < STANDING) {
                self.all += 1;
                if let Some(track) = tracks.iter().find(|track| is_near(track, person)) {
                    self.seen += 1;
                    let ids = ids.entry((person.scene, person.id)).or_default();
                    if !ids.contains(&track.id) {
                        ids.push(track.id);
                    }
                }
            }
        }
        self.heads += ids.len() as u64;
        self.ids += ids.values().map(|ids| ids.len() as u64).sum::<u64>();
    }
}

/// The tracks of a run on these inputs.
fn run(book: &Book, sim: &str, inputs: &[PathBuf], how: &[&str]) -> Result<Vec<Row>> {
    let out = format!("{sim}-out");
    let words: Vec<OsString> =
        ["run", "--csv", "--out", &out].iter().chain(how).map(OsString::from).collect();
    book.quietly(&[words, inputs.iter().map(argument).collect()].concat())?;
    read(&format!("{out}/tracks.csv"))
}

/// The recordings of a folder of scenes.
fn scenes_of(sim: &str) -> Result<Vec<PathBuf>> {
    let mut scenes: Vec<PathBuf> =
        fs::read_dir(sim).map_err(|e| e.to_string())?.flatten().map(|file| file.path()).collect();
    scenes.retain(|path| path.to_string_lossy().contains("scene-"));
    scenes.sort();
    Ok(scenes)
}

/// The clouds of each scene as a folder of PCD files.
fn as_pcd(book: &Book, sim: &str) -> Result<Vec<PathBuf>> {
    scenes_of(sim)?
        .iter()
        .enumerate()
        .map(|(k, scene)| {
            let folder = book.scratch(&format!("pcd-{k:02}"));
            let line = format!(
                "cargo run --release --quiet --package umbracast-io --example clouds_to_pcd -- {} /lidar_east/points {}",
                scene.display(),
                folder.display()
            );
            book.bash(&root(), &line).map(|_| folder)
        })
        .collect()
}

/// Four stand on rays from the middle of the default hall; six walk in rings.
fn in_default_hall(scene: u64) -> String {
    let mut draw = draws(FIRST_WAY + scene);
    let mut people: Vec<Vec<(f64, f64)>> = (0..4)
        .map(|person| {
            let angle = std::f64::consts::TAU / 4.0 * f64::from(person) + draw();
            let radius_m = 3.5 + 4.5 * draw();
            way(&[(radius_m * angle.cos(), radius_m * angle.sin())], STANDS_S, 1.0, STANDS_S)
        })
        .collect();
    people.extend(rings(STANDS_S, &[(4, 9.5, 1.2), (2, 2.0, 0.8)]));
    table(&people)
}

/// Four stand in the hall of 20 x 12 m, three walk up and down beside and between them.
fn in_small_hall(scene: u64) -> String {
    let mut draw = draws(FIRST_WAY + 100 + scene);
    let mut people: Vec<Vec<(f64, f64)>> = (0..4)
        .map(|person| {
            let at = (-7.5 + 4.6 * f64::from(person) + draw(), -4.0 + 8.0 * draw());
            way(&[at], STANDS_S, 1.0, STANDS_S)
        })
        .collect();
    people.extend([-5.2, 5.2, 0.3].map(|y_m| {
        let (speed_mps, first_m) = (1.0 + 0.3 * draw(), 32.0 * draw());
        (0..=(10.0 * STANDS_S) as u32)
            .map(|k| (first_m + 0.1 * speed_mps * f64::from(k)) % 32.0)
            .map(|gone_m: f64| (8.0 - (16.0 - gone_m).abs(), y_m + 0.3 * gone_m.sin()))
            .collect()
    }));
    table(&people)
}

/// Four sit on the stools; six walk in rings.
fn on_stools(scene: u64) -> String {
    let mut draw = draws(FIRST_WAY + 200 + scene);
    let mut people: Vec<Vec<(f64, f64)>> =
        stools().iter().map(|&at| way(&[at], STANDS_S, 1.0, STANDS_S)).collect();
    people.extend(rings(STANDS_S, &[(4, 9.5, 1.0 + 0.4 * draw()), (2, 2.0, 0.6 + 0.4 * draw())]));
    table(&people)
}

/// Two stand for 4 and 7 s and then walk.
fn for_clouds(scene: u64) -> String {
    let mut draw = draws(FIRST_WAY + 300 + scene);
    let people: Vec<_> = [(-4.0, 4.0), (3.0, 7.0)]
        .map(|(x_m, until_s)| {
            let (x_m, y_m) = (x_m + 3.0 * draw(), -4.0 + 8.0 * draw());
            let across = if y_m < 0.0 { 4.5 } else { -4.5 };
            way(&[(x_m, y_m), (x_m, across), (x_m + 1.5, 0.0)], until_s, 1.1, CLOUDS_S)
        })
        .into();
    table(&people)
}
