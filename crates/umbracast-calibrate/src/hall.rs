//! The upright surfaces of a site in plan view, and the surface that a point belongs to.

use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};

/// Lower points are the floor's and its skirting's.
const LOWEST_M: f64 = 0.3;
/// Higher ones are the ceiling's and what hangs from it.
const BELOW_CEILING_M: f64 = 0.3;

/// One surface.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Surface {
    /// From end to end, up to a height.
    Wall { ends_m: [DVec2; 2], top_m: f64 },
    /// A pillar's.
    Round { middle_m: DVec2, radius_m: f64 },
}

/// Where a point lies against the surface that is nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foot {
    /// Which surface.
    pub surface: usize,
    /// From the surface to the point, along `normal`, metres.
    pub off_m: f64,
    /// Unit vector, level.
    pub normal: DVec2,
}

/// Walls, pillars and furniture.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// The hall's walls first. None of what is left out; the others keep their numbers.
    surfaces: Vec<Option<Surface>>,
    walls: usize,
    ceiling_m: f64,
}

impl Outline {
    /// Of a site.
    pub fn new(site: &Site) -> Self {
        let hall = &site.hall;
        let wall = |ends_m| Surface::Wall { ends_m, top_m: hall.height_m };
        let mut surfaces: Vec<Surface> = hall.walls().map(wall).collect();
        let walls = surfaces.len();
        for item in &site.furniture {
            let (corners, top_m) = (item.corners(), item.size_m[2]);
            let side = |i: usize| Surface::Wall { ends_m: [corners[i], corners[(i + 1) % 4]], top_m };
            surfaces.extend((0..4).map(side));
        }
        let pillar = |p: &umbracast::site::Pillar| Surface::Round {
            middle_m: DVec2::from_array(p.position_m),
            radius_m: p.radius_m,
        };
        surfaces.extend(site.pillars.iter().map(pillar));
        Self { surfaces: surfaces.into_iter().map(Some).collect(), walls, ceiling_m: hall.height_m }
    }

    /// How many surfaces there are.
    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// How many of them, the first, are the hall's walls.
    pub fn walls(&self) -> usize {
        self.walls
    }

    /// The ends of a wall.
    pub fn wall(&self, wall: usize) -> Option<[DVec2; 2]> {
        match self.surfaces.get(wall).copied().flatten() {
            Some(Surface::Wall { ends_m, .. }) => Some(ends_m),
            _ => None,
        }
    }

    /// The same where nothing is known of these surfaces.
    pub fn without(&self, surfaces: &[usize]) -> Self {
        let mut rest = self.clone();
        surfaces.iter().for_each(|&surface| rest.surfaces[surface] = None);
        rest
    }

    /// True for what may be of an upright surface; `z_m` above the floor.
    pub fn may_be_upright(&self, z_m: f64) -> bool {
        z_m > LOWEST_M && z_m < self.ceiling_m - BELOW_CEILING_M
    }

    /// The nearest surface of a point in the site's frame.
    pub fn foot(&self, point_m: DVec3) -> Option<Foot> {
        let p = point_m.truncate();
        let of = |(surface, kind): (usize, &Option<Surface>)| {
            let (off, across) = match (*kind)? {
                Surface::Wall { top_m, .. } if point_m.z > top_m + 0.1 => return None,
                Surface::Wall { ends_m: [from, to], .. } => {
                    let along = (to - from).normalize_or_zero();
                    let reach = (p - from).dot(along).clamp(0.0, from.distance(to));
                    (p - (from + along * reach), along.perp())
                }
                Surface::Round { middle_m, radius_m } => {
                    let away = (p - middle_m).normalize_or(DVec2::X);
                    (p - middle_m - away * radius_m, away)
                }
            };
            let off_m = off.dot(across);
            Some((off.length_squared(), Foot { surface, off_m, normal: across }))
        };
        let all = self.surfaces.iter().enumerate().filter_map(of);
        all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, foot)| foot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    #[test]
    fn a_point_is_of_the_nearest_surface() {
        let outline = Outline::new(&Config::default().site);
        let foot = outline.foot(DVec3::new(16.8, 3.0, 4.0)).unwrap();
        assert!((foot.off_m.abs() - 0.2).abs() < 1e-12 && foot.normal.x.abs() > 1.0 - 1e-12, "{foot:?}");
        // A pillar of 0.35 m about (11.5, 11.5).
        let foot = outline.foot(DVec3::new(11.5, 11.0, 2.0)).unwrap();
        assert!((foot.off_m - 0.15).abs() < 1e-12 && (foot.normal + DVec2::Y).length() < 1e-12, "{foot:?}");
        // Above the counter nothing but the wall behind is left.
        let at = |z: f64| outline.foot(DVec3::new(0.0, 15.5, z)).unwrap().off_m.abs();
        assert!((at(1.0) - 0.1).abs() < 1e-9 && (at(1.5) - 1.5).abs() < 1e-9, "{} {}", at(1.0), at(1.5));
    }
}
