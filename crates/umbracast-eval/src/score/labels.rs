//! People labelled by hand in the clouds of one sensor, as truth for stage 1.
//!
//! CSV with the columns `frame_file`, `label_index`, `x_m`, `y_m`, `z_m` (centre of the box, sensor frame), in any
//! order and with any others. The number in a cloud's file name is the frame's number, as in `run`. `label_index`
//! serves as the person's number; such labels have no identities over time.

use umbracast::Error;
use umbracast::geometry::{DVec3, Pose};
use umbracast_io::rows::{PeopleRow, TrackRow};

use crate::score::stage1::Stage1;

/// Reads labels as rows of truth in the site frame. `file` names the text in errors.
///
/// # Errors
/// A column that is missing, a cell that is no number, a file name without one: with file and line.
pub fn parse(text: &str, site_from_sensor: &Pose, file: &str) -> Result<Vec<PeopleRow>, Error> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    let column = |name: &str| {
        header.iter().position(|column| *column == name).ok_or_else(|| {
            Error::new(format!("{file}:1: expected a column {name}, found {}", header.join(", ")))
        })
    };
    let [frame, person, x, y, z] = ["frame_file", "label_index", "x_m", "y_m", "z_m"].map(column);
    let (frame, person, x, y, z) = (frame?, person?, x?, y?, z?);
    let mut rows = Vec::new();
    for (number, line) in lines.enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let cell = |at: usize, expected: &str| {
            let story = |found: &str| {
                Error::new(format!(
                    "{file}:{}: {}: expected {expected}, found {found:?}",
                    number + 2,
                    header[at]
                ))
            };
            cells.get(at).copied().ok_or_else(|| story("nothing")).map(|text| (text, story(text)))
        };
        let value = |at: usize| {
            let (text, wrong) = cell(at, "a number")?;
            text.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or(wrong)
        };
        let (name, wrong) = cell(frame, "a file named by a number")?;
        let stem = name.rsplit('/').next().unwrap_or(name).split('.').next().unwrap_or_default();
        let frame = stem.parse::<u64>().map_err(|_| wrong)?;
        let at_m = site_from_sensor.point(DVec3::new(value(x)?, value(y)?, value(z)?));
        rows.push(PeopleRow {
            frame,
            person: value(person)? as u32,
            x_m: at_m.x,
            y_m: at_m.y,
            ..PeopleRow::default()
        });
    }
    Ok(rows)
}

/// Stage 1 against labels: frames without a label are left out.
pub fn score(labels: &[PeopleRow], tracks: &[TrackRow]) -> Stage1 {
    let labelled: std::collections::BTreeSet<u64> = labels.iter().map(|row| row.frame).collect();
    let tracks: Vec<TrackRow> = tracks.iter().filter(|row| labelled.contains(&row.frame)).copied().collect();
    Stage1::of(labels, &tracks)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "frame_file,label_index,x_m,y_m,z_m\n70.pcd,0,1.0,2.0,-0.3\n70.pcd,1,3.0,2.0,-0.3\n";

    #[test]
    fn labels_become_rows_and_are_scored_by_frame() {
        let labels = parse(TEXT, &Pose::IDENTITY, "labels.csv").unwrap();
        assert_eq!((labels[1].frame, labels[1].person, labels[1].x_m), (70, 1, 3.0));
        let track = |frame, x_m| TrackRow { frame, x_m, y_m: 2.0, confirmed: true, ..TrackRow::default() };
        let score = score(&labels, &[track(70, 1.1), track(71, 9.0)]);
        assert_eq!((score.recall(), score.precision()), (Some(0.5), Some(1.0)));
    }

    #[test]
    fn a_missing_column_and_a_wrong_cell_are_named() {
        let error = parse("frame_file,x_m\n", &Pose::IDENTITY, "l.csv").unwrap_err().to_string();
        assert!(error.contains("l.csv:1") && error.contains("label_index"), "{error}");
        let text = TEXT.replace("3.0", "three");
        let error = parse(&text, &Pose::IDENTITY, "l.csv").unwrap_err().to_string();
        assert!(error.contains("l.csv:3") && error.contains("x_m") && error.contains("three"), "{error}");
    }
}
