//! A data set for who foresees blockages by a method of one's own: what LiDARs saw, what access points heard, and the radio's truth.
//!
//! A folder holds, for every scene, the sensors' packets and the empty hall as recordings that `umbracast run` and every reader of MCAP
//! open; `people` (who was where), `radio` (every link every 10 ms), `labels` (what is to be foreseen from every frame on), `reports`
//! (power heard, by device), `devices.csv` (whose each device is), and `split.csv`.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use umbracast::{Config, Error, STEP_NS, STEPS, Site};
use umbracast_eval::run::chain::CIRCLE_M;
use umbracast_eval::score::scene::{SceneTruth, note_truth};
use umbracast_io::input::{EMPTY, scene_file};
use umbracast_io::recording::RecordingWriter;
use umbracast_io::rows::{LabelRow, PeopleRow, RadioRow, ReportRow};
use umbracast_io::tables::TableWriter;
use umbracast_sim::crowd::{Ground, Stroll};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::hall::Crowd;
use crate::reports::{self, LATE_NS};
use crate::truth::{Air, Counted, TICK_NS, TICK_S, Traces, TruthModel};

/// The seed of the empty hall's noise, and how many frames are recorded of it.
const EMPTY_SEED: u64 = 200_000;
const EMPTY_FRAMES: u64 = 10;
/// Of ten scenes so many are to learn from, and so many to choose with; the others are to be scored once.
const TRAIN: u32 = 7;
const VALIDATION: u32 = 1;
/// Radio instants of a step.
const TICKS: usize = (STEP_NS / TICK_NS) as usize;

/// Writes scenes into a folder, one after the other.
#[derive(Debug)]
pub struct DataSet<'a> {
    folder: &'a Path,
    config: &'a Config,
    ground: Ground,
    sensors: Sensors,
    people: TableWriter<PeopleRow>,
    radio: TableWriter<RadioRow>,
    labels: TableWriter<LabelRow>,
    reports: TableWriter<ReportRow>,
    devices: String,
    split: String,
}

impl<'a> DataSet<'a> {
    /// Begins one in a folder that is there: the empty hall, and tables as Parquet and, where asked for, CSV.
    ///
    /// # Errors
    /// A sensor that cannot be simulated, a hall without room for a crowd, a file that cannot be written.
    pub fn create(folder: &'a Path, config: &'a Config, csv: bool) -> Result<Self, Error> {
        let site = &config.site;
        let names: Vec<String> = site.access_points.iter().map(|ap| ap.name.clone()).collect();
        let mut empty = RecordingWriter::create(&folder.join(EMPTY), &config.to_toml(), site, false)?;
        for (k, packets) in (1_i64..).zip(Scene::empty(site, EMPTY_SEED, EMPTY_FRAMES)?) {
            empty.write_packets(k * STEP_NS, &packets)?;
        }
        empty.finish()?;
        Ok(Self {
            folder,
            config,
            ground: Ground::of(site, CIRCLE_M)?,
            sensors: Sensors::new(site, EMPTY_SEED)?,
            people: TableWriter::create(folder, &names, csv)?,
            radio: TableWriter::create(folder, &names, csv)?,
            labels: TableWriter::create(folder, &names, csv)?,
            reports: TableWriter::create(folder, &names, csv)?,
            devices: "scene,person,device\n".to_owned(),
            split: "scene,seed,split\n".to_owned(),
        })
    }

