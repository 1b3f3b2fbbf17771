//! What becomes of links in the second after the last step, as far as everybody's straight way tells: too little for a probability,
//! enough to choose between two access points that are both in sight until then.

use crate::blockage::lanes::{WORD, bits_of, word_of};
use crate::blockage::trajectories::{MOMENTS, Trajectories};
use crate::elementary::wide;
use crate::geometry::{DVec2, DVec3};

/// The last step, and one before, which tell the velocity.
const LAST: usize = MOMENTS - 1;
const BEFORE: usize = LAST - 3;
const BETWEEN: f64 = (LAST - BEFORE) as f64;
/// Instants that are looked at, so many steps apart: between two of them nobody crosses a path.
const INSTANTS: usize = 5;
const STEPS_APART: f64 = 2.0;
/// A path nearer to somebody's axis is blocked: half of what a trunk shows from any side.
const HALF_WIDTH_M: f64 = 0.2;

/// Everybody on their straight way.
#[derive(Debug, Clone, Default)]
pub(super) struct Beyond {
    people: Vec<Straight>,
}

/// One person's. Arrays are by sample, in single precision.
#[derive(Debug, Clone, Default)]
struct Straight {
    /// By instant: the mean, and how far samples are from it.
    mean_m: [DVec2; INSTANTS],
    radius_m: [f64; INSTANTS],
    /// From the mean at the last step, and by how much more in each step after.
    off_m: [Vec<f32>; 2],
    drift_m: [Vec<f32>; 2],
    /// Of the head and of the device.
    top_m: Vec<f32>,
    ue_m: Vec<f32>,
    highest_m: f64,
}

/// How many steps after the last one an instant is.
fn steps_on(instant: usize) -> f64 {
    (instant + 1) as f64 * STEPS_APART
}

impl Beyond {
    /// Takes everybody's samples of a frame; devices are at so much of their owners' heights.
    pub(super) fn take(&mut self, people: &[Trajectories], ue_share: f64) {
        self.people.resize(people.len(), Straight::default());
        for (straight, p) in self.people.iter_mut().zip(people) {
            straight.take(p, ue_share as f32);
        }
    }

    wide! {
        /// Notes, a bit a sample, whether somebody is between an access point and a person's device at one of the instants.
        pub(super) fn mark(&self, ap_m: DVec3, owner: usize, bits: &mut [u32]) = mark_avx2 or mark_portably
    }

    #[inline(always)]
    fn mark_portably(&self, ap_m: DVec3, owner: usize, bits: &mut [u32]) {
        let q = &self.people[owner];
        for instant in 0..INSTANTS {
            for (body, p) in self.people.iter().enumerate() {
                if body != owner && p.may_cut(q, ap_m, instant) {
                    p.cut(q, ap_m, instant, bits);
                }
            }
        }
    }
}

impl Straight {
    fn take(&mut self, p: &Trajectories, ue_share: f32) {
        let velocity_m = (p.mean_m[LAST] - p.mean_m[BEFORE]) / BETWEEN;
        self.mean_m = std::array::from_fn(|instant| p.mean_m[LAST] + steps_on(instant) * velocity_m);
        let [last_m, before_m] = [LAST, BEFORE].map(|step| p.spread[step].radius_m);
        let grows_m = (last_m - before_m).max(0.0) / BETWEEN;
        self.radius_m = std::array::from_fn(|instant| last_m + steps_on(instant) * grows_m);
        for (axis, (off_m, drift_m)) in self.off_m.iter_mut().zip(&mut self.drift_m).enumerate() {
            let [last, before] =
                [LAST, BEFORE].map(|step| &p.off_m[axis][step * p.samples..(step + 1) * p.samples]);
            off_m.clear();
            off_m.extend_from_slice(last);
            drift_m.clear();
            drift_m.extend(last.iter().zip(before).map(|(a, b)| (a - b) / BETWEEN as f32));
        }
        let floor_m = p.floor_m[LAST] as f32;
        self.top_m.clear();
        self.top_m.extend(p.height_m.iter().map(|height_m| height_m + floor_m));
        self.ue_m.clear();
        self.ue_m.extend(p.height_m.iter().map(|height_m| ue_share * height_m + floor_m));
        self.highest_m = p.floor_m[LAST] + p.heights_m[1];
    }

    /// Whether a sample of this body may be between an access point and a sample of `q` at an instant.
    fn may_cut(&self, q: &Self, ap_m: DVec3, instant: usize) -> bool {
        let way_m = q.mean_m[instant] - ap_m.truncate();
        let off_m = self.mean_m[instant] - ap_m.truncate();
        let length_m = way_m.length().max(1e-3);
        let along = way_m / length_m;
        let room_m = HALF_WIDTH_M + self.radius_m[instant] + q.radius_m[instant];
        let from_m = along.dot(off_m);
        // A path from above comes down to a head's height on its last part; one from below is never clear.
        let comes_down_m = ap_m.z - f64::from(q.ue_m.first().copied().unwrap_or_default());
        let above_m = (ap_m.z - self.highest_m).max(0.0);
        let clear_m = (above_m / comes_down_m.max(1e-3)).min(1.0) * length_m;
        along.perp_dot(off_m).abs() < room_m && from_m > clear_m - room_m && from_m < length_m + room_m
    }

