//! Real people before a real VLP-16: two stretches of clouds, every mode, its tracks against boxes drawn by hand, and why the
//! default mode misses whom it misses.

use std::ffi::OsString;
use std::fs;
use std::ops::RangeInclusive;

use super::book::Book;
use crate::tools::{Result, argument};

/// A stretch of consecutive clouds, and what was chosen by looking at it.
struct Stretch {
    frames: RangeInclusive<u32>,
    chose: &'static str,
}

/// The constants are `HEIGHT_MIN_M` and `DIAGONAL_M` of src/detect/first_sight.rs and `BESIDE_BINS` of range_model.rs.
const STRETCHES: [Stretch; 2] = [
    Stretch { frames: 117..=140, chose: "3 constants: tuning" },
    Stretch { frames: 70..=95, chose: "no constant" },
];
/// Frames of the first second of a stretch: who was there before it begins is seen for the first time.
const FIRST_SECOND: u32 = 10;
/// Half a person's width: who is nearer to the line of sight to another one stands in front.
const HALF_M: f64 = 0.3;

/// What stands below the table.
const ABOUT: &str = "\
By confirmed tracks, matched one to one with the labels of each frame within 0.5 m (optimal assignment). Both: the stretches together.
The labels: hand-drawn boxes around the visible side, in every frame of both stretches. Nobody labelled who stands and walks beside the
tripod; the site file leaves that ground out, so neither they nor tracks of them count. Of 9 of the frames 70 to 95 it is not certain
which box belongs to which cloud (both lie within 0.2 m). The labels have no identities; their order keeps each person within a stretch,
so switches count. The clouds have no times; 10 a second is inferred from the steps.";

/// Counts of a mode over some frames.
#[derive(Default, Clone, Copy)]
struct Counts {
    labels: f64,
    tracks: f64,
    matches: f64,
    switches: f64,
    squared_m2: f64,
    /// Labels from one second on, and those of them without a track.
    later: f64,
    later_missed: f64,
}

/// One table of all modes, then each label that the default mode misses.
pub fn logictronix(book: &mut Book) -> Result<()> {
    let labels = book.data("logictronix_vlp16/labels.csv")?;
    let boxes = boxes(&fs::read_to_string(&labels).map_err(|e| format!("labels.csv: {e}"))?)?;
    book.command("cargo xtask record logictronix");
    book.line(
        "# each stretch: umbracast run CLOUDS --site config/sites/logictronix.toml --mode MODE --out RUN",
    );
    book.line(
        "#               umbracast evaluate RUN --labels $UMBRACAST_DATA/logictronix_vlp16/labels.csv --json",
    );
    book.line(
        "mode     frames      chose                labels  recall  precision    MOTA  switches  position, m  recall from 1 s on",
    );
    let mut missed = Vec::new();
    for mode in ["default", "paper", "hdl"] {
        let mut both = Counts::default();
        for stretch in &STRETCHES {
            let first = *stretch.frames.start();
            let clouds = book.scratch(&format!("clouds-{first}"));
            fs::create_dir_all(&clouds).map_err(|e| e.to_string())?;
            for frame in stretch.frames.clone() {
                let from = book.data(&format!("logictronix_vlp16/pcd/{frame}.pcd"))?;
                fs::copy(from, clouds.join(format!("{frame}.pcd"))).map_err(|e| e.to_string())?;
            }
            let out = argument(book.scratch(&format!("run-{first}-{mode}")));
            let site =
                ["--site", "config/sites/logictronix.toml", "--mode", mode, "--out"].map(OsString::from);
            let run: Vec<OsString> =
                ["run".into(), argument(&clouds)].into_iter().chain(site).chain([out.clone()]).collect();
            book.quietly(&run)?;
            let said =
                book.quietly(&["evaluate".into(), out, "--labels".into(), labels.clone(), "--json".into()])?;
            let mut counts = Counts::of(&said)?;
            let without: Vec<(f64, f64)> =
                numbers(&said, "missed").chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
            let later = |frame: f64| frame >= f64::from(first + FIRST_SECOND);
            let of_stretch = boxes.iter().filter(|b| stretch.frames.contains(&b.frame));
            counts.later = of_stretch.filter(|b| later(f64::from(b.frame))).count() as f64;
            counts.later_missed = without.iter().filter(|(frame, _)| later(*frame)).count() as f64;
            let frames = format!("{first} to {}", stretch.frames.end());
            book.line(&counts.row(mode, &frames, stretch.chose));
            both = both.plus(&counts);
            if mode == "default" {
                missed.extend(without.into_iter().map(|(frame, label)| (first, frame, label)));
            }
        }
        book.line(&both.row(mode, "both", ""));
    }
    book.line("");
    book.line(&format!("Missed by the default mode: {} labels", missed.len()));
    for (first, frame, label) in missed {
        let place = boxes.iter().position(|b| (f64::from(b.frame), f64::from(b.label)) == (frame, label));
        let place = place.ok_or_else(|| format!("labels.csv: no label {label} of frame {frame}"))?;
        let cloud = book.data(&format!("logictronix_vlp16/pcd/{frame}.pcd"))?;
        let points = points(&fs::read(cloud).map_err(|e| format!("{frame}.pcd: {e}"))?)?;
        let (it, others) = (&boxes[place], boxes.iter().enumerate().filter(|(k, _)| *k != place));
        let hidden = others.map(|(_, other)| other).any(|other| it.is_behind(other));
        book.line(&format!(
            "frame {frame:3}, number {:2} of its stretch: label {label} at {:.1} m, {:3} returns in the box, {}",
            frame - f64::from(first) + 1.0,
            it.centre_m[0].hypot(it.centre_m[1]),
            points.iter().filter(|point| it.holds(point)).count(),
            if hidden { "behind the other person" } else { "in full view" }
        ));
    }
    book.line("");
    book.line(ABOUT);
    Ok(())
}

