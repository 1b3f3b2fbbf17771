//! Ways by a single reflection: from a wall, the ceiling or the floor, by images.

use crate::geometry::{DVec2, DVec3};
use crate::site::{Hall, Material, Reflections};

/// What a beam is pointed at in place of the device.
///
/// ```
/// use umbracast::radio::Surface;
///
/// assert_eq!(Surface::Wall(2).to_string(), "wall-2");
/// assert_eq!("wall-2".parse(), Ok(Surface::Wall(2)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Surface {
    /// At height 0.
    Floor,
    /// At the hall's height.
    Ceiling,
    /// The wall from this corner of the hall to the next, corners counted from 0 ([`Hall::walls`]).
    Wall(u32),
}

impl std::fmt::Display for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Floor => f.pad("floor"),
            Self::Ceiling => f.pad("ceiling"),
            Self::Wall(corner) => write!(f, "wall-{corner}"),
        }
    }
}

impl std::str::FromStr for Surface {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        match name {
            "floor" => Ok(Self::Floor),
            "ceiling" => Ok(Self::Ceiling),
            _ => Ok(Self::Wall(name.strip_prefix("wall-").and_then(|corner| corner.parse().ok()).ok_or(())?)),
        }
    }
}

/// A way between two places by a single reflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflection {
    /// What reflects.
    pub surface: Surface,
    /// How long the way is.
    pub length_m: f64,
    /// How much less is received than on the straight way in sight: the way is longer, and the surface takes its share.
    pub excess_db: f64,
}

/// Every such way between two places of a hall without people.
///
/// ```
/// use umbracast::{Config, geometry::DVec3, radio::reflections, site::Reflections};
///
/// let hall = Config::default().site.hall;
/// let ways = reflections(&hall, Reflections::default(), DVec3::new(-5.0, 0.0, 3.0), DVec3::new(3.0, 0.0, 1.0));
/// // Floor, ceiling, and four walls.
/// assert_eq!(ways.len(), 6);
/// assert!((ways[0].length_m - 80.0_f64.sqrt()).abs() < 1e-12);
/// ```
pub fn reflections(hall: &Hall, of: Reflections, from_m: DVec3, to_m: DVec3) -> Vec<Reflection> {
    let mirrors = Mirrors::new(hall, of);
    let way = |mirror: &Mirror| Reflection {
        surface: mirror.surface,
        length_m: mirror.image_m(to_m).distance(from_m),
        excess_db: mirrors.excess_db(mirror, from_m, to_m),
    };
    mirrors.mirrors.iter().map(way).filter(|way| way.excess_db.is_finite()).collect()
}

/// A plane as a mirror, and what it is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mirror {
    pub(super) surface: Surface,
    pub(super) normal: DVec3,
    /// How far along the normal from the origin.
    pub(super) offset_m: f64,
    material: Material,
}

/// Everything in a hall that reflects.
#[derive(Debug, Clone)]
pub(super) struct Mirrors {
    mirrors: Vec<Mirror>,
    walls: Vec<[DVec2; 2]>,
    height_m: f64,
}

impl Mirrors {
    /// Of a hall whose surfaces are made so.
    pub(super) fn new(hall: &Hall, of: Reflections) -> Self {
        let walls: Vec<[DVec2; 2]> = hall.walls().collect();
        let level = |surface, offset_m, material| Mirror { surface, normal: DVec3::Z, offset_m, material };
        let levels =
            [level(Surface::Floor, 0.0, of.floor), level(Surface::Ceiling, hall.height_m, of.ceiling)];
        let upright = |(corner, &[from_m, to_m]): (usize, &[DVec2; 2])| {
            let normal = (to_m - from_m).normalize_or_zero().perp();
            Mirror {
                surface: Surface::Wall(corner as u32),
                normal: normal.extend(0.0),
                offset_m: normal.dot(from_m),
                material: of.walls,
            }
        };
        let uprights = walls.iter().enumerate().map(upright);
        let mirrors = levels.into_iter().chain(uprights).filter(|mirror| mirror.material != Material::None);
        Self { mirrors: mirrors.collect(), height_m: hall.height_m, walls }
    }

    /// The mirrors over which the way between both places loses less than `margin_db`, the strongest first.
    pub(super) fn within(&self, ap_m: DVec3, ue_m: DVec3, margin_db: f64) -> impl Iterator<Item = Mirror> {
        let excess_db = |mirror: &Mirror| (self.excess_db(mirror, ap_m, ue_m), *mirror);
        let mut within: Vec<_> =
            self.mirrors.iter().map(excess_db).filter(|(excess_db, _)| *excess_db < margin_db).collect();
        within.sort_by(|a, b| a.0.total_cmp(&b.0));
        within.into_iter().map(|(_, mirror)| mirror)
    }

    /// How much less is received by a mirror than on the straight way in sight: the way is longer, and the surface takes its share.
    /// Infinite where there is no such way.
    pub(super) fn excess_db(&self, mirror: &Mirror, ap_m: DVec3, ue_m: DVec3) -> f64 {
        let (ap_off_m, ue_off_m) = (mirror.off_m(ap_m), mirror.off_m(ue_m));
        if ap_off_m * ue_off_m <= 0.0 {
            return f64::INFINITY;
        }
        let way_m = mirror.image_m(ue_m) - ap_m;
        let meets_m = ap_m + way_m * (ap_off_m / (ap_off_m + ue_off_m));
        if !self.is_met(mirror.surface, meets_m, [ap_m, ue_m]) {
            return f64::INFINITY;
        }
        let cos = (ap_off_m + ue_off_m).abs() / way_m.length();
        let longer_db = 20.0 * (way_m.length() / ap_m.distance(ue_m).max(1e-3)).log10();
        longer_db + mirror.material.swallowed_db(cos)
    }

