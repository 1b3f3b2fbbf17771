//! Rows on the wire: each row type as a ROS 2 message and as JSON, from the columns that its table has.
//! [`Row::visit`] alone describes what tables, recordings, messages and the page say of a track.
//!
//! A frame's rows are one message: `std_msgs/Header header`, `uint64 frame`, and the rows without their keys. A value
//! that a table leaves empty is NaN, or 2 where it is yes or no; an access point goes by its name.

use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::{Map, Value};
use umbracast::decide::Action;

use crate::cdr::{Decoder, Encoder};
use crate::messages::{HEADER_DEFINITIONS, Schema};
use crate::rows::{BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, ReportRow, TrackRow};
use crate::tables::{Cell, Row};

/// The columns that the message says once for all of its rows.
const KEYS: [&str; 3] = ["scene", "frame", "time_ns"];

/// A row that is sent.
pub trait WireRow: Row {
    /// Name of the message of one row.
    const ONE: &'static str;
    /// Name of the message of a frame's rows.
    const MANY: &'static str;
    /// What a frame's rows are, in a sentence.
    const WHAT: &'static str;
    /// Where they are published and recorded.
    const TOPIC: &'static str;
}

impl WireRow for DetectionRow {
    const ONE: &'static str = "Detection";
    const MANY: &'static str = "Detections";
    const WHAT: &'static str = "Every person that was seen in one frame, before tracks.";
    const TOPIC: &'static str = "/umbracast/detections";
}

impl WireRow for TrackRow {
    const ONE: &'static str = "Track";
    const MANY: &'static str = "Tracks";
    const WHAT: &'static str =
        "Everybody followed, at the end of a frame, and where they will be in the next 900 ms.";
    const TOPIC: &'static str = "/umbracast/tracks";
}

impl WireRow for LinkRow {
    const ONE: &'static str = "Blockage";
    const MANY: &'static str = "Blockages";
    const WHAT: &'static str =
        "Every link at the end of a frame: how likely a body blocks it now and within 100 to 900 ms.";
    const TOPIC: &'static str = "/umbracast/blockages";
}

impl WireRow for LossRow {
    const ONE: &'static str = "Loss";
    const MANY: &'static str = "Losses";
    const WHAT: &'static str =
        "What every link loses to bodies at the end of a frame and in the next 900 ms, in dB.";
    const TOPIC: &'static str = "/umbracast/losses";
}

impl WireRow for DecisionRow {
    const ONE: &'static str = "Decision";
    const MANY: &'static str = "Decisions";
    const WHAT: &'static str = "What to do about the link of every device, at the end of a frame.";
    const TOPIC: &'static str = "/umbracast/decisions";
}

impl WireRow for BindingRow {
    const ONE: &'static str = "Binding";
    const MANY: &'static str = "Bindings";
    const WHAT: &'static str =
        "Who may carry which device that was heard, at the end of a frame, likeliest first.";
    const TOPIC: &'static str = "/umbracast/bindings";
}

impl WireRow for ReportRow {
    const ONE: &'static str = "Report";
    const MANY: &'static str = "Reports";
    const WHAT: &'static str = "What access points heard of devices, taken before this frame.";
    const TOPIC: &'static str = "/umbracast/reports";
}

/// The fields of one row, in the words of ROS 2.
pub fn fields<R: WireRow>() -> String {
    let mut text = String::new();
    each(&mut R::default(), |name, cell| {
        let kind = match cell {
            Cell::U32(_) => "uint32",
            Cell::U64(_) | Cell::MaybeU64(_) => "uint64",
            Cell::I64(_) => "int64",
            Cell::F64(_) | Cell::MaybeF64(_) => "float64",
            Cell::Bool(_) => "bool",
            Cell::MaybeBool(_) => "uint8",
            Cell::AccessPoint(_) | Cell::MaybeAccessPoint(_) | Cell::Action(_) | Cell::MaybeSurface(_) => {
                "string"
            }
        };
        let remark = match cell {
            Cell::MaybeU64(_) => " # 18446744073709551615: none",
            Cell::MaybeF64(_) => " # NaN: none",
            Cell::MaybeBool(_) => " # 0 no, 1 yes, 2 unknown",
            Cell::MaybeAccessPoint(_) => " # empty: none",
            Cell::Action(_) => " # stay, wait, hand-over, prepare or beam",
            Cell::MaybeSurface(_) => " # floor, ceiling or wall-N; empty: none",
            _ => "",
        };
        text.push_str(&format!("{kind} {name}{remark}\n"));
    });
    text
}

/// The fields of a frame's message, in the words of ROS 2.
pub fn list_fields<R: WireRow>() -> String {
    let (one, what) = (R::ONE, R::WHAT);
    format!("# {what}\nstd_msgs/Header header\nuint64 frame\n{one}[] {}\n", R::MANY.to_lowercase())
}

