//! Tracks of another program, from a table: who follows people by other means gets their links.
//!
//! The columns are those of the table `tracks`, of which number, time, position and velocity suffice. What else is there is used:
//! covariance, heading, height, width, gait, and forecasts of one's own. Short names serve as well: `id`, `x`, `y`, `vx`, `vy`, and
//! `time_s`, `t_s`, `time` or `t` for seconds.

use std::path::Path;

use umbracast::forecast::{Coupling, Forecast, Gaussian2, Weights};
use umbracast::geometry::DVec2;
use umbracast::lidar::is_time;
use umbracast::track::Track;
use umbracast::{Config, Error, Health, Outcome, Pipeline, STEPS, Site};

use crate::rows::TrackRow;
use crate::tables::{Loose, Row, Value};

/// What other programs call the columns that are needed.
const ALSO: [(&str, &str); 5] =
    [("id", "track"), ("x", "x_m"), ("y", "y_m"), ("vx", "vx_mps"), ("vy", "vy_mps")];
/// Names of a time in seconds.
const SECONDS: [&str; 4] = ["time_s", "t_s", "time", "t"];
/// Columns that have to be there.
const NEEDED: [&str; 6] = ["time_ns", "track", "x_m", "y_m", "vx_mps", "vy_mps"];
/// Nobody is faster, metres a second: a larger number is one of another unit.
const FASTEST_MPS: f64 = 100.0;
/// No hall is larger, metres.
const FARTHEST_M: f64 = 1e5;
/// The columns of the first and of the last forecast step.
const STEP_FIRST: &str = "x_s1_m";
/// By how much a frame's first forecasts tell the noise of an acceleration that nobody foresees, m^2/s^3: that of our own forecast
/// by constant velocity.
const ACCELERATION_PSD_M2PS3: f64 = 0.01;

/// Tracks of another program, in order of scene, time and number. What the table does not say is NaN.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnTracks {
    rows: Vec<TrackRow>,
    /// Whether forecasts are among the columns.
    foreseen: bool,
}

impl OwnTracks {
    /// From a file: CSV with a header, or Parquet.
    ///
    /// # Errors
    /// As [`Self::new`], with the file's name and the line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::new(Loose::read(path)?).map_err(|e| e.within(path.display()))
    }

    /// From a table in memory.
    ///
    /// # Errors
    /// A column that is missing, a value of another kind or that cannot be, a person twice in a frame: with row or line, column,
    /// expected and found.
    pub fn new(mut table: Loose) -> Result<Self, Error> {
        ALSO.iter().for_each(|(theirs, ours)| table.rename(theirs, ours));
        from_seconds(&mut table)?;
        let unknown = TrackRow { confirmed: true, ..nothing_known() };
        let may_miss = |name: &str| !NEEDED.contains(&name);
        let mut rows: Vec<TrackRow> = table.rows(&[], unknown, may_miss)?;
        let (numbered, foreseen) = (table.column("frame").is_some(), table.column(STEP_FIRST).is_some());
        for (r, row) in rows.iter().enumerate() {
            check(row).map_err(|e| e.within(table.place(r)))?;
        }
        let mut order: Vec<usize> = (0..rows.len()).collect();
        let key = |r: &usize| (rows[*r].scene, rows[*r].time_ns, rows[*r].track);
        order.sort_by_key(key);
        if let Some(pair) = order.windows(2).find(|pair| key(&pair[0]) == key(&pair[1])) {
            let (track, first) = (rows[pair[1]].track, table.place(pair[0]));
            let story = format!(
                "column track: expected each person once at a time, found {track} again, after {first}"
            );
            return Err(Error::new(story).within(table.place(pair[1])));
        }
        rows = order.into_iter().map(|r| rows[r]).collect();
        if !numbered {
            number(&mut rows);
        }
        Ok(Self { rows, foreseen })
    }

    /// The rows as they were given.
    pub fn rows(&self) -> &[TrackRow] {
        &self.rows
    }

    /// Stages 2 and 3: gives the outcome of every frame to `sink`, with its scene. Each scene has a pipeline of its own. Where the
    /// table holds forecasts, they are taken in place of stage 2's.
    ///
    /// # Errors
    /// A setting that cannot work, and what `sink` fails with.
    pub fn cast(
        &self,
        config: &Config,
        weights: &Weights,
        mut sink: impl FnMut(u32, &Outcome) -> Result<(), Error>,
    ) -> Result<Health, Error> {
        let mut health = Health::default();
        for scene in self.rows.chunk_by(|a, b| a.scene == b.scene) {
            let mut pipeline = Pipeline::new(config, Some(weights))?;
            let mut of_scene = Health::default();
            for frame in scene.chunk_by(|a, b| a.time_ns == b.time_ns) {
                let TrackRow { scene, frame: number, time_ns, .. } = frame[0];
                let tracks: Vec<Track> = frame.iter().map(|row| track(row, &config.site)).collect();
                let outcome = match self.foreseen {
                    false => pipeline.step_tracks(number, time_ns, &tracks),
                    true => {
                        let forecasts: Vec<Forecast> =
                            frame.iter().zip(&tracks).map(|(row, track)| forecast(row, track)).collect();
                        pipeline.step_forecasts(number, time_ns, &tracks, &forecasts)
                    }
                };
                sink(scene, outcome)?;
                of_scene = outcome.health;
            }
            health.add(&of_scene);
        }
        Ok(health)
    }
}

