//! Glass and mirrors: which beams pass through, which are reflected, and which return from the pane itself.
//!
//! A sensor reports the strongest return (Koch, May, Nuechter 2017, "Detection and purging of specular reflective and
//! transparent object influences in 3D range measurements": the object, what is behind it, or a reflected one). A
//! reflected return has met the pane twice. The share that a sheet reflects follows Fresnel's formula for a
//! refractive index of 1.5, unpolarised, both faces.

use umbracast::geometry::{DMat3, DVec3, Pose};
use umbracast::site::{Pane, Surface};

/// Refractive index of window glass.
const INDEX: f64 = 1.5;
/// A beam nearer to the perpendicular comes straight back from a pane: half the divergence of a beam and of a receiver,
/// and what a pane is out of plane. Assumed: 3.6 degrees.
const GLINT_COS: f64 = 0.998;
/// Share of a sheet's spots that are dirty enough to be seen, and their size; assumed.
const DIRTY: u64 = 10;
const SPOT_M: f64 = 0.05;
/// A pane this near to a surface is on it.
const ON_M: f64 = 0.02;
/// At this range a sensor just sees a surface of 10 % (the limit of the default site's sensors).
const SEES_TENTH_M: f64 = 50.0;
/// Of what is reflected: clothes, percent.
const REFLECTED: f64 = 20.0;

/// What a beam does at a pane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Meets {
    /// It comes back.
    Pane,
    /// It goes on.
    Through,
    /// It shows what stands before the pane, along a way of this length at most.
    Reflection { reach_m: f64 },
}

/// Of one pixel: the pane that shows a reflection in it. None: [`Mirrored::NONE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirrored {
    /// Number of the pane, from 1 on.
    pub pane: u8,
    /// Its range.
    pub at_m: f32,
    /// Longest way that a sensor sees along.
    pub reach_m: f32,
}

impl Mirrored {
    /// Nothing is reflected here.
    pub const NONE: Self = Self { pane: 0, at_m: f32::INFINITY, reach_m: 0.0 };
}

/// All panes of a hall.
#[derive(Debug)]
pub struct Panes {
    panes: Vec<Flat>,
}

#[derive(Debug)]
struct Flat {
    from_m: DVec3,
    /// Along its lower edge, of length 1.
    along: DVec3,
    normal: DVec3,
    length_m: f64,
    height_m: f64,
    surface: Surface,
}

/// Where a ray meets the first pane.
#[derive(Debug, Clone, Copy)]
pub struct Met {
    /// Number of the pane, from 1 on.
    pub pane: u8,
    /// How far.
    pub range_m: f64,
    /// The ray afterwards, if it is thrown back.
    pub reflected: DVec3,
    surface: Surface,
    cos: f64,
    is_dirty: bool,
}

impl Panes {
    /// Those of a site; beyond 255 they are not there.
    pub fn new(panes: &[Pane]) -> Self {
        Self { panes: panes.iter().take(usize::from(u8::MAX)).map(Flat::new).collect() }
    }

    /// Without any, nothing is to be done.
    pub fn is_empty(&self) -> bool {
        self.panes.is_empty()
    }

    /// Each pane's reflection, as a motion of the site.
    pub fn reflections(&self) -> impl Iterator<Item = Pose> {
        self.panes.iter().map(|pane| {
            let n = pane.normal;
            let rotation = DMat3::IDENTITY - 2.0 * DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            Pose { rotation, translation_m: 2.0 * n * n.dot(pane.from_m) }
        })
    }

    /// The pane that a ray meets first, before `solid_m`, where it meets something solid.
    pub fn first(&self, origin_m: DVec3, direction: DVec3, solid_m: f64) -> Option<Met> {
        let met =
            self.panes.iter().zip(1..).filter_map(|(pane, number)| pane.meet(number, origin_m, direction));
        met.filter(|met| met.range_m < solid_m + ON_M).min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }
}

impl Met {
    /// What becomes of the beam, something solid being at `solid_m`. A window in a wall has nothing behind that comes
    /// back.
    pub fn does(&self, solid_m: f64) -> Meets {
        if self.surface == Surface::Mirror {
            return Meets::Reflection { reach_m: f64::INFINITY };
        }
        if self.cos > GLINT_COS || self.is_dirty {
            return Meets::Pane;
        }
        let share = reflected_share(self.cos);
        if solid_m < self.range_m + ON_M || share > 0.5 {
            Meets::Reflection { reach_m: share * SEES_TENTH_M * (REFLECTED / 10.0).sqrt() }
        } else {
            Meets::Through
        }
    }
}

impl Flat {
    fn new(pane: &Pane) -> Self {
        let from_m = DVec3::new(pane.from_m[0], pane.from_m[1], pane.bottom_m);
        let edge_m = DVec3::new(pane.to_m[0], pane.to_m[1], pane.bottom_m) - from_m;
        let along = edge_m.normalize();
        Self {
            from_m,
            along,
            normal: DVec3::new(-along.y, along.x, 0.0),
            length_m: edge_m.length(),
            height_m: pane.top_m - pane.bottom_m,
            surface: pane.surface,
        }
    }