/// The schema of a frame's message, with the definitions of all it holds.
pub fn schema<R: WireRow>() -> Schema {
    let rule = "=".repeat(80);
    let list = list_fields::<R>().replace(&format!("{}[]", R::ONE), &format!("umbracast_msgs/{}[]", R::ONE));
    Schema {
        name: format!("umbracast_msgs/msg/{}", R::MANY).into(),
        definition: format!(
            "{list}{rule}\nMSG: umbracast_msgs/{}\n{}{HEADER_DEFINITIONS}",
            R::ONE,
            fields::<R>()
        )
        .into(),
    }
}

/// A frame's message. `access_points` are the site's names, by index.
pub fn encode<R: WireRow>(time_ns: i64, frame: u64, rows: &[R], access_points: &[String]) -> Vec<u8> {
    let name_of = |index: u32| access_points.get(index as usize).map_or("", String::as_str);
    let mut e = Encoder::default();
    e.header(time_ns, "site");
    e.u64(frame);
    e.u32(rows.len() as u32);
    for &row in rows {
        each(&mut { row }, |_, cell| match cell {
            Cell::U32(v) => e.u32(*v),
            Cell::U64(v) => e.u64(*v),
            Cell::MaybeU64(v) => e.u64(v.unwrap_or(u64::MAX)),
            Cell::I64(v) => e.u64(*v as u64),
            Cell::F64(v) => e.f64(*v),
            Cell::Bool(v) => e.bool(*v),
            Cell::MaybeBool(v) => e.u8(v.map_or(2, u8::from)),
            Cell::MaybeF64(v) => e.f64(v.unwrap_or(f64::NAN)),
            Cell::AccessPoint(v) => e.string(name_of(*v)),
            Cell::MaybeAccessPoint(v) => e.string(v.map_or("", name_of)),
            Cell::Action(v) => e.string(v.name()),
            Cell::MaybeSurface(v) => e.string(&v.map_or(String::new(), |v| v.to_string())),
        });
    }
    e.finish()
}

/// The rows of a message, with the frame's number and time; `None` where the bytes are something else.
pub fn decode<R: WireRow>(bytes: &[u8], access_points: &[String]) -> Option<(u64, i64, Vec<R>)> {
    decode_without(bytes, access_points, "")
}

/// The same of a message from before there was a column.
pub(crate) fn decode_without<R: WireRow>(
    bytes: &[u8],
    access_points: &[String],
    column: &str,
) -> Option<(u64, i64, Vec<R>)> {
    let mut d = Decoder::new(bytes)?;
    let time_ns = d.time()?;
    d.string()?;
    let frame = d.u64()?;
    let count = d.u32()?;
    let index_of =
        |name: &str| access_points.iter().position(|known| known == name).map(|index| index as u32);
    let mut rows = Vec::new();
    for _ in 0..count {
        let mut row = R::default();
        let mut whole = true;
        row.visit(&mut |name, cell| {
            whole &= match (name.to_string().as_str(), cell) {
                ("frame", Cell::U64(v)) => set(v, Some(frame)),
                ("time_ns", Cell::I64(v)) => set(v, Some(time_ns)),
                ("scene", _) => true,
                (name, _) if name == column => true,
                (_, Cell::U32(v)) => set(v, d.u32()),
                (_, Cell::U64(v)) => set(v, d.u64()),
                (_, Cell::MaybeU64(v)) => set(v, d.u64().map(|v| (v != u64::MAX).then_some(v))),
                (_, Cell::I64(v)) => set(v, d.u64().map(|v| v as i64)),
                (_, Cell::F64(v)) => set(v, d.f64()),
                (_, Cell::Bool(v)) => set(v, d.bool()),
                (_, Cell::MaybeBool(v)) => {
                    set(v, d.u8().map(|v| [Some(false), Some(true), None][usize::from(v.min(2))]))
                }
                (_, Cell::MaybeF64(v)) => set(v, d.f64().map(|v| (!v.is_nan()).then_some(v))),
                (_, Cell::AccessPoint(v)) => set(v, d.string().and_then(index_of)),
                (_, Cell::MaybeAccessPoint(v)) => match d.string() {
                    Some("") => set(v, Some(None)),
                    name => set(v, name.and_then(index_of).map(Some)),
                },
                (_, Cell::Action(v)) => {
                    let name = d.string();
                    set(v, Action::ALL.into_iter().find(|action| Some(action.name()) == name))
                }
                (_, Cell::MaybeSurface(v)) => match d.string() {
                    Some("") => set(v, Some(None)),
                    name => set(v, name.and_then(|name| name.parse().ok()).map(Some)),
                },
            };
        });
        if !whole {
            return None;
        }
        rows.push(row);
    }
    Some((frame, time_ns, rows))
}