/// Times in seconds become nanoseconds.
pub(crate) fn from_seconds(table: &mut Loose) -> Result<(), Error> {
    if table.column("time_ns").is_some() {
        return Ok(());
    }
    let Some(name) = SECONDS.into_iter().find(|name| table.column(name).is_some()) else {
        let found: Vec<&str> = table.names().collect();
        return Err(Error::new(format!(
            "column time_ns: expected times in nanoseconds, or time_s in seconds, found neither but {}",
            found.join(", ")
        )));
    };
    let in_ns = |(row, value): (usize, &Value)| {
        let seconds = match *value {
            Value::Whole(v) => Some(v as f64),
            Value::Real(v) => Some(v),
            _ => None,
        };
        let ns = seconds.map(|s| (s * 1e9).round()).filter(|ns| ns.abs() < 9.2e18);
        ns.map(|ns| Value::Whole(ns as i64)).ok_or_else(|| {
            let place = table.place(row);
            Error::new(format!("{place}, column {name}: expected a time in seconds, found {value}"))
        })
    };
    let times = table.column(name).unwrap_or_default().iter().enumerate().map(in_ns);
    let times: Vec<Value> = times.collect::<Result<_, _>>()?;
    table.put("time_ns", times);
    Ok(())
}

/// Frames by their times, from 0 in every scene.
fn number(rows: &mut [TrackRow]) {
    for scene in rows.chunk_by_mut(|a, b| a.scene == b.scene) {
        for (number, frame) in (0..).zip(scene.chunk_by_mut(|a, b| a.time_ns == b.time_ns)) {
            frame.iter_mut().for_each(|row| row.frame = number);
        }
    }
}

fn check(row: &TrackRow) -> Result<(), Error> {
    if !is_time(row.time_ns) {
        return Err(Error::new(format!(
            "column time_ns: expected a time that a clock shows, found {}",
            row.time_ns
        )));
    }
    let needed = [
        ("x_m", row.x_m, FARTHEST_M, "metres"),
        ("y_m", row.y_m, FARTHEST_M, "metres"),
        ("vx_mps", row.vx_mps, FASTEST_MPS, "metres a second"),
        ("vy_mps", row.vy_mps, FASTEST_MPS, "metres a second"),
    ];
    for (name, value, most, unit) in needed {
        if value.is_nan() || value.abs() > most {
            return Err(Error::new(format!(
                "column {name}: expected -{most} to {most} {unit}, found {value}"
            )));
        }
    }
    let [xx, .., vyvy] = row.covariance;
    for (name, variance) in [("cov_xx_m2", xx), ("cov_yy_m2", row.covariance[4]), ("cov_vyvy_m2ps2", vyvy)] {
        if variance < 0.0 {
            return Err(Error::new(format!(
                "column {name}: expected a variance, not below 0, found {variance}"
            )));
        }
    }
    if row.height_m <= 0.0 {
        return Err(Error::new(format!("column height_m: expected metres above 0, found {}", row.height_m)));
    }
    Ok(())
}