    /// Whether a place of a plane belongs to the surface, and no other wall hides it from both ends. Floor and ceiling are as wide
    /// as the hall.
    fn is_met(&self, surface: Surface, at_m: DVec3, ends_m: [DVec3; 2]) -> bool {
        let Surface::Wall(corner) = surface else {
            return !self.walls.iter().any(|wall| cross(*wall, ends_m.map(|end_m| end_m.truncate())));
        };
        let [from_m, to_m] = self.walls[corner as usize];
        let (along_m, off_m) = (to_m - from_m, at_m.truncate() - from_m);
        let others = || self.walls.iter().enumerate().filter(|(other, _)| *other != corner as usize);
        (0.0..=along_m.length_squared()).contains(&along_m.dot(off_m))
            && (0.0..=self.height_m).contains(&at_m.z)
            && !others()
                .any(|(_, wall)| ends_m.iter().any(|end_m| cross(*wall, [end_m.truncate(), at_m.truncate()])))
    }
}

impl Mirror {
    /// How far a place is before it, along its normal.
    pub(super) fn off_m(&self, at_m: DVec3) -> f64 {
        self.normal.dot(at_m) - self.offset_m
    }

    /// Whether it is an upright plane between two places of the floor.
    pub(super) fn parts(&self, a_m: DVec2, b_m: DVec2) -> bool {
        self.normal.z == 0.0 && self.off_m(a_m.extend(0.0)) * self.off_m(b_m.extend(0.0)) < 0.0
    }

    /// The place behind it that looks as if it were this one.
    pub(super) fn image_m(&self, at_m: DVec3) -> DVec3 {
        at_m - 2.0 * self.off_m(at_m) * self.normal
    }
}

/// Whether two pieces of straight lines cross; one that ends on the other does not.
fn cross([a_m, b_m]: [DVec2; 2], [c_m, d_m]: [DVec2; 2]) -> bool {
    let side = |from_m: DVec2, to_m: DVec2, at_m: DVec2| (to_m - from_m).perp_dot(at_m - from_m);
    side(a_m, b_m, c_m) * side(a_m, b_m, d_m) < -1e-9 && side(c_m, d_m, a_m) * side(c_m, d_m, b_m) < -1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    fn hall(outline_m: &[[f64; 2]], height_m: f64) -> Hall {
        Hall { outline_m: outline_m.to_vec(), height_m, ..Config::default().site.hall }
    }

    #[test]
    fn a_ceiling_of_metal_is_the_best_mirror_and_one_that_swallows_all_is_none() {
        let hall = hall(&[], 4.0);
        let (ap_m, ue_m) = (DVec3::new(0.0, 0.0, 2.5), DVec3::new(8.0, 0.0, 1.0));
        let of = |ceiling| {
            Mirrors::new(&hall, Reflections { ceiling, floor: Material::None, ..Default::default() })
        };
        let of_metal = of(Material::Metal);
        let best = of_metal.within(ap_m, ue_m, 10.0).next().unwrap();
        assert_eq!((best.surface, of_metal.within(ap_m, ue_m, 10.0).count()), (Surface::Ceiling, 1));
        assert!(best.image_m(ue_m).distance(DVec3::new(8.0, 0.0, 7.0)) < 1e-12);
        // 1.5 m + 3 m up and down over 8 m, beside 8.14 m straight on.
        let longer_db = 20.0 * (8.0_f64.hypot(4.5) / 8.0_f64.hypot(1.5)).log10();
        assert!((of(Material::Metal).excess_db(&best, ap_m, ue_m) - longer_db).abs() < 1e-9);
        assert!(of(Material::None).within(ap_m, ue_m, 10.0).next().is_none(), "walls are 17 m away");
    }

    #[test]
    fn an_inner_wall_hides_a_mirror() {
        // An L; both are in one arm, the mirror at the far end of the other.
        let outline_m = [[0.0, 0.0], [12.0, 0.0], [12.0, 3.0], [3.0, 3.0], [3.0, 12.0], [0.0, 12.0]];
        let mirrors = Mirrors::new(&hall(&outline_m, 3.0), Reflections::default());
        let excess_db = |corner: u32, ap_m: [f64; 2], ue_m: [f64; 2]| {
            let mirror =
                mirrors.mirrors.iter().find(|mirror| mirror.surface == Surface::Wall(corner)).unwrap();
            let at_m = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.5);
            mirrors.excess_db(mirror, at_m(ap_m), at_m(ue_m))
        };
        assert!(excess_db(0, [4.0, 2.0], [10.0, 2.0]) < 15.0, "by the long wall below");
        assert!(excess_db(5, [10.0, 2.5], [1.0, 10.0]).is_infinite(), "the inner corner is in the way");
        assert!(excess_db(5, [1.0, 2.0], [2.0, 10.0]) < 15.0);
        assert!(excess_db(2, [4.0, 2.0], [10.0, -2.0]).is_infinite(), "behind it");
    }
}