    /// Adds a scene.
    ///
    /// # Errors
    /// A hall without room for so many, a disk that is full or gone.
    pub fn add(&mut self, scene: u32, crowd: Crowd, seed: u64, model: TruthModel) -> Result<(), Error> {
        let site = &self.config.site;
        self.ground.hold(crowd.people)?;
        let walk = Stroll::new(crowd.preset, crowd.people, &self.ground, seed).leg(crowd.seconds);
        let ticks = (walk.duration_ns / TICK_NS) as usize;
        let mut simulated = Scene::in_hall(walk, site, &self.sensors, seed);
        let file = scene_file(self.folder, scene as usize);
        let mut recording = RecordingWriter::create(&file, &self.config.to_toml(), site, false)?;
        while let Some(frame) = simulated.next_frame() {
            recording.write_packets(frame.time_ns, &frame.packets)?;
            let mut truth = SceneTruth::default();
            note_truth(scene, &frame, &mut truth);
            self.people.write(&truth.people)?;
        }
        recording.finish()?;
        let own_body = site.ue.forward_m != 0.0 || site.ue.left_m != 0.0;
        let airs = [Air::of(site, model)];
        let counted = Counted { own_body, reflections_db: 0.0 };
        let traces = Traces::of_scene(site, simulated.walkers(), ticks, &airs, counted);
        for traces in &traces {
            self.radio.write(&radio_of(scene, site, traces))?;
            self.labels.write(&labels_of(scene, site, traces))?;
            // Devices are numbered in an order that says nothing of people.
            let people = traces.people as u64;
            let device_of = |person: usize| 1000 + (person as u64 * 7 + 3 + seed) % people.max(1);
            let heard = reports::of_scene(site, traces, seed, device_of);
            let row = |report: &umbracast::radio::Report| ReportRow {
                scene,
                frame: 0,
                time_ns: report.time_ns + LATE_NS,
                heard_ns: report.time_ns,
                access_point: report.access_point as u32,
                device: report.device,
                power_dbm: report.power_dbm,
                serves: report.serves,
            };
            self.reports.write(&heard.iter().map(row).collect::<Vec<_>>())?;
            for person in 0..traces.people {
                let _ = writeln!(self.devices, "{scene},{person},{}", device_of(person)); // To a string.
            }
        }
        let part = match scene % 10 {
            k if k < TRAIN => "train",
            k if k < TRAIN + VALIDATION => "validation",
            _ => "test",
        };
        let _ = writeln!(self.split, "{scene},{seed},{part}"); // To a string.
        Ok(())
    }

    /// Writes the ends of the tables; without them they cannot be read.
    ///
    /// # Errors
    /// A disk that is full or gone.
    pub fn finish(self) -> Result<(), Error> {
        self.people.finish()?;
        self.radio.finish()?;
        self.labels.finish()?;
        self.reports.finish()?;
        for (name, text) in [("devices.csv", self.devices), ("split.csv", self.split)] {
            let path = self.folder.join(name);
            fs::write(&path, text).map_err(|e| Error::new(e.to_string()).within(path.display()))?;
        }
        Ok(())
    }
}

/// Links of access points with a radio.
fn links<'a>(site: &'a Site, traces: &'a Traces) -> impl Iterator<Item = (usize, usize, f64)> + 'a {
    let of_radio = |(ap, place): (usize, &umbracast::site::AccessPoint)| Some((ap, place.radio?.margin_db));
    let access_points = site.access_points.iter().enumerate().filter_map(of_radio);
    access_points.flat_map(|(ap, margin_db)| (0..traces.people).map(move |person| (ap, person, margin_db)))
}

fn radio_of(scene: u32, site: &Site, traces: &Traces) -> Vec<RadioRow> {
    let mut rows = Vec::new();
    for tick in 0..traces.ticks {
        rows.extend(links(site, traces).map(|(ap, person, _)| RadioRow {
            scene,
            time_ns: tick as i64 * TICK_NS,
            access_point: ap as u32,
            person: person as u32,
            loss_db: traces.loss_db(tick, ap, person),
        }));
    }
    rows
}

/// Of every frame whose future is simulated to its end.
fn labels_of(scene: u32, site: &Site, traces: &Traces) -> Vec<LabelRow> {
    let mut rows = Vec::new();
    for frame in 0..(traces.ticks / TICKS).saturating_sub(1 + STEPS) {
        let now = (frame + 1) * TICKS;
        rows.extend(links(site, traces).map(|(ap, person, margin_db)| {
            let loss_db = |tick: usize| traces.loss_db(tick, ap, person);
            let is_out = |tick: &usize| loss_db(*tick) >= margin_db;
            let within = |steps: usize| (now..=now + steps * TICKS).find(is_out);
            let place_m = traces.place_m(now, person);
            let first = within(STEPS).filter(|_| !is_out(&now));
            LabelRow {
                scene,
                frame: frame as u64,
                time_ns: now as i64 * TICK_NS,
                access_point: ap as u32,
                person: person as u32,
                x_m: place_m.x,
                y_m: place_m.y,
                loss_db: std::array::from_fn(|step| loss_db(now + step * TICKS)),
                out: std::array::from_fn(|steps| within(steps).is_some()),
                onset_s: first.map(|tick| (tick - now) as f64 * TICK_S),
            }
        }));
    }
    rows
}
