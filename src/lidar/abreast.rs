//! Beams side by side, so that the returns of a column are placed in vector registers.

use super::scan::Azimuths;
use super::{Beam, RangeImage};
use crate::elementary::index;
use crate::geometry::DVec3;

/// Beams that are placed at once; half of a column of 32.
pub const ABREAST: usize = 16;

/// A number of each beam.
pub type Lanes = [f64; ABREAST];

/// Some beams that follow one another in a column; what is missing to a whole number of them looks nowhere.
#[derive(Debug, Clone)]
pub struct Abreast {
    origin_m: [Lanes; 3],
    direction: [Lanes; 3],
    turned_ns: [f32; ABREAST],
    /// In the column.
    first: usize,
    beams: usize,
    /// Whether the manufacturer's decoder rounds the azimuths of all of them.
    whole_cdeg: bool,
}

impl Abreast {
    /// The beams of a column, in their order, in memory that is used again.
    pub fn take(all: &mut Vec<Self>, beams: &[Beam]) {
        all.clear();
        all.extend(beams.chunks(ABREAST).zip((0..).step_by(ABREAST)).map(|(beams, first)| {
            let lanes = |of: fn(&Beam) -> f64| std::array::from_fn(|i| beams.get(i).map_or(0.0, of));
            Self {
                origin_m: [lanes(|b| b.origin_m.x), lanes(|b| b.origin_m.y), lanes(|b| b.origin_m.z)],
                direction: [lanes(|b| b.direction.x), lanes(|b| b.direction.y), lanes(|b| b.direction.z)],
                turned_ns: std::array::from_fn(|i| beams.get(i).map_or(0.0, |beam| beam.turned_ns as f32)),
                first,
                beams: beams.len(),
                whole_cdeg: beams.iter().all(|beam| beam.whole_cdeg),
            }
        }));
    }

    /// Which beam of the column the `i`-th is.
    pub fn beam(&self, i: usize) -> usize {
        self.first + i
    }

    /// Sines and cosines of the head's azimuths when these beams of column `c` fire.
    #[inline(always)]
    pub fn head_sin_cos(&self, image: &RangeImage, azimuths: &Azimuths, c: usize) -> [Lanes; 2] {
        let [mut sin, mut cos] = [[0.0; ABREAST]; 2];
        let column = &image.columns[c];
        // As `RangeImage::azimuth_cdeg`; what it has to bring back into the turn is not in the table.
        let mut whole_cdeg = [0; ABREAST];
        for (whole_cdeg, turned_ns) in whole_cdeg.iter_mut().zip(self.turned_ns) {
            let azimuth = f64::from(column.azimuth_cdeg + column.azimuth_rate_cdeg_per_ns * turned_ns);
            *whole_cdeg = index(azimuth + 0.5_f64.copysign(azimuth));
        }
        for i in 0..self.beams {
            let tabled = azimuths.get(whole_cdeg[i]).filter(|_| self.whole_cdeg);
            (sin[i], cos[i]) = tabled.unwrap_or_else(|| image.head_sin_cos(azimuths, c, self.first + i));
        }
        [sin, cos]
    }

    /// The point of the `i`-th beam, as [`Beam::point_m`] has it.
    #[inline(always)]
    pub fn point_m(&self, [sin, cos]: &[Lanes; 2], i: usize, range_m: f64) -> DVec3 {
        let of = |[x, y, z]: &[Lanes; 3]| DVec3::new(x[i], y[i], z[i]);
        super::beam::turned((sin[i], cos[i]), of(&self.origin_m) + range_m * of(&self.direction))
    }
}
