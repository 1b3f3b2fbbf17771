//! What access points hear of devices: from tables, from JSON, and from recordings.
//!
//! A table has the columns `time_ns` (or `time_s`, `t_s`, `time`, `t` in seconds), `access_point` (its name in the site file),
//! `device` (the network's number) and `power_dbm` or `rsrp_dbm`; and `serves` where it is known which access point serves the device.
//! A recording's table has `heard_ns` besides: then `time_ns` is the end of the frame before which a report was taken. JSON is one
//! report or a list of them:
//!
//! ```json
//! [ { "time_ns": 1700000000100000000, "access_point": "door", "device": 17, "power_dbm": -63.5, "serves": true } ]
//! ```
//!
//! `time_ns` is of the hall's sensors, whose clocks need not be the host's. It may be missing in JSON: then a report was heard when
//! it came.

use std::path::Path;

use serde::Deserialize;
use umbracast::lidar::is_time;
use umbracast::radio::Report;
use umbracast::{Error, Site};

use crate::own_tracks::from_seconds;
use crate::recording::{Entry, RecordingReader};
use crate::rows::ReportRow;
use crate::tables::{Loose, Value};
use crate::wire::{self, WireRow};

/// More in one message is not of one hall: half a second of 100 devices and 8 access points, every 20 ms, is a third of it.
const REPORTS_MAX: usize = 65_536;
/// No radio hears less or more, dBm: another number is one of another unit.
const POWER_DBM: std::ops::RangeInclusive<f64> = -250.0..=100.0;

/// Reports in the order in which a run takes them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reports {
    rows: Vec<ReportRow>,
    taken: usize,
}

impl Reports {
    /// Those that a recording holds.
    ///
    /// # Errors
    /// A file that is no recording.
    pub fn recorded(path: &Path, site: &Site) -> Result<Self, Error> {
        let (mut reader, names) = (RecordingReader::open(path)?, names(site));
        let mut rows = Vec::new();
        while let Some(entry) = reader.next_entry()? {
            if let Entry::Other(topic, _, message) = entry
                && topic == ReportRow::TOPIC
                && let Some(of_frame) = of_message(&message, &names)
            {
                rows.extend(of_frame);
            }
        }
        Ok(Self::new(rows))
    }

    fn new(mut rows: Vec<ReportRow>) -> Self {
        rows.sort_by_key(|row| row.time_ns);
        Self { rows, taken: 0 }
    }

    /// What is taken before the frame of this time and was not taken yet.
    pub fn before(&mut self, frame_ns: i64) -> Vec<Report> {
        let rest = &self.rows[self.taken..];
        let due = &rest[..rest.partition_point(|row| row.time_ns <= frame_ns)];
        self.taken += due.len();
        due.iter().map(of_row).collect()
    }
}

/// Reports of all scenes, from a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Tabled {
    rows: Vec<ReportRow>,
    /// The table has no column `scene`: what it holds is of each.
    of_all: bool,
}

impl Tabled {
    /// A file: CSV with a header, or Parquet.
    ///
    /// # Errors
    /// A column that is missing, a value of another kind, an access point without a radio, a power that no radio hears: with file,
    /// line, column, expected and found.
    pub fn read(path: &Path, site: &Site) -> Result<Self, Error> {
        of_table(Loose::read(path)?, site).map_err(|e| e.within(path.display()))
    }

    /// Those of a scene.
    pub fn of_scene(&self, scene: u32) -> Reports {
        Reports::new(self.rows.iter().filter(|row| self.of_all || row.scene == scene).copied().collect())
    }
}

/// The rows of reports that are taken before a frame.
pub fn rows(frame: u64, time_ns: i64, reports: &[Report]) -> Vec<ReportRow> {
    let row = |report: &Report| ReportRow {
        scene: 0,
        frame,
        time_ns,
        heard_ns: report.time_ns,
        access_point: report.access_point as u32,
        device: report.device,
        power_dbm: report.power_dbm,
        serves: report.serves,
    };
    reports.iter().map(row).collect()
}

/// A report that came over a network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Came {
    /// What was heard. Its time is the host's, if nobody said when it was heard.
    pub report: Report,
    /// Whether somebody said so.
    pub is_timed: bool,
}

/// A report as it is sent.
#[derive(Deserialize)]
struct Sent {
    time_ns: Option<i64>,
    access_point: String,
    device: u64,
    power_dbm: f64,
    #[serde(default)]
    serves: bool,
}

/// One or several.
#[derive(Deserialize)]
#[serde(untagged)]
enum SomeSent {
    One(Sent),
    Many(Vec<Sent>),
}

