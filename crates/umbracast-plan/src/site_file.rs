//! Writes a plan into a site file: what did not change stays as it stands, with its comments.

use serde::Serialize;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, TableLike, Value, value};
use umbracast::site::{AccessPoint, Furniture, Pillar, Sensor};
use umbracast::{Config, Error, Mode, Site};

/// The text of a site file that says `site`, made from `text`, which says what was there before. An empty text is a new
/// file.
///
/// # Errors
/// A text that is no site file, or a plan that none can say.
pub fn write_into(text: &str, site: &Site, file: &str) -> Result<String, Error> {
    let before = Config::with_overlay(Mode::Default, text, file)?.site;
    let mut document: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| Error::new(e.to_string()).within(file))?;
    let place = document.entry("site").or_insert_with(implicit);
    let place = place.as_table_like_mut().ok_or_else(|| Error::new("site: expected a table").within(file))?;
    if site.name != before.name {
        set(place, "name", Value::from(&site.name));
    }
    hall(place, &before, site)?;
    list(place, "pillars", &before.pillars, &site.pillars, |pillar: &Pillar| pairs(pillar), None)?;
    list(place, "furniture", &before.furniture, &site.furniture, |piece: &Furniture| pairs(piece), None)?;
    let name = |sensor: &Sensor| sensor.name.clone();
    list(place, "sensors", &before.sensors, &site.sensors, |sensor: &Sensor| pairs(sensor), Some(&name))?;
    let name = |ap: &AccessPoint| ap.name.clone();
    list(
        place,
        "access_points",
        &before.access_points,
        &site.access_points,
        |ap: &AccessPoint| pairs(ap),
        Some(&name),
    )?;
    let written = document.to_string();
    match Config::with_overlay(Mode::Default, &written, file)?.site == *site {
        true => Ok(written),
        false => {
            Err(Error::new("expected a plan that a site file can say, found one that reads back as another")
                .within(file))
        }
    }
}

fn implicit() -> Item {
    let mut table = Table::new();
    table.set_implicit(true);
    Item::Table(table)
}

fn hall(place: &mut dyn TableLike, before: &Site, site: &Site) -> Result<(), Error> {
    let (old, new) = (&before.hall, &site.hall);
    if old == new {
        return Ok(());
    }
    let hall = place.entry("hall").or_insert(Item::Table(Table::new()));
    let hall = hall.as_table_like_mut().ok_or_else(|| Error::new("site.hall: expected a table"))?;
    for (key, old, new) in [
        ("length_m", old.length_m, new.length_m),
        ("width_m", old.width_m, new.width_m),
        ("height_m", old.height_m, new.height_m),
    ] {
        if old != new {
            set(hall, key, Value::from(new));
        }
    }
    if old.outline_m != new.outline_m {
        let corners: Array =
            new.outline_m.iter().map(|corner| corner.iter().copied().collect::<Array>()).collect();
        set(hall, "outline_m", Value::Array(corners));
    }
    Ok(())
}

/// A list of tables: those that are still there keep their text, and only numbers that differ are written anew.
fn list<T: PartialEq>(
    place: &mut dyn TableLike,
    key: &str,
    before: &[T],
    after: &[T],
    pairs: impl Fn(&T) -> Result<Table, Error>,
    name: Option<&dyn Fn(&T) -> String>,
) -> Result<(), Error> {
    if before == after {
        return Ok(());
    }
    let old = place.remove(key).unwrap_or(Item::ArrayOfTables(ArrayOfTables::new()));
    let old = old.into_array_of_tables().unwrap_or_default();
    let mut left: Vec<Option<Table>> = old.into_iter().map(Some).collect();
    // Where the file names none, those before are the defaults, which stand nowhere.
    let is_written = left.len() == before.len();
    let mut tables = ArrayOfTables::new();
    for (number, one) in after.iter().enumerate() {
        let index = match name {
            Some(name) => before.iter().position(|old| name(old) == name(one)),
            None => Some(number)
                .filter(|_| before.len() == after.len())
                .or_else(|| before.iter().position(|old| old == one)),
        };
        let table = index.filter(|_| is_written).and_then(|index| left[index].take());
        let (new, unchanged) = (pairs(one)?, index.is_some_and(|index| before[index] == *one));
        tables.push(match (table, index) {
            (Some(table), _) if unchanged => table,
            (Some(table), Some(index)) => changed(table, &pairs(&before[index])?, &new),
            _ => new,
        });
    }
    match after.is_empty() {
        true => place.insert(key, value(Array::new())),
        false => place.insert(key, Item::ArrayOfTables(tables)),
    };
    Ok(())
}