impl Counts {
    /// Of what `evaluate --labels --json` says.
    fn of(said: &str) -> Result<Self> {
        let [labels, tracks, matches, switches, rmse_m] =
            ["labels", "tracks", "matches", "switches", "position_rmse_m"].map(|name| {
                let number = numbers(said, name).first().copied();
                number.ok_or_else(|| format!("evaluate --labels: expected {name}, found\n{said}"))
            });
        let (matches, rmse_m) = (matches?, rmse_m?);
        let squared_m2 = matches * rmse_m * rmse_m;
        Ok(Self {
            labels: labels?,
            tracks: tracks?,
            matches,
            switches: switches?,
            squared_m2,
            ..Self::default()
        })
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            labels: self.labels + other.labels,
            tracks: self.tracks + other.tracks,
            matches: self.matches + other.matches,
            switches: self.switches + other.switches,
            squared_m2: self.squared_m2 + other.squared_m2,
            later: self.later + other.later,
            later_missed: self.later_missed + other.later_missed,
        }
    }

    /// A line of the table. MOTA: 1 - (missed + false + switches) / labels.
    fn row(&self, mode: &str, frames: &str, chose: &str) -> String {
        let wrong = self.labels + self.tracks - 2.0 * self.matches + self.switches;
        format!(
            "{mode:<8} {frames:<11} {chose:<20} {:6}  {:6.3}  {:9.3}  {:6.3}  {:8}  {:11.3}  {:18.3}",
            self.labels,
            self.matches / self.labels,
            self.matches / self.tracks,
            1.0 - wrong / self.labels,
            self.switches,
            (self.squared_m2 / self.matches).sqrt(),
            1.0 - self.later_missed / self.later
        )
    }
}

/// The numbers below a name of a JSON object, up to the next name.
fn numbers(json: &str, name: &str) -> Vec<f64> {
    let after = json.split_once(&format!("\"{name}\":")).map_or("", |(_, after)| after);
    let value = after.split(['"', '}']).next().unwrap_or_default();
    value.split([',', '[', ']', ' ', '\n']).filter_map(|number| number.parse().ok()).collect()
}

/// A labelled box, in the sensor's frame.
struct LabelledBox {
    frame: u32,
    label: u32,
    centre_m: [f64; 3],
    /// Along its own x, y and z. The source's `width` lies along x and its `length` along y.
    size_m: [f64; 3],
    yaw_rad: f64,
}

