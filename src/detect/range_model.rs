//! The empty scene as one sensor sees it: the most frequent ranges of each pixel (a row of one beam, a bin of
//! azimuth).

mod movers;
mod stays;
mod arrivals;
mod columns;

pub use stays::Near;
use stays::Stays;

/// A range is background when it came back in at least this share of the revolutions: leaves and edges come back at
/// several ranges; a passer-by has a smaller share.
const SHARE: f32 = 0.3;
/// Without an empty scan what was seen first is believed, after so many revolutions, until something farther comes back.
const START_REVOLUTIONS: f32 = 1.0;
/// What no ray looked at is unknown and not open, for packets were lost or the first revolution began late; after so many revolutions
/// it lies between the columns of a sensor that has fewer of them.
const UNKNOWN_REVOLUTIONS: f32 = 10.0;
/// Revolutions after which what was learned weighs half: a minute at 10 Hz.
const MEMORY_REVOLUTIONS: f32 = 600.0;
/// What was put there after the empty scan is background once it came back so often,
const FURNITURE_REVOLUTIONS: f32 = 6.0;
/// and no longer once so many revolutions saw past it
const FURNITURE_GONE: u8 = 10;
/// by so many margins.
const FURNITURE_SPREADS: f32 = 3.0;
/// How many ranges a pixel remembers: an edge returns two, and one more passes by.
const MODES: usize = 3;
/// A mode's mean follows at least this fast: 1/50 a revolution.
const GAIN_MIN: f32 = 0.02;
/// A return is new when it is nearer than the background by so many standard deviations of what comes back from the hall,
const MARGIN_SIGMAS: f32 = 5.0;
/// within these bounds; before anything is known of them, by this.
const MARGIN_M: std::ops::RangeInclusive<f32> = 0.05..=0.25;
const FIRST_MARGIN_M: f32 = 0.1;
/// Standard deviations by mean absolute deviation, of a normal distribution: sqrt(pi / 2).
const SIGMA_PER_DEVIATION: f32 = 1.2533;
/// Returns of a pixel that tell its deviation, and the revolutions after which those of all pixels are looked at.
const TELLING_RETURNS: f32 = 10.0;
const TELLING_REVOLUTIONS: [f32; 3] = [12.0, 20.0, 50.0];
/// Edges of a body jitter by a bin from revolution to revolution: as many pixels beside those that see somebody now saw the same body
/// before, where their range differs by no more than surfaces of one body do.
const EDGE_BINS: usize = 2;
const EDGE_M: f32 = 0.3;
/// What is behind somebody is taken to be as near as the nearest of so many bins beside: leaves have no even face.
const BESIDE_BINS: usize = 5;

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

/// In how many revolutions something was so of a pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    /// Halved by forgetting.
    revolutions: f32,
    /// The last of them.
    seen: u32,
}

impl Count {
    fn note(&mut self, revolution: u32) {
        if self.seen != revolution {
            *self = Self { revolutions: self.revolutions + 1.0, seen: revolution };
        }
    }
}

/// What becomes of one return.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is remembered.
    Learned,
    /// It is somebody's: the revolution does not count for its pixel.
    Somebodys,
    /// It is remembered as something that was put there.
    Furnitures,
    /// Nothing.
    Left,
}

/// The pixels of one sensor, bin after bin, in each bin row after row: as the columns of a scan come.
#[derive(Debug, Clone)]
pub struct RangeModel {
    bins: usize,
    bins_per_cdeg: f32,
    rows: usize,
    modes: Vec<[Mode; MODES]>,
    /// Kept from learning, because somebody expected stood there.
    frozen: Vec<Count>,
    /// Looked at, whether anything came back or not. `None` where only returns are told: then every revolution looked everywhere.
    looked: Option<Vec<Count>>,
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
    /// Of each pixel: 0 where no furniture was put since, else 1 more than the revolutions that saw past it.
    furniture: Vec<u8>,
    /// Pixels of which it is not 0.
    furnished: usize,
    /// What is nearer than the background by more than this is new.
    margin_m: f32,
    /// What is new and stays.
    stays: Stays,
}

impl RangeModel {
    /// Knows nothing yet, and will be told of every ray, also of those that come back without a return ([`RangeModel::look`]).
    pub fn of_rays(azimuth_bin_deg: f64) -> Self {
        Self { looked: Some(Vec::new()), ..Self::new(azimuth_bin_deg) }
    }

