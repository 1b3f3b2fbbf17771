//! The log of a live run: a line for each event, as text for people or as a JSON object.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

use serde_json::{Map, Value, json};

use crate::run::Summary;

/// The same thing is said no more often than this; what happened meanwhile is counted.
const AGAIN_NS: i64 = 10_000_000_000;

/// How lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// For people.
    Text,
    /// One JSON object a line.
    Json,
}

/// How much it matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// As it should be.
    Info,
    /// Something is lost, and the run goes on.
    Warn,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// How much it matters.
    pub level: Level,
    /// Its name for machines.
    pub name: &'static str,
    /// The sensor that it is of, if it is of one.
    pub sensor: Option<String>,
    /// How often, of what is counted.
    pub count: u64,
    /// For people; without the count.
    pub text: String,
}

impl Event {
    /// Something that happened once, to no sensor of its own.
    pub fn new(level: Level, name: &'static str, text: impl Into<String>) -> Self {
        Self { level, name, sensor: None, count: 1, text: text.into() }
    }
}

/// Sees what changed from one look at a run to the next.
#[derive(Debug)]
pub struct Watch {
    sensors: Vec<String>,
    before: Summary,
    sends: Vec<bool>,
}

impl Watch {
    /// For a run of these sensors. All of them are expected to send.
    pub fn new(sensors: Vec<String>) -> Self {
        Self { sends: vec![true; sensors.len()], sensors, before: Summary::default() }
    }

    /// What happened since the last look; a look a second tells a sensor gone that sent nothing for a second.
    pub fn look(&mut self, now: Summary) -> Vec<Event> {
        let mut events = Vec::new();
        for (s, sends) in self.sends.iter_mut().enumerate() {
            let count = |summary: &Summary| summary.of_sensors.get(s).copied().unwrap_or(0);
            let sent = count(&now) > count(&self.before);
            if sent != *sends {
                *sends = sent;
                let event = match sent {
                    true => Event::new(Level::Info, "sensor_back", "the sensor sends again"),
                    false => Event::new(Level::Warn, "sensor_gone", "no packet for a second"),
                };
                events.push(Event { sensor: Some(self.sensors[s].clone()), ..event });
            }
        }
        let before = &self.before;
        let counted = [
            ("frames_skipped", "frames skipped", now.frames_skipped, before.frames_skipped),
            ("packets_lost", "packets dropped", now.packets_lost, before.packets_lost),
            (
                "dropped_by_system",
                "packets dropped by the system",
                now.dropped_by_system,
                before.dropped_by_system,
            ),
            ("strangers", "packets from addresses of no sensor", now.strangers, before.strangers),
            (
                "not_understood",
                "packets not understood",
                now.health.packets_not_understood + now.health.packets_wrong_size,
                before.health.packets_not_understood + before.health.packets_wrong_size,
            ),
            ("clock_jumps", "jumps of a clock", now.health.clock_jumps, before.health.clock_jumps),
            ("not_recorded", "packets and results not recorded", now.recorded.lost, before.recorded.lost),
        ];
        for (name, text, now, before) in counted {
            if now > before {
                events.push(Event { count: now - before, ..Event::new(Level::Warn, name, text) });
            }
        }
        match (&now.recorded.failing, &before.recorded.failing) {
            (Some(told), None) => events.push(Event::new(Level::Warn, "disk_failing", told.clone())),
            (None, Some(_)) => {
                events.push(Event::new(Level::Info, "disk_back", "the disk takes recordings again"))
            }
            _ => {}
        }
        if let Some(file) =
            now.recorded.newest.as_ref().filter(|_| now.recorded.files > before.recorded.files)
        {
            events.push(Event::new(Level::Info, "file", format!("recording to {file}")));
        }
        self.before = now;
        events
    }
}