/// Reports from JSON that came at `now_ns`, time of the host.
///
/// # Errors
/// Bytes of another kind, an access point that is not the site's or has no radio, a power that no radio hears: with the report's
/// place, expected and found. Then none of them is taken.
pub fn from_json(json: &[u8], site: &Site, now_ns: i64) -> Result<Vec<Came>, Error> {
    let sent: SomeSent = serde_json::from_slice(json).map_err(|_| {
        Error::new(
            "expected JSON, one report or a list of them: {\"access_point\": \"NAME\", \"device\": 17, \"power_dbm\": -63.5}, and \
             \"time_ns\" where it was not heard just now",
        )
    })?;
    let sent = match sent {
        SomeSent::One(one) => vec![one],
        SomeSent::Many(many) => many,
    };
    if sent.len() > REPORTS_MAX {
        return Err(Error::new(format!("expected {REPORTS_MAX} reports at most, found {}", sent.len())));
    }
    let report = |(place, sent): (usize, Sent)| {
        let (is_timed, time_ns) = (sent.time_ns.is_some(), sent.time_ns.unwrap_or(now_ns));
        let report = named(time_ns, &sent.access_point, sent.device, sent.power_dbm, sent.serves, site);
        report.map(|report| Came { report, is_timed }).map_err(|e| e.within(format!("report {place}")))
    };
    sent.into_iter().enumerate().map(report).collect()
}

/// A report of an access point by its name.
///
/// # Errors
/// An access point that is not the site's or has no radio, a power that no radio hears, a time that no clock shows.
pub fn named(
    time_ns: i64,
    access_point: &str,
    device: u64,
    power_dbm: f64,
    serves: bool,
    site: &Site,
) -> Result<Report, Error> {
    let index = site.access_points.iter().position(|known| known.name == access_point);
    let report = Report { time_ns, access_point: index.unwrap_or(usize::MAX), device, power_dbm, serves };
    check(&report, access_point, site).map(|()| report)
}

/// The same as JSON, for who passes them on.
pub fn to_json(came: &[Came], site: &Site) -> String {
    let named = |Came { report, is_timed }: &Came| {
        serde_json::json!({
            "time_ns": is_timed.then_some(report.time_ns),
            "access_point": site.access_points.get(report.access_point).map(|ap| &ap.name),
            "device": report.device,
            "power_dbm": report.power_dbm,
            "serves": report.serves,
        })
    };
    serde_json::Value::from(came.iter().map(named).collect::<Vec<_>>()).to_string()
}

/// The reports of a message in a recording. Earlier messages do not say who serves.
fn of_message(message: &[u8], names: &[String]) -> Option<Vec<ReportRow>> {
    let rows = wire::decode(message, names).or_else(|| wire::decode_without(message, names, "serves"));
    rows.map(|(.., rows)| rows)
}

fn of_table(mut table: Loose, site: &Site) -> Result<Tabled, Error> {
    from_seconds(&mut table)?;
    table.rename("rsrp_dbm", "power_dbm");
    if table.column("heard_ns").is_none() {
        let times: Vec<Value> = table.column("time_ns").unwrap_or_default().to_vec();
        table.put("heard_ns", times);
    }
    let of_all = table.column("scene").is_none();
    let may_miss = |name: &str| ["scene", "frame", "serves"].contains(&name);
    let names = names(site);
    let rows: Vec<ReportRow> = table.rows(&names, ReportRow::default(), may_miss)?;
    for (r, row) in rows.iter().enumerate() {
        let name = names.get(row.access_point as usize).map_or("", String::as_str);
        check(&of_row(row), name, site).map_err(|e| e.within(table.place(r)))?;
    }
    Ok(Tabled { rows, of_all })
}

fn of_row(row: &ReportRow) -> Report {
    Report {
        time_ns: row.heard_ns,
        access_point: row.access_point as usize,
        device: row.device,
        power_dbm: row.power_dbm,
        serves: row.serves,
    }
}

fn check(report: &Report, name: &str, site: &Site) -> Result<(), Error> {
    if site.access_points.get(report.access_point).is_none_or(|ap| ap.radio.is_none()) {
        let of_radio = site.access_points.iter().filter(|ap| ap.radio.is_some());
        let known: Vec<&str> = of_radio.map(|ap| ap.name.as_str()).collect();
        return Err(Error::new(format!(
            "access_point: expected one of the site's that has a radio ({}), found {name:?}",
            if known.is_empty() { "none has".to_owned() } else { known.join(", ") }
        )));
    }
    if !POWER_DBM.contains(&report.power_dbm) {
        return Err(Error::new(format!(
            "power_dbm: expected {} to {} dBm, found {}",
            POWER_DBM.start(),
            POWER_DBM.end(),
            report.power_dbm
        )));
    }
    if !is_time(report.time_ns) {
        return Err(Error::new(format!(
            "time_ns: expected a time that a clock shows, found {}",
            report.time_ns
        )));
    }
    Ok(())
}

