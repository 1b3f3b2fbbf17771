//! Bodies as another program takes them: the triangles once, the corners wherever they stand.

use std::path::Path;

use umbracast::geometry::DVec3;
use umbracast_sim::body::Walker;

use crate::exchange::{write_f32, write_u32};

/// Of all bodies, one after the other: `triangles` with corners counted in each body from 0, and for each body in `counts` how
/// many vertices and triangles it has.
pub fn write_triangles(folder: &Path, walkers: &[&Walker]) {
    let vertices =
        |walker: &Walker| walker.surface().parts.iter().map(|(range, _)| range.end).max().unwrap_or(0);
    let triangles: Vec<u32> =
        walkers.iter().flat_map(|w| w.surface().triangles.iter().flatten().copied()).collect();
    let counts: Vec<u32> = walkers
        .iter()
        .flat_map(|w| [vertices(w), w.surface().triangles.len()].map(|count| count as u32))
        .collect();
    write_u32(folder, "triangles", &[triangles.len() / 3, 3], &triangles);
    write_u32(folder, "counts", &[walkers.len(), 2], &counts);
}

/// The vertices of all bodies, each written by `pose`.
pub fn write_vertices(
    folder: &Path,
    name: &str,
    walkers: &[&Walker],
    pose: impl Fn(&Walker, usize, &mut Vec<DVec3>),
) {
    let (mut all_m, mut vertices_m) = (Vec::new(), Vec::new());
    for (number, walker) in walkers.iter().enumerate() {
        pose(walker, number, &mut vertices_m);
        all_m.extend(vertices_m.iter().flat_map(|vertex_m| vertex_m.as_vec3().to_array()));
    }
    write_f32(folder, name, &[all_m.len() / 3, 3], &all_m);
}