/// A table with what differs between two states of it.
fn changed(mut table: Table, before: &Table, after: &Table) -> Table {
    for (key, new) in after {
        let differs = before.get(key).is_none_or(|old| old.to_string() != new.to_string());
        if let (true, Some(new)) = (differs, new.as_value()) {
            set(&mut table, key, new.clone());
        }
    }
    for (key, _) in before {
        if !after.contains_key(key) {
            table.remove(key);
        }
    }
    table
}

/// What a site file says of it, inner tables in one line.
fn pairs<T: Serialize>(one: &T) -> Result<Table, Error> {
    let wrong = |told: String| Error::new(told);
    let text = toml::to_string(one).map_err(|e| wrong(e.to_string()))?;
    let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| wrong(e.to_string()))?;
    let mut table = Table::new();
    for (key, item) in document.as_table() {
        let inline = match item.clone() {
            Item::Table(inner) => Value::InlineTable(inner.into_inline_table()),
            other => other.into_value().map_err(|_| wrong(format!("{key}: expected a value")))?,
        };
        let mut inline = inline;
        inline.decor_mut().clear();
        table.insert(key, Item::Value(inline));
    }
    Ok(table)
}

/// Sets a value where it stands, with the comment behind it.
fn set(table: &mut dyn TableLike, key: &str, mut new: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    table.insert(key, Item::Value(new));
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "# Our hall.\n[site]\nname = \"ours\" # as on the door\n\n[[site.sensors]] # above the door\nname = \"east\"\n\
                        position_m = [12.5, 0.0, 6.0] # measured twice\nrotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\n\
                        # by the window\n[[site.sensors]]\nname = \"west\"\nposition_m = [-12.5, 0.0, 6.0]\n\
                        rotation_deg = { yaw = 0.0, pitch = 35.0, roll = 0.0 } # tilted\n";

    fn site() -> Site {
        Config::with_overlay(Mode::Default, FILE, "hall.toml").unwrap().site
    }

    #[test]
    fn what_did_not_change_stays_as_it_stands() {
        assert_eq!(write_into(FILE, &site(), "hall.toml").unwrap(), FILE);
        let mut moved = site();
        moved.sensors[0].position_m[0] = 11.25;
        let written = write_into(FILE, &moved, "hall.toml").unwrap();
        assert_eq!(written, FILE.replace("[12.5, 0.0, 6.0]", "[11.25, 0.0, 6.0]"));
    }

    #[test]
    fn things_come_and_go_and_comments_of_the_others_stay() {
        let mut plan = site();
        plan.sensors.remove(0);
        plan.sensors.push(Sensor {
            name: "third".to_owned(),
            position_m: [0.0, 12.0, 5.0],
            ..plan.sensors[0].clone()
        });
        plan.furniture.clear();
        plan.access_points[0].position_m = [1.0, 2.0, 3.0];
        plan.hall.outline_m = vec![[-17.0, -17.0], [17.0, -17.0], [17.0, 17.0], [-17.0, 16.0]];
        let written = write_into(FILE, &plan, "hall.toml").unwrap();
        for kept in ["# Our hall.", "# as on the door", "# by the window", "# tilted"] {
            assert!(written.contains(kept), "{kept}: {written}");
        }
        assert!(!written.contains("above the door") && written.contains("furniture = []"), "{written}");
        let new = write_into("", &plan, "new.toml").unwrap();
        assert_eq!(Config::with_overlay(Mode::Default, &new, "new.toml").unwrap().site, plan);
    }

    #[test]
    fn what_is_no_site_file_is_refused_by_name() {
        let told = write_into("[site\n", &site(), "hall.toml").unwrap_err().to_string();
        assert!(told.contains("hall.toml"), "{told}");
    }
}
