//! Finds the place in a user's file where a table lacks a field. serde names the field only.

use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// Byte offset and path of the first element of an array that lacks `field` where the defaults' element has it:
/// `site.sensors[1] "west"`. Tables outside of arrays take what they lack from the defaults.
pub(super) fn place(found: &DeTable<'_>, known: &Table, field: &str) -> Option<(usize, String)> {
    within_table(found, known, field, "", false)
}

fn within_table(
    found: &DeTable<'_>,
    known: &Table,
    field: &str,
    path: &str,
    in_array: bool,
) -> Option<(usize, String)> {
    found.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        let path = if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
        within_value(value, known.get(name.as_ref())?, field, &path, in_array)
    })
}

fn within_value(
    found: &Spanned<DeValue<'_>>,
    known: &Value,
    field: &str,
    path: &str,
    in_array: bool,
) -> Option<(usize, String)> {
    match (found.get_ref(), known) {
        (DeValue::Table(table), Value::Table(known)) => {
            if in_array && known.contains_key(field) && !table.contains_key(field) {
                let name = table.get("name").and_then(|name| name.get_ref().as_str());
                let name = name.map_or(String::new(), |name| format!(" {name:?}"));
                return Some((found.span().start, format!("{path}{name}")));
            }
            within_table(table, known, field, path, in_array)
        }
        (DeValue::Array(elements), Value::Array(known)) => {
            let first = known.first()?;
            elements
                .iter()
                .enumerate()
                .find_map(|(i, element)| within_value(element, first, field, &format!("{path}[{i}]"), true))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DEFAULT_TOML;

    #[test]
    fn the_table_that_lacks_a_field_is_found_with_its_line_and_name() {
        let known: Table = toml::from_str(DEFAULT_TOML).unwrap();
        let told = |text: &str, field: &str| {
            let (offset, path) = place(DeTable::parse(text).unwrap().get_ref(), &known, field)?;
            Some((text[..offset].matches('\n').count() + 1, path))
        };
        let sensors = "[[site.sensors]]\nname = \"east\"\nposition_m = [1.0, 2.0, 3.0]\n\n[[site.sensors]]\nname = \"west\"\n";
        assert_eq!(told(sensors, "position_m"), Some((5, "site.sensors[1] \"west\"".to_owned())));
        let rotation = "[[site.sensors]]\nname = \"east\"\nrotation_deg = { yaw = 1.0, pitch = 2.0 }\n";
        assert_eq!(told(rotation, "roll"), Some((3, "site.sensors[0].rotation_deg".to_owned())));
        assert_eq!(
            told("[[site.pillars]]\nradius_m = 1.0\n", "position_m"),
            Some((1, "site.pillars[0]".to_owned()))
        );
        assert_eq!(told("[site.hall]\nlength_m = 3.0\n", "width_m"), None, "the defaults have it");
    }
}
