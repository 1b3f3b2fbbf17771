//! Every score as one long CSV table with one value in each row, for users who draw their own figures.

use std::fmt::Write as _;

use umbracast::Mode;

use super::published;
use crate::run::pooled::{Estimate, Group, Scores};

/// Columns `group`, `scenes`, `mode`, `predictor`, `access_point`, `step` (the window or the step of the forecast,
/// each of 100 ms), `score`, `value` and the ends of its 95 % interval, empty where there is none. Words hold no
/// comma but in names of the user's, which are quoted.
pub fn to_csv(scores: &Scores) -> String {
    let mut csv = String::from("group,scenes,mode,predictor,access_point,step,score,value,low,high\n");
    scores.groups.iter().for_each(|group| of_group(group, &mut csv));
    let mut published = |step: usize, score: &str, value: f64| {
        // Writing to a String cannot fail.
        let _ = writeln!(csv, "published,500,,,,{step},{score},{value},,");
    };
    published(3, "base_rate", published::BASE_RATE_AT_300_MS);
    published::AT_300_MS.iter().for_each(|&(score, value)| published(3, score, value));
    published(3, "f1", published::F1_AT_300_MS);
    published(8, "f1", published::F1_FROM_800_MS);
    for (step, value) in (1..).zip(published::DISPLACEMENT_M) {
        published(step, "displacement_m", value);
    }
    csv
}

fn of_group(group: &Group, csv: &mut String) {
    let mut row = |of: [&str; 3], step: Option<usize>, score: &str, estimate: Estimate| {
        let [mode, predictor, access_point] = of;
        let step = step.map_or(String::new(), |step| step.to_string());
        let cell = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let (low, high) = (estimate.interval.map(|i| i[0]), estimate.interval.map(|i| i[1]));
        let _ = writeln!(
            csv,
            "{},{},{mode},{predictor},{},{step},{score},{},{},{}",
            quoted(&group.name),
            group.scenes,
            quoted(access_point),
            cell(estimate.value),
            cell(low),
            cell(high)
        );
    };
    let alone = |value: Option<f64>| Estimate { value, interval: None };
    for links in &group.links {
        let of = [links.mode.map_or("", Mode::name), links.predictor, &links.access_point];
        for w in &links.windows {
            let scores = [
                ("base_rate", w.base_rate),
                ("accuracy", w.accuracy),
                ("precision", w.precision),
                ("recall", w.recall),
                ("f1", w.f1),
                ("onset_f1", w.onset_f1),
                ("auprc", alone(w.auprc)),
                ("brier", alone(w.brier)),
                ("ece", alone(w.ece)),
                ("lead_median_s", alone(w.lead_median_s)),
                ("lead_warned", alone(w.lead_warned)),
            ];
            scores.into_iter().for_each(|(name, estimate)| row(of, Some(w.w), name, estimate));
        }
    }
    for mode in &group.modes {
        let of = [mode.mode.name(), "run", ""];
        let tracking = [
            ("tracking_recall", mode.recall),
            ("tracking_precision", mode.precision),
            ("mota", mode.mota),
            ("idf1", mode.idf1),
            ("hota", mode.hota),
            ("switches_per_scene", mode.switches_per_scene),
            ("position_rmse_m", mode.position_rmse_m),
            ("velocity_rmse_mps", mode.velocity_rmse_mps),
            ("position_nees", mode.position_nees),
            ("velocity_nees", mode.velocity_nees),
            ("tracked_share", mode.tracked_share),
        ];
        tracking.into_iter().for_each(|(name, estimate)| row(of, None, name, estimate));
        for (i, &displacement) in mode.displacement_m.iter().enumerate() {
            row(of, Some(i + 1), "displacement_m", displacement);
            row(of, Some(i + 1), "nll", alone(mode.nll[i]));
        }
    }
    for (i, &value) in group.constant_velocity_m.iter().enumerate() {
        row(["", "constant velocity of truth", ""], Some(i + 1), "displacement_m", alone(value));
    }
    for rung in &group.ladder {
        let of = ["", rung.oracle, &rung.access_point];
        let scores = [
            ("base_rate", rung.base_rate),
            ("precision", rung.precision),
            ("recall", rung.recall),
            ("f1", rung.f1),
            ("onset_f1", rung.onset_f1),
        ];
        for (name, value) in scores {
            row([of[0], &quoted(of[1]), of[2]], Some(rung.window), name, alone(value));
        }
    }
}

fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_owned(),
    }
}