impl LabelledBox {
    fn holds(&self, point_m: &[f64; 3]) -> bool {
        let [x, y, z] = [0, 1, 2].map(|axis| point_m[axis] - self.centre_m[axis]);
        let (sin, cos) = self.yaw_rad.sin_cos();
        let own = [cos * x + sin * y, cos * y - sin * x, z];
        own.iter().zip(self.size_m).all(|(own, size)| own.abs() <= 0.5 * size)
    }

    /// Whether somebody else stands between it and the sensor.
    fn is_behind(&self, other: &Self) -> bool {
        let ([x, y, _], [other_x, other_y, _]) = (self.centre_m, other.centre_m);
        let range_m = x.hypot(y);
        let (along_m, aside_m) =
            ((other_x * x + other_y * y) / range_m, (other_y * x - other_x * y).abs() / range_m);
        other.frame == self.frame && along_m > 0.0 && along_m < range_m && aside_m < HALF_M
    }
}

/// Rows `frame_file,label_index,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad`.
fn boxes(text: &str) -> Result<Vec<LabelledBox>> {
    let row = |line: &str| {
        let (file, numbers) = line.split_once(".pcd,")?;
        let numbers: Vec<f64> = numbers.split(',').map_while(|number| number.parse().ok()).collect();
        let &[label, x, y, z, length, width, height, yaw_rad] = &numbers[..] else { return None };
        Some(LabelledBox {
            frame: file.parse().ok()?,
            label: label as u32,
            centre_m: [x, y, z],
            size_m: [width, length, height],
            yaw_rad,
        })
    };
    let wrong = |line: &str| format!("labels.csv: expected a file and eight numbers, found {line:?}");
    text.lines().skip(1).map(|line| row(line).ok_or_else(|| wrong(line))).collect()
}

/// x, y and z of every point of a binary PCD with four 32-bit numbers a point.
fn points(pcd: &[u8]) -> Result<Vec<[f64; 3]>> {
    const DATA: &[u8] = b"DATA binary\n";
    let header = pcd.windows(DATA.len()).position(|window| window == DATA);
    let body = &pcd[header.ok_or("expected a binary PCD, found none")? + DATA.len()..];
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    Ok(body.chunks_exact(16).map(|p| [number(p), number(&p[4..]), number(&p[8..])]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_misses_are_read_and_added() {
        let said = "{\n  \"labels\": 4,\n  \"matches\": 3,\n  \"missed\": [\n    [\n      70,\n      0\n    ]\n  ],\n  \
                    \"mode\": \"default\",\n  \"position_rmse_m\": 0.1,\n  \"switches\": 1,\n  \"tracks\": 5\n}";
        assert_eq!(numbers(said, "missed"), [70.0, 0.0]);
        let counts = Counts { later: 2.0, later_missed: 1.0, ..Counts::of(said).unwrap() };
        let both = counts.plus(&counts);
        // Of 8 labels 2 are missed, 4 tracks are nobody's and 2 are of somebody else than before.
        let row = both.row("default", "both", "");
        assert!(
            row.contains("0.750      0.600   0.000") && row.ends_with("0.100               0.500"),
            "{row}"
        );
        assert!(Counts::of("{}").is_err());
    }

    #[test]
    fn a_box_holds_what_lies_within_and_hides_what_lies_behind() {
        let text = "frame_file,label_index,x_m,y_m,z_m,length_m,width_m,height_m,yaw_rad\n\
                    7.pcd,0,4.0,0.1,0.0,1.0,0.4,1.8,0.0\n7.pcd,1,2.0,0.0,0.0,1.0,0.4,1.8,0.0\n";
        let boxes = boxes(text).unwrap();
        assert!(boxes[0].holds(&[4.1, 0.5, 0.8]) && !boxes[0].holds(&[4.3, 0.1, 0.0]));
        assert!(boxes[0].is_behind(&boxes[1]) && !boxes[1].is_behind(&boxes[0]));
    }
}
