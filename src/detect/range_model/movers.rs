//! Who was there when a sensor began to learn, and has walked off since: background no longer.

use super::{MODES, Mode, RangeModel};

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

impl RangeModel {
    /// Who was there from the start and walks off is background to every pixel that saw a part of them twice.
    /// Once enough of a body has gone on, it is forgotten as a whole (video's ghost removal): what is beside each
    /// of its rows is taken to go on behind it.
    pub(super) fn forget_movers(&mut self) {
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
}