/// A row of which every measure is unknown.
fn nothing_known() -> TrackRow {
    let mut row = TrackRow::default();
    row.visit(&mut |_, cell| {
        if let crate::tables::Cell::F64(value) = cell {
            *value = f64::NAN;
        }
    });
    row
}

/// What the row says of a track, and what is usual where it says nothing.
fn track(row: &TrackRow, site: &Site) -> Track {
    let mut track = Track::new(row.track, DVec2::new(row.x_m, row.y_m), DVec2::new(row.vx_mps, row.vy_mps));
    let c = row.covariance;
    if c[0].is_finite() && c[4].is_finite() {
        let given = [
            [c[0], c[1], c[2], c[3]],
            [c[1], c[4], c[5], c[6]],
            [c[2], c[5], c[7], c[8]],
            [c[3], c[6], c[8], c[9]],
        ];
        let speeds_are_given = given[2][2].is_finite() && given[3][3].is_finite();
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            if (i < 2 && j < 2) || speeds_are_given {
                track.covariance[i][j] = if given[i][j].is_finite() { given[i][j] } else { 0.0 };
            }
        }
        track.face_ahead();
    }
    put(&mut track.heading_rad, row.heading_rad);
    put(&mut track.heading_sigma_rad, row.heading_sigma_rad);
    put(&mut track.height_m, row.height_m);
    put(&mut track.height_sigma_m, row.height_sigma_m);
    put(&mut track.width_scale, row.width_scale);
    put(&mut track.width_scale_sigma, row.width_scale_sigma);
    let outline_m = track.outline_m.as_flattened_mut().iter_mut().zip(row.outline_m.as_flattened());
    outline_m.for_each(|(to, given)| put(to, *given));
    track.canopy = row.canopy();
    put(&mut track.gait.phase_rad, row.gait_phase_rad);
    put(&mut track.gait.concentration, row.gait_concentration);
    for i in 0..2 {
        put(&mut track.gait.hand_swing[i], row.hand_swing[i]);
        put(&mut track.gait.hand_swing_sigma[i], row.hand_swing_sigma[i]);
    }
    (track.points, track.confirmed, track.part_of) = (row.points, row.confirmed, row.part_of);
    track.stand_up(site.hall.floor_m(track.position_m));
    track
}

fn put(to: &mut f64, given: f64) {
    if given.is_finite() {
        *to = given;
    }
}

