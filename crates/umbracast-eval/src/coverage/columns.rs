//! The survey as a table: a row a place, columns named after the site's sensors and access points.

use umbracast::Site;
use umbracast_io::tables::Values;

use super::Coverage;

/// Name and values of every column; a row a place.
pub fn columns(site: &Site, coverage: &Coverage) -> Vec<(String, Values)> {
    let places = &coverage.places;
    let real = |value: &dyn Fn(&super::Place) -> f64| Values::F64(places.iter().map(value).collect());
    let mut columns = vec![
        ("x_m".to_owned(), real(&|place| place.position_m.x)),
        ("y_m".to_owned(), real(&|place| place.position_m.y)),
        ("returns".to_owned(), real(&|place| place.all_returns())),
        (
            "sensors_seeing".to_owned(),
            Values::U32(places.iter().map(|place| place.sensors_seeing() as u32).collect()),
        ),
        (
            "lowest_m".to_owned(),
            Values::MaybeF64(places.iter().map(|place| place.span_m.map(|span| span.0)).collect()),
        ),
        (
            "highest_m".to_owned(),
            Values::MaybeF64(places.iter().map(|place| place.span_m.map(|span| span.1)).collect()),
        ),
    ];
    for (number, sensor) in site.sensors.iter().enumerate() {
        columns.push((format!("returns_{}", sensor.name), real(&|place| place.returns[number])));
    }
    for (number, access_point) in site.access_points.iter().enumerate() {
        let blocked = places.iter().map(|place| place.static_blocked[number]).collect();
        columns.push((format!("static_blocked_{}", access_point.name), Values::Bool(blocked)));
    }
    columns
}
