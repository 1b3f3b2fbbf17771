//! `view`: runs a recording through the pipeline at its own pace and shows it in the browser.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use umbracast::{Error, Health, Pipeline};
use umbracast_live::advice::Advised;
use umbracast_live::published;
use umbracast_live::run::Counters;
use umbracast_live::warnings::Warnings;
use umbracast_live::{HostClock, Published};

use crate::args::{Common, View};
use crate::ending::Ending;
use crate::input;
use crate::page::Page;
use crate::{say, setup, signal};

/// Shows every input, one after the other, then keeps the last picture until the end is asked for.
pub fn run(args: &View, common: &Common) -> Result<Ending, Error> {
    let inputs = input::scenes(&args.inputs)?;
    let mut config = setup::config(args.mode, args.site.site.as_deref())?;
    if args.site.site.is_none() {
        config.site = input::recorded_site(&inputs)?.unwrap_or(config.site);
    }
    let inputs = input::of_site(inputs, &config.site)?;
    let weights = setup::weights(None)?;
    let asked = signal::asked_to_end()?;
    let (clock, counters) = (HostClock::start(), Arc::new(Counters::default()));
    let page = Page::open(&args.page, &config.site, &counters, clock, &inputs[0].to_string())?;
    let (publish, names) = (page.listener(), published::access_points(&config.site));
    let mut lost = Vec::new();
    loop {
        lost.clear(); // Another pass loses the same.
        for input in &inputs {
            let mut pipeline = Pipeline::new(&config, Some(&weights))?;
            if let Some(empty) = input::empty_beside(input) {
                let (frames, _) = input::empty_frames(&empty, &config, &mut Health::default())?;
                frames.iter().for_each(|frame| pipeline.learn_empty(frame));
            }
            let (mut warnings, mut advised, mut first) = (Warnings::default(), Advised::default(), None);
            let told = input.frames(&config.site, &mut Health::default(), |frame| {
                let (host_ns, frame_ns) = *first.get_or_insert((clock.now_ns(), frame.time_ns));
                let outcome = pipeline.step(frame);
                let mut published = Published::of(outcome, frame, config.site.sensors.len(), &names);
                published.events = warnings.changes(&published.links, &names);
                published.advice = advised.changes(&published.decisions, &names);
                clock.sleep_until(host_ns + ((frame.time_ns - frame_ns) as f64 / args.rate) as i64);
                published.published_ns = clock.now_ns();
                counters.frames.fetch_add(1, Ordering::Relaxed);
                publish(&Arc::new(published));
                match asked.load(Ordering::Relaxed) {
                    true => Err(Error::new("asked to end")),
                    false => Ok(()),
                }
            });
            if asked.load(Ordering::Relaxed) {
                page.close();
                return Ok(Ending::Done);
            }
            lost.extend(told?);
        }
        if !args.again {
            break;
        }
    }
    if !common.quiet {
        say::note("the recording has ended; Ctrl-C ends the page");
    }
    while !asked.load(Ordering::Relaxed) && !args.page.no_serve {
        std::thread::sleep(Duration::from_millis(50));
    }
    page.close();
    if lost.is_empty() { Ok(Ending::Done) } else { Ok(Ending::DataLost(lost.join("; "))) }
}
