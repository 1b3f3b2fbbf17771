//! What the empty scene looks like to one sensor: for each pixel (a row of one beam, a bin of azimuth) the ranges
//! that came back most often.

/// A range is background when it came back in at least this share of the revolutions: leaves and edges come back at
/// several ranges; a passer-by has a smaller share.
const SHARE: f32 = 0.3;
/// Without an empty scan what was seen first is believed, after so many revolutions, until something farther comes back.
const START_REVOLUTIONS: f32 = 1.0;
/// Revolutions after which what was learned weighs half: a minute at 10 Hz.
const MEMORY_REVOLUTIONS: f32 = 600.0;
/// How many ranges a pixel remembers: an edge returns two, and one more passes by.
const MODES: usize = 3;
/// A mode's mean follows at least this fast: 1/50 a revolution.
const GAIN_MIN: f32 = 0.02;
/// Surfaces of one body in neighbouring bins and rows are at most this far apart in range.
const STEP_M: f32 = 0.3;
/// Width of one row of a person: a leg or a post is narrower, furniture and walls are wider.
const WIDTH_M: [f32; 2] = [0.2, 1.0];
/// Revolutions without a return after which something has gone: edges flicker for one.
const GONE: u32 = 2;
/// A mover has gone from this share of its pixels, in this many rows, and came to the bin beside in as many as
/// `CAME_ROWS`: leaves and edges flicker, but do not also appear on the other side.
const GONE_SHARE: f32 = 0.2;
const GONE_ROWS: usize = 3;
const CAME_ROWS: usize = 2;

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

/// Pixels of one row that may be a person: something clearly farther is on both sides.
#[derive(Debug, Clone, Copy)]
struct Piece {
    row: usize,
    /// From here on to the right, so many of them.
    first_bin: usize,
    bins: usize,
    near_m: f32,
    /// The nearer of what is beside it.
    behind_m: f32,
    /// Pixels that see past it now.
    gone: usize,
    /// True where a bin beside it has returns from its range now.
    came: bool,
}

/// The pixels of one sensor, bin after bin, in each bin row after row: as the columns of a scan come.
#[derive(Debug, Clone)]
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
}

impl RangeModel {
    /// Knows nothing yet. A return is new when it is nearer than the background by more than `margin_m`.
    pub fn new(margin_m: f64, azimuth_bin_deg: f64) -> Self {
        let bins = (360.0 / azimuth_bin_deg).round().clamp(1.0, 36_000.0) as usize;
        Self {
            bins,
            bins_per_cdeg: bins as f32 / 36_000.0,
            rows: 0,
            modes: Vec::new(),
            nearest_m: Vec::new(),
            limit_m: Vec::new(),
            revolutions: 0.0,
            margin_m: margin_m as f32,
            count: 1,
            known: false,
        }
    }

