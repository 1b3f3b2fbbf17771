//! Lays TOML texts over each other, and names the place of a wrong key or value.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::missing;
use crate::Error;

/// The table of a user's file that nodes read, and nothing here.
const OF_NODES: &str = "network";

/// Parses `(file name, text)` layers, each over the ones before it. The first layer is complete and says which
/// keys exist and of which kind they are. Tables merge; arrays replace. [`OF_NODES`] is left out.
pub(super) fn parse<T: DeserializeOwned>(layers: &[(&str, &str)]) -> Result<T, Error> {
    let mut merged = Table::new();
    let mut known: Option<Table> = None;
    for &(file, text) in layers {
        let mut spans = DeTable::parse(text)
            .map_err(|e| at(file, text, e.span().map_or(0, |s| s.start), e.message().to_owned()))?;
        spans.get_mut().remove(OF_NODES);
        if let Some(known) = &known {
            check_table(spans.get_ref(), known, "", &|offset, message| at(file, text, offset, message))?;
        }
        let mut table: Table = toml::from_str(text).map_err(|e| Error::new(e.to_string()).within(file))?;
        table.remove(OF_NODES);
        known.get_or_insert_with(|| table.clone());
        merge(&mut merged, table);
    }
    let (file, text) = layers.last().copied().unwrap_or_default();
    merged.try_into().map_err(|e: toml::de::Error| {
        let lacking = e.message().strip_prefix("missing field `").and_then(|rest| rest.strip_suffix('`'));
        let place = lacking
            .and_then(|field| missing::place(DeTable::parse(text).ok()?.get_ref(), known.as_ref()?, field));
        match place {
            Some((offset, path)) => at(file, text, offset, format!("{path}: {}", e.message())),
            None => Error::new(e.message().to_owned()).within(file),
        }
    })
}

fn merge(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(base)), Value::Table(over)) => merge(base, over),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Keys that the defaults leave out, with their kinds.
const OPTIONAL: [(&str, &str, &str); 20] = [
    ("site", "handover", "a table"),
    ("site", "reflections", "a table"),
    ("site.hall", "outline_m", "an array"),
    ("site.hall", "floors", "an array"),
    ("site.access_points", "radio", "a table"),
    ("site.sensors", "address", "a string"),
    ("site.sensors", "calibration", "a string"),
    ("site.sensors", "calibration_file", "a string"),
    ("site.sensors", "clock_offset_ms", "a number"),
    ("site.sensors", "time", "a string"),
    ("site.sensors", "udp_port", "a whole number"),
    ("site.simulation", "clock_ahead_ms", "a table"),
    ("site.simulation", "slip", "a table"),
    ("site.simulation", "put_in", "a table"),
    ("site.simulation", "entrances_m", "an array"),
    ("site.simulation", "places_m", "an array"),
    ("site.simulation", "range_bias_m", "a table"),
    ("site.simulation", "mixed_returns", "a table"),
    ("site.simulation", "dark_cloth", "a table"),
    ("site.simulation", "panes", "an array"),
];

type Complain<'a> = &'a dyn Fn(usize, String) -> Error;

fn check_table(found: &DeTable<'_>, known: &Table, path: &str, complain: Complain<'_>) -> Result<(), Error> {
    // A table that is empty in the defaults takes names that are the user's.
    if known.is_empty() && !path.is_empty() {
        return Ok(());
    }
    for (key, value) in found {
        let name = key.get_ref();
        let Some(expected) = known.get(name.as_ref()) else {
            let optional = || OPTIONAL.iter().filter(|(place, ..)| *place == path);
            if let Some((_, _, expected)) = optional().find(|(_, key, _)| key == name) {
                let whole = kind(value.get_ref()) == "a whole number" && *expected == "a number";
                if kind(value.get_ref()) == *expected || whole {
                    continue;
                }
                let found = kind(value.get_ref());
                let story = format!("{path}.{name}: expected {expected}, found {found}");
                return Err(complain(value.span().start, story));
            }
            let keys = known.keys().map(String::as_str).chain(optional().map(|(_, key, _)| *key));
            let keys: Vec<&str> = keys.collect();
            let place = if path.is_empty() { "the file" } else { path };
            return Err(complain(
                key.span().start,
                format!("unknown key `{name}` in {place}; expected one of: {}", keys.join(", ")),
            ));
        };
        let path = if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
        check_value(value, expected, &path, complain)?;
    }
    Ok(())
}

fn check_value(
    found: &Spanned<DeValue<'_>>,
    expected: &Value,
    path: &str,
    complain: Complain<'_>,
) -> Result<(), Error> {
    match (found.get_ref(), expected) {
        (DeValue::Table(found), Value::Table(known)) => check_table(found, known, path, complain),
        (DeValue::Array(found), Value::Array(known)) => {
            // An element of an array is checked against the default's first: all elements are of one kind.
            let Some(first) = known.first() else { return Ok(()) };
            if !first.is_table() && found.len() != known.len() && !known.is_empty() && path_is_fixed(path) {
                return Err(complain(
                    found_start(found, 0),
                    format!("{path}: expected {} values, found {}", known.len(), found.len()),
                ));
            }
            found.iter().try_for_each(|element| check_value(element, first, path, complain))
        }
        (DeValue::Integer(_), Value::Float(_)) => Ok(()),
        (found_value, expected) if kind(found_value) == kind_of(expected) => Ok(()),
        (found_value, expected) => Err(complain(
            found.span().start,
            format!("{path}: expected {}, found {}", kind_of(expected), kind(found_value)),
        )),
    }
}

/// Vectors of coordinates have a fixed length.
fn path_is_fixed(path: &str) -> bool {
    path.ends_with("position_m") || path.ends_with("size_m")
}

fn found_start(array: &toml::de::DeArray<'_>, fallback: usize) -> usize {
    array.iter().next().map_or(fallback, |v| v.span().start)
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "a string",
        Value::Integer(_) => "a whole number",
        Value::Float(_) => "a number",
        Value::Boolean(_) => "true or false",
        Value::Datetime(_) => "a date",
        Value::Array(_) => "an array",
        Value::Table(_) => "a table",
    }
}

fn at(file: &str, text: &str, offset: usize, message: String) -> Error {
    let before = &text[..offset.min(text.len())];
    let line = before.matches('\n').count() + 1;
    let column = before.len() - before.rfind('\n').map_or(0, |i| i + 1) + 1;
    Error::new(format!("{file}:{line}:{column}: {message}"))
}
