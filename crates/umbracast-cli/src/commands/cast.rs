//! `cast`: tracks of another program become links.

use umbracast::Error;
use umbracast_io::outcome_tables::{OutcomeRows, OutcomeTables};
use umbracast_io::own_tracks::OwnTracks;

use crate::args::{Cast, Common};
use crate::ending::Ending;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup;

/// Stages 2 and 3 on a table of tracks.
pub fn run(args: &Cast, common: &Common) -> Result<Ending, Error> {
    let config = setup::config(args.mode, args.site.site.as_deref())?;
    let weights = setup::weights(args.weights.as_deref())?;
    let own = OwnTracks::read(&args.tracks)?;
    setup::make_dir(&args.out)?;
    setup::write(&args.out.join("config.toml"), config.to_toml())?;
    let watch = Stopwatch::start();
    let mut tables = OutcomeTables::create(&args.out, &config.site, args.csv, false)?;
    let (mut frames, mut links) = (0_u64, 0);
    let health = own.cast(&config, &weights, |scene, outcome| {
        frames += 1;
        links += outcome.blockages.len();
        tables.write(&OutcomeRows::of(scene, outcome))
    })?;
    tables.finish()?;
    let seconds = watch.seconds();
    let summary = RunJson::new("cast", &watch)
        .with("mode", args.mode)
        .with("frames", frames)
        .with("tracks", own.rows().len())
        .with("links", links)
        .with("health", health);
    summary.write(&args.out)?;
    let tracks = own.rows().len();
    let text = format!(
        "{links} links of {tracks} tracks in {frames} frames in {}: {seconds:.1} s",
        args.out.display()
    );
    summary.print(common, &text);
    Ok(Ending::Done)
}