    #[inline(always)]
    fn cut(&self, q: &Self, ap_m: DVec3, instant: usize, bits: &mut [u32]) {
        let on = steps_on(instant) as f32;
        let (ap_z, half_m) = (ap_m.z as f32, HALF_WIDTH_M as f32);
        let [body_m, aim_m] = [self, q].map(|of| {
            let base_m = of.mean_m[instant] - ap_m.truncate();
            [base_m.x as f32, base_m.y as f32]
        });
        for (word, bits) in bits.iter_mut().enumerate() {
            let [bx, by] = [0, 1].map(|axis| word_of(&self.off_m[axis], word));
            let [dx, dy] = [0, 1].map(|axis| word_of(&self.drift_m[axis], word));
            let [ax, ay] = [0, 1].map(|axis| word_of(&q.off_m[axis], word));
            let [ex, ey] = [0, 1].map(|axis| word_of(&q.drift_m[axis], word));
            let (tops_m, ues_m) = (word_of(&self.top_m, word), word_of(&q.ue_m, word));
            let mut inside = [0.0; WORD];
            for k in 0..WORD {
                let (x, y) = (body_m[0] + bx[k] + on * dx[k], body_m[1] + by[k] + on * dy[k]);
                let (to_x, to_y) = (aim_m[0] + ax[k] + on * ex[k], aim_m[1] + ay[k] + on * ey[k]);
                // Each of these is not negative where it holds, in units of its own: no division, and one root.
                let square = to_x * to_x + to_y * to_y;
                let (along, aside) = (to_x * x + to_y * y, to_y * x - to_x * y);
                let beside = half_m * square.sqrt() - aside.abs();
                let below = (tops_m[k] - ap_z) * square + (ap_z - ues_m[k]) * along;
                let between = if along < square - along { along } else { square - along };
                let least = if beside < below { beside } else { below };
                inside[k] = if least < between { least } else { between };
            }
            *bits |= bits_of(&inside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blockage::Caster;
    use crate::blockage::probability::Drawn;
    use crate::forecast::{Forecast, constant_velocity};
    use crate::radio::links::tests::somebody;
    use crate::{Config, STEP_S};

    /// The share of samples, in per cent, of which it is noted that somebody cuts the line between (14, 0) and somebody at (2, 0):
    /// he is on it so long after now.
    fn marked_from(ap_z: f64, cuts_after_s: f64, at_x_m: f64) -> u32 {
        let speed_mps = 1.5;
        let walks = somebody(0, DVec2::new(at_x_m, -speed_mps * cuts_after_s), DVec2::new(0.0, speed_mps));
        let stands = somebody(1, DVec2::new(2.0, 0.0), DVec2::ZERO);
        let tracks = [walks, stands];
        let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
        let config = Config::default();
        let mut caster = Caster::new(&config.blockage, &config.site);
        caster.cast(&tracks, &forecasts, &mut Vec::new());
        let Drawn { bodies, samples, .. } = caster.drawn().unwrap();
        let (mut beyond, mut bits) = (Beyond::default(), vec![0; samples / WORD]);
        beyond.take(bodies, config.site.ue.height_share);
        beyond.mark(DVec3::new(14.0, 0.0, ap_z), 1, &mut bits);
        bits.iter().map(|word| word.count_ones()).sum::<u32>() * 100 / samples as u32
    }

    fn marked(cuts_after_s: f64, at_x_m: f64) -> u32 {
        marked_from(2.0, cuts_after_s, at_x_m)
    }

    #[test]
    fn an_access_point_lower_than_the_device_is_cut_everywhere() {
        let then_s = LAST as f64 * STEP_S + 0.6;
        for ap_z in [0.5, 1.75 * Config::default().site.ue.height_share] {
            for at_x_m in [4.0, 8.0, 12.0] {
                let found = marked_from(ap_z, then_s, at_x_m);
                assert!(found > 80, "{ap_z} m, {at_x_m} m: {found} %");
            }
        }
    }

    #[test]
    fn who_comes_upon_the_line_after_the_last_step_cuts_it() {
        let last_s = LAST as f64 * STEP_S;
        assert!(marked(last_s + 0.6, 4.0) > 80, "{}", marked(last_s + 0.6, 4.0));
        assert_eq!(marked(last_s - 0.5, 4.0), 0, "he is over");
        assert_eq!(marked(last_s + 2.5, 4.0), 0, "he comes later");
        assert_eq!(marked(last_s + 0.6, 13.0), 0, "below the path");
        assert_eq!(marked(last_s + 0.6, 1.0), 0, "behind the device");
    }
}