fn names(site: &Site) -> Vec<String> {
    site.access_points.iter().map(|ap| ap.name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::Encoder;
    use umbracast::Config;

    fn site() -> Site {
        let mut site = Config::default().site;
        site.access_points[0].radio = Some(umbracast::site::Radio::default());
        site
    }

    fn read(text: &str) -> Result<Reports, Error> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("reports.csv");
        std::fs::write(&path, text).unwrap();
        Ok(Tabled::read(&path, &site())?.of_scene(3))
    }

    #[test]
    fn a_table_gives_before_each_frame_what_was_heard_until_then() {
        let name = &site().access_points[0].name;
        let text = format!(
            "time_s,device,power_dbm,access_point\n1.2,7,-60,{name}\n1.1,7,-61.5,{name}\n1.3,8,-70,{name}\n"
        );
        let mut reports = read(&text).unwrap();
        assert_eq!(reports.before(1_000_000_000), []);
        let powers: Vec<f64> = reports.before(1_200_000_000).iter().map(|report| report.power_dbm).collect();
        assert_eq!(powers, [-61.5, -60.0]);
        assert_eq!(reports.before(1_200_000_000), []);
        assert_eq!(reports.before(9_000_000_000)[0].device, 8);
    }

    #[test]
    fn a_table_of_several_scenes_gives_those_of_one() {
        let name = &site().access_points[0].name;
        let text = format!(
            "scene,time_ns,device,power_dbm,access_point\n3,5000000000,7,-60,{name}\n4,5000000000,9,-60,{name}\n"
        );
        let heard = read(&text).unwrap().before(i64::MAX);
        assert_eq!(heard.iter().map(|report| report.device).collect::<Vec<_>>(), [7]);
    }

    #[test]
    fn what_cannot_be_is_told_with_its_place() {
        let (site, header) = (site(), "time_s,device,power_dbm,access_point\n");
        let deaf = &site.access_points[1].name;
        let name = &site.access_points[0].name;
        let told = read(&format!("{header}1.0,7,-60,{deaf}\n")).unwrap_err().to_string();
        assert!(told.contains("line 2: access_point: expected one of the site's that has a radio"), "{told}");
        let told = read(&format!("{header}1.0,7,-60,{name}\n1.0,7,1e9,{name}\n")).unwrap_err().to_string();
        assert!(told.contains("line 3: power_dbm: expected -250 to 100 dBm, found 1000000000"), "{told}");
        let told = read("time_s,device,access_point\n").unwrap_err().to_string();
        assert!(told.contains("column power_dbm: expected a number"), "{told}");
        let told = from_json(b"[{\"access_point\":\"nowhere\",\"device\":1,\"power_dbm\":-60}]", &site, 5);
        assert!(told.unwrap_err().to_string().starts_with("report 0: access_point: expected one of"));
        assert!(from_json(b"{}", &site, 5).unwrap_err().to_string().starts_with("expected JSON"));
    }

    /// Recordings of before the column `serves` hold messages without it.
    #[test]
    fn reports_recorded_before_they_said_who_serves_are_read() {
        let mut e = Encoder::default();
        e.header(100_000_000, "site");
        e.u64(1);
        e.u32(2);
        for device in [7, 8] {
            e.u64(90_000_000);
            e.string("door");
            e.u64(device);
            e.f64(-61.5);
        }
        let rows = of_message(&e.finish(), &["door".to_owned()]).unwrap();
        assert_eq!(rows.iter().map(|row| row.device).collect::<Vec<_>>(), [7, 8]);
        assert!(rows.iter().all(|row| !row.serves && row.power_dbm == -61.5));
    }

    #[test]
    fn json_goes_out_and_in() {
        let site = site();
        let name = &site.access_points[0].name;
        let now_ns = 1_700_000_000_000_000_000;
        let one =
            format!("{{\"access_point\":\"{name}\",\"device\":18446744073709551615,\"power_dbm\":-63.25}}");
        let reports = from_json(one.as_bytes(), &site, now_ns).unwrap();
        let Came { report, is_timed } = reports[0];
        assert_eq!((reports.len(), report.time_ns, report.device, is_timed), (1, now_ns, u64::MAX, false));
        assert_eq!(from_json(to_json(&reports, &site).as_bytes(), &site, now_ns).unwrap(), reports);
        let timed = [Came { report: Report { serves: true, ..report }, is_timed: true }];
        assert_eq!(from_json(to_json(&timed, &site).as_bytes(), &site, 0).unwrap(), timed);
        assert_eq!(rows(4, 9, &[report])[0].heard_ns, now_ns);
    }
}
