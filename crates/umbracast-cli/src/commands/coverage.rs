//! `coverage`: what a site's sensors see of a standing person, place by place.

use umbracast::{Error, Mode};
use umbracast_eval::coverage::{self, Options};
use umbracast_io::tables;

use crate::args::{Common, Coverage};
use crate::ending::Ending;
use crate::{say, setup};

/// Surveys the floor; the summary to stdout, table and floor plan into a folder where one is given.
pub fn run(args: &Coverage, common: &Common) -> Result<Ending, Error> {
    let site = setup::config(Mode::Default, args.site.site.as_deref())?.site;
    let options = Options { step_m: args.step, height_m: args.height, headings: args.headings };
    let surveyed = setup::with_threads(common.threads, || coverage::survey(&site, options))??;
    let summary = coverage::summary(&site, &surveyed)?;
    match common.json {
        true => say::line(format_args!("{:#}", serde_json::json!(summary))),
        false => say::text(&summary.to_text()),
    }
    if let Some(folder) = &args.out {
        setup::make_dir(folder)?;
        tables::write_columns(folder, "coverage", &coverage::columns(&site, &surveyed))?;
        let picture = folder.join("coverage.svg");
        setup::write(&picture, coverage::svg(&site, &surveyed))?;
        if !common.json {
            say::line(format_args!("\nfloor plan: {}", picture.display()));
        }
    }
    Ok(Ending::Done)
}
