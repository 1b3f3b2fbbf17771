//! What scores come to, in three sentences: for who does not read tables.

use umbracast::Mode;

use crate::run::pooled::{Scores, WindowScores};
use crate::run::scene_score::Predictor;

/// The window that is spoken of, 300 ms.
const WINDOW: usize = 3;

/// How often the best mode was right at the first access point, beside the paper's method and the answer "as now", and what
/// that is worth. `None` where nothing was scored.
pub fn verdict(scores: &Scores) -> Option<String> {
    let group = scores.headline()?;
    let access_point = *group.access_points().first()?;
    let at = |mode: Mode| {
        group.link(Some(mode), Predictor::Run, access_point).map(|links| &links.windows[WINDOW - 1])
    };
    let best = group.modes.iter().rev().find_map(|of| at(of.mode).map(|window| (of.mode, window)))?;
    let (mode, window) = best;
    let now =
        group.link(None, Predictor::PersistenceOfTruth, access_point).map(|links| &links.windows[WINDOW - 1]);
    let beside = |of: fn(&WindowScores) -> Option<f64>| {
        let paper = (mode != Mode::Paper).then(|| at(Mode::Paper)).flatten();
        let others = [("the paper's method", paper), ("\"as now\" of the true present", now)];
        let told =
            others.iter().filter_map(|(name, of_other)| Some(format!("{name} {:.3}", of((*of_other)?)?)));
        told.map(|told| format!("; {told}")).collect::<String>()
    };
    // Cut, not rounded: what is not all is not 100 %.
    let percent = |share: Option<f64>| {
        share.map_or("-".to_owned(), |share| format!("{:.1} %", (share * 1000.0).floor() / 10.0))
    };
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
    let seen = match group.scenes {
        1 => "One scene shows how it works, not how good it is: docs/RESULTS.md has many, with intervals and with what fails.".to_owned(),
        scenes => format!("These are {scenes} simulated scenes: docs/RESULTS.md says what they do not show."),
    };
    Some(format!(
        "Verdict: of the links to {access_point} that a body blocked within 300 ms, mode {} warned of {}, and {} of its warnings \
         were right (F1 {}{}). Of blockages that had yet to begin, F1 is {}{}. {seen}",
        mode.name(),
        percent(window.recall.value),
        percent(window.precision.value),
        number(window.f1.value),
        beside(|scores| scores.f1.value),
        number(window.onset_f1.value),
        beside(|scores| scores.onset_f1.value),
    ))
}
