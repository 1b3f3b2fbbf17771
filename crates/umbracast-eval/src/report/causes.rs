//! The table of causes: blockage by the owner's own body, by the hall, and by any cause. The other tables have
//! blockage by other people.

use super::tables::Table;
use crate::run::pooled::{Estimate, Group};
use crate::run::scene_score::Predictor;

/// Windows that are shown: 100, 300 and 900 ms.
const WINDOWS: [usize; 3] = [1, 3, 9];

/// Every mode and access point where a device is hidden by its owner or by the hall; without rows where none is.
pub fn causes(group: &Group) -> Table {
    let header = [
        "access point",
        "window",
        "mode",
        "blocked by",
        "base rate",
        "precision",
        "recall",
        "F1",
        "onset F1",
        "ECE",
    ];
    let mut table = Table::new("Blockage by cause", 4, &header);
    let figure = |value: Option<f64>, digits| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    for access_point in group.access_points() {
        for w in WINDOWS {
            for mode in &group.modes {
                for (predictor, name) in [
                    (Predictor::ByOwner, "the owner"),
                    (Predictor::ByHall, "the hall"),
                    (Predictor::ByAny, "anything"),
                ] {
                    let Some(links) = group.link(Some(mode.mode), predictor, access_point) else { continue };
                    let scores = &links.windows[w - 1];
                    let start = [access_point, &format!("{} ms", 100 * w), mode.mode.name(), name];
                    let of = |estimate: &Estimate| match estimate.interval {
                        Some([low, high]) => {
                            format!("{} [{low:.3}, {high:.3}]", figure(estimate.value, 3))
                        }
                        None => figure(estimate.value, 3),
                    };
                    let mut row: Vec<String> = start.map(str::to_owned).into();
                    let estimates = [scores.base_rate, scores.precision, scores.recall, scores.f1];
                    row.extend(estimates.iter().chain([&scores.onset_f1]).map(of));
                    row.push(figure(scores.ece, 4));
                    table.rows.push(row);
                }
            }
        }
    }
    table.noted(
        "The owner: only instances in which the UE stays outside the owner's body. Anything: others, the owner \
         or the hall, in all instances.",
    )
}
