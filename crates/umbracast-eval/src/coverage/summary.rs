//! The survey in a few figures: shares of the floor, and where the worst places are.

use std::collections::BTreeMap;

use serde::Serialize;
use umbracast::geometry::DVec2;
use umbracast::{Error, Site};

use super::{Coverage, Place, SEEN_RETURNS, WELL_SEEN_RETURNS};
use crate::report::tables::{Table, number};
use crate::run::chain::CIRCLE_M;

/// Badly seen regions that are named.
const NAMED: usize = 6;

/// What a planner reads first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The site's name.
    pub site: String,
    /// From place to place, metres.
    pub step_m: f64,
    /// Of the body, metres.
    pub height_m: f64,
    /// That were averaged.
    pub headings: usize,
    /// All sensors on the whole floor and within the circle of the paper's scene, then each sensor alone: what is
    /// left when the others are lost.
    pub rows: Vec<Row>,
    /// Access points with the share of the floor from which hall and furniture leave the link free.
    pub free_links: Vec<(String, f64)>,
    /// Where fewer than [`SEEN_RETURNS`] come back from the whole body, the largest regions first.
    pub regions: Vec<Region>,
    /// How many such regions there are; not all are named.
    pub region_count: usize,
}

/// Shares of the places.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Which sensors, which places.
    pub what: String,
    /// How many.
    pub places: usize,
    /// Fewer than one return.
    pub none: f64,
    /// From there to [`SEEN_RETURNS`].
    pub few: f64,
    /// As many or more.
    pub seen: f64,
    /// [`WELL_SEEN_RETURNS`] or more.
    pub well_seen: f64,
    /// Seen by two sensors, each by itself; null with a single sensor.
    pub by_two: Option<f64>,
    /// The middle one.
    pub median_returns: f64,
}

/// Neighbouring places where a person is badly seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// The worst place.
    pub worst_m: [f64; 2],
    /// Returns there.
    pub returns: f64,
    /// From, to along x and along y.
    pub x_m: [f64; 2],
    /// See `x_m`.
    pub y_m: [f64; 2],
    /// Floor that the places stand for, square metres.
    pub area_m2: f64,
}

/// Sums a survey up.
///
/// # Errors
/// A floor without a place to stand on.
pub fn summary(site: &Site, coverage: &Coverage) -> Result<Summary, Error> {
    let all: Vec<&Place> = coverage.places.iter().collect();
    let middle_m = site.hall.middle_m();
    let circle: Vec<&Place> =
        all.iter().copied().filter(|place| place.position_m.distance(middle_m) <= CIRCLE_M).collect();
    let several = site.sensors.len() > 1;
    let mut rows: Vec<Row> = row("the whole floor".to_owned(), &all, None, several).into_iter().collect();
    if rows.is_empty() {
        let story = "expected a place to stand on between pillars and furniture, found none";
        return Err(Error::new(story).within(format!("site {:?}", site.name)));
    }
    rows.extend(row(format!("within {CIRCLE_M} m"), &circle, None, several));
    for (number, sensor) in site.sensors.iter().enumerate().filter(|_| several) {
        rows.extend(row(format!("{} alone", sensor.name), &all, Some(number), false));
        rows.extend(row(format!("{} alone, within {CIRCLE_M} m", sensor.name), &circle, Some(number), false));
    }
    let free = |number: usize| share(&all, |place| !place.static_blocked[number]);
    let free_links =
        site.access_points.iter().enumerate().map(|(number, ap)| (ap.name.clone(), free(number))).collect();
    let mut regions = regions(coverage);
    let region_count = regions.len();
    regions.truncate(NAMED);
    let super::Options { step_m, height_m, headings } = coverage.options;
    let site = site.name.clone();
    Ok(Summary { site, step_m, height_m, headings, rows, free_links, regions, region_count })
}

fn share(places: &[&Place], holds: impl Fn(&Place) -> bool) -> f64 {
    places.iter().filter(|place| holds(place)).count() as f64 / places.len() as f64
}

/// None without places.
fn row(what: String, places: &[&Place], sensor: Option<usize>, several: bool) -> Option<Row> {
    let returns = |place: &Place| sensor.map_or_else(|| place.all_returns(), |number| place.returns[number]);
    let mut sorted: Vec<f64> = places.iter().map(|place| returns(place)).collect();
    sorted.sort_by(f64::total_cmp);
    Some(Row {
        what,
        places: places.len(),
        none: share(places, |place| returns(place) < 1.0),
        few: share(places, |place| (1.0..SEEN_RETURNS).contains(&returns(place))),
        seen: share(places, |place| returns(place) >= SEEN_RETURNS),
        well_seen: share(places, |place| returns(place) >= WELL_SEEN_RETURNS),
        by_two: several.then(|| share(places, |place| place.sensors_seeing() >= 2)),
        median_returns: *sorted.get(sorted.len() / 2)?,
    })
}

