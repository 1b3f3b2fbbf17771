//! Losses over time as a table that network simulators replay.

use std::fmt::Write as _;

use umbracast::Error;

use crate::case::Case;
use crate::experiment::{Spec, Truths};
use crate::foreseen::Foreteller;
use crate::truth::{TICK_NS, TICK_S};

/// A loss is written where it differs by more from the last that was.
const STEP_DB: f64 = 0.05;
/// The window of the probability beside it: 300 ms.
const WINDOW: usize = 3;

/// Truth and warning of a scene as CSV: `time_s`, `access_point` and `device` (their numbers), `loss_db` from then on, and
/// `p_out_300ms`, the probability that was told last of the link being out within 300 ms (0 before anybody is followed).
///
/// # Errors
/// As [`crate::experiment::run`].
pub fn csv(spec: &Spec, case: &Case, seed: u64) -> Result<String, Error> {
    let seen = spec.hall.see(spec.crowd, seed)?;
    let config = case.config(spec.hall.config())?;
    let truths = Truths::of(spec.hall.config(), std::slice::from_ref(case), &seen, false)?;
    let traces = truths.of_case(&config, case);
    let mut foreteller = Foreteller::new(&config, None)?;
    let mut frames = seen.ours.iter().peekable();
    let links = traces.access_points * traces.people;
    let (mut p_out, mut written_db) = (vec![0.0; links], vec![f64::INFINITY; links]);
    let mut text = "time_s,access_point,device,loss_db,p_out_300ms\n".to_owned();
    for tick in 0..traces.ticks {
        while let Some(frame) = frames.next_if(|frame| frame.time_ns <= tick as i64 * TICK_NS) {
            let said = foreteller.foresee(frame, traces);
            for (link, p_out) in p_out.iter_mut().enumerate() {
                let loss = said.index_of[link % traces.people]
                    .and_then(|index| said.loss(link / traces.people, index));
                *p_out = loss.map_or(0.0, |loss| loss.p_out[WINDOW - 1].max(loss.p_out_now));
            }
        }
        for link in 0..links {
            let (access_point, person) = (link / traces.people, link % traces.people);
            let loss_db = traces.loss_db(tick, access_point, person);
            if (loss_db - written_db[link]).abs() <= STEP_DB {
                continue;
            }
            written_db[link] = loss_db;
            let (time_s, p_out) = (tick as f64 * TICK_S, p_out[link]);
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{time_s:.2},{access_point},{person},{loss_db:.2},{p_out:.3}");
        }
    }
    Ok(text)
}
