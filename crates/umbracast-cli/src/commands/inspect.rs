//! `inspect`: what is in a file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use serde_json::json;
use umbracast::detect::point_network::PointNetwork;
use umbracast::forecast::{Residual, Weights};
use umbracast::{Config, Error};
use umbracast_io::pcap::PcapReader;
use umbracast_io::pcd::read_pcd;
use umbracast_io::recording::{Entry, RecordingReader};
use umbracast_io::trajectories::{self, Options};
use umbracast_io::{bvh, tables};

use crate::args::{Common, Inspect};
use crate::ending::Ending;
use crate::{say, setup};

/// The names of what is told of a damaged file.
const LOST: &str = "lost";
const REFUSED: &str = "not understood";

/// What was found in a file: lines of name and value, and what was lost.
#[derive(Default)]
struct Findings {
    lines: Vec<(String, String)>,
    lost: Option<String>,
}

impl Findings {
    fn say(&mut self, name: &str, value: impl ToString) {
        self.lines.push((name.to_owned(), value.to_string()));
    }
}

/// Tells of every file. One that cannot be read does not hide the others.
pub fn run(args: &Inspect, common: &Common) -> Result<Ending, Error> {
    let (mut lost, mut refused, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for file in &args.files {
        let findings = look(file);
        if !common.json {
            say::line(file.display());
        }
        let named = file.display().to_string();
        match findings {
            Ok(findings) => {
                let pairs: serde_json::Map<String, serde_json::Value> =
                    findings.lines.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
                all.push(json!({ "file": named, "found": pairs, "lost": findings.lost }));
                let lines = findings.lines.iter().map(|(name, value)| (name.as_str(), value));
                let lines = lines.chain(findings.lost.iter().map(|lost| (LOST, lost)));
                lines
                    .filter(|_| !common.json)
                    .for_each(|(name, value)| say::line(format_args!("  {name:28} {value}")));
                lost.extend(findings.lost);
            }
            Err(error) if args.files.len() == 1 => return Err(error),
            Err(error) => {
                all.push(json!({ "file": named, "refused": error.to_string() }));
                if !common.json {
                    say::line(format_args!("  {REFUSED:28} {error}"));
                }
                refused.push(error);
            }
        }
    }
    if common.json {
        say::line(format_args!("{:#}", serde_json::Value::Array(all)));
    }
    if let Some(first) = refused.first() {
        let (refused, files) = (refused.len(), args.files.len());
        return Err(Error::new(format!(
            "{refused} of {files} files were not understood, the first: {first}"
        )));
    }
    Ok(if lost.is_empty() { Ending::Done } else { Ending::DataLost(lost.join("; ")) })
}

fn look(file: &Path) -> Result<Findings, Error> {
    let bytes = || setup::read(file);
    let mut found = Findings::default();
    if file.is_dir() {
        return Err(Error::new("expected a file, found a folder").within(file.display()));
    }
    let extension = file.extension().and_then(|e| e.to_str()).unwrap_or_default();
    match extension {
        "mcap" | "db3" => recording(file, &mut found)?,
        "parquet" => table(file, &mut found)?,
        "pcd" => cloud(&bytes()?, file, &mut found)?,
        "pcap" => capture(file, &mut found)?,
        "safetensors" => {
            let bytes = bytes()?;
            let (lstm, residual) = (Weights::from_safetensors(&bytes), Residual::from_safetensors(&bytes));
            let kind = match (lstm, residual, PointNetwork::from_safetensors(&bytes)) {
                (Ok(_), ..) => "weights of the paper's LSTM",
                (_, Ok(_), _) => "weights of the default forecast's residual network",
                (.., Ok(_)) => "weights of the network that reads the pose of a body",
                (Err(no_lstm), Err(no_residual), Err(no_pose)) => {
                    let story = format!(
                        "neither the LSTM ({no_lstm}) nor the residual ({no_residual}) nor the network of the pose ({no_pose})"
                    );
                    return Err(Error::new(story).within(file.display()));
                }
            };
            found.say("kind", kind);
            found.say("bytes", bytes.len());
        }
        "toml" => {
            let text = setup::read_text(file)?;
            let config = Config::of_run(&text, &file.display().to_string())?;
            found.say("kind", "configuration");
            found.say("mode", config.mode.name());
            found.say("site", &config.site.name);
            found.say("sensors", config.site.sensors.len());
            found.say("access points", config.site.access_points.len());
        }
        "ndjson" | "txt" => people(file, &mut found)?,
        "bvh" => {
            let motion = bvh::read(file)?;
            found.say("kind", "motion capture");
            found.say("joints", motion.joints.len());
            found.say("frames", motion.positions.len());
            found.say("duration_s", motion.frame_s * motion.positions.len() as f64);
        }
        "csv" if is_of_people(file)? => people(file, &mut found)?,
        "csv" => {
            let text = setup::read_text(file)?;
            let header = text.lines().next().filter(|line| line.contains(','));
            let header = header.ok_or_else(|| {
                Error::new("expected a header with commas, found none").within(file.display())
            })?;
            found.say("kind", "table");
            found.say("rows", text.lines().count() - 1);
            found.say("columns", header.replace(',', " "));
        }
        "json" => {
            let value: serde_json::Value = serde_json::from_slice(&bytes()?).map_err(|e| {
                Error::new(format!("expected JSON, found an error: {e}")).within(file.display())
            })?;
            found.say("kind", "JSON");
            for (key, value) in value.as_object().into_iter().flatten().take(40) {
                found.say(
                    key,
                    if value.is_object() || value.is_array() { "..".to_owned() } else { value.to_string() },
                );
            }
        }
        other => {
            return Err(Error::new(format!(
                "expected .mcap, .db3, .parquet, .csv, .ndjson, .txt, .bvh, .pcd, .pcap, .safetensors, .toml or .json, found \
                 {other:?}"
            ))
            .within(file.display()));
        }
    }
    Ok(found)
}

/// Whether a table is one of recorded people: somebody's number, and where they were.
fn is_of_people(file: &Path) -> Result<bool, Error> {
    let bytes = setup::read(file)?;
    let text = String::from_utf8_lossy(&bytes); // Headers may hold Latin-1.
    let header = text.lines().find(|line| !line.is_empty() && !line.starts_with('#')).unwrap_or_default();
    let has = |names: &[&str]| header.split(',').any(|column| names.contains(&column.trim()));
    Ok(has(&["id"]) && has(&["x_m", "x/m"]))
}

fn people(file: &Path, found: &mut Findings) -> Result<(), Error> {
    let known = trajectories::read(file, Options::default());
    // Without a rate the rows are still there to be counted.
    let counted = || trajectories::read(file, Options { fps: Some(1.0), ..Options::default() }).ok();
    let (people, has_rate) = match known {
        Ok(people) => (people, true),
        Err(error) => (counted().ok_or(error)?, false),
    };
    let samples = || people.iter().flat_map(|person| &person.samples);
    let span = |axis: usize| {
        let all = samples().map(|sample| sample[axis]);
        let (low, high) =
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        format!("{low} to {high}")
    };
    found.say("kind", "recorded people");
    found.say("people", people.len());
    found.say("samples", samples().count());
    found.say("time_s", if has_rate { span(0) } else { "no rate in the file: --fps gives one".to_owned() });
    found.say("x_m", span(1));
    found.say("y_m", span(2));
    Ok(())
}

fn recording(file: &Path, found: &mut Findings) -> Result<(), Error> {
    let mut reader = RecordingReader::open(file)?;
    let mut topics: BTreeMap<String, (u64, u64)> = BTreeMap::new();
    found.say("kind", "recording");
    while let Some(entry) = reader.next_entry()? {
        let (topic, things) = match entry {
            Entry::Config(text) => {
                found.say("site", Config::site_of_run(&text, &file.display().to_string())?.name);
                continue;
            }
            Entry::Packets(sensor, packets) => (format!("/{sensor}/packets"), packets.len() as u64),
            Entry::Cloud(topic, _) => (format!("{topic} sensor_msgs/msg/PointCloud2"), 0),
            Entry::Other(topic, kind, _) => (format!("{topic} {kind}"), 0),
        };
        let counts = topics.entry(topic).or_default();
        *counts = (counts.0 + 1, counts.1 + things);
    }
    for (topic, (messages, packets)) in topics {
        let packets = if packets > 0 { format!(", {packets} packets") } else { String::new() };
        found.say(&topic, format!("{messages} messages{packets}"));
    }
    found.lost = reader.lost().map(str::to_owned);
    Ok(())
}

fn table(file: &Path, found: &mut Findings) -> Result<(), Error> {
    let summary = tables::describe(file)?;
    found.say("kind", "table");
    found.say("rows", summary.rows);
    for (name, kind) in summary.columns {
        found.say(&name, kind);
    }
    Ok(())
}

fn cloud(bytes: &[u8], file: &Path, found: &mut Findings) -> Result<(), Error> {
    let cloud = read_pcd(bytes, &file.display().to_string())?;
    found.say("kind", "point cloud");
    found.say("points", format!("{} x {}", cloud.width, cloud.height));
    for field in &cloud.fields {
        let finite = || field.values.iter().copied().filter(|v| v.is_finite());
        let (low, high) =
            (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
        found.say(&field.name, format!("{}, {low} to {high}", format!("{:?}", field.kind).to_lowercase()));
    }
    Ok(())
}

fn capture(file: &Path, found: &mut Findings) -> Result<(), Error> {
    let open = File::open(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
    let mut reader = PcapReader::new(BufReader::new(open), &file.display().to_string())?;
    let mut kinds: BTreeMap<(u16, usize), u64> = BTreeMap::new();
    let (mut first_ns, mut last_ns) = (None, 0);
    for datagram in reader.by_ref() {
        first_ns.get_or_insert(datagram.time_ns);
        last_ns = datagram.time_ns;
        *kinds.entry((datagram.port, datagram.payload.len())).or_default() += 1;
    }
    found.say("kind", "capture");
    found.say("duration_s", (last_ns - first_ns.unwrap_or(last_ns)) as f64 / 1e9);
    for ((port, bytes), count) in kinds {
        found.say(&format!("port {port}, {bytes} bytes"), format!("{count} datagrams"));
    }
    if reader.truncated() {
        found.lost = Some(format!("{}: ends within a record", file.display()));
    }
    Ok(())
}
