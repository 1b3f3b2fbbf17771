//! An independent ray caster for the tests: `parry3d` on the hall and on every person's triangles.

use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::{Pose, Vector};
use parry3d::query::details::local_ray_intersection_with_triangle;
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::{Cuboid, SharedShape, TriMesh};
use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::RangeImage;
use umbracast::site::{Floor, Pillar, Sensor};

use crate::body::Walker;

/// Farther than anything in a hall.
const FAR_M: f32 = 1000.0;

/// The hall and people of a test.
pub struct Oracle<'a> {
    hall: Vec<(Pose, SharedShape)>,
    walkers: &'a [Walker],
}

/// A ray that the simulation and the oracle measure differently.
#[derive(Debug)]
pub struct Difference {
    /// What the simulation says.
    pub found_m: f32,
    /// What the oracle says along the ray and along rays that pass it at 0.1 mm: least and greatest.
    pub near_m: (f32, f32),
}

impl Difference {
    /// An edge or a grazed surface lies within 0.1 mm of the ray, so that either answer is right.
    pub fn at_silhouette(&self) -> bool {
        (self.near_m.0 - 1e-3..=self.near_m.1 + 1e-3).contains(&self.found_m)
    }
}

impl<'a> Oracle<'a> {
    pub fn new(site: &Site, walkers: &'a [Walker]) -> Self {
        Self { hall: hall_shapes(site), walkers }
    }

    /// The rays of every `stride`th column that differ by more than 1 mm, and how many were compared.
    pub fn compare(&self, sensor: &Sensor, image: &RangeImage, stride: usize) -> (Vec<Difference>, usize) {
        let columns = &image.columns;
        let times_ns = [0, columns.len() / 2, columns.len() - 1].map(|c| columns[c].time_ns);
        let room: Vec<Aabb> = self
            .walkers
            .iter()
            .map(|w| Aabb::from_points(times_ns.iter().flat_map(|&t| mesh(w, t))).loosened(0.2))
            .collect();
        let mut differences = Vec::new();
        for c in (0..columns.len()).step_by(stride) {
            for b in 0..image.beams.len() {
                let ray = site_ray(sensor, image, c, b);
                let bodies: Vec<(Vec<Vector>, &[[u32; 3]])> = room
                    .iter()
                    .zip(self.walkers)
                    .filter(|(room, _)| room.intersects_local_ray(&ray, FAR_M))
                    .map(|(_, w)| (mesh(w, image.time_ns(c, b)), w.surface().triangles.as_slice()))
                    .collect();
                let found_m = image.range_m[c * image.beams.len() + b];
                if (found_m - self.range_m(&ray, &bodies)).abs() > 1e-3 {
                    let near_m = beside(&ray, found_m)
                        .map(|near| self.range_m(&near, &bodies))
                        .fold((FAR_M, 0.0), |(low, high): (f32, f32), r| (low.min(r), high.max(r)));
                    differences.push(Difference { found_m, near_m });
                }
            }
        }
        (differences, columns.len().div_ceil(stride) * image.beams.len())
    }

    fn range_m(&self, ray: &Ray, bodies: &[(Vec<Vector>, &[[u32; 3]])]) -> f32 {
        let hall = self.hall.iter().filter_map(|(pose, shape)| shape.cast_ray(pose, ray, FAR_M, false));
        let people = bodies.iter().flat_map(|(vertices, triangles)| {
            triangles.iter().filter_map(|corners| {
                let [a, b, c] = corners.map(|i| vertices[i as usize]);
                Some(local_ray_intersection_with_triangle(a, b, c, ray)?.0.time_of_impact)
            })
        });
        hall.chain(people).fold(FAR_M, f32::min)
    }
}

/// The ray itself and eight that pass it at 0.1 mm where it ends.
fn beside(ray: &Ray, range_m: f32) -> impl Iterator<Item = Ray> {
    let (right, up) = ray.dir.any_orthonormal_pair();
    let turns = (0..8).map(|i| i as f32 * std::f32::consts::FRAC_PI_4);
    let offsets = turns.map(move |t| (right * t.cos() + up * t.sin()) * (1e-4 / range_m));
    let ray = *ray;
    std::iter::once(Vector::ZERO).chain(offsets).map(move |offset| Ray::new(ray.origin, ray.dir + offset))
}

/// A beam in the site's frame.
fn site_ray(sensor: &Sensor, image: &RangeImage, c: usize, b: usize) -> Ray {
    let site_from_sensor = sensor.site_from_sensor();
    let origin_m = site_from_sensor.point(image.point_m(c, b, 0.0));
    let far_m = site_from_sensor.point(image.point_m(c, b, 1.0));
    Ray::new(vector(origin_m), vector(far_m - origin_m))
}

