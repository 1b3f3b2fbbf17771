//! Whether anything in a column of a scan is new: nearly every one sees nothing but the hall.

use super::RangeModel;

impl RangeModel {
    /// The pixels at which a column's beams look: the first azimuth, hundredths of a degree, is that of row 0.
    #[inline(always)]
    pub fn pixels(&self, azimuths_cdeg: &[f32], pixels: &mut [u32]) {
        for (row, (pixel, azimuth_cdeg)) in (0_u32..).zip(pixels.iter_mut().zip(azimuths_cdeg)) {
            *pixel = self.bin(*azimuth_cdeg) * self.rows as u32 + row;
        }
    }

    /// The first pixels of the bins of a column whose beams look between two azimuths, where that is one bin, then named twice, or two
    /// neighbours, as with an HDL-32E.
    #[inline(always)]
    pub fn one_or_two_bins(&self, [least_cdeg, most_cdeg]: [f32; 2]) -> Option<[usize; 2]> {
        let [first, last] = [least_cdeg, most_cdeg].map(|azimuth_cdeg| self.bin(azimuth_cdeg) as usize);
        let are_neighbours = last == first || last == if first + 1 < self.bins { first + 1 } else { 0 };
        (are_neighbours && most_cdeg - least_cdeg < 18_000.0)
            .then(|| [first, last].map(|bin| bin * self.rows))
    }

    /// Whether a return of a column in those bins may be new: true wherever [`RangeModel::any_new`] is, and where a return would be new in
    /// the other bin. It does not ask which beam looks into which, and so runs in vector registers.
    #[inline(always)]
    pub fn may_be_new(&self, bins: [usize; 2], ranges_m: &[f32]) -> bool {
        // Without an index: its check would leave the last thirty-two beams of a column, which are all, to be asked one by one.
        let [limits_m, others_m] = bins.map(|first| self.limit_m[first..][..self.rows].iter());
        let is_new = |((&limit_m, &other_m), &range_m): ((&f32, &f32), &f32)| {
            let farther_m = if other_m > limit_m { other_m } else { limit_m };
            u32::from(!is_known(farther_m, range_m))
        };
        limits_m.zip(others_m).zip(ranges_m).map(is_new).fold(0, |any, new| any | new) != 0
    }

    /// Whether any return of a column is new, or is one that cannot be told, as NaN.
    #[inline(always)]
    pub fn any_new(&self, pixels: &[u32], ranges_m: &[f32]) -> bool {
        let known = |(&pixel, &range_m): (&u32, &f32)| is_known(self.limit_m(pixel as usize), range_m);
        !pixels.iter().zip(ranges_m).fold(true, |all, of| all & known(of))
    }
}

/// Whether a return is none or lies no nearer than its pixel's limit.
#[inline(always)]
fn is_known(limit_m: f32, range_m: f32) -> bool {
    (range_m == 0.0) | (range_m >= limit_m)
}
