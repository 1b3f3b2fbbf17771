//! Scores of stage 1 for the three modes, and for any settings laid over the default mode:
//!
//! `cargo run --release -p umbracast-eval --example track_score -- orca-03 5 100000 [FILE.toml ...]`
//!
//! Arguments: who walks (`orca-03`, `orca-06`, `mixed`, `pairs`, side by side 0.5 m apart, or a file of recorded
//! people), how many scenes, the first seed. Expect a MOTA and an IDF1 of 0.98 and more and errors of 0.03 m and
//! 0.1 m/s in the default mode.

use std::env::args;
use std::fs::read_to_string;
use std::path::Path;

use umbracast::detect::{Background, Cluster, Clusterer, Detection, Measurer, Point};
use umbracast::lidar::{Assembler, Frame};
use umbracast::track::{Track, Tracker};
use umbracast::{Config, Error, Health, Mode, Site};
use umbracast_eval::bootstrap::Pooled;
use umbracast_eval::chain::{empty_frames, push};
use umbracast_eval::matching::match_scene;
use umbracast_eval::stage1::Stage1;
use umbracast_io::rows::{PeopleRow, TrackRow, of_track};
use umbracast_io::trajectories;
use umbracast_sim::crowd::{Crowd, Preset, Recorded, circle_crossing, pairs, replay};
use umbracast_sim::scene::Scene;

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = args().skip(1).collect();
    let number = |i: usize, otherwise| arguments.get(i).map_or(Ok(otherwise), |text| text.parse::<u64>());
    let wrong = |_| Error::new("expected: PRESET SCENES SEED [FILE.toml ...]");
    let preset = arguments.first().map_or("orca-03", String::as_str);
    let (scenes, seed) = (number(1, 2).map_err(wrong)?, number(2, 100_000).map_err(wrong)?);
    let mut contenders: Vec<Contender> = Vec::new();
    for mode in Mode::ALL {
        contenders.push(Contender::new(mode.name(), Config::for_mode(mode)));
    }
    for file in arguments.iter().skip(3) {
        let text = read_to_string(file).map_err(|e| Error::new(format!("{file}: {e}")))?;
        contenders.push(Contender::new(file, Config::with_overlay(Mode::Default, &text, file)?));
    }
    let site = Config::for_mode(Mode::Default).site;
    for scene in 0..scenes {
        run_scene(crowd(preset, seed + scene)?, &site, seed + scene, &mut contenders)?;
    }
    println!("{preset}, {scenes} scenes from seed {seed}");
    println!(
        "{:24} recall  prec   MOTA   IDF1   HOTA  switch    pos    vel  NEES p    v  height  by returns 0, 1-5, 6+",
        ""
    );
    for contender in &contenders {
        contender.print();
    }
    Ok(())
}

fn crowd(who: &str, seed: u64) -> Result<Crowd, Error> {
    Ok(match who {
        "orca-03" => circle_crossing(Preset::Orca03, 10, 12.5, seed),
        "orca-06" => circle_crossing(Preset::Orca06, 10, 12.5, seed),
        "mixed" => circle_crossing(Preset::Mixed, 10, 12.5, seed),
        "pairs" => pairs(5, 0.5, 12.5, seed),
        file => {
            let people = trajectories::read(Path::new(file), trajectories::Options::default())?;
            let recorded: Vec<Recorded> =
                people.iter().map(|p| Recorded { samples: &p.samples, height_m: p.height_m }).collect();
            replay(&recorded, 0.12)?
        }
    })
}

/// One set of values with what it scored.
struct Contender {
    name: String,
    config: Config,
    sums: Stage1,
    /// Squared height errors of matches, and their number.
    height_m2: f64,
    heights: f64,
    people: Vec<PeopleRow>,
    tracks: Vec<TrackRow>,
}

impl Contender {
    fn new(name: &str, config: Config) -> Self {
        let name = name.to_owned();
        Self {
            name,
            config,
            sums: Stage1::default(),
            height_m2: 0.0,
            heights: 0.0,
            people: Vec::new(),
            tracks: Vec::new(),
        }
    }