/// A body's vertices; none while the person is not in the scene.
fn mesh(walker: &Walker, time_ns: i64) -> Vec<Vector> {
    let mut vertices_m = Vec::new();
    walker.mesh_at(time_ns, &mut vertices_m);
    vertices_m.into_iter().map(vector).collect()
}

/// How far a point is from a body's surface.
pub fn distance_m(walker: &Walker, time_ns: i64, point_m: DVec3) -> f32 {
    let body = TriMesh::new(mesh(walker, time_ns), walker.surface().triangles.clone()).unwrap();
    body.distance_to_local_point(vector(point_m), false)
}

fn vector(v: DVec3) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

/// Slabs round the room, boxes and pillars.
fn hall_shapes(site: &Site) -> Vec<(Pose, SharedShape)> {
    let (x, y, z) = (site.hall.length_m as f32, site.hall.width_m as f32, site.hall.height_m as f32);
    let mut shapes = Vec::new();
    let mut cuboid = |middle: Vector, size: Vector, yaw_deg: f64| {
        let pose = Pose::new(middle, Vector::Z * yaw_deg.to_radians() as f32);
        shapes.push((pose, SharedShape::new(Cuboid::new(size * 0.5))));
    };
    for side in [-1.0, 1.0] {
        cuboid(Vector::new(side * (x + 1.0) * 0.5, 0.0, z * 0.5), Vector::new(1.0, y + 2.0, z + 2.0), 0.0);
        cuboid(Vector::new(0.0, side * (y + 1.0) * 0.5, z * 0.5), Vector::new(x + 2.0, 1.0, z + 2.0), 0.0);
        cuboid(
            Vector::new(0.0, 0.0, z * 0.5 + side * (z + 1.0) * 0.5),
            Vector::new(x + 2.0, y + 2.0, 1.0),
            0.0,
        );
    }
    for item in &site.furniture {
        let ([px, py], [sx, sy, sz]) = (item.position_m, item.size_m.map(|s| s as f32));
        let floor_m = site.hall.floor_m(DVec2::from_array(item.position_m)) as f32;
        cuboid(Vector::new(px as f32, py as f32, floor_m + sz * 0.5), Vector::new(sx, sy, sz), item.yaw_deg);
    }
    for floor in &site.hall.floors {
        shapes.push((Pose::IDENTITY, SharedShape::new(plinth(floor))));
    }
    for pillar in &site.pillars {
        shapes.push((Pose::IDENTITY, SharedShape::new(prism(pillar, z))));
    }
    shapes
}

/// A convex piece of floor as the top of a block that reaches below z = 0.
fn plinth(floor: &Floor) -> TriMesh {
    let n = floor.outline_m.len() as u32;
    let [x0, y0] = floor.outline_m[0];
    let top = |&[x, y]: &[f64; 2]| floor.height_m + floor.slope[0] * (x - x0) + floor.slope[1] * (y - y0);
    let corner = |[x, y]: [f64; 2], z: f64| Vector::new(x as f32, y as f32, z as f32);
    let tops = floor.outline_m.iter().map(|p| corner(*p, top(p)));
    let vertices = tops.chain(floor.outline_m.iter().map(|p| corner(*p, -0.5))).collect();
    let fan = (1..n - 1).map(|i| [0, i, i + 1]);
    let sides = (0..n).flat_map(|i| [[i, (i + 1) % n, n + i], [(i + 1) % n, n + (i + 1) % n, n + i]]);
    TriMesh::new(vertices, fan.chain(sides).collect()).unwrap()
}

/// A pillar as a prism of so many sides that it is 3 um from round.
fn prism(pillar: &Pillar, height_m: f32) -> TriMesh {
    const SIDES: u32 = 720;
    let [x, y] = pillar.position_m;
    let corner = |i: u32| {
        let (sin, cos) = (f64::from(i / 2) * std::f64::consts::TAU / f64::from(SIDES)).sin_cos();
        let z = if i.is_multiple_of(2) { 0.0 } else { height_m };
        Vector::new((x + pillar.radius_m * cos) as f32, (y + pillar.radius_m * sin) as f32, z)
    };
    let triangles = (0..2 * SIDES).map(|i| [i, (i + 1) % (2 * SIDES), (i + 2) % (2 * SIDES)]);
    TriMesh::new((0..2 * SIDES).map(corner).collect(), triangles.collect()).unwrap()
}