/// A frame's rows as JSON, each without its keys; what is not finite or not there is null.
#[derive(Debug, Clone, Copy)]
pub struct Json<'a, R> {
    rows: &'a [R],
    access_points: &'a [String],
    asked: &'a Asked,
}

/// What somebody asks for of rows as JSON.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// Names of the columns; all of them where none are named.
    pub columns: Option<Vec<String>>,
    /// Decimals that measures are rounded to; as many as they have where it is not said.
    pub decimals: Option<u8>,
}

impl Asked {
    /// All of them as they are.
    pub const WHOLE: Self = Self { columns: None, decimals: None };
}

impl<'a, R> Json<'a, R> {
    /// Rows as they are. `access_points` are the site's names, by index.
    pub fn whole(rows: &'a [R], access_points: &'a [String]) -> Self {
        Self { rows, access_points, asked: &Asked::WHOLE }
    }

    /// What is asked for of them.
    pub fn of(rows: &'a [R], access_points: &'a [String], asked: &'a Asked) -> Self {
        Self { rows, access_points, asked }
    }
}

impl<R: WireRow> Serialize for Json<'_, R> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Every row shows its cells in the same order, so that names are written out once.
        let is_asked =
            |name: &String| self.asked.columns.as_ref().is_none_or(|columns| columns.contains(name));
        let names: Vec<Option<String>> =
            all_names::<R>().into_iter().map(|name| name.filter(|name| is_asked(name))).collect();
        serializer.collect_seq(self.rows.iter().map(|&row| JsonRow { row, names: &names, of: self }))
    }
}

struct JsonRow<'a, R> {
    row: R,
    names: &'a [Option<String>],
    of: &'a Json<'a, R>,
}

impl<R: WireRow> Serialize for JsonRow<'_, R> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let &Self { mut row, names, of: Json { access_points, asked, .. } } = self;
        let rounded = |v: f64| match asked.decimals {
            Some(decimals) => {
                let unit = 10_f64.powi(i32::from(decimals));
                (v * unit).round() / unit + 0.0 // Not minus nought.
            }
            None => v,
        };
        let (mut object, mut written) = (serializer.serialize_map(None)?, Ok(()));
        let mut names = names.iter();
        row.visit(&mut |_, cell| {
            let Some(Some(name)) = names.next() else { return };
            if written.is_err() {
                return;
            }
            written = match cell {
                Cell::U32(v) => object.serialize_entry(name, v),
                Cell::U64(v) => object.serialize_entry(name, v),
                Cell::MaybeU64(v) => object.serialize_entry(name, v),
                Cell::I64(v) => object.serialize_entry(name, v),
                Cell::F64(v) => object.serialize_entry(name, &rounded(*v)),
                Cell::Bool(v) => object.serialize_entry(name, v),
                Cell::MaybeBool(v) => object.serialize_entry(name, v),
                Cell::MaybeF64(v) => object.serialize_entry(name, &v.map(rounded)),
                Cell::AccessPoint(v) => object.serialize_entry(name, &access_points.get(*v as usize)),
                Cell::MaybeAccessPoint(v) => {
                    object.serialize_entry(name, &v.and_then(|v| access_points.get(v as usize)))
                }
                Cell::Action(v) => object.serialize_entry(name, v.name()),
                Cell::MaybeSurface(v) => object.serialize_entry(name, &v.map(|v| v.to_string())),
            };
        });
        written?;
        object.end()
    }
}

/// The columns that a row has on the wire, in order.
pub fn columns<R: WireRow>() -> Vec<String> {
    all_names::<R>().into_iter().flatten().collect()
}

/// Of each cell in order; none for keys.
fn all_names<R: Row>() -> Vec<Option<String>> {
    let mut names = Vec::new();
    R::default().visit(&mut |name, _| {
        names.push(Some(name.to_string()).filter(|name| !KEYS.contains(&name.as_str())));
    });
    names
}

