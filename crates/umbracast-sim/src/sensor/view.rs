//! What one sensor sees in one frame, free of noise.

use umbracast::lidar::RangeImage;

use super::hall::HallImage;
use super::head::Head;
use super::panes::Mirrored;

/// Owner of a pixel that shows the hall.
pub const NOBODY: u32 = u32::MAX;

/// Neighbouring columns that differ by more show two surfaces, not one that is slant.
const EDGE_M: f32 = 0.3;

/// True ranges along the reported directions, and whose body each pixel shows.
#[derive(Debug, Clone)]
pub struct View {
    /// Columns as a decoder gives them, with true ranges.
    pub image: RangeImage,
    /// Place in the list of walkers, or [`NOBODY`]; in the image's order.
    pub owner: Vec<u32>,
    /// Number of the first column since the scene began.
    pub first_column: u64,
    /// Azimuth of the first column, not wrapped.
    pub first_cdeg: f64,
    /// The number of the pane whose reflections are being shown, 0 for what is seen straight.
    pub pane: u8,
    step_cdeg: f64,
    /// Ranges of the empty hall, in the image's order.
    hall_m: Vec<f32>,
    /// Empty in a hall without panes.
    mirrored: Vec<Mirrored>,
    /// How many times as much as the data sheet says each pixel's range errs, once it is measured.
    pub scales: Vec<f32>,
}

impl View {
    /// The empty hall in frame `index`. A view that is no longer needed gives its buffers: new ones are pages that the system has
    /// to clear.
    pub fn of_hall(hall: &HallImage, head: &Head, index: u64, spent: Option<Self>) -> Self {
        let columns = head.frame_columns(index);
        let first_column = columns.start;
        let beams = head.model.beams.clone();
        let columns = head.reported(columns);
        let rays = columns.len() * beams.len();
        let mut view = spent.unwrap_or_else(|| Self {
            image: RangeImage {
                beams: beams.clone(),
                columns: Vec::new(),
                range_m: Vec::new(),
                reflectivity: Vec::new(),
            },
            owner: Vec::new(),
            first_column,
            first_cdeg: 0.0,
            pane: 0,
            step_cdeg: 0.0,
            hall_m: Vec::new(),
            mirrored: Vec::new(),
            scales: Vec::new(),
        });
        (view.image.beams, view.image.columns) = (beams, columns);
        // All of it is written below.
        view.image.range_m.resize(rays, 0.0);
        view.image.reflectivity.resize(rays, 0);
        view.mirrored.resize(if hall.has_panes() { rays } else { 0 }, Mirrored::NONE);
        hall.show(&mut view.image, &mut view.mirrored);
        view.hall_m.clone_from(&view.image.range_m);
        view.owner.clear();
        view.owner.resize(rays, NOBODY);
        view.first_column = first_column;
        view.first_cdeg = head.turned_cdeg(head.time_ns(first_column));
        view.pane = 0;
        view.step_cdeg = head.rate_cdeg_per_ns * head.model.column_period_ns;
        view
    }

    /// Which column's first beam looks along an azimuth that is not wrapped.
    pub fn column_at(&self, azimuth_cdeg: f64) -> f64 {
        (azimuth_cdeg - self.first_cdeg) / self.step_cdeg
    }

    /// The azimuth of a column's first beam, not wrapped.
    pub fn azimuth_at(&self, column: f64) -> f64 {
        self.first_cdeg + column * self.step_cdeg
    }

    /// How far the same surface comes nearer or goes away from a pixel to that of the next column; 0 where that shows another.
    /// Of the hall this does not depend on who stands before it.
    pub fn slope_m(&self, pixel: usize) -> f32 {
        let beams = self.image.beams.len();
        let owner = self.owner[pixel];
        let ranges_m = if owner == NOBODY { &self.hall_m } else { &self.image.range_m };
        // The last column has its neighbour before it.
        let beside = if pixel + beams < ranges_m.len() { pixel + beams } else { pixel.saturating_sub(beams) };
        let step_m = (ranges_m[beside] - ranges_m[pixel]).abs();
        let is_same = owner == NOBODY || self.owner[beside] == owner;
        if is_same && step_m < EDGE_M { step_m } else { 0.0 }
    }

    /// Writes [`Self::slope_m`] of every pixel.
    pub fn slopes_m(&self, slopes_m: &mut Vec<f32>) {
        let next = self.hall_m.get(self.image.beams.len()..).unwrap_or_default();
        slopes_m.clear();
        // As if nobody stood before the hall, without a branch, for vector registers.
        slopes_m.extend(self.hall_m.iter().zip(next).map(|(here_m, next_m)| {
            let step_m = (next_m - here_m).abs();
            if step_m < EDGE_M { step_m } else { 0.0 }
        }));
        for (pixel, slope_m) in slopes_m.iter_mut().enumerate() {
            if self.owner[pixel] != NOBODY {
                *slope_m = self.slope_m(pixel);
            }
        }
        slopes_m.extend((slopes_m.len()..self.hall_m.len()).map(|pixel| self.slope_m(pixel)));
    }

    /// From one column to the next.
    pub fn step_rad(&self) -> f64 {
        (0.01 * self.step_cdeg).to_radians()
    }

    /// A surface of a body at `range_m`: shown where nothing nearer is. A reflection is nobody's body.
    pub fn show(&mut self, column: usize, beam: usize, range_m: f32, reflectivity: u8, owner: u32) {
        let pixel = column * self.image.beams.len() + beam;
        if range_m < self.image.range_m[pixel] && self.reaches(pixel, range_m) {
            self.image.range_m[pixel] = range_m;
            self.image.reflectivity[pixel] = reflectivity;
            self.owner[pixel] = if self.pane == 0 { owner } else { NOBODY };
        }
    }

    /// Whether light goes so far where a pane may be in its way.
    fn reaches(&self, pixel: usize, range_m: f32) -> bool {
        let Mirrored { pane, at_m, reach_m } = self.mirrored.get(pixel).copied().unwrap_or(Mirrored::NONE);
        match self.pane {
            0 => range_m < at_m,
            shown => shown == pane && range_m > at_m && range_m <= reach_m,
        }
    }
}