/// Badly seen places, those that touch (corners too) together.
fn regions(coverage: &Coverage) -> Vec<Region> {
    let step_m = coverage.options.step_m;
    let on_grid = |place: &Place| (place.position_m / step_m).round().as_i64vec2();
    let badly_seen = coverage.places.iter().filter(|place| place.all_returns() < SEEN_RETURNS);
    let mut left: BTreeMap<(i64, i64), &Place> =
        badly_seen.map(|place| (on_grid(place).into(), place)).collect();
    let mut regions = Vec::new();
    while let Some((_, first)) = left.pop_first() {
        let mut region = vec![first];
        let mut reached = 0;
        while reached < region.len() {
            let from = on_grid(region[reached]);
            let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (from.x + i, from.y + j)));
            region.extend(around.filter_map(|key| left.remove(&key)));
            reached += 1;
        }
        regions.push(described(&region, step_m));
    }
    regions.sort_by(|a, b| {
        b.area_m2
            .total_cmp(&a.area_m2)
            .then(a.x_m[0].total_cmp(&b.x_m[0]))
            .then(a.y_m[0].total_cmp(&b.y_m[0]))
    });
    regions
}

fn described(region: &[&Place], step_m: f64) -> Region {
    let low_m = region.iter().fold(DVec2::INFINITY, |low, place| low.min(place.position_m));
    let high_m = region.iter().fold(DVec2::NEG_INFINITY, |high, place| high.max(place.position_m));
    let middle_m = region.iter().map(|place| place.position_m).sum::<DVec2>() / region.len() as f64;
    // Of equally bad places the one in the midst.
    let rank = |place: &Place| (place.all_returns(), place.position_m.distance(middle_m));
    let worst = region.iter().min_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    Region {
        worst_m: worst.map_or([0.0; 2], |place| place.position_m.to_array()),
        returns: worst.map_or(0.0, |place| place.all_returns()),
        x_m: [low_m.x, high_m.x],
        y_m: [low_m.y, high_m.y],
        area_m2: region.len() as f64 * step_m * step_m,
    }
}

impl Summary {
    /// For a terminal.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: a body of {} m every {} m, mean of {} headings\n\n{}",
            self.site,
            self.height_m,
            self.step_m,
            self.headings,
            self.shares().to_text()
        );
        if !self.free_links.is_empty() {
            let free: Vec<String> =
                self.free_links.iter().map(|(name, share)| format!("{name} {share:.3}")).collect();
            text +=
                &format!("\nLink free of pillars and furniture, share of the floor: {}\n", free.join(", "));
        }
        match self.regions.is_empty() {
            true => text += "\nNo place has fewer than 6 returns.\n",
            false => text += &format!("\n{}", self.worst().to_text()),
        }
        text
    }

    fn shares(&self) -> Table {
        let header = [
            "share of the places",
            "places",
            "none",
            "1 to 5",
            "6 or more",
            "16 or more",
            "by two",
            "median",
        ];
        let mut table = Table::new("Returns from a standing person in one revolution", 1, &header);
        table.rows = self.rows.iter().map(Row::cells).collect();
        table
            .noted("By two: each of two sensors gets at least 6 returns. Median: the median place's returns.")
    }

    fn worst(&self) -> Table {
        let header = ["worst at x, y, m", "returns", "x from, m", "to", "y from, m", "to", "area, m2"];
        let title = match self.region_count {
            count if count > self.regions.len() => {
                format!("Fewer than 6 returns: the largest of {count} regions")
            }
            _ => "Fewer than 6 returns".to_owned(),
        };
        let mut table = Table::new(title, 1, &header);
        table.rows = self.regions.iter().map(Region::cells).collect();
        table
    }
}

impl Row {
    fn cells(&self) -> Vec<String> {
        let shares = [Some(self.none), Some(self.few), Some(self.seen), Some(self.well_seen), self.by_two];
        let mut cells = vec![self.what.clone(), self.places.to_string()];
        cells.extend(shares.iter().map(|&share| number(share, 3)));
        cells.push(number(Some(self.median_returns), 0));
        cells
    }
}

impl Region {
    fn cells(&self) -> Vec<String> {
        let mut cells = vec![format!("({:.2}, {:.2})", self.worst_m[0], self.worst_m[1])];
        cells.push(number(Some(self.returns), 1));
        cells.extend([self.x_m, self.y_m].as_flattened().iter().map(|&m| number(Some(m), 2)));
        cells.push(number(Some(self.area_m2), 1));
        cells
    }
}