/// JSON Schema of the same.
pub fn json_schema<R: WireRow>() -> Value {
    let mut properties = Map::new();
    each(&mut R::default(), |name, cell| {
        let kind: Value = match cell {
            Cell::U32(_) | Cell::U64(_) | Cell::I64(_) => "integer".into(),
            Cell::MaybeU64(_) => vec!["integer", "null"].into(),
            Cell::F64(_) | Cell::MaybeF64(_) => vec!["number", "null"].into(),
            Cell::Bool(_) => "boolean".into(),
            Cell::MaybeBool(_) => vec!["boolean", "null"].into(),
            Cell::AccessPoint(_) | Cell::Action(_) => "string".into(),
            Cell::MaybeAccessPoint(_) | Cell::MaybeSurface(_) => vec!["string", "null"].into(),
        };
        let mut schema = serde_json::json!({ "type": kind });
        if let Cell::Action(_) = cell {
            schema["enum"] = serde_json::json!(Action::ALL.map(Action::name));
        }
        properties.insert(name.to_string(), schema);
    });
    let required: Vec<&String> = properties.keys().collect();
    serde_json::json!({ "title": R::ONE, "type": "object", "required": required, "properties": properties })
}

/// Shows every cell but the keys.
fn each<R: Row>(row: &mut R, mut see: impl FnMut(&str, Cell)) {
    let mut text = String::new();
    row.visit(&mut |name, cell| {
        use std::fmt::Write;
        text.clear();
        let _ = write!(text, "{name}"); // To a string: cannot fail.
        if !KEYS.contains(&text.as_str()) {
            see(&text, cell);
        }
    });
}

fn set<T>(place: &mut T, value: Option<T>) -> bool {
    value.map(|value| *place = value).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access_points() -> Vec<String> {
        vec!["side".to_owned(), "centre".to_owned()]
    }

    fn link() -> LinkRow {
        LinkRow {
            scene: 0,
            frame: 7,
            time_ns: 800_000_000,
            access_point: 1,
            track: 3,
            p_now: 0.25,
            blocked: [false, false, true, true, true, true, true, true, true],
            p: [0.5; 9],
            onset_s: [Some(0.3), None, Some(0.7)],
            ..LinkRow::default()
        }
    }

    #[test]
    fn rows_survive_the_wire() {
        let bytes = encode(800_000_000, 7, &[link(), LinkRow { track: 4, ..link() }], &access_points());
        let (frame, time_ns, rows) = decode::<LinkRow>(&bytes, &access_points()).unwrap();
        assert_eq!((frame, time_ns, rows.len()), (7, 800_000_000, 2));
        assert_eq!(rows[0], link());
        for cut in 0..bytes.len() {
            assert!(decode::<LinkRow>(&bytes[..cut], &access_points()).is_none(), "cut at {cut}");
        }
    }

    #[test]
    fn an_access_point_that_the_site_has_not_is_no_message_of_it() {
        let bytes = encode(0, 0, &[link()], &access_points());
        assert!(decode::<LinkRow>(&bytes, &["door".to_owned()]).is_none());
    }

    #[test]
    fn a_decision_names_its_action_and_its_target_or_none() {
        use umbracast::radio::Surface;

        let wait = DecisionRow { track: 3, serving: 1, action: Action::Wait, ..DecisionRow::default() };
        let leave = DecisionRow { action: Action::HandOver, target: Some(0), deadline_s: Some(0.2), ..wait };
        let beam = DecisionRow { action: Action::Beam, surface: Some(Surface::Wall(2)), ..wait };
        let bytes = encode(0, 0, &[wait, leave, beam], &access_points());
        assert_eq!(decode(&bytes, &access_points()), Some((0, 0, vec![wait, leave, beam])));
        let value = serde_json::to_value(Json::whole(&[wait, leave], &access_points())).unwrap();
        assert_eq!((&value[0]["action"], &value[0]["target"]), (&"wait".into(), &Value::Null));
        assert_eq!((&value[1]["action"], &value[1]["target"]), (&"hand-over".into(), &"side".into()));
        assert_eq!(json_schema::<DecisionRow>()["properties"]["action"]["enum"][2], "hand-over");
    }

    #[test]
    fn json_has_the_names_of_the_table_and_null_for_nothing() {
        let value = &serde_json::to_value(Json::whole(&[link()], &access_points())).unwrap()[0];
        assert_eq!(value["access_point"], "centre");
        assert_eq!(value["blocked_w3"], true);
        assert_eq!(value["onset_p50_s"], Value::Null);
        assert_eq!(value.get("time_ns"), None, "said once for all rows");
        let schema = json_schema::<LinkRow>();
        assert_eq!(schema["properties"]["onset_p50_s"]["type"], serde_json::json!(["number", "null"]));
    }

    #[test]
    fn a_schema_names_what_it_is_made_of() {
        let schema = schema::<TrackRow>();
        assert_eq!(schema.name, "umbracast_msgs/msg/Tracks");
        assert!(schema.definition.contains("umbracast_msgs/Track[] tracks\n"));
        assert!(schema.definition.contains("MSG: umbracast_msgs/Track\nuint64 track\nfloat64 x_m\n"));
        assert!(schema.definition.ends_with("int32 sec\nuint32 nanosec\n"));
    }
}
