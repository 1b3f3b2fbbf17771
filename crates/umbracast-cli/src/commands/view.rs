//! `view`: runs a recording through the pipeline and shows it in the browser: any place of it, at any speed.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::{Value, json};
use umbracast::{Config, Error, Frame, Health, Pipeline};
use umbracast_io::input::{self, Input, Inputs};
use umbracast_io::reports::Reports;
use umbracast_io::rows::{PeopleLinkRow, PeopleRow};
use umbracast_io::tables;
use umbracast_live::advice::Advised;
use umbracast_live::recording::Recording;
use umbracast_live::run::Counters;
use umbracast_live::warnings::Warnings;
use umbracast_live::whole;
use umbracast_live::{HostClock, Published, published};

use crate::args::{Common, View};
use crate::ending::Ending;
use crate::inputs;
use crate::page::{Page, Shown};
use crate::{say, setup, signal};

/// Computes every input, one after the other, while the page shows what there is already; then waits until the end is
/// asked for.
pub fn run(args: &View, common: &Common) -> Result<Ending, Error> {
    let mut configs = vec![setup::config(args.mode, args.site.site.as_deref())?];
    configs.extend(args.beside.map(|mode| setup::config(mode, args.site.site.as_deref())).transpose()?);
    let mut site = configs[0].site.clone();
    let Inputs { scenes: inputs, empty } =
        inputs::read(&args.inputs, &args.captures, args.site.site.as_deref(), &mut site, common)?;
    configs.iter_mut().for_each(|config| config.site = site.clone());
    let (empty, _) =
        inputs::empty_frames(None, empty, &args.captures, &site, &mut Health::default(), common)?;
    let truth = Truth::beside(&inputs, args.truth.as_deref(), &published::access_points(&site))?;
    let asked = signal::asked_to_end()?;
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let modes = configs.iter().map(|config| config.mode.name().to_owned()).collect();
    let recording = Arc::new(Recording::new(modes, args.rate, args.again, truth.is_some())?);
    let recorded = Shown::live(&site, &counters, clock, &inputs[0].to_string());
    let shown = Shown { recording: Some(recording.clone()), ..recorded };
    let page = Page::open(&args.page, shown)?;
    let (publish, middle_m) = (page.listener(), whole::middle_m(&site));
    let mut lost = Vec::new();
    for input in &inputs {
        let (scene, mut modes) = (input::scene_number(input).unwrap_or(0), Vec::new());
        for config in &configs {
            modes.push(Shows::new(config, input, &empty)?);
        }
        let told = input.frames(&site, &mut Health::default(), |frame| {
            let of_modes: Vec<Published> = modes.iter_mut().map(|mode| mode.step(frame, clock)).collect();
            counters.frames.fetch_add(1, Ordering::Relaxed);
            let truth = truth.as_ref().and_then(|truth| truth.of(scene, frame.index));
            let goes_on = recording.add(&of_modes, truth, || whole::encoded(frame, middle_m));
            of_modes.into_iter().take(1).for_each(|published| publish(&Arc::new(published)));
            match asked.load(Ordering::Relaxed) || !goes_on {
                true => Err(Error::new("asked to end")),
                false => Ok(()),
            }
        });
        if asked.load(Ordering::Relaxed) {
            page.close();
            return Ok(Ending::Done);
        }
        if recording.is_full() {
            break;
        }
        lost.extend(told?);
    }
    recording.finish((!lost.is_empty()).then(|| lost.join("; ")));
    if !common.quiet {
        say::note("every frame is computed; Ctrl-C ends the page");
    }
    while !asked.load(Ordering::Relaxed) && !args.page.no_serve {
        std::thread::sleep(Duration::from_millis(50));
    }
    page.close();
    if lost.is_empty() { Ok(Ending::Done) } else { Ok(Ending::DataLost(lost.join("; "))) }
}

/// One method on one input.
struct Shows {
    pipeline: Pipeline,
    /// What access points heard, as the recording holds it.
    heard: Reports,
    sensors: usize,
    names: Arc<[String]>,
    warnings: Warnings,
    advised: Advised,
}

impl Shows {
    fn new(config: &Config, input: &Input, empty: &[Frame]) -> Result<Self, Error> {
        let mut pipeline = Pipeline::new(config, Some(&setup::weights(None)?))?;
        empty.iter().for_each(|frame| pipeline.learn_empty(frame));
        let (sensors, names) = (config.site.sensors.len(), published::access_points(&config.site));
        let heard = inputs::heard(0, input, None, &config.site)?;
        Ok(Self {
            pipeline,
            heard,
            sensors,
            names,
            warnings: Warnings::default(),
            advised: Advised::default(),
        })
    }

    fn step(&mut self, frame: &Frame, clock: HostClock) -> Published {
        self.pipeline.hear(&self.heard.before(frame.time_ns));
        let outcome = self.pipeline.step(frame);
        let mut published = Published::of(outcome, frame, self.sensors, &self.names);
        published.events = self.warnings.changes(&published.links, &self.names);
        published.advice = self.advised.changes(&published.decisions, &self.names);
        published.published_ns = clock.now_ns();
        published
    }
}

/// Who was where in truth, and whose link was blocked: by scene and frame, as the page gets it.
struct Truth(BTreeMap<(u32, u64), Value>);

impl Truth {
    /// From the folder that is given, or else from that of the recordings, where it holds the truth.
    fn beside(inputs: &[Input], given: Option<&Path>, names: &[String]) -> Result<Option<Self>, Error> {
        let own = match inputs.first() {
            Some(Input::Recording(file)) => file.parent(),
            _ => None,
        };
        let own = own.filter(|folder| tables::path_in::<PeopleRow>(folder).is_file());
        let Some(folder) = given.or(own) else { return Ok(None) };
        let mut frames: BTreeMap<(u32, u64), (Vec<Value>, Vec<Value>)> = BTreeMap::new();
        for row in tables::read::<PeopleRow>(folder, names)?.into_iter().filter(|row| !row.arrived) {
            frames.entry((row.scene, row.frame)).or_default().0.push(json!({
                "person": row.person, "x_m": row.x_m, "y_m": row.y_m, "heading_rad": row.heading_rad,
                "height_m": row.height_m,
            }));
        }
        for row in tables::read::<PeopleLinkRow>(folder, names)? {
            let name = names.get(row.access_point as usize);
            frames.entry((row.scene, row.frame)).or_default().1.push(json!({
                "person": row.person, "access_point": name, "blocked": row.blocked,
                "static_blocked": row.static_blocked, "self_blocked": row.self_blocked,
            }));
        }
        let json = |(people, links): (Vec<Value>, Vec<Value>)| json!({ "people": people, "links": links });
        Ok(Some(Self(frames.into_iter().map(|(key, frame)| (key, json(frame))).collect())))
    }

    fn of(&self, scene: u32, frame: u64) -> Option<&Value> {
        self.0.get(&(scene, frame))
    }
}