    fn meet(&self, pane: u8, origin_m: DVec3, direction: DVec3) -> Option<Met> {
        let towards = direction.dot(self.normal);
        let range_m = (self.from_m - origin_m).dot(self.normal) / towards;
        let spot_m = origin_m + direction * range_m - self.from_m;
        let (x_m, z_m) = (spot_m.dot(self.along), spot_m.z);
        // A ray along the pane is infinitely far from it or not a number, and meets nothing.
        let is_met =
            range_m > 0.0 && (0.0..=self.length_m).contains(&x_m) && (0.0..=self.height_m).contains(&z_m);
        is_met.then(|| Met {
            pane,
            range_m,
            reflected: direction - 2.0 * towards * self.normal,
            surface: self.surface,
            cos: towards.abs(),
            is_dirty: is_dirty(pane, x_m, z_m),
        })
    }
}

/// Dirt stays where it is: every sensor finds it on the same spots.
fn is_dirty(pane: u8, x_m: f64, z_m: f64) -> bool {
    let spot = ((x_m / SPOT_M) as u64) << 32 | ((z_m / SPOT_M) as u64) << 8 | u64::from(pane);
    // Fibonacci hashing (Knuth 6.4), twice for its low bits.
    let mixed = (spot.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 29).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
    mixed % 100 < DIRTY
}

/// Of light that meets a sheet of glass, the share that both faces throw back (Fresnel, unpolarised).
fn reflected_share(cos: f64) -> f64 {
    let inside = (1.0 - (1.0 - cos * cos) / (INDEX * INDEX)).sqrt();
    let across = ((cos - INDEX * inside) / (cos + INDEX * inside)).powi(2);
    let along = ((inside - INDEX * cos) / (inside + INDEX * cos)).powi(2);
    let both = |face: f64| 2.0 * face / (1.0 + face);
    0.5 * (both(across) + both(along))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIRROR: Pane =
        Pane { from_m: [-1.0, 5.0], to_m: [1.0, 5.0], bottom_m: 0.5, top_m: 2.0, surface: Surface::Mirror };

    #[test]
    fn glass_reflects_what_fresnel_says() {
        assert!((reflected_share(1.0) - 0.0769).abs() < 1e-3, "4 % a face");
        assert!(reflected_share(f64::to_radians(60.0).cos()) < 0.2);
        assert!(reflected_share(f64::to_radians(82.0).cos()) > 0.5);
        assert!((reflected_share(0.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_ray_meets_the_pane_within_its_edges_and_is_thrown_back() {
        let panes = Panes::new(&[MIRROR]);
        let from_m = DVec3::new(0.0, 0.0, 1.0);
        let direction = DVec3::new(0.1, 1.0, 0.0).normalize();
        let met = panes.first(from_m, direction, 100.0).unwrap();
        assert!((met.range_m - 5.0_f64.hypot(0.5)).abs() < 1e-9);
        assert!((met.reflected - DVec3::new(0.1, -1.0, 0.0).normalize()).length() < 1e-9);
        assert_eq!(met.does(100.0), Meets::Reflection { reach_m: f64::INFINITY });
        for beside in
            [DVec3::new(0.3, 1.0, 0.0), DVec3::new(0.0, 1.0, 0.5), DVec3::new(0.0, -1.0, 0.0), DVec3::X]
        {
            assert!(panes.first(from_m, beside.normalize(), 100.0).is_none(), "{beside}");
        }
        assert!(panes.first(from_m, direction, 4.0).is_none(), "something stands before it");
    }

    #[test]
    fn glass_is_seen_straight_on_through_at_a_slant_and_is_a_mirror_when_flat() {
        let met = |degrees: f64, is_dirty| Met {
            pane: 1,
            range_m: 5.0,
            reflected: DVec3::X,
            surface: Surface::Glass,
            cos: degrees.to_radians().cos(),
            is_dirty,
        };
        assert_eq!(met(2.0, false).does(9.0), Meets::Pane);
        assert_eq!(met(40.0, false).does(9.0), Meets::Through);
        assert_eq!(met(40.0, true).does(9.0), Meets::Pane);
        assert!(matches!(met(85.0, false).does(9.0), Meets::Reflection { reach_m } if reach_m > 40.0));
        // In a wall: what stands near before it.
        assert!(
            matches!(met(20.0, false).does(5.0), Meets::Reflection { reach_m } if (4.0..8.0).contains(&reach_m))
        );
    }

    #[test]
    fn some_spots_are_dirty() {
        let spots = (0..200).flat_map(|x| (0..40).map(move |z| (f64::from(x), f64::from(z))));
        let dirty = spots.filter(|&(x, z)| is_dirty(1, 0.05 * x + 0.02, 0.05 * z + 0.02)).count();
        assert!((640..960).contains(&dirty), "{dirty} of 8000");
    }

    #[test]
    fn a_reflection_leaves_the_pane_and_turns_back_to_itself() {
        let reflection = Panes::new(&[MIRROR]).reflections().next().unwrap();
        assert!((reflection.point(DVec3::new(0.3, 5.0, 1.0)) - DVec3::new(0.3, 5.0, 1.0)).length() < 1e-12);
        assert!((reflection.point(DVec3::new(0.3, 3.0, 1.0)) - DVec3::new(0.3, 7.0, 1.0)).length() < 1e-12);
    }
}