/// What the row foresees. Where a step has no covariance, it is that of the track carried on.
fn forecast(row: &TrackRow, track: &Track) -> Forecast {
    let psd = ACCELERATION_PSD_M2PS3;
    let coupling = Coupling { state: track.covariance, acceleration_psd_m2ps3: [[psd, 0.0], [0.0, psd]] };
    let steps: [Gaussian2; STEPS] = std::array::from_fn(|step| {
        let [x_m, y_m, xx, xy, yy] = row.steps[step];
        let t_s = (step + 1) as f64 * umbracast::STEP_S;
        let p = &track.covariance;
        let carried = |i: usize, j: usize, unforeseen: f64| {
            p[i][j] + t_s * (p[i][j + 2] + p[i + 2][j]) + t_s * t_s * p[i + 2][j + 2] + unforeseen
        };
        let unforeseen = psd * t_s.powi(3) / 3.0;
        let or = |given: f64, usual: f64| if given.is_finite() { given } else { usual };
        let mean_m = DVec2::new(
            or(x_m, track.position_m.x + t_s * track.velocity_mps.x),
            or(y_m, track.position_m.y + t_s * track.velocity_mps.y),
        );
        Gaussian2 {
            mean_m,
            xx_m2: or(xx, carried(0, 0, unforeseen)),
            xy_m2: or(xy, carried(0, 1, 0.0)),
            yy_m2: or(yy, carried(1, 1, unforeseen)),
        }
    });
    Forecast { track: track.id, steps, coupling }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Mode;

    fn read(text: &str) -> Result<OwnTracks, Error> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("tracks.csv");
        std::fs::write(&path, text).unwrap();
        OwnTracks::read(&path)
    }

    fn links(tracks: &OwnTracks, mode: Mode) -> Vec<f64> {
        let weights = crate::setup::weights(None).unwrap();
        let mut found = Vec::new();
        let cast = tracks.cast(&Config::for_mode(mode), &weights, |_, outcome| {
            found.extend(outcome.blockages.iter().map(|link| link.p[8]));
            Ok(())
        });
        assert!(cast.unwrap().is_clean());
        found
    }

    /// One stands at (4, 0) m, and another walks into the line between that place and the access point `side`.
    const CROSSING: &str =
        "id,t,x,y,vx,vy\n7,0.1,4,0,0,0\n8,0.1,6,-0.8,0,1.3\n7,0.2,4,0,0,0\n8,0.2,6,-0.67,0,1.3\n";

    #[test]
    fn number_time_place_and_velocity_suffice() {
        let tracks = read(CROSSING).unwrap();
        assert_eq!(tracks.rows().iter().map(|row| row.frame).collect::<Vec<_>>(), [0, 0, 1, 1]);
        for mode in Mode::ALL {
            let p = links(&tracks, mode);
            assert_eq!(p.len(), 2 * 2 * 2);
            assert!(p[0] > 0.5 && p[1] < 0.1, "{}: {p:?}", mode.name());
        }
    }

    #[test]
    fn forecasts_of_ones_own_go_before_ours() {
        let stays = CROSSING.lines().enumerate().map(|(line, text)| match line {
            0 => format!("{text},x_s1_m,y_s1_m,x_s9_m,y_s9_m\n"),
            _ => format!("{text},4,0,4,0\n").replace(",1.3,4,0,4,0", ",0,6,-0.8,6,-0.8"),
        });
        let p = links(&read(&stays.collect::<String>()).unwrap(), Mode::Default);
        assert!(p[0] < 0.5, "{p:?}: nobody walks on");
    }

    #[test]
    fn bad_input_is_told_with_line_and_column() {
        let told = |text: &str| read(text).unwrap_err().to_string();
        for (text, expected) in [
            ("id,t,x,y,vx,vy\n1,0.1,a,0,0,0\n", "line 2, column x_m: expected a number, found \"a\""),
            (
                "id,t,x,y,vx\n1,0.1,0,0,0\n",
                "column vy_mps: expected a number, found no such column but track",
            ),
            ("id,x,y,vx,vy\n1,0,0,0,0\n", "column time_ns: expected times in nanoseconds, or time_s"),
            (
                "id,t,x,y,vx,vy\n1,now,0,0,0,0\n",
                "line 2, column t: expected a time in seconds, found \"now\"",
            ),
            (
                "id,t,x,y,vx,vy\n1,1,0,0,0,0\n2,1,0,0,0,0\n1,1,0,0,0,0\n",
                "line 4: column track: expected each person once",
            ),
            (
                "id,t,x,y,vx,vy\n1,1,0,0,1300,0\n",
                "line 2: column vx_mps: expected -100 to 100 metres a second",
            ),
            ("id,t,x,y,vx,vy,height_m\n1,1,0,0,0,0,0\n", "line 2: column height_m: expected metres above 0"),
            ("id,t,x,y,vx,vy\n1,1,,0,0,0\n", "line 2, column x_m: expected a number, found null"),
        ] {
            let message = told(text);
            assert!(message.contains("tracks.csv: ") && message.contains(expected), "{message}");
        }
    }
}
