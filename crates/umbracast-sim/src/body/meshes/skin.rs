//! A surface that follows several bones at each place (linear blend skinning).

use umbracast::geometry::DVec3;

use crate::body::shape::Surface;
use crate::body::skeleton::Bone;

/// A person's surface over the resting bones of our own bodies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skin {
    /// For each vertex and bone that it follows: the bone, its share, and where the vertex is at rest if it follows that
    /// bone alone.
    follows: Vec<(Bone, f64, DVec3)>,
    /// Where each vertex's bones end in `follows`.
    ends: Vec<u32>,
    /// In parts of one bone each, so that rays are settled part by part; a part has its own copy of the vertices on its
    /// edge.
    pub surface: Surface,
}

impl Skin {
    /// Adds a part: its triangles, and what each of `vertices` follows.
    pub(super) fn add(&mut self, vertices: &[&[(Bone, f64, DVec3)]], triangles: &[[u32; 3]]) {
        let (from, first) = (self.ends.len(), self.surface.triangles.len());
        for follows in vertices {
            self.follows.extend_from_slice(follows);
            self.ends.push(self.follows.len() as u32);
        }
        self.surface.triangles.extend(triangles.iter().map(|t| t.map(|corner| from as u32 + corner)));
        self.surface.parts.push((from..self.ends.len(), first..self.surface.triangles.len()));
    }

    /// How many vertices.
    pub fn vertices(&self) -> usize {
        self.ends.len()
    }

    /// Adds all vertices, moved with their bones, to `out`. What comes to lie below the floor is pressed flat on it, as soles
    /// are.
    pub fn posed(&self, posed: impl Fn(Bone, DVec3) -> DVec3, out: &mut Vec<DVec3>) {
        let mut begin = 0;
        for &end in &self.ends {
            let follows = &self.follows[begin..end as usize];
            begin = end as usize;
            let at: DVec3 = follows.iter().map(|&(bone, share, rest)| share * posed(bone, rest)).sum();
            out.push(at.with_z(at.z.max(0.0)));
        }
    }
}
