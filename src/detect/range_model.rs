//! What the empty scene looks like to one sensor: for each pixel (a row of one beam, a bin of azimuth) the ranges
//! that came back most often.

use crate::config::BackgroundConfig;

/// How many ranges a pixel remembers: an edge returns two, and one more passes by.
const MODES: usize = 3;
/// A mode's mean follows at least this fast: 1/50 a revolution.
const GAIN_MIN: f32 = 0.02;

/// One range that comes back, with how often it did.
#[derive(Debug, Clone, Copy, Default)]
struct Mode {
    range_m: f32,
    /// Mean absolute deviation, metres.
    spread_m: f32,
    /// Revolutions in which it came back; halved by forgetting.
    weight: f32,
    /// The last of them.
    seen: u32,
}

/// The pixels of one sensor, bin after bin, in each bin row after row: as the columns of a scan come.
#[derive(Debug)]
pub struct RangeModel {
    bins: usize,
    bins_per_cdeg: f32,
    rows: usize,
    modes: Vec<[Mode; MODES]>,
    /// Nearest background of each pixel, before the margin; infinite where nothing stands, 0 while unknown.
    nearest_m: Vec<f32>,
    /// The same, less margin, over the neighbours in azimuth: a nearer return is new.
    limit_m: Vec<f32>,
    /// Revolutions learned; halved by forgetting.
    revolutions: f32,
    /// The revolution that is being observed.
    count: u32,
    /// True once it was learned without people.
    known: bool,
    margin_m: f32,
    share: f32,
    start: f32,
    memory: f32,
}

impl RangeModel {
    /// Knows nothing yet.
    pub fn new(config: &BackgroundConfig, azimuth_bin_deg: f64) -> Self {
        let bins = (360.0 / azimuth_bin_deg).round().clamp(1.0, 36_000.0) as usize;
        Self {
            bins,
            bins_per_cdeg: bins as f32 / 36_000.0,
            rows: 0,
            modes: Vec::new(),
            nearest_m: Vec::new(),
            limit_m: Vec::new(),
            revolutions: 0.0,
            margin_m: config.margin_m as f32,
            share: config.share as f32,
            start: config.start_revolutions as f32,
            memory: config.memory_revolutions as f32,
            count: 1,
            known: false,
        }
    }

    /// How many rows there are.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Adds rows about which nothing is known. Pixels change their numbers.
    pub fn grow(&mut self, rows: usize) {
        if rows <= self.rows {
            return;
        }
        let (old_rows, old) = (self.rows, std::mem::take(&mut self.modes));
        self.rows = rows;
        self.modes = vec![[Mode::default(); MODES]; rows * self.bins];
        self.nearest_m = vec![0.0; rows * self.bins];
        self.limit_m = vec![0.0; rows * self.bins];
        if old_rows > 0 {
            for (new, old) in self.modes.chunks_exact_mut(rows).zip(old.chunks_exact(old_rows)) {
                new[..old_rows].copy_from_slice(old);
            }
            self.find_limits();
        }
    }

    /// The pixel of a row that looks at this azimuth, hundredths of a degree.
    #[inline]
    pub fn pixel(&self, row: usize, azimuth_cdeg: f32) -> usize {
        // A turn more or less is common, more than one is not: no remainder in the hot loop.
        let mut bin = (azimuth_cdeg * self.bins_per_cdeg).floor() as i32;
        let bins = self.bins as i32;
        if bin >= bins {
            bin -= bins;
        } else if bin < 0 {
            bin += bins;
        }
        bin.clamp(0, bins - 1) as usize * self.rows + row
    }

    /// Returns nearer than this are new. Zero, so that nothing is, until the scene is known.
    #[inline]
    pub fn limit_m(&self, pixel: usize) -> f32 {
        self.limit_m[pixel]
    }

    /// Remembers one return.
    pub fn observe(&mut self, pixel: usize, range_m: f32) {
        let modes = &mut self.modes[pixel];
        for mode in modes.iter_mut() {
            let off_m = range_m - mode.range_m;
            if mode.weight > 0.0 && off_m.abs() < self.margin_m {
                mode.weight += f32::from(mode.seen != self.count);
                mode.seen = self.count;
                let gain = (1.0 / mode.weight).max(GAIN_MIN);
                mode.range_m += gain * off_m;
                mode.spread_m += gain * (off_m.abs() - mode.spread_m);
                return;
            }
        }
        // No mode fits: the rarest gives way once it is outvoted.
        let rarest = modes.iter_mut().min_by(|a, b| a.weight.total_cmp(&b.weight)).expect("there are modes");
        rarest.weight -= 1.0;
        if rarest.weight <= 0.0 {
            *rarest = Mode { range_m, spread_m: 0.0, weight: 1.0, seen: self.count };
        }
    }

    /// Closes a revolution that was observed and works out the limits anew. What was always empty counts as
    /// open once the scene is `known` or enough revolutions were seen.
    pub fn close_revolution(&mut self, known: bool) {
        self.known |= known;
        self.revolutions += 1.0;
        self.count = self.count.wrapping_add(1);
        if self.revolutions > self.memory {
            self.revolutions *= 0.5;
            self.modes.iter_mut().flatten().for_each(|mode| mode.weight *= 0.5);
        }
        self.find_limits();
    }

    fn find_limits(&mut self) {
        let unseen_m = if self.known || self.revolutions >= self.start { f32::INFINITY } else { 0.0 };
        // An empty scan is believed as it is; what walks by has to be outvoted.
        let least = self.share * self.revolutions;
        let least = if self.known { least } else { least.max(1.5) };
        for (nearest, modes) in self.nearest_m.iter_mut().zip(&self.modes) {
            *nearest = nearest_m(modes, least).unwrap_or(unseen_m).min(unseen_m);
        }
        for bin in 0..self.bins {
            // Edges jitter by one bin from revolution to revolution.
            let [own, left, right] = [0, self.bins - 1, 1].map(|off| (bin + off) % self.bins * self.rows);
            for row in 0..self.rows {
                let around = [own, left, right].map(|first| self.nearest_m[first + row]);
                self.limit_m[own + row] = around.into_iter().fold(f32::INFINITY, f32::min) - self.margin_m;
            }
        }
    }
}

/// The nearest range that came back in at least `least` revolutions. Where none did although the pixel often
/// returned something (a wall seen at a grazing angle, leaves), the nearest of all; nothing where it rarely did.
fn nearest_m(modes: &[Mode; MODES], least: f32) -> Option<f32> {
    let near = |mode: &Mode| mode.range_m - 2.0 * mode.spread_m;
    let nearest = |weight: f32| {
        modes.iter().filter(|m| m.weight > 0.0 && m.weight >= weight).map(near).reduce(f32::min)
    };
    nearest(least).or_else(|| {
        let total: f32 = modes.iter().map(|m| m.weight).sum();
        if total >= least { nearest(0.0) } else { None }
    })
}
