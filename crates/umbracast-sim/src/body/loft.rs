//! Closed surfaces stretched over rings: what every part of a body is made of.

use std::f64::consts::TAU;

use umbracast::geometry::DVec3;

/// Along which axis of the resting body a part's rings are stacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// Forward: feet.
    X,
    /// Up: everything else.
    Z,
}

/// A superellipse across a part: |u / half_u|^power + |v / half_v|^power = 1, with (u, v) = (x, y) for parts
/// along z and (y, z) for parts along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Where along the part, metres.
    pub at_m: f64,
    /// Its middle, metres.
    pub center_m: [f64; 2],
    /// Its half axes, metres.
    pub half_m: [f64; 2],
    /// 2 is an ellipse; more is squarer.
    pub power: f64,
    /// How far the ring follows the part's second bone, 0 to 1.
    pub second: f64,
}

/// The vertices of a part, ring by ring with rising coordinate, then the middle of its lower and its upper cap.
pub fn vertices(along: Along, rings: &[Ring], points: usize, out: &mut Vec<(DVec3, f64)>) {
    let place = |at: f64, u: f64, v: f64| match along {
        Along::X => DVec3::new(at, u, v),
        Along::Z => DVec3::new(u, v, at),
    };
    for ring in rings {
        for k in 0..points {
            let (sin, cos) = (TAU * k as f64 / points as f64).sin_cos();
            let bent = |c: f64| c.signum() * c.abs().powf(2.0 / ring.power);
            let (u, v) = (ring.half_m[0] * bent(cos), ring.half_m[1] * bent(sin));
            out.push((place(ring.at_m, ring.center_m[0] + u, ring.center_m[1] + v), ring.second));
        }
    }
    for cap in [&rings[0], &rings[rings.len() - 1]] {
        out.push((place(cap.at_m, cap.center_m[0], cap.center_m[1]), cap.second));
    }
}

/// The triangles that belong to [`vertices`], counter-clockwise from outside; `first` is the part's first vertex.
pub fn triangles(rings: usize, points: usize, first: usize, out: &mut Vec<[u32; 3]>) {
    let vertex = |ring: usize, k: usize| (first + ring * points + k % points) as u32;
    let (bottom, top) = ((first + rings * points) as u32, (first + rings * points + 1) as u32);
    for ring in 0..rings - 1 {
        for k in 0..points {
            let (a, b) = (vertex(ring, k), vertex(ring, k + 1));
            let (c, d) = (vertex(ring + 1, k + 1), vertex(ring + 1, k));
            out.extend([[a, b, c], [a, c, d]]);
        }
    }
    for k in 0..points {
        out.push([bottom, vertex(0, k + 1), vertex(0, k)]);
        out.push([top, vertex(rings - 1, k), vertex(rings - 1, k + 1)]);
    }
}

/// Points around a hoop, and around its tube.
const HOOP: [usize; 2] = [32, 8];

/// A ring-shaped tube about an axle along y, with its triangles; so many vertices are `before` all of `vertices`.
pub fn hoop(
    middle_m: DVec3,
    radius_m: f64,
    half_m: f64,
    before: usize,
    vertices: &mut Vec<(DVec3, f64)>,
    triangles: &mut Vec<[u32; 3]>,
) {
    let [around, tube] = HOOP;
    let first = before + vertices.len();
    for i in 0..around {
        let (up, ahead) = (TAU * i as f64 / around as f64).sin_cos();
        for k in 0..tube {
            let (aside, out) = (TAU * k as f64 / tube as f64).sin_cos();
            let r = radius_m + half_m * out;
            vertices.push((middle_m + DVec3::new(r * ahead, half_m * aside, r * up), 0.0));
        }
    }
    let vertex = |i: usize, k: usize| (first + (i % around) * tube + k % tube) as u32;
    for i in 0..around {
        for k in 0..tube {
            let (a, b) = (vertex(i, k), vertex(i, k + 1));
            let (c, d) = (vertex(i + 1, k + 1), vertex(i + 1, k));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// Adds `between` rings in every gap, on a smooth curve through the given ones.
pub fn smooth(keys: &[Ring], between: usize) -> Vec<Ring> {
    let mut rings = Vec::with_capacity(keys.len() * (between + 1));
    for i in 0..keys.len() - 1 {
        let around = [keys[i.saturating_sub(1)], keys[i], keys[i + 1], keys[(i + 2).min(keys.len() - 1)]];
        for step in 0..=between {
            let u = step as f64 / (between + 1) as f64;
            let curve = |of: &dyn Fn(&Ring) -> f64| through(around.each_ref().map(of), u);
            rings.push(Ring {
                at_m: around[1].at_m + u * (around[2].at_m - around[1].at_m),
                center_m: [curve(&|r| r.center_m[0]), curve(&|r| r.center_m[1])],
                half_m: [curve(&|r| r.half_m[0]), curve(&|r| r.half_m[1])],
                power: around[1].power + u * (around[2].power - around[1].power),
                second: around[1].second + u * (around[2].second - around[1].second),
            });
        }
    }
    rings.push(keys[keys.len() - 1]);
    rings
}

/// Puts two smaller rings beyond an end, `rise_m` out, so that it is round where it meets the next part.
pub fn rounded(end: Ring, rise_m: f64) -> [Ring; 2] {
    // Angles of 40 and 75 degrees on a quarter circle.
    [(0.643, 0.766), (0.966, 0.259)].map(|(out, across)| Ring {
        at_m: end.at_m + rise_m * out,
        half_m: end.half_m.map(|half| half * across),
        ..end
    })
}

/// The Catmull-Rom curve between the second and the third of four values.
fn through([a, b, c, d]: [f64; 4], u: f64) -> f64 {
    let (from, to) = ((c - a) / 2.0, (d - b) / 2.0);
    let (u2, u3) = (u * u, u * u * u);
    b * (2.0 * u3 - 3.0 * u2 + 1.0) + from * (u3 - 2.0 * u2 + u) + c * (3.0 * u2 - 2.0 * u3) + to * (u3 - u2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The divergence theorem: a closed surface that faces outward holds its volume, wherever it lies.
    fn volume(points: &[(DVec3, f64)], faces: &[[u32; 3]]) -> f64 {
        let cone = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|i| points[i as usize].0 + DVec3::new(5.0, 7.0, -3.0));
            a.dot(b.cross(c)) / 6.0
        };
        faces.iter().map(cone).sum()
    }

    #[test]
    fn a_part_is_closed_and_faces_outward() {
        for along in [Along::X, Along::Z] {
            let ring =
                |at_m| Ring { at_m, center_m: [0.3, -0.2], half_m: [0.1, 0.1], power: 2.0, second: 0.0 };
            let (mut points, mut faces) = (Vec::new(), Vec::new());
            vertices(along, &[ring(0.0), ring(0.5), ring(1.0)], 64, &mut points);
            triangles(3, 64, 0, &mut faces);
            let volume = volume(&points, &faces);
            assert!((volume - std::f64::consts::PI * 0.01).abs() < 1e-4, "{volume}");
        }
    }

    #[test]
    fn a_hoop_is_closed_and_faces_outward() {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        hoop(DVec3::new(0.1, 0.3, 0.3), 0.3, 0.02, 0, &mut points, &mut faces);
        // Pappus: the tube's section along the circle of its middle; an octagon holds 0.90 of its circle.
        let expected = 0.90 * std::f64::consts::PI * 0.02 * 0.02 * TAU * 0.3;
        let volume = volume(&points, &faces);
        assert!((volume / expected - 1.0).abs() < 0.02, "{volume} {expected}");
    }
}
