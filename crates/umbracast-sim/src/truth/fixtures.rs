//! Segments against the round pillars and boxes of the hall, solved exactly.

use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::{Furniture, Pillar};

/// Is the segment cut by a pillar, a piece of furniture or a wall between two places of the hall? A rectangle has none
/// such; who looks in from outside of an outline looks in through it.
pub fn block(site: &Site, start_m: DVec3, end_m: DVec3) -> bool {
    let indoors = !site.hall.outline_m.is_empty() && site.hall.contains(start_m.truncate());
    (indoors && walls_block(site, start_m.truncate(), end_m.truncate()))
        || site.pillars.iter().any(|pillar| pillar_blocks(pillar, start_m, end_m))
        || site.furniture.iter().any(|piece| {
            let down = DVec3::NEG_Z * site.hall.floor_m(DVec2::from_array(piece.position_m));
            furniture_blocks(piece, start_m + down, end_m + down)
        })
}

/// Walls reach from floor to ceiling. A segment that ends on one is not cut by it.
fn walls_block(site: &Site, start: DVec2, end: DVec2) -> bool {
    let side = |[a, b]: [DVec2; 2], p: DVec2| (b - a).perp_dot(p - a);
    site.hall.walls().any(|wall| {
        side(wall, start) * side(wall, end) < 0.0
            && side([start, end], wall[0]) * side([start, end], wall[1]) < 0.0
    })
}

/// A pillar reaches from floor to ceiling, so only the plan view counts: is its axis nearer than its radius?
fn pillar_blocks(pillar: &Pillar, start_m: DVec3, end_m: DVec3) -> bool {
    let (start, way) = (start_m.truncate(), (end_m - start_m).truncate());
    let to_axis = DVec2::from_array(pillar.position_m) - start;
    let share = (to_axis.dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to_axis - way * share).length() <= pillar.radius_m
}

/// Cuts the segment by the six faces in turn, in the box's own frame, and asks whether something is left.
fn furniture_blocks(piece: &Furniture, start_m: DVec3, end_m: DVec3) -> bool {
    let turn = DVec2::from_angle(-piece.yaw_deg.to_radians());
    let own = |p: DVec3| turn.rotate(p.truncate() - DVec2::from_array(piece.position_m)).extend(p.z);
    let [length, width, height] = piece.size_m;
    let (lo, hi) =
        (DVec3::new(-length / 2.0, -width / 2.0, 0.0), DVec3::new(length / 2.0, width / 2.0, height));
    let mut rest = (own(start_m), own(end_m));
    for axis in 0..3 {
        for (face, sign) in [(lo[axis], 1.0), (hi[axis], -1.0)] {
            let inside = [rest.0, rest.1].map(|p| sign * (p[axis] - face));
            if inside[0] < 0.0 && inside[1] < 0.0 {
                return false;
            }
            let cut = || rest.0.lerp(rest.1, inside[0] / (inside[0] - inside[1]));
            if inside[0] < 0.0 {
                rest.0 = cut();
            } else if inside[1] < 0.0 {
                rest.1 = cut();
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const PILLAR: Pillar = Pillar { position_m: [2.0, 1.0], radius_m: 0.5 };
    const TABLE: Furniture = Furniture { position_m: [0.0, 3.0], size_m: [2.0, 1.0, 0.8], yaw_deg: 90.0 };

    #[test]
    fn a_pillar_blocks_at_every_height_within_its_radius() {
        let cast = |y: f64, z: f64| pillar_blocks(&PILLAR, DVec3::new(0.0, y, z), DVec3::new(4.0, y, 0.1));
        assert!(cast(0.51, 9.0) && cast(1.49, 0.1));
        assert!(!cast(0.49, 9.0) && !cast(1.51, 0.1));
        assert!(
            !pillar_blocks(&PILLAR, DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.4, 1.0, 1.0)),
            "ends before it"
        );
    }

    #[test]
    fn furniture_is_turned_and_ends_at_its_top() {
        let cast = |x: f64, z: f64| furniture_blocks(&TABLE, DVec3::new(x, -5.0, z), DVec3::new(x, 9.0, z));
        // Turned by 90 degrees it is 1 m wide along x and 2 m along y.
        assert!(cast(0.49, 0.5) && !cast(0.51, 0.5));
        assert!(cast(0.0, 0.79) && !cast(0.0, 0.81));
        assert!(
            !furniture_blocks(&TABLE, DVec3::new(0.0, -5.0, 0.5), DVec3::new(0.0, 1.9, 0.5)),
            "ends before it"
        );
        assert!(
            furniture_blocks(&TABLE, DVec3::new(0.0, 3.0, 0.5), DVec3::new(0.0, 3.1, 0.5)),
            "lies inside"
        );
    }
}
