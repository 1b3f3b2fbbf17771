//! Single reflections from the walls of a hall, by images.

use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::Hall;

/// Relative permittivity of concrete from 1 to 100 GHz (ITU-R P.2040-3, table 3). Its conductivity changes the loss by less than
/// 0.1 dB.
const PERMITTIVITY: f64 = 5.24;

/// A wall from floor to ceiling.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    from_m: DVec2,
    along: DVec2,
    length_m: f64,
    height_m: f64,
}

/// A way by a wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reflected {
    /// The access point's place behind the wall, as if it were a mirror.
    pub(crate) ap_image_m: DVec3,
    /// The device's.
    pub(crate) ue_image_m: DVec3,
    /// How much less is received than on the straight way in sight: the longer way, and what the wall swallows.
    pub(crate) loss_db: f64,
}

impl Wall {
    /// The walls of a hall.
    pub(crate) fn of_hall(hall: &Hall) -> Vec<Self> {
        let wall = |[from_m, to_m]: [DVec2; 2]| Self {
            from_m,
            along: (to_m - from_m).normalize_or_zero(),
            length_m: from_m.distance(to_m),
            height_m: hall.height_m,
        };
        hall.walls().map(wall).collect()
    }

    /// The way from an access point to a device by this wall; `None` where there is none.
    pub(crate) fn reflects(&self, ap_m: DVec3, ue_m: DVec3) -> Option<Reflected> {
        let off_m = |at: DVec3| self.along.perp_dot(at.truncate() - self.from_m);
        let (ap_off_m, ue_off_m) = (off_m(ap_m), off_m(ue_m));
        if ap_off_m * ue_off_m <= 0.0 {
            return None;
        }
        let image_m = |at: DVec3, by_m: f64| at - 2.0 * by_m * self.along.perp().extend(0.0);
        let (ap_image_m, ue_image_m) = (image_m(ap_m, ap_off_m), image_m(ue_m, ue_off_m));
        let way_m = ue_image_m - ap_m;
        let meets_m = ap_m + way_m * (ap_off_m / (ap_off_m + ue_off_m));
        let place_m = self.along.dot(meets_m.truncate() - self.from_m);
        if !(0.0..=self.length_m).contains(&place_m) || !(0.0..=self.height_m).contains(&meets_m.z) {
            return None;
        }
        let cos = (ap_off_m + ue_off_m).abs() / way_m.length();
        let longer_db = 20.0 * (way_m.length() / ap_m.distance(ue_m)).log10();
        Some(Reflected { ap_image_m, ue_image_m, loss_db: longer_db + swallowed_db(cos) })
    }
}

/// What a wall takes from a wave, as the mean power of both polarisations: Fresnel's equations (ITU-R P.2040-3, eq. 31), by the
/// cosine of the angle to the wall's normal.
fn swallowed_db(cos: f64) -> f64 {
    let inside = (PERMITTIVITY - (1.0 - cos * cos)).sqrt();
    let across = (cos - inside) / (cos + inside);
    let along = (PERMITTIVITY * cos - inside) / (PERMITTIVITY * cos + inside);
    -10.0 * (0.5 * (across * across + along * along)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_shows_an_image_and_takes_what_fresnel_says() {
        let (from_m, along) = (DVec2::new(10.0, -5.0), DVec2::Y);
        let wall = Wall { from_m, along, length_m: 10.0, height_m: 4.0 };
        let (ap_m, ue_m) = (DVec3::new(0.0, -1.0, 3.0), DVec3::new(4.0, 1.0, 1.0));
        let way = wall.reflects(ap_m, ue_m).unwrap();
        assert!(way.ap_image_m.distance(DVec3::new(20.0, -1.0, 3.0)) < 1e-12);
        assert!(way.ue_image_m.distance(DVec3::new(16.0, 1.0, 1.0)) < 1e-12);
        // Straight on, concrete reflects ((1 - n) / (1 + n))^2 with n^2 = 5.24: 8.14 dB; a way three times as long adds more.
        assert!((swallowed_db(1.0) - 8.14).abs() < 0.01, "{}", swallowed_db(1.0));
        assert!(swallowed_db(0.05) < 2.0, "a grazing ray is hardly weakened");
        assert!((way.loss_db - 8.3 - 10.5).abs() < 0.5, "{}", way.loss_db);
        assert!(wall.reflects(ap_m, DVec3::new(4.0, 30.0, 1.0)).is_none(), "beside the wall");
        assert!(wall.reflects(ap_m, DVec3::new(12.0, 1.0, 1.0)).is_none(), "behind it");
    }
}
