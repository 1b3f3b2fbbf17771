//! What came after the empty scan and stays. Nobody appears out of nothing: people walk in, or come out from behind something. What
//! appears where the hall was seen a moment before, with nobody on the way, is an object, whatever its shape, and so is what has been
//! at the same range for long where no person is known.

use super::stays::{Near, Stay};
use super::{EDGE_M, RangeModel};

/// What came so many revolutions ago stays. Out of nothing it may be the first that is seen of somebody who walks on;
const STAYS_REVOLUTIONS: u32 = 10;
/// beside somebody, or where it may have been hidden, nobody walks so slowly that one pixel sees him for so long.
const STAYS_BESIDE_REVOLUTIONS: u32 = 40;
/// What was not seen in so many revolutions, though nothing was before it, is gone.
const GONE_REVOLUTIONS: u32 = 4;

impl RangeModel {
    /// From the next revolution on it is not known what came in between.
    pub fn was_blind(&mut self) {
        self.stays.blind = self.count;
    }

    /// A new return. True where it is an object's. Who is `near` is asked only where it matters.
    pub fn stays(&mut self, pixel: usize, range_m: f32, near: &dyn Fn() -> Near) -> bool {
        let (count, margin_m) = (self.count, self.margin_m);
        let blind = self.stays.blind;
        let stays = &mut self.stays.of_pixel[pixel];
        let (mut own, mut was_hidden) = (None, count.wrapping_sub(blind) <= GONE_REVOLUTIONS);
        for (k, stay) in stays.iter_mut().enumerate().filter(|(_, stay)| stay.range_m != 0.0) {
            let off_m = range_m - stay.range_m;
            if count.wrapping_sub(stay.last) > GONE_REVOLUTIONS {
                *stay = Stay::default();
            } else if off_m > margin_m {
                // An edge comes back now from before and now from behind.
                was_hidden = true;
            } else {
                stay.last = count;
                if off_m >= -margin_m && own.is_none() {
                    own = Some(k);
                }
            }
        }
        let Some(k) = own else {
            // It takes the place of none, or of the nearer: who passes by is not what is behind.
            let [first, second] = stays.map(|stay| stay.range_m);
            let k = usize::from(first != 0.0 && (second == 0.0 || second < first));
            let came = near();
            let came = if was_hidden && came == Near::Nobody { Near::Unsure } else { came };
            stays[k] = Stay { range_m, since: count, last: count, came };
            return false;
        };
        let stay = &mut self.stays.of_pixel[pixel][k];
        let since = count.wrapping_sub(stay.since);
        if stay.came == Near::Nobody {
            return since >= STAYS_REVOLUTIONS;
        }
        if since < STAYS_BESIDE_REVOLUTIONS {
            return false;
        }
        match (stay.came, near()) {
            // Whoever may have stood there is gone, and who walked there since does not stay.
            (Near::Unsure, Near::Nobody | Near::Walker) => true,
            // Whoever brought it has left it there.
            (Near::Walker | Near::Both, Near::Nobody) => {
                (stay.came, stay.since) = (Near::Unsure, count);
                false
            }
            _ => self.is_rim(pixel, range_m),
        }
    }

    /// Whether an object that came out of nothing, and is background by now, goes on there. What is learned by this does not go on
    /// itself, so that of who leans on it no more than a rim is learned.
    fn is_rim(&self, pixel: usize, range_m: f32) -> bool {
        let (bin, row) = (pixel / self.rows, pixel % self.rows);
        let goes_on = |off: usize| {
            let beside = (bin + off) % self.bins * self.rows + row;
            let same = |stay: &Stay| {
                stay.range_m != 0.0 && stay.came == Near::Nobody && (stay.range_m - range_m).abs() < EDGE_M
            };
            self.furniture[beside] > 0 && self.stays.of_pixel[beside].iter().any(same)
        };
        [1, 2, self.bins - 1, self.bins - 2].into_iter().any(goes_on)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the last of these returns of one pixel, a revolution each and 0 where there is none, is taken for an object's.
    fn stays(ranges_m: &[f32], near: impl Fn(usize) -> Near) -> bool {
        let mut model = RangeModel::new(1.0);
        model.grow(1);
        model.count = 100;
        let mut last = false;
        for (k, &range_m) in ranges_m.iter().enumerate() {
            last = range_m > 0.0 && model.stays(0, range_m, &|| near(k));
            model.close_known_revolution();
        }
        last
    }

    #[test]
    fn what_comes_out_of_nothing_and_stays_is_an_object_whoever_is_taken_to_stand_there_later() {
        for later in [Near::Nobody, Near::Unsure, Near::Walker] {
            let near = |k| if k == 0 { Near::Nobody } else { later };
            assert_eq!([5, 12].map(|n| stays(&vec![9.0; n], near)), [false, true], "{later:?}");
        }
    }

    #[test]
    fn who_came_walking_or_was_there_from_the_start_is_nobodys_object() {
        assert!(!stays(&[9.0; 3000], |_| Near::Walker));
        assert!(!stays(&[9.0; 3000], |_| Near::Unsure));
        assert!(stays(&[9.0; 100], |k| if k < 20 { Near::Walker } else { Near::Nobody }), "carried there");
    }

    /// Four stood in the hall from the first frame on. Each was learned as furniture once somebody had passed within his reach.
    #[test]
    fn who_stands_while_somebody_walks_past_is_nobodys_object() {
        let passes = |k| if k % 60 < 50 { Near::Unsure } else { Near::Both };
        assert!(!stays(&[9.0; 3000], passes));
        let slid_onto_it = |k| if k < 50 { Near::Unsure } else { Near::Walker };
        assert!(stays(&[9.0; 100], slid_onto_it), "the one who is near is elsewhere");
    }

    #[test]
    fn who_was_hidden_is_not_out_of_nothing_and_who_passes_by_hides_nothing_for_good() {
        let near = |k| if k < 4 { Near::Nobody } else { Near::Unsure };
        assert!(!stays(&[&[7.0; 4][..], &[9.0; 100]].concat(), near), "behind a lorry that drove away");
        assert!(stays(&[&[9.0; 4][..], &[7.0; 4], &[9.0; 4]].concat(), near), "a table behind a walker");
        assert!(!stays(&[&[9.0; 4][..], &[0.0; 6], &[9.0; 4]].concat(), near), "it went");
    }
}
