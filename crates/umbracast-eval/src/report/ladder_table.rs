//! The ladder of oracles, beside what was measured before where it can be compared.

use umbracast::{Config, Site};

use super::published;
use super::tables::{Table, number, scenes, window};
use crate::ladder::LadderRow;
use crate::pooled::{Group, Scores};

/// Windows of a ladder that has no reference.
const WINDOWS: [usize; 3] = [1, 3, 9];

const NOT_EXPLAINED: &str = "not explained yet";

/// The ladder of the preset that the reference was measured with, beside it, where the site is the reference's
/// too; else that of all scenes by itself. `explanations` are (oracle, why it lies below the reference).
pub fn ladder(scores: &Scores, site: Option<&Site>, explanations: &[(String, String)]) -> Option<Table> {
    let same_site = site.is_some_and(|site| *site == Config::default().site);
    let same_preset = scores.groups.iter().find(|group| group.name == published::LADDER_PRESET);
    let table = match same_preset.filter(|_| same_site) {
        Some(group) => beside_reference(group, explanations),
        None => alone(scores.headline()?),
    };
    (!table.rows.is_empty()).then_some(table)
}

fn alone(group: &Group) -> Table {
    let header = ["what is known", "access point", "window", "base rate", "F1", "onset F1"];
    let mut table = Table::new(title(group), 3, &header);
    for row in group.ladder.iter().filter(|row| WINDOWS.contains(&row.window)) {
        table.rows.push(vec![
            row.oracle.to_owned(),
            row.access_point.clone(),
            window(row.window),
            number(row.base_rate, 3),
            number(row.f1, 3),
            number(row.onset_f1, 3),
        ]);
    }
    table
}

fn beside_reference(group: &Group, explanations: &[(String, String)]) -> Table {
    let header = [
        "what is known",
        "access point",
        "window",
        "base rate",
        "F1",
        "reference",
        "onset F1",
        "reference",
        "differs",
    ];
    let mut table = Table::new(title(group), 3, &header);
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (oracle, reference) in oracles(group).into_iter().zip(published::LADDER) {
        let known = explanations.iter().find(|(name, _)| name == oracle);
        let why_below = known.map_or(NOT_EXPLAINED, |(_, why)| why.as_str());
        for ((access_point, w), (f1, onset)) in published::LADDER_AT.into_iter().zip(reference) {
            let at = |row: &&LadderRow| {
                row.oracle == oracle && row.access_point == access_point && row.window == w
            };
            let Some(row) = group.ladder.iter().find(at) else { continue };
            let gaps = [(row.f1, f1), (row.onset_f1, onset)];
            let gaps = gaps.into_iter().filter_map(|(found, expected)| Some(found? - expected));
            let below = gaps.clone().any(|gap| gap < -published::LADDER_TOLERANCE);
            let above = gaps.clone().any(|gap| gap > published::LADDER_TOLERANCE);
            if below {
                give_reason(&mut reasons, why_below, oracle.to_owned());
            }
            if above {
                give_reason(&mut reasons, NOT_EXPLAINED, format!("{oracle} (above)"));
            }
            let differs = match (below, above) {
                (false, false) => "",
                (true, false) => "below",
                (false, true) => "above",
                (true, true) => "both ways",
            };
            table.rows.push(vec![
                oracle.to_owned(),
                access_point.to_owned(),
                window(w),
                number(row.base_rate, 3),
                number(row.f1, 3),
                number(Some(f1), 3),
                number(row.onset_f1, 3),
                number(Some(onset), 3),
                differs.to_owned(),
            ]);
        }
    }
    let explained: Vec<String> =
        reasons.iter().map(|(why, oracles)| format!("{}: {why}.", oracles.join("; "))).collect();
    let note = format!(
        "Reference: an earlier measurement with bodies of 18 capsules on {}. Marked where F1 or onset \
         F1 lies more than {:.2} apart. {}",
        published::LADDER_PRESET,
        published::LADDER_TOLERANCE,
        explained.join(" ")
    );
    table.noted(note.trim_end())
}

fn give_reason<'a>(reasons: &mut Vec<(&'a str, Vec<String>)>, why: &'a str, rung: String) {
    match reasons.iter_mut().find(|(reason, _)| *reason == why) {
        Some((_, rungs)) if rungs.contains(&rung) => {}
        Some((_, rungs)) => rungs.push(rung),
        None => reasons.push((why, vec![rung])),
    }
}

fn oracles(group: &Group) -> Vec<&'static str> {
    let mut oracles = Vec::new();
    for row in &group.ladder {
        if !oracles.contains(&row.oracle) {
            oracles.push(row.oracle);
        }
    }
    oracles
}

fn title(group: &Group) -> String {
    format!("Ladder of oracles: {}", scenes(group))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ladder of three rungs: as the reference, below it, above it.
    fn scores(preset: &str) -> Scores {
        let mut group = Group { name: preset.to_owned(), ..empty_group() };
        for (rung, (oracle, off)) in [("same", 0.0), ("low", -0.1), ("high", 0.1)].into_iter().enumerate() {
            for ((access_point, window), (f1, onset)) in
                published::LADDER_AT.into_iter().zip(published::LADDER[rung])
            {
                group.ladder.push(LadderRow {
                    oracle,
                    access_point: access_point.to_owned(),
                    window,
                    base_rate: None,
                    precision: None,
                    recall: None,
                    f1: Some(f1 + off),
                    onset_f1: Some(onset),
                });
            }
        }
        Scores { groups: vec![group] }
    }

    fn empty_group() -> Group {
        Group {
            name: String::new(),
            scenes: 1,
            recordings: 1,
            frames: 1,
            links: Vec::new(),
            modes: Vec::new(),
            constant_velocity_m: Vec::new(),
            ladder: Vec::new(),
        }
    }

    #[test]
    fn only_rungs_below_the_reference_are_explained() {
        let explanations = ["same", "low", "high"].map(|name| (name.to_owned(), "they sway".to_owned()));
        let table = ladder(&scores("orca-03"), Some(&Config::default().site), &explanations).unwrap();
        let differs: Vec<&str> = table.rows.iter().map(|row| row[8].as_str()).collect();
        assert_eq!(differs, [[""; 4], ["below"; 4], ["above"; 4]].concat());
        let note = &table.note;
        assert!(note.ends_with("low: they sway. high (above): not explained yet."), "{note}");
    }

    #[test]
    fn elsewhere_there_is_no_reference() {
        let site = Config::default().site;
        let mut moved = site.clone();
        moved.access_points[0].position_m[2] += 0.5;
        for table in
            [ladder(&scores("orca-06"), Some(&site), &[]), ladder(&scores("orca-03"), Some(&moved), &[])]
        {
            let table = table.unwrap();
            assert!(!table.header.iter().any(|name| name == "reference" || name == "differs"));
            assert_eq!((table.rows.len(), table.note.as_str()), (12, ""));
        }
    }
}
