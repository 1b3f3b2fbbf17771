//! The straight pieces that ways consist of: one of a straight way, two of one by a reflection.

use super::body::Wave;
use super::reflection::{Mirror, Mirrors};
use crate::blockage::trajectories::{Disc, MOMENTS, Trajectories};
use crate::geometry::{DVec2, DVec3};
use crate::site::Ue;

/// Those of every straight way, access points first; then two of each way by a reflection.
#[derive(Debug, Clone, Default)]
pub(super) struct Legs {
    pub(super) legs: Vec<Leg>,
    pub(super) reflected: Vec<Reflected>,
}

impl Legs {
    /// Lays them to everybody's device.
    pub(super) fn lay(
        &mut self,
        antennas: &[Option<Antenna>],
        mirrors: Option<&Mirrors>,
        ue: &Ue,
        people: &[Trajectories],
    ) {
        self.legs.clear();
        self.reflected.clear();
        let with_radio = || antennas.iter().enumerate().filter_map(|(ap, of)| Some((ap, of.as_ref()?)));
        for (access_point, antenna) in with_radio() {
            let start_m = antenna.place_m;
            let leg = |owner| Leg { access_point, owner, start_m, mirror: None, ends_at_image: false };
            self.legs.extend((0..people.len()).map(leg));
        }
        let Some(mirrors) = mirrors else { return };
        for (access_point, antenna) in with_radio() {
            for (owner, q) in people.iter().enumerate() {
                let height_m = 0.5 * (q.heights_m[0] + q.heights_m[1]);
                let ue_m = |step: usize| q.mean_m[step].extend(ue.height_share * height_m + q.floor_m[step]);
                let start_m = antenna.place_m;
                for mirror in mirrors.within(start_m, ue_m(0), antenna.margin_db) {
                    let excess_db =
                        std::array::from_fn(|step| mirrors.excess_db(&mirror, start_m, ue_m(step)));
                    let image_m = mirror.image_m(start_m);
                    self.reflected.push(Reflected { access_point, owner, excess_db });
                    let mirror = Some(mirror);
                    let leg = Leg { access_point, owner, start_m, mirror, ends_at_image: true };
                    self.legs.push(Leg { start_m: image_m, ends_at_image: false, ..leg });
                    self.legs.push(leg);
                }
            }
        }
    }

    /// How many straight ways there are.
    pub(super) fn straight(&self) -> usize {
        self.legs.len() - 2 * self.reflected.len()
    }
}

/// An access point with a radio.
#[derive(Debug, Clone)]
pub(super) struct Antenna {
    pub(super) place_m: DVec3,
    pub(super) wave: Wave,
    pub(super) margin_db: f64,
    pub(super) spreads: bool,
}

/// A straight line from an access point, or its image, to a device, or its image. Who is before the mirror and meets a line to an
/// image meets the real piece of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub(super) access_point: usize,
    pub(super) owner: usize,
    pub(super) start_m: DVec3,
    /// Of a way by a reflection: what reflects. What of such a line is below the floor is not there.
    pub(super) mirror: Option<Mirror>,
    pub(super) ends_at_image: bool,
}

/// A way by a reflection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reflected {
    pub(super) access_point: usize,
    pub(super) owner: usize,
    /// By step: what it loses without anybody, beside the straight way.
    pub(super) excess_db: [f64; MOMENTS],
}

impl Leg {
    /// Where it ends on the floor's plan, if the device is there.
    pub(super) fn end_m(&self, ue_m: DVec2) -> DVec2 {
        self.image().map_or(ue_m, |mirror| mirror.image_m(ue_m.extend(0.0)).truncate())
    }

    /// The least height at which it ends, if the device is between these.
    pub(super) fn lowest_end_m(&self, heights_m: [f64; 2]) -> f64 {
        let of_m = |height_m: f64| self.image().map_or(height_m, |of| of.image_m(DVec3::Z * height_m).z);
        of_m(heights_m[0]).min(of_m(heights_m[1]))
    }

