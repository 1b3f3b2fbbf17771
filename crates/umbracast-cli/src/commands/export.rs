//! `export`: scans, foreground, ways and links in the forms that other programs open.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use umbracast::{Config, Error, Frame, Health, Pipeline};
use umbracast_io::geojson::{GeoJson, Ways};
use umbracast_io::input::{self, Input, Inputs};
use umbracast_io::pcd::{PcdCloud, PcdEncoding, write_pcd};
use umbracast_io::rows::{LinkRow, TrackRow};
use umbracast_io::{clouds, las, ply, rows};

use crate::args::{Common, Export, ExportForm};
use crate::ending::Ending;
use crate::inputs;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup;

type GeoJsonFile = GeoJson<BufWriter<File>>;

/// Writes what is asked for of every scene.
pub fn run(args: &Export, common: &Common) -> Result<Ending, Error> {
    let mut config = setup::config(args.mode, args.site.site.as_deref())?;
    let site_file = args.site.site.as_deref();
    let Inputs { scenes, empty } =
        inputs::read(&args.inputs, &args.captures, site_file, &mut config.site, common)?;
    let wanted = Wanted::of(args);
    let (mut health, mut lost, mut learned) = (Health::default(), Vec::new(), Vec::new());
    if wanted.outcome {
        let (given, captures) = (args.empty.as_deref(), &args.captures);
        let (frames, told) = inputs::empty_frames(given, empty, captures, &config.site, &mut health, common)?;
        (learned, lost) = (frames, told.into_iter().collect());
    }
    setup::make_dir(&args.out)?;
    let watch = Stopwatch::start();
    let mut files = Files { folder: &args.out, forms: &args.forms, written: 0 };
    if wanted.geojson {
        let path = files.path("site.geojson");
        let mut file = GeoJson::new(create(&path)?, &config.site.name, args.origin).map_err(at(&path))?;
        file.site(&config.site).and_then(|()| file.finish()).map_err(at(&path))?;
    }
    let mut frames = 0;
    for (place, input) in scenes.iter().enumerate() {
        let scene = input::scene_number(input).unwrap_or(place as u32);
        let scene = Scene { number: scene, config: &config, empty: &learned, args, wanted: &wanted };
        frames += scene.export(input, &mut files, &mut health, &mut lost)?;
    }
    if let Some(frame) = args.frame.filter(|_| frames == 0) {
        return Err(Error::new(format!(
            "--frame {frame}: expected a frame of the input, found none of that number"
        )));
    }
    RunJson::new("export", &watch)
        .with("frames", frames)
        .with("files", files.written)
        .with("health", health)
        .with("lost", &lost)
        .print(common, &format!("{} files of {frames} frames in {}", files.written, args.out.display()));
    Ok(if lost.is_empty() { Ending::Done } else { Ending::DataLost(lost.join("; ")) })
}

/// What is written.
struct Wanted {
    scans: bool,
    tracks: bool,
    links: bool,
    geojson: bool,
    /// Whether the pipeline has to run.
    outcome: bool,
}

impl Wanted {
    fn of(args: &Export) -> Self {
        let geojson = args.forms.contains(&ExportForm::Geojson);
        let points = args.forms.iter().any(|form| *form != ExportForm::Geojson);
        let nothing_said = !(args.tracks || args.links);
        Self {
            scans: points && !args.foreground && nothing_said,
            tracks: args.tracks || (geojson && nothing_said),
            links: args.links || (geojson && nothing_said),
            geojson,
            outcome: geojson || args.foreground || !nothing_said,
        }
    }
}

/// Files of one folder.
struct Files<'a> {
    folder: &'a Path,
    forms: &'a [ExportForm],
    written: u64,
}

impl Files<'_> {
    fn path(&mut self, name: &str) -> PathBuf {
        self.written += 1;
        self.folder.join(name)
    }

    /// A cloud in every form that holds points.
    fn cloud(&mut self, name: &str, cloud: &PcdCloud) -> Result<(), Error> {
        for form in self.forms {
            let (bytes, ending) = match form {
                ExportForm::Pcd => (write_pcd(cloud, PcdEncoding::Binary), "pcd"),
                ExportForm::Ply => (ply::write_ply(cloud, "site frame, metres"), "ply"),
                ExportForm::Las => (las::write_las(cloud)?, "las"),
                ExportForm::Geojson => continue,
            };
            let path = self.path(&format!("{name}.{ending}"));
            setup::write(&path, bytes)?;
        }
        Ok(())
    }
}

