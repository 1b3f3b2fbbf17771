//! Single reflections from the walls, the ceiling and the floor of a hall, by images: the truth's own, which the forecast does not
//! use.

use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::{Hall, Material, Reflections};

/// A wall, a ceiling or a floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    /// One of its corners.
    from_m: DVec3,
    normal: DVec3,
    /// From there to the next corner of a wall; of a level plane nothing, for it is as wide as the hall.
    wall_m: Option<DVec2>,
    height_m: f64,
    material: Material,
}

/// A way by a plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reflected {
    /// The access point's place behind the plane, as if it were a mirror.
    pub(crate) ap_image_m: DVec3,
    /// The device's.
    pub(crate) ue_image_m: DVec3,
    /// How much less is received than on the straight way in sight: the longer way, and what the plane swallows.
    pub(crate) loss_db: f64,
    meets_m: DVec3,
}

/// The planes of a hall that reflect.
pub(crate) fn planes(hall: &Hall, of: Reflections) -> Vec<Plane> {
    let height_m = hall.height_m;
    let level =
        |z: f64, material| Plane { from_m: DVec3::Z * z, normal: DVec3::Z, wall_m: None, height_m, material };
    let wall = |[from_m, to_m]: [DVec2; 2]| Plane {
        from_m: from_m.extend(0.0),
        normal: (to_m - from_m).normalize_or_zero().perp().extend(0.0),
        wall_m: Some(to_m - from_m),
        height_m,
        material: of.walls,
    };
    let levels = [level(0.0, of.floor), level(height_m, of.ceiling)];
    let all = hall.walls().map(wall).chain(levels);
    all.filter(|plane| plane.material != Material::None).collect()
}

/// The way from an access point to a device by a plane; `None` where there is none, or another wall hides it.
pub(crate) fn reflects(planes: &[Plane], by: usize, ap_m: DVec3, ue_m: DVec3) -> Option<Reflected> {
    let way = planes[by].reflects(ap_m, ue_m)?;
    let is_hidden = |(other, plane): (usize, &Plane)| {
        other != by && [ap_m, ue_m].iter().any(|end_m| plane.is_between(*end_m, way.meets_m))
    };
    (!planes.iter().enumerate().any(is_hidden)).then_some(way)
}

impl Plane {
    fn reflects(&self, ap_m: DVec3, ue_m: DVec3) -> Option<Reflected> {
        let off_m = |at: DVec3| self.normal.dot(at - self.from_m);
        let (ap_off_m, ue_off_m) = (off_m(ap_m), off_m(ue_m));
        if ap_off_m * ue_off_m <= 0.0 {
            return None;
        }
        let (ap_image_m, ue_image_m) =
            (ap_m - 2.0 * ap_off_m * self.normal, ue_m - 2.0 * ue_off_m * self.normal);
        let way_m = ue_image_m - ap_m;
        let meets_m = ap_m + way_m * (ap_off_m / (ap_off_m + ue_off_m));
        if !self.holds(meets_m) {
            return None;
        }
        let cos = (ap_off_m + ue_off_m).abs() / way_m.length();
        let longer_db = 20.0 * (way_m.length() / ap_m.distance(ue_m)).log10();
        let loss_db = longer_db + self.material.permittivity().map_or(0.0, |of| swallowed_db(of, cos));
        Some(Reflected { ap_image_m, ue_image_m, loss_db, meets_m })
    }

    /// Whether a place of the plane is on the wall.
    fn holds(&self, at_m: DVec3) -> bool {
        self.wall_m.is_none_or(|wall_m| {
            let along = wall_m.dot((at_m - self.from_m).truncate()) / wall_m.length_squared();
            (0.0..=1.0).contains(&along) && (0.0..=self.height_m).contains(&at_m.z)
        })
    }