    fn image(&self) -> Option<Mirror> {
        self.mirror.filter(|_| self.ends_at_image)
    }
}

impl Antenna {
    /// Whether a body within one disc, so wide and so high, may cost a path from a place to another disc something. Errs on the side
    /// of asking the samples: [`Wave::is_clear`] of none that is left out would be false.
    pub(super) fn meets(
        &self,
        from_m: DVec3,
        aim: Disc,
        aim_z: f64,
        body: Disc,
        half_m: f64,
        top_m: f64,
    ) -> bool {
        let start_m: DVec2 = from_m.truncate();
        let way_m = aim.center_m - start_m;
        let length_m = way_m.length().max(1e-9);
        let (along, off_m) = (way_m / length_m, body.center_m - start_m);
        let (from_start_m, aside_m) = (along.dot(off_m), along.perp_dot(off_m).abs());
        // The way to a sample of the aim turns by as much as this, and takes the body's place along it with it.
        let turn = aim.radius_m / length_m;
        let along_m = body.radius_m + turn * aside_m + turn * turn * off_m.length();
        let longest_m = length_m + aim.radius_m;
        let [near_m, far_m] = [from_start_m - along_m, from_start_m + along_m];
        if far_m < 0.0 || near_m > longest_m {
            return false;
        }
        // Where the zone is widest between the two.
        let widest_m = (0.5 * longest_m).max(near_m).min(far_m).clamp(0.0, longest_m);
        let zone_m = self.wave.zone_m(widest_m, longest_m);
        if aside_m > body.radius_m + half_m + zone_m + turn * from_start_m.abs() {
            return false;
        }
        let far = (far_m / (length_m - aim.radius_m).max(1e-9)).clamp(0.0, 1.0);
        let near = (near_m / longest_m).clamp(0.0, 1.0);
        let rises_m = aim_z - from_m.z;
        let lowest_m = from_m.z + (rises_m * far).min(rises_m * near);
        lowest_m <= top_m + zone_m
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::site::Radio;

    #[test]
    fn no_body_is_left_out_that_is_in_the_way_of_a_sample() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let antenna = Antenna {
            place_m: DVec3::ZERO,
            wave: Wave::new(&Radio::default(), 40.0),
            margin_db: 10.0,
            spreads: false,
        };
        let (mut left_out, mut missed) = (0, 0);
        for _ in 0..200_000 {
            let mut part = |from: f64, to: f64| rng.random_range(from..to);
            let disc = |x: f64, y: f64, radius_m: f64| Disc { center_m: DVec2::new(x, y), radius_m };
            let aim_m = part(1.0, 25.0);
            let aim = disc(aim_m, 0.0, part(0.0, 0.25 * aim_m.min(6.0)));
            let body = disc(part(-1.0, aim_m + 1.0), part(-3.0, 3.0), part(0.0, 1.0));
            let scale = part(0.8, 1.3) as f32;
            let in_disc =
                |of: Disc, turn: f64, share: f64| of.center_m + share * of.radius_m * DVec2::from_angle(turn);
            let (end_m, foot_m) =
                (in_disc(aim, part(0.0, 6.3), part(0.0, 1.0)), in_disc(body, part(0.0, 6.3), part(0.0, 1.0)));
            let half_m = f64::from(Wave::half_m(scale));
            if antenna.meets(DVec3::Z, aim, 1.0, body, half_m, 2.0) {
                continue;
            }
            left_out += 1;
            let (length_m, to) = (end_m.length(), end_m.normalize());
            let from_tx_m = to.dot(foot_m);
            let aside_m = to.perp_dot(foot_m) as f32;
            let is_clear =
                antenna.wave.is_clear(scale, aside_m, from_tx_m as f32, (length_m - from_tx_m) as f32);
            missed += usize::from(!is_clear);
        }
        assert!(left_out > 20_000 && missed == 0, "{missed} of {left_out}");
    }
}
