//! The floor in square cells.

use serde::Serialize;
use umbracast::geometry::DVec2;
use umbracast::{Error, Site};

/// Nobody's body axis comes nearer to a wall, a pillar or a piece of furniture: half a body's width.
const ELBOW_ROOM_M: f64 = 0.25;
/// More cells than that take longer than a drag may.
const CELLS_MOST: f64 = 20_000.0;
/// The cells of a hall that is small enough, metres.
const FINEST_M: f64 = 0.5;

/// Where people may stand, cell by cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Floor {
    /// The middle of the first cell, metres.
    pub from_m: [f64; 2],
    /// From cell to cell, metres.
    pub step_m: f64,
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Whether somebody can stand there; by y, then by x.
    #[serde(skip)]
    pub open: Vec<bool>,
}

impl Floor {
    /// Cells of `step_m`, or larger ones where the hall is so large. No step takes half a metre.
    ///
    /// # Errors
    /// A hall in which nobody can stand.
    pub fn of(site: &Site, step_m: Option<f64>) -> Result<Self, Error> {
        let [least_m, most_m] = site.hall.bounds_m();
        let size_m = most_m - least_m;
        let step_m = step_m.unwrap_or(FINEST_M).max((size_m.x * size_m.y / CELLS_MOST).sqrt());
        let [columns, rows] = [size_m.x, size_m.y].map(|m| (m / step_m).floor().max(1.0) as usize);
        let spare_m = size_m - DVec2::new(columns as f64, rows as f64) * step_m;
        let from_m = (least_m + 0.5 * spare_m + 0.5 * step_m).to_array();
        let mut floor = Self { from_m, step_m, columns, rows, open: Vec::new() };
        floor.open = (0..columns * rows).map(|cell| is_floor(site, floor.place_m(cell))).collect();
        if !floor.open.contains(&true) {
            let found = format!(
                "site.hall: expected a floor for a person to stand on, found {} x {} m",
                size_m.x, size_m.y
            );
            return Err(Error::new(found));
        }
        Ok(floor)
    }

    /// The middle of a cell.
    pub fn place_m(&self, cell: usize) -> DVec2 {
        let (i, j) = (cell % self.columns, cell / self.columns);
        DVec2::from_array(self.from_m) + DVec2::new(i as f64, j as f64) * self.step_m
    }

    /// How many cells are open.
    pub fn places(&self) -> usize {
        self.open.iter().filter(|open| **open).count()
    }

    /// Of the open cells, square metres.
    pub fn area_m2(&self) -> f64 {
        self.places() as f64 * self.step_m * self.step_m
    }

    /// The mean of a map over the open cells.
    pub fn mean(&self, of: impl Fn(usize) -> f64) -> f64 {
        let open = self.open.iter().enumerate().filter(|(_, open)| **open);
        open.map(|(cell, _)| of(cell)).sum::<f64>() / self.places() as f64
    }
}

fn is_floor(site: &Site, place_m: DVec2) -> bool {
    let in_pillar = site.pillars.iter().any(|pillar| {
        place_m.distance(DVec2::from_array(pillar.position_m)) < pillar.radius_m + ELBOW_ROOM_M
    });
    let in_furniture = site.furniture.iter().any(|item| {
        let offset_m = place_m - DVec2::from_array(item.position_m);
        let own_m = DVec2::from_angle(-item.yaw_deg.to_radians()).rotate(offset_m);
        let half_m = 0.5 * DVec2::new(item.size_m[0], item.size_m[1]);
        (own_m.abs() - half_m).max(DVec2::ZERO).length() < ELBOW_ROOM_M
    });
    site.hall.clearance_m(place_m) >= ELBOW_ROOM_M && !in_pillar && !in_furniture
}