    /// Knows nothing yet, and will be told of returns alone.
    pub fn new(azimuth_bin_deg: f64) -> Self {
        let bins = (360.0 / azimuth_bin_deg).round().clamp(1.0, 36_000.0) as usize;
        Self {
            bins,
            bins_per_cdeg: bins as f32 / 36_000.0,
            rows: 0,
            modes: Vec::new(),
            frozen: Vec::new(),
            looked: None,
            nearest_m: Vec::new(),
            limit_m: Vec::new(),
            revolutions: 0.0,
            margin_m: FIRST_MARGIN_M,
            count: 1,
            known: false,
            furniture: Vec::new(),
            furnished: 0,
            stays: Stays::default(),
        }
    }

    /// One of the same make that knows nothing.
    pub fn forgotten(&self) -> Self {
        let bin_deg = 360.0 / self.bins as f64;
        if self.looked.is_some() { Self::of_rays(bin_deg) } else { Self::new(bin_deg) }
    }

    /// How many bins of azimuth there are.
    pub fn bins(&self) -> usize {
        self.bins
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
        let old_rows = std::mem::replace(&mut self.rows, rows);
        let pixels = rows * self.bins;
        self.modes = widened(&self.modes, [old_rows, rows], self.bins);
        self.frozen = widened(&self.frozen, [old_rows, rows], self.bins);
        self.looked = self.looked.as_ref().map(|looked| widened(looked, [old_rows, rows], self.bins));
        (self.nearest_m, self.limit_m) = (vec![0.0; pixels], vec![0.0; pixels]);
        // Numbers of pixels change: what was put there is learned anew.
        (self.furniture, self.furnished) = (vec![0; pixels], 0);
        self.stays.of_pixel = vec![Default::default(); pixels];
        if old_rows > 0 {
            self.find_limits();
        }
    }

    /// The pixel of a row that looks at this azimuth, hundredths of a degree.
    pub fn pixel(&self, row: usize, azimuth_cdeg: f32) -> usize {
        self.bin(azimuth_cdeg) as usize * self.rows + row
    }

    /// The bin of an azimuth, which is a turn off at most: one comparison takes the place of a remainder in the hot loop. There is no
    /// call of `floor` and no conversion that asks for NaN either, for vector registers have neither on every processor.
    #[inline(always)]
    pub fn bin(&self, azimuth_cdeg: f32) -> u32 {
        // Numbers of this size are whole: adding it and taking it away rounds, and the bits of a sum end in those of
        // the whole number. Bins are far fewer.
        const WHOLE: f32 = 8_388_608.0;
        const SIGNED: f32 = 1.5 * WHOLE;
        let (bins, asked) = (self.bins as f32, azimuth_cdeg * self.bins_per_cdeg);
        let rounded = (asked + SIGNED) - SIGNED;
        let mut bin = rounded - if rounded > asked { 1.0 } else { 0.0 };
        bin -= if bin >= bins { bins } else { 0.0 };
        bin += if bin < 0.0 { bins } else { 0.0 };
        // Where the azimuth is no number, neither comparison holds.
        let below = if bin < bins { bin } else { bins - 1.0 };
        let bin = if below > 0.0 { below } else { 0.0 };
        (bin + WHOLE).to_bits() & 0x7f_ffff
    }

    /// Returns nearer than this are new. Zero, so that nothing is, until the scene is known.
    #[inline]
    pub fn limit_m(&self, pixel: usize) -> f32 {
        self.limit_m[pixel]
    }

    /// A ray of this revolution looks there.
    #[inline]
    pub fn look(&mut self, pixel: usize) {
        if let Some(looked) = &mut self.looked {
            looked[pixel].note(self.count);
        }
    }

