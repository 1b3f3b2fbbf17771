//! Segments against triangle meshes (Möller and Trumbore 1997). Shares nothing with the sensors' rasteriser.

use std::ops::Range;

use umbracast::geometry::{Aabb, DVec3};

use crate::body::Surface;

/// A body's mesh at one instant, boxed part by part so that most segments are settled without a triangle.
#[derive(Debug, Clone)]
pub struct BodyMesh {
    vertices: Vec<DVec3>,
    bounds: Aabb,
    parts: Vec<Aabb>,
}

/// What a segment meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Crossing {
    /// From outside to inside.
    In,
    /// From inside to outside.
    Out,
}

impl BodyMesh {
    /// An empty mesh to be filled by [`BodyMesh::update`].
    pub fn new() -> Self {
        Self { vertices: Vec::new(), bounds: Aabb::EMPTY, parts: Vec::new() }
    }

    /// Lets `write` fill in the vertices of the moment, then boxes them, part by part of the body's `surface`.
    pub fn update(&mut self, surface: &Surface, write: impl FnOnce(&mut Vec<DVec3>)) {
        write(&mut self.vertices);
        self.bounds = Aabb::around(self.vertices.iter().copied());
        self.parts.clear();
        if !self.vertices.is_empty() {
            let vertices = &self.vertices;
            let boxed = |range: &Range<usize>| Aabb::around(vertices[range.clone()].iter().copied());
            self.parts.extend(surface.parts.iter().map(|(range, _)| boxed(range)));
        }
    }

    /// The vertices, as written last.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Does the segment cross the surface?
    pub fn blocks(&self, surface: &Surface, start_m: DVec3, end_m: DVec3) -> bool {
        self.crossings(surface, start_m, end_m).next().is_some()
    }

    /// Is the point inside one of the closed parts? A line from an inner point leaves more often than it enters.
    pub fn holds(&self, surface: &Surface, point_m: DVec3) -> bool {
        // Any direction will do; an odd one runs along no edge.
        let far = point_m + DVec3::new(3.971_3, 1.237_9, 2.718_1);
        let crossings = self.crossings(surface, point_m, far);
        crossings.map(|crossing| if crossing == Crossing::Out { 1 } else { -1 }).sum::<i32>() > 0
    }

    fn crossings<'a>(
        &'a self,
        surface: &'a Surface,
        start_m: DVec3,
        end_m: DVec3,
    ) -> impl Iterator<Item = Crossing> + 'a {
        let near = meets_box(&self.bounds, start_m, end_m);
        let parts = self.parts.iter().zip(&surface.parts).take(if near { usize::MAX } else { 0 });
        parts.filter(move |(bounds, _)| meets_box(bounds, start_m, end_m)).flat_map(move |(_, (_, range))| {
            surface.triangles[range.clone()]
                .iter()
                .filter_map(move |t| crossing(t.map(|i| self.vertices[i as usize]), start_m, end_m))
        })
    }
}

impl Default for BodyMesh {
    fn default() -> Self {
        Self::new()
    }
}

/// Where the segment goes through a triangle, and which way.
fn crossing([a, b, c]: [DVec3; 3], start_m: DVec3, end_m: DVec3) -> Option<Crossing> {
    let direction = end_m - start_m;
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from_a = start_m - a;
    let u = from_a.dot(p) / determinant;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = from_a.cross(ab);
    let v = direction.dot(q) / determinant;
    if v < 0.0 || u + v > 1.0 {
        return None;
    }
    let t = ac.dot(q) / determinant;
    // The determinant is positive where the line runs against the outward normal.
    (0.0..=1.0).contains(&t).then_some(if determinant > 0.0 { Crossing::In } else { Crossing::Out })
}

/// Do box and segment meet? By the separating axes of both, not by slabs as the runtime does it.
fn meets_box(bounds: &Aabb, start_m: DVec3, end_m: DVec3) -> bool {
    let half = (bounds.max_m - bounds.min_m) * 0.5;
    let direction = (end_m - start_m) * 0.5;
    let middle = (start_m + end_m) * 0.5 - (bounds.max_m + bounds.min_m) * 0.5;
    let along = direction.abs();
    if middle.abs().cmpgt(half + along).any() {
        return false;
    }
    let across = middle.cross(direction).abs();
    // A hair of room, so that a flat box is not missed by rounding.
    let room = 1e-9;
    across.x <= half.y * along.z + half.z * along.y + room
        && across.y <= half.x * along.z + half.z * along.x + room
        && across.z <= half.x * along.y + half.y * along.x + room
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Walker;
    use crate::crowd::Trajectory;
    use crate::random::stream;
    use rand::RngExt;
    use umbracast::geometry::DVec2;

    fn walker() -> Walker {
        let positions_m = (0..200).map(|i| DVec2::new(0.01 * f64::from(i), 0.0)).collect();
        let way = Trajectory {
            person: 0,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m,
            arrived_ns: None,
            height_m: None,
        };
        Walker::new(way, 5)
    }

    fn mesh(walker: &Walker) -> BodyMesh {
        let mut mesh = BodyMesh::new();
        mesh.update(walker.surface(), |vertices| {
            walker.mesh_at(1_000_000_000, vertices);
        });
        mesh
    }

    /// Signed volumes instead of Möller-Trumbore, every triangle, no boxes.
    fn brute_force(mesh: &BodyMesh, triangles: &[[u32; 3]], start: DVec3, end: DVec3) -> bool {
        let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
        triangles.iter().any(|t| {
            let [a, b, c] = t.map(|i| mesh.vertices()[i as usize]);
            let sides = volume(a, b, c, start) * volume(a, b, c, end) < 0.0;
            let around = [volume(start, end, a, b), volume(start, end, b, c), volume(start, end, c, a)]
                .map(f64::signum);
            sides && around[0] == around[1] && around[1] == around[2]
        })
    }

    #[test]
    fn segments_agree_with_brute_force() {
        let walker = walker();
        let (mesh, rng) = (mesh(&walker), &mut stream(3, "segments", 0));
        let mut blocked = 0;
        for _ in 0..4000 {
            let mut point = |spread: f64| {
                let mut draw = || rng.random::<f64>() * 2.0 - 1.0;
                DVec3::new(1.0 + spread * draw(), spread * draw(), 0.9 + 0.9 * draw())
            };
            let (start, end) = (point(4.0), point(0.6));
            let found = mesh.blocks(walker.surface(), start, end);
            assert_eq!(found, brute_force(&mesh, &walker.surface().triangles, start, end), "{start} {end}");
            blocked += i32::from(found);
        }
        assert!((500..3500).contains(&blocked), "{blocked}: the test meets both answers");
    }

    #[test]
    fn the_trunk_holds_its_middle_and_not_the_air() {
        let walker = walker();
        let mesh = mesh(&walker);
        let at = |z: f64| walker.state_at(1_000_000_000).unwrap().position_m.extend(z);
        let height = walker.build.height_m();
        assert!(mesh.holds(walker.surface(), at(0.60 * height)));
        assert!(mesh.holds(walker.surface(), at(0.94 * height)));
        assert!(!mesh.holds(walker.surface(), at(height + 0.05)));
        assert!(!mesh.holds(walker.surface(), at(1.2) + DVec3::new(0.6, 0.0, 0.0)));
    }
}