    fn count_scene(&mut self) {
        self.sums = self.sums.plus(&Stage1::of(&self.people, &self.tracks), 1);
        let matching = match_scene(&self.people, &self.tracks);
        for person in &self.people {
            let Some(&id) = matching.get(&(person.frame, person.person)) else { continue };
            let own = |track: &&TrackRow| track.frame == person.frame && track.track == id;
            let Some(t) = self.tracks.iter().find(own) else { continue };
            self.height_m2 += (t.height_m - person.height_m).powi(2);
            self.heights += 1.0;
        }
        self.people.clear();
        self.tracks.clear();
    }

    fn print(&self) {
        let s = &self.sums;
        let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
        println!(
            "{:24} {:.4} {:.4} {:.4} {:.4} {:.4}  {:6.2} {:.4} {:.4}   {:5.2} {:5.2}  {:.3}  {:.3?}",
            self.name,
            or_nan(s.recall()),
            or_nan(s.precision()),
            or_nan(s.mota()),
            or_nan(s.idf1()),
            or_nan(s.hota()),
            or_nan(s.switches_per_scene()),
            or_nan(s.position_rmse_m()),
            or_nan(s.velocity_rmse_mps()),
            or_nan(s.position_nees()),
            or_nan(s.velocity_nees()),
            (self.height_m2 / self.heights).sqrt(),
            s.recall_by_returns().map(or_nan),
        );
    }
}

/// Stage 1 alone, as the pipeline runs it.
struct Stage {
    background: Background,
    clusterer: Clusterer,
    measurer: Measurer,
    tracker: Tracker,
    health: Health,
    points: Vec<Point>,
    clusters: Vec<Cluster>,
    detections: Vec<Detection>,
    tracks: Vec<Track>,
}

impl Stage {
    fn new(config: &Config) -> Result<Self, Error> {
        Ok(Self {
            background: Background::new(&config.detect, &config.site)?,
            clusterer: Clusterer::new(&config.detect, &config.site),
            measurer: Measurer::new(&config.detect, &config.site),
            tracker: Tracker::new(&config.track, &config.site),
            health: Health::default(),
            points: Vec::new(),
            clusters: Vec::new(),
            detections: Vec::new(),
            tracks: Vec::new(),
        })
    }

    fn step(&mut self, frame: &Frame) {
        let priors = self.tracker.priors(frame.time_ns);
        self.background.foreground(frame, &priors, &mut self.health, &mut self.points);
        self.clusterer.clusters(&self.points, &priors, &mut self.clusters);
        self.measurer.detections(&self.points, &self.clusters, &priors, &mut self.detections);
        self.tracker.update(frame, &self.detections, &mut self.tracks);
    }
}

fn run_scene(crowd: Crowd, site: &Site, seed: u64, contenders: &mut [Contender]) -> Result<(), Error> {
    let mut stages = contenders.iter().map(|c| Stage::new(&c.config)).collect::<Result<Vec<_>, _>>()?;
    for frame in empty_frames(site, seed + 1_000_000)? {
        stages.iter_mut().for_each(|stage| stage.background.learn_empty(&frame));
    }
    let (mut assembler, mut health) = (Assembler::new(site)?, Health::default());
    let mut scene = Scene::new(crowd, site, seed)?;
    loop {
        let truth = scene.next_frame();
        match &truth {
            Some(truth) => push(&mut assembler, &truth.packets, &mut health),
            None => assembler.finish(),
        }
        while let Some(frame) = assembler.pop() {
            for (stage, contender) in stages.iter_mut().zip(contenders.iter_mut()) {
                stage.step(&frame);
                contender
                    .tracks
                    .extend(stage.tracks.iter().map(|track| of_track(frame.index, frame.time_ns, track)));
            }
        }
        let Some(truth) = truth else { break };
        for person in &truth.people {
            let (at, v) = (person.state.position_m, person.state.velocity_mps);
            let row = PeopleRow {
                frame: truth.index,
                time_ns: truth.time_ns,
                person: person.person,
                x_m: at.x,
                y_m: at.y,
                vx_mps: v.x,
                vy_mps: v.y,
                heading_rad: person.state.heading_rad,
                height_m: person.state.height_m,
                returns: person.returns,
                ..PeopleRow::default()
            };
            contenders.iter_mut().for_each(|contender| contender.people.push(row));
        }
    }
    contenders.iter_mut().for_each(Contender::count_scene);
    Ok(())
}