/// Writes events as lines, the same one not too often.
#[derive(Debug)]
pub struct Log {
    form: Form,
    /// By name and sensor: when it was said last, and how many were held back since.
    said: BTreeMap<(&'static str, Option<String>), (i64, u64)>,
}

impl Log {
    /// Nothing was said yet.
    pub fn new(form: Form) -> Self {
        Self { form, said: BTreeMap::new() }
    }

    /// The line of an event; none where the same was said a moment ago.
    pub fn line(&mut self, event: &Event, now_ns: i64) -> Option<String> {
        let key = (event.name, event.sensor.clone());
        let (said_ns, held_back) = self.said.entry(key).or_insert((i64::MIN, 0));
        *held_back += event.count;
        if now_ns.saturating_sub(*said_ns) < AGAIN_NS {
            return None;
        }
        let count = std::mem::take(held_back);
        *said_ns = now_ns;
        let time = SystemTime::UNIX_EPOCH + Duration::from_nanos(now_ns.max(0) as u64);
        let time = humantime::format_rfc3339_millis(time).to_string();
        let of = event.sensor.as_ref().map(|sensor| format!("{sensor}: ")).unwrap_or_default();
        let times = if count > 1 { format!("{count} ") } else { String::new() };
        Some(match self.form {
            Form::Text => format!("{time} {of}{times}{}", event.text),
            Form::Json => {
                let mut line = Map::new();
                let level = if event.level == Level::Warn { "warn" } else { "info" };
                for (key, value) in
                    [("time", json!(time)), ("level", json!(level)), ("event", json!(event.name))]
                {
                    line.insert(key.to_owned(), value);
                }
                if let Some(sensor) = &event.sensor {
                    line.insert("sensor".to_owned(), json!(sensor));
                }
                line.insert("count".to_owned(), json!(count));
                line.insert("text".to_owned(), json!(event.text));
                Value::Object(line).to_string()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::RecordStatus;

    const S: i64 = 1_000_000_000;

    fn names(events: &[Event]) -> Vec<(&str, Option<&str>, u64)> {
        events.iter().map(|event| (event.name, event.sensor.as_deref(), event.count)).collect()
    }

    #[test]
    fn what_changed_is_told_once() {
        let mut watch = Watch::new(vec!["east".to_owned(), "west".to_owned()]);
        let look = |of_sensors: [u64; 2], failing: Option<&str>, frames_skipped: u64| Summary {
            of_sensors: of_sensors.to_vec(),
            frames_skipped,
            recorded: RecordStatus { failing: failing.map(str::to_owned), ..RecordStatus::default() },
            ..Summary::default()
        };
        assert_eq!(names(&watch.look(look([5, 5], None, 0))), []);
        assert_eq!(names(&watch.look(look([9, 5], None, 0))), [("sensor_gone", Some("west"), 1)]);
        assert_eq!(
            names(&watch.look(look([12, 5], Some("full"), 3))),
            [("frames_skipped", None, 3), ("disk_failing", None, 1)]
        );
        assert_eq!(
            names(&watch.look(look([15, 9], None, 3))),
            [("sensor_back", Some("west"), 1), ("disk_back", None, 1)]
        );
    }

    #[test]
    fn the_same_is_not_said_too_often_and_counted_meanwhile() {
        let mut log = Log::new(Form::Json);
        let event = |count| Event { count, ..Event::new(Level::Warn, "frames_skipped", "frames skipped") };
        assert!(log.line(&event(2), 0).is_some());
        assert_eq!(log.line(&event(3), 2 * S), None);
        let line: Value = serde_json::from_str(&log.line(&event(4), 11 * S).unwrap()).unwrap();
        assert_eq!(
            (&line["count"], &line["level"], &line["time"]),
            (&json!(7), &json!("warn"), &json!("1970-01-01T00:00:11.000Z"))
        );
        let mut log = Log::new(Form::Text);
        let gone =
            Event { sensor: Some("east".to_owned()), ..Event::new(Level::Warn, "sensor_gone", "no packet") };
        assert_eq!(log.line(&gone, 0).unwrap(), "1970-01-01T00:00:00.000Z east: no packet");
    }
}