    /// One of the same make that knows nothing.
    pub fn forgotten(&self) -> Self {
        Self::new(f64::from(self.margin_m), 360.0 / self.bins as f64)
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
    pub fn pixel(&self, row: usize, azimuth_cdeg: f32) -> usize {
        self.bin(azimuth_cdeg) as usize * self.rows + row
    }

    /// The same of a column: the first azimuth is that of row 0.
    #[inline(always)]
    pub fn pixels(&self, azimuths_cdeg: &[f32], pixels: &mut [u32]) {
        for (row, (pixel, azimuth_cdeg)) in (0_u32..).zip(pixels.iter_mut().zip(azimuths_cdeg)) {
            *pixel = self.bin(*azimuth_cdeg) * self.rows as u32 + row;
        }
    }

    /// A turn more or less is common, more than one is not: no remainder in the hot loop. Nor a call of `floor` or a
    /// conversion that asks for NaN, which no vector register does where the processor may be any.
    #[inline(always)]
    fn bin(&self, azimuth_cdeg: f32) -> u32 {
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

    /// Whether any return of a column is new, or is one that cannot be told, as NaN.
    #[inline(always)]
    pub fn any_new(&self, pixels: &[u32], ranges_m: &[f32]) -> bool {
        let is_known = |limit_m: f32, range_m: f32| (range_m == 0.0) | (range_m >= limit_m);
        let least = pixels.iter().fold(u32::MAX, |least, &pixel| least.min(pixel));
        let most = pixels.iter().fold(0, |most, &pixel| most.max(pixel));
        let (bin, last) = (least as usize / self.rows, most as usize / self.rows);
        if last > bin + 1 {
            let known = |(&pixel, &range_m): (&u32, &f32)| is_known(self.limit_m(pixel as usize), range_m);
            return !pixels.iter().zip(ranges_m).fold(true, |all, of| all & known(of));
        }
        // The beams of a column look into one bin or two beside each other, if the sensor does not fan them out: then
        // the limits of both lie in a row, and nothing need be looked up.
        let n = ranges_m.len().min(pixels.len()).min(self.rows);
        let next = (last * self.rows) as u32;
        let (pixels, ranges_m) = (&pixels[..n], &ranges_m[..n]);
        let (limits_m, of_next_m) =
            (&self.limit_m[bin * self.rows..][..n], &self.limit_m[last * self.rows..][..n]);
        let mut new = 0;
        for i in 0..n {
            let limit_m = if pixels[i] < next { limits_m[i] } else { of_next_m[i] };
            new |= u32::from(!is_known(limit_m, ranges_m[i]));
        }
        new != 0
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
        // After the first halving nothing tells any more what was there from the start.
        if !self.known && self.count as f32 <= MEMORY_REVOLUTIONS {
            self.forget_movers();
        }
        self.count = self.count.wrapping_add(1);
        if self.revolutions > MEMORY_REVOLUTIONS {
            self.revolutions *= 0.5;
            self.modes.iter_mut().flatten().for_each(|mode| mode.weight *= 0.5);
        }
        self.find_limits();
    }

    /// Who was there from the start and walks off is background to every pixel that saw a part of them twice.
    /// Once enough of a body has gone on, it is forgotten as a whole (video's ghost removal): what is beside each
    /// of its rows is taken to go on behind it.
    fn forget_movers(&mut self) {
        let pieces: Vec<Piece> = (0..self.rows * self.bins).filter_map(|pixel| self.piece(pixel)).collect();
        for seed in pieces.iter().filter(|piece| piece.gone > 0) {
            let body: Vec<&Piece> = pieces.iter().filter(|piece| self.is_same_body(piece, seed)).collect();
            let sum = |count: fn(&Piece) -> usize| body.iter().map(|piece| count(piece)).sum::<usize>();
            let moved = sum(|piece| piece.gone) as f32 >= GONE_SHARE * sum(|piece| piece.bins) as f32;
            let rows = sum(|piece| usize::from(piece.gone > 0));
            if !moved || rows < GONE_ROWS || sum(|piece| usize::from(piece.came)) < CAME_ROWS {
                continue;
            }
            for piece in body {
                let weight = if piece.behind_m.is_finite() { self.revolutions } else { 0.0 };
                let behind = Mode { range_m: piece.behind_m, spread_m: 0.0, weight, seen: self.count };
                for bin in piece.first_bin..piece.first_bin + piece.bins {
                    let modes = &mut self.modes[bin % self.bins * self.rows + piece.row];
                    *modes = [Mode::default(); MODES];
                    if weight > 0.0 {
                        modes[0] = behind;
                    }
                }
            }
        }
    }

    /// The piece whose left edge is this pixel.
    fn piece(&self, pixel: usize) -> Option<Piece> {
        let (first_bin, row) = (pixel / self.rows, pixel % self.rows);
        let at = |bins: usize| (first_bin + bins) % self.bins * self.rows + row;
        let (near_m, left_m) = (self.nearest_m[pixel], self.nearest_m[at(self.bins - 1)]);
        if near_m <= 0.0 || near_m + STEP_M >= left_m {
            return None;
        }
        let bin_m = near_m * std::f32::consts::TAU / self.bins as f32;
        let bins_max = ((WIDTH_M[1] / bin_m) as usize).min(self.bins - 1);
        let (mut last_m, mut gone, mut bins) = (near_m, 0, 0);
        while bins <= bins_max && (self.nearest_m[at(bins)] - last_m).abs() <= STEP_M {
            last_m = self.nearest_m[at(bins)];
            gone += usize::from(self.has_gone(at(bins)));
            bins += 1;
        }
        let right_m = self.nearest_m[at(bins)];
        let is_person = bins <= bins_max && bins as f32 * bin_m >= WIDTH_M[0] && right_m > last_m + STEP_M;
        let came = |bins: usize, from_m: f32| {
            let here = |mode: &Mode| mode.seen == self.count && (mode.range_m - from_m).abs() < STEP_M;
            self.modes[at(bins)].iter().any(here)
        };
        is_person.then(|| Piece {
            row,
            first_bin,
            bins,
            near_m,
            behind_m: left_m.min(right_m),
            gone,
            came: came(self.bins - 1, near_m) || came(bins, last_m),
        })
    }

    /// True where two pieces are one above the other. The order of the rows says nothing: those of clouds come
    /// as they are first seen.
    fn is_same_body(&self, a: &Piece, b: &Piece) -> bool {
        let right_of = |a: &Piece, b: &Piece| (b.first_bin + self.bins - a.first_bin) % self.bins;
        (right_of(a, b) < a.bins || right_of(b, a) < b.bins) && (a.near_m - b.near_m).abs() < STEP_M
    }

    /// True where what came back from the start on no longer does, and something farther does.
    fn has_gone(&self, pixel: usize) -> bool {
        let (modes, near_m) = (&self.modes[pixel], self.nearest_m[pixel]);
        let left = |m: &Mode| {
            m.range_m - 2.0 * m.spread_m == near_m
                && m.weight + 1.0 >= m.seen as f32
                && m.seen + GONE <= self.count
        };
        modes.iter().any(left)
            && modes.iter().any(|m| m.seen == self.count && m.range_m > near_m + self.margin_m)
    }

    fn find_limits(&mut self) {
        let unseen_m = if self.known || self.revolutions >= START_REVOLUTIONS { f32::INFINITY } else { 0.0 };
        // An empty scan is believed as it is; what walks by has to be outvoted.
        let least = SHARE * self.revolutions;
        let least = if self.known { least } else { least.max(self.revolutions.min(1.5)) };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_azimuth_lies_in_its_bin_whatever_it_is() {
        let model = RangeModel::new(0.05, 0.2);
        for (azimuth_cdeg, bin) in [
            (0.0, 0),
            (19.9, 0),
            (20.0, 1),
            (35_999.0, 1799),
            (36_000.0, 0),
            (-0.5, 1799),
            (-35_999.0, 0),
            (71_999.0, 1799),
            (f32::NAN, 1799),
            (f32::INFINITY, 1799),
            (1e30, 1799),
            (-1e30, 0),
        ] {
            assert_eq!(model.bin(azimuth_cdeg), bin, "{azimuth_cdeg}");
        }
    }

    #[test]
    fn a_column_is_new_where_one_of_its_pixels_is_however_its_beams_lie() {
        let mut model = RangeModel::new(0.05, 1.0);
        model.grow(ROWS);
        (0..model.limit_m.len()).for_each(|pixel| model.limit_m[pixel] = 2.0 + (pixel * 7 % 13) as f32);
        let columns = [
            [500.0; ROWS],
            [590.0, 595.0, 600.0, 605.0],
            [35_990.0, 36_010.0, 35_900.0, 0.0],
            [0.0, 500.0, 9e3, 2e4],
        ];
        for azimuths_cdeg in columns {
            let mut pixels = [0; ROWS];
            model.pixels(&azimuths_cdeg, &mut pixels);
            let limits_m = pixels.map(|pixel| model.limit_m(pixel as usize));
            assert!(!model.any_new(&pixels, &limits_m), "{azimuths_cdeg:?}");
            assert!(!model.any_new(&pixels, &[0.0; ROWS]), "nothing came back");
            for row in 0..ROWS {
                for nearer_m in [limits_m[row] - 0.001, f32::NAN] {
                    let mut ranges_m = limits_m;
                    ranges_m[row] = nearer_m;
                    assert!(model.any_new(&pixels, &ranges_m), "{azimuths_cdeg:?}, row {row}");
                }
            }
        }
    }

    const ROWS: usize = 4;
    const NEAR_M: f32 = 5.0;
    const FAR_M: f32 = 10.0;

    /// One revolution in bins of one degree: something at 5 m in bins `first..end`, a wall at 10 m around it.
    fn look(model: &mut RangeModel, first: usize, end: usize) {
        for bin in 0..model.bins {
            let range_m = if (first..end).contains(&bin) { NEAR_M } else { FAR_M };
            for row in 0..model.rows {
                model.observe(bin * model.rows + row, range_m);
            }
        }
        model.close_revolution(false);
    }

    fn learned(first: usize, end: usize) -> RangeModel {
        let mut model = RangeModel::new(0.1, 1.0);
        model.grow(ROWS);
        for _ in 0..10 {
            look(&mut model, first, end);
        }
        model
    }

    fn is_new(model: &RangeModel, bin: usize) -> bool {
        (0..ROWS).all(|row| NEAR_M < model.limit_m(bin * ROWS + row))
    }

    #[test]
    fn who_walks_off_is_forgotten_as_a_whole() {
        let mut model = learned(100, 106);
        assert!(!is_new(&model, 104));
        for step in 1..=3 {
            look(&mut model, 100 + step, 106 + step);
        }
        assert!(is_new(&model, 104));
    }

    #[test]
    fn what_stays_is_not_forgotten_where_its_edge_goes() {
        // A pillar whose edge is no longer hit, and a wall that a walker leaves.
        for (first, end) in [(100, 106), (100, 180)] {
            let mut model = learned(first, end);
            for _ in 0..5 {
                look(&mut model, first + 2, end);
            }
            assert!(!is_new(&model, first + 4), "{first}..{end}");
        }
        let mut wall = learned(100, 180);
        for step in 1..=5 {
            look(&mut wall, 100 + step, 180 + step);
        }
        assert!(!is_new(&wall, 140));
    }
}