struct Scene<'a> {
    number: u32,
    config: &'a Config,
    empty: &'a [Frame],
    args: &'a Export,
    wanted: &'a Wanted,
}

impl Scene<'_> {
    /// Gives how many frames were written.
    fn export(
        &self,
        input: &Input,
        files: &mut Files,
        health: &mut Health,
        lost: &mut Vec<String>,
    ) -> Result<u64, Error> {
        let Self { number, config, args, wanted, .. } = self;
        let site = &config.site;
        let mut pipeline = match wanted.outcome {
            true => Some(Pipeline::new(config, Some(&setup::weights(None)?))?),
            false => None,
        };
        if let Some(pipeline) = &mut pipeline {
            self.empty.iter().for_each(|frame| pipeline.learn_empty(frame));
        }
        let mut links_file = self.geojson("links", wanted.links, files)?;
        let (mut ways, mut every_track) = (Ways::default(), Vec::<TrackRow>::new());
        let (mut frames, mut is_over, mut stage_health) = (0, false, Health::default());
        let told = input.frames(site, health, |frame| {
            let chosen = args.frame.is_none_or(|chosen| chosen == frame.index);
            let name = |what: &str| format!("{what}-{number:04}-{:06}", frame.index);
            let (mut tracks, mut links) = (Vec::<TrackRow>::new(), Vec::<LinkRow>::new());
            if let Some(pipeline) = &mut pipeline {
                let outcome = pipeline.step(frame);
                stage_health = outcome.health;
                rows::of_outcome(*number, outcome, &mut tracks, &mut links);
                if chosen && args.foreground {
                    files.cloud(&name("foreground"), &clouds::of_foreground(&outcome.foreground))?;
                }
            }
            if chosen {
                frames += 1;
                if wanted.scans {
                    files.cloud(&name("scan"), &clouds::of_frame(frame))?;
                }
                if args.links {
                    files.cloud(&name("links"), &clouds::of_links(site, &tracks, &links))?;
                }
                if let Some((path, file)) = &mut links_file {
                    file.links(site, &tracks, &links).map_err(at(path))?;
                }
            }
            // Ways lead up to the chosen frame.
            if wanted.tracks {
                ways.add(site, &tracks);
                every_track.extend(tracks);
            }
            is_over = args.frame.is_some() && chosen;
            if is_over { Err(Error::new("written")) } else { Ok(()) }
        });
        match told {
            Err(_) if is_over => {}
            told => lost.extend(told?),
        }
        if args.tracks {
            files.cloud(&format!("tracks-{number:04}"), &clouds::of_tracks(site, &every_track))?;
        }
        if let Some((path, mut file)) = self.geojson("tracks", wanted.tracks, files)? {
            file.ways(&ways).and_then(|()| file.finish()).map_err(at(&path))?;
        }
        if let Some((path, file)) = links_file {
            file.finish().map_err(at(&path))?;
        }
        health.add(&stage_health);
        Ok(frames)
    }

    fn geojson(
        &self,
        what: &str,
        wanted: bool,
        files: &mut Files,
    ) -> Result<Option<(PathBuf, GeoJsonFile)>, Error> {
        if !wanted || !self.wanted.geojson {
            return Ok(None);
        }
        let path = files.path(&format!("{what}-{:04}.geojson", self.number));
        let file = GeoJson::new(create(&path)?, what, self.args.origin).map_err(at(&path))?;
        Ok(Some((path, file)))
    }
}

fn create(path: &Path) -> Result<BufWriter<File>, Error> {
    File::create(path).map(BufWriter::new).map_err(at(path))
}

fn at(path: &Path) -> impl Fn(std::io::Error) -> Error {
    move |error| Error::new(error.to_string()).within(path.display())
}