    /// Does with a return what was decided.
    #[inline]
    pub fn take(&mut self, pixel: usize, range_m: f32, verdict: Verdict) {
        match verdict {
            Verdict::Learned => self.observe(pixel, range_m),
            Verdict::Somebodys => self.freeze(pixel),
            Verdict::Furnitures => self.furnish(pixel, range_m),
            Verdict::Left => {}
        }
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

    /// True while anything that was put there since the empty scan is background.
    #[inline]
    pub fn has_furniture(&self) -> bool {
        self.furnished > 0
    }

    /// Remembers a return of something that was put there; it is background once it came back often enough.
    fn furnish(&mut self, pixel: usize, range_m: f32) {
        self.observe(pixel, range_m);
        let least = FURNITURE_REVOLUTIONS.min(SHARE * self.revolutions);
        let near_m = nearest_m(&self.modes[pixel], least).unwrap_or(f32::INFINITY);
        if near_m < self.nearest_m[pixel] {
            self.furnished += usize::from(self.furniture[pixel] == 0);
            self.furniture[pixel] = 1;
            self.set_nearest(pixel, near_m);
        }
    }

    /// A return from farther than the background. Where that is furniture, it has been taken away again once enough
    /// revolutions saw past it.
    #[inline]
    pub fn see_past(&mut self, pixel: usize, range_m: f32) {
        if self.furniture[pixel] == 0 {
            return;
        }
        if range_m < self.nearest_m[pixel] + FURNITURE_SPREADS * self.margin_m {
            self.furniture[pixel] = 1;
            return;
        }
        self.furniture[pixel] += 1;
        if self.furniture[pixel] > FURNITURE_GONE {
            (self.furniture[pixel], self.furnished) = (0, self.furnished - 1);
            let gone = |mode: &Mode| mode.range_m < range_m - self.margin_m;
            let least = SHARE * self.revolutions;
            self.stays.hid(pixel, range_m, self.count);
            self.modes[pixel].iter_mut().filter(|mode| gone(mode)).for_each(|mode| *mode = Mode::default());
            self.set_nearest(pixel, nearest_m(&self.modes[pixel], least).unwrap_or(f32::INFINITY));
        }
    }

    /// Another background for one pixel.
    fn set_nearest(&mut self, pixel: usize, nearest_m: f32) {
        self.nearest_m[pixel] = nearest_m;
        let (bin, row) = (pixel / self.rows, pixel % self.rows);
        let at = |off: usize| (bin + off) % self.bins * self.rows + row;
        for off in [self.bins - 1, 0, 1] {
            self.limit_m[at(off)] = self.limit_of([at(off), at(off + self.bins - 1), at(off + 1)]);
        }
    }

    /// Forgets what is nearest in these pixels, which are sorted: it was somebody. What is beside each row of them is taken to
    /// go on behind.
    pub fn forget(&mut self, pixels: &[usize]) {
        let pixels = &*self.with_edges(pixels);
        let is_theirs = |bin: usize, row: usize| pixels.binary_search(&(bin * self.rows + row)).is_ok();
        let beside_m = |pixel: usize, step: usize| {
            let (mut bin, row) = (pixel / self.rows, pixel % self.rows);
            // Who stands beside the sensor may fill all of it.
            for _ in 0..self.bins {
                bin = (bin + step) % self.bins;
                if !is_theirs(bin, row) {
                    break;
                }
            }
            (0..BESIDE_BINS)
                .map(|k| self.nearest_m[(bin + k * step) % self.bins * self.rows + row])
                .fold(f32::INFINITY, f32::min)
        };
        let behind_m: Vec<f32> =
            pixels.iter().map(|&pixel| beside_m(pixel, self.bins - 1).min(beside_m(pixel, 1))).collect();
        for (&pixel, range_m) in pixels.iter().zip(behind_m) {
            let weight = if range_m.is_finite() { self.revolutions } else { 0.0 };
            let behind = Mode { range_m, spread_m: 0.0, weight, seen: self.count };
            self.modes[pixel] = [Mode::default(); MODES];
            if weight > 0.0 {
                self.modes[pixel][0] = behind;
            }
        }
        self.find_limits();
    }

    /// These pixels, which are sorted, and those beside them that saw the same body: as long as one of them keeps its range, the body
    /// seems to go on behind itself.
    fn with_edges(&self, pixels: &[usize]) -> Vec<usize> {
        let mut all = pixels.to_vec();
        for &pixel in pixels {
            for step in [1, self.bins - 1] {
                let mut at = pixel;
                for _ in 0..EDGE_BINS {
                    let beside = (at / self.rows + step) % self.bins * self.rows + at % self.rows;
                    if (self.nearest_m[beside] - self.nearest_m[at]).abs() > EDGE_M {
                        break;
                    }
                    all.push(beside);
                    at = beside;
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Leaves a revolution out of a pixel's account: somebody who is expected there was seen. Otherwise what stands behind
    /// would come back in ever fewer of the revolutions, until the one who stands is taken for it.
    fn freeze(&mut self, pixel: usize) {
        self.frozen[pixel].note(self.count);
    }

    /// Closes a revolution that was observed and works out the limits anew. What was always empty counts as
    /// open once the scene is `known` or enough revolutions were seen.
    pub fn close_revolution(&mut self, known: bool) {
        self.known |= known;
        self.revolutions += 1.0;
        if TELLING_REVOLUTIONS.contains(&self.revolutions) {
            self.find_margin();
        }
        // After the first halving nothing tells any more what was there from the start.
        if !self.known && self.count as f32 <= MEMORY_REVOLUTIONS {
            self.forget_movers();
        }
        self.count = self.count.wrapping_add(1);
        if self.revolutions > MEMORY_REVOLUTIONS {
            self.revolutions *= 0.5;
            self.modes.iter_mut().flatten().for_each(|mode| mode.weight *= 0.5);
            let counts = self.frozen.iter_mut().chain(self.looked.iter_mut().flatten());
            counts.for_each(|count| count.revolutions *= 0.5);
        }
        self.find_limits();
    }

    /// How far the returns of this sensor scatter is seen, whatever its file says: the median of all pixels that know.
    fn find_margin(&mut self) {
        let telling = |mode: &&Mode| mode.weight >= TELLING_RETURNS;
        let mut spreads_m: Vec<f32> =
            self.modes.iter().flatten().filter(telling).map(|mode| mode.spread_m).collect();
        let middle = spreads_m.len() / 2;
        if middle > 0 {
            let (_, &mut spread_m, _) = spreads_m.select_nth_unstable_by(middle, f32::total_cmp);
            let margin_m = MARGIN_SIGMAS * SIGMA_PER_DEVIATION * spread_m;
            self.margin_m = margin_m.clamp(*MARGIN_M.start(), *MARGIN_M.end());
        }
    }

    /// The same where nothing is learned but furniture.
    pub fn close_known_revolution(&mut self) {
        self.count = self.count.wrapping_add(1);
    }

    fn find_limits(&mut self) {
        // An empty scan is believed as it is; what walks by has to be outvoted.
        let least = |revolutions: f32| match self.known {
            true => SHARE * revolutions,
            false => (SHARE * revolutions).max(revolutions.min(1.5)),
        };
        for (pixel, nearest) in self.nearest_m.iter_mut().enumerate() {
            let looks = self.looked.as_ref().map_or(self.revolutions, |looked| looked[pixel].revolutions);
            let open = looks >= START_REVOLUTIONS || self.revolutions >= UNKNOWN_REVOLUTIONS;
            let unseen_m = if self.known || open { f32::INFINITY } else { 0.0 };
            let least = least(looks - self.frozen[pixel].revolutions);
            *nearest = nearest_m(&self.modes[pixel], least).unwrap_or(unseen_m).min(unseen_m);
        }
        for bin in 0..self.bins {
            let [own, left, right] = [0, self.bins - 1, 1].map(|off| (bin + off) % self.bins * self.rows);
            for row in 0..self.rows {
                self.limit_m[own + row] = self.limit_of([own + row, left + row, right + row]);
            }
        }
    }

    /// Edges jitter by one bin from revolution to revolution, so the neighbours of a pixel count as well, as far as they are known.
    #[inline]
    fn limit_of(&self, [own, left, right]: [usize; 3]) -> f32 {
        let beside_m = [left, right].map(|pixel| self.nearest_m[pixel]).into_iter().filter(|m| *m > 0.0);
        beside_m.fold(self.nearest_m[own], f32::min) - self.margin_m
    }
}

/// What is kept of every pixel, with more rows in each bin.
fn widened<T: Copy + Default>(old: &[T], [old_rows, rows]: [usize; 2], bins: usize) -> Vec<T> {
    let mut wide = vec![T::default(); rows * bins];
    if old_rows > 0 {
        for (wide, old) in wide.chunks_exact_mut(rows).zip(old.chunks_exact(old_rows)) {
            wide[..old_rows].copy_from_slice(old);
        }
    }
    wide
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

#[cfg(test)]
#[path = "range_model_tests.rs"]
mod tests;