    /// Whether the wall is between two places, of which one may be on another wall.
    fn is_between(&self, a_m: DVec3, b_m: DVec3) -> bool {
        let (a_off_m, b_off_m) = (self.normal.dot(a_m - self.from_m), self.normal.dot(b_m - self.from_m));
        let share = a_off_m / (a_off_m - b_off_m);
        a_off_m * b_off_m < -1e-9 && self.holds(a_m + (b_m - a_m) * share)
    }
}

/// What a plane takes from a wave, as the mean power of both polarisations: Fresnel's equations (ITU-R P.2040-3, eq. 31), by the
/// cosine of the angle to the plane's normal.
fn swallowed_db(permittivity: f64, cos: f64) -> f64 {
    let inside = (permittivity - (1.0 - cos * cos)).sqrt();
    let across = (cos - inside) / (cos + inside);
    let along = (permittivity * cos - inside) / (permittivity * cos + inside);
    -10.0 * (0.5 * (across * across + along * along)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    fn hall(outline_m: &[[f64; 2]]) -> Hall {
        Hall { outline_m: outline_m.to_vec(), height_m: 4.0, ..Config::default().site.hall }
    }

    #[test]
    fn a_wall_shows_an_image_and_takes_what_fresnel_says() {
        // The second wall is at x = 10.
        let planes = planes(
            &hall(&[[-10.0, -5.0], [10.0, -5.0], [10.0, 5.0], [-10.0, 5.0]]),
            Reflections { ceiling: Material::Metal, ..Reflections::default() },
        );
        let (ap_m, ue_m) = (DVec3::new(0.0, -1.0, 3.0), DVec3::new(4.0, 1.0, 1.0));
        let way = reflects(&planes, 1, ap_m, ue_m).unwrap();
        assert!(way.ap_image_m.distance(DVec3::new(20.0, -1.0, 3.0)) < 1e-12);
        assert!(way.ue_image_m.distance(DVec3::new(16.0, 1.0, 1.0)) < 1e-12);
        // Straight on, concrete reflects ((1 - n) / (1 + n))^2 with n^2 = 5.24: 8.14 dB; a way three times as long adds more.
        assert!((swallowed_db(5.24, 1.0) - 8.14).abs() < 0.01, "{}", swallowed_db(5.24, 1.0));
        assert!(swallowed_db(5.24, 0.05) < 2.0, "a grazing ray is hardly weakened");
        assert!((way.loss_db - 8.3 - 10.5).abs() < 0.5, "{}", way.loss_db);
        assert!(reflects(&planes, 1, ap_m, DVec3::new(4.0, 30.0, 1.0)).is_none(), "beside the wall");
        assert!(reflects(&planes, 1, ap_m, DVec3::new(12.0, 1.0, 1.0)).is_none(), "behind it");
        let ceiling = reflects(&planes, 5, ap_m, ue_m).unwrap();
        assert!(ceiling.ap_image_m.distance(DVec3::new(0.0, -1.0, 5.0)) < 1e-12);
        let longer_db = 20.0 * ((20.0_f64 + 16.0).sqrt() / (20.0_f64 + 4.0).sqrt()).log10();
        assert!((ceiling.loss_db - longer_db).abs() < 1e-12, "metal takes nothing: {}", ceiling.loss_db);
    }

    #[test]
    fn an_inner_wall_hides_the_way_by_another() {
        let outline_m = [[0.0, 0.0], [12.0, 0.0], [12.0, 3.0], [3.0, 3.0], [3.0, 12.0], [0.0, 12.0]];
        let planes = planes(&hall(&outline_m), Reflections::default());
        let (ap_m, ue_m) = (DVec3::new(10.0, 2.5, 2.0), DVec3::new(1.0, 10.0, 1.0));
        assert!(planes[5].reflects(ap_m, ue_m).is_some() && reflects(&planes, 5, ap_m, ue_m).is_none());
        assert!(reflects(&planes, 0, ap_m, DVec3::new(2.0, 2.0, 1.0)).is_some());
    }
}
