//! Position and boxes of one person. Heights are above the floor below the person; only the boxes are in the site
//! frame.

use super::canopy::{OVERHEAD_M, Overhead};
use super::evidence::FULL_BODY_TOP_M;
use super::looks::{Look, Looks};
use super::outline::{LEVELS, Reach, reaches};
use super::point_network::PointNetwork;
use super::pose_view::{PoseView, Seen};
use super::shape::{BANDS, Moments, band_of};
use super::{Cluster, Detection, Point, Prior, pose};
use crate::Site;
use crate::config::{DetectConfig, Mechanism, PositionMethod};
use crate::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};
use crate::site::Hall;

/// What is seen is the near side, 0.08 to 0.12 m nearer than the body axis: so far a point is moved along the horizontal
/// line of sight.
pub const SHIFT_M: f64 = 0.1;
/// Points that do not look like a person count where one is expected within this distance, half a stride: legs alone, or a
/// head behind others, still tell where somebody known is.
const EXPECTED_M: f64 = 0.55;
/// From the top of a head to the chin.
const HEAD_M: f64 = 0.2;
/// A prior farther than this from a cluster does not tell where its person walks.
const OWN_M: f64 = 0.5;
/// A wheelchair is 1.3 m from corner to corner, and who sits in one reaches no higher than this.
const SEATED_DIAGONAL_MAX_M: f64 = 1.5;
const SEATED_HEIGHT_M: f64 = 1.5;

/// Somebody known whose arms are stretched out is as long as tall at most. What is below this share of it is legs that stand,
/// which take up less than this.
const ARMS_OUT_M: f64 = 2.1;
const HIPS_SHARE: f64 = 0.4;
const LEGS_M: f64 = 0.9;

/// What has the size of a person: both ends excluded, but of the points.
#[derive(Debug, Clone)]
struct Size {
    points: std::ops::RangeInclusive<usize>,
    /// Of the box in plan view, from corner to corner.
    diagonal_m: [f64; 2],
    /// From the lowest to the highest point.
    extent_m: [f64; 2],
    /// The highest point above the floor.
    top_m: [f64; 2],
}

/// A stride with swinging arms is longer than 1 m.
const OURS: Size = Size { points: 5..=8192, diagonal_m: [0.1, 1.3], extent_m: [0.0, 2.4], top_m: [0.5, 2.3] };
/// As hdl_people_tracking has it: more than 10 points.
const ADAPTED: Size = Size {
    points: 11..=8191,
    diagonal_m: [0.2, 1.0],
    extent_m: [0.3, 2.0],
    top_m: [f64::NEG_INFINITY, f64::INFINITY],
};

/// Which way an oriented box may turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObbAxes {
    /// Along the eigenvectors of the points.
    Eigenvectors,
    /// About the vertical only: people stand upright.
    Yaw,
}

/// Turns clusters into detections.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # use umbracast::Config;
/// # let points = somebody();
/// use umbracast::detect::Measurer;
///
/// let config = Config::default();
/// let (mut measurer, mut detections) = (Measurer::new(&config.detect, &config.site), Vec::new());
/// measurer.detections(&points, &[(0..40).collect()], &[], &mut detections);
/// assert!(detections[0].position_m.length() < 0.3 && detections[0].top_m > 1.6);
/// ```
#[derive(Debug, Clone)]
pub struct Measurer {
    position: PositionMethod,
    size: Size,
    /// Whether known people may be as long as a wheelchair.
    seated: bool,
    sensors_m: Vec<DVec3>,
    hall: Hall,
    pose: PointNetwork,
    /// By point: whether a cluster has it.
    is_taken: Vec<bool>,
    /// Points that hang over people, above the floor, with their sensors.
    overhead_m: Vec<(DVec3, u16)>,
    /// Of the frame's people.
    looks: Looks,
    /// Memory of the last frame's detections.
    spare: Vec<Vec<Reach>>,
}

impl Measurer {
    /// Needs the site to know from where each point was seen.
    ///
    /// ```
    /// use umbracast::{Config, detect::Measurer};
    ///
    /// let config = Config::default();
    /// let mut detections = Vec::new();
    /// Measurer::new(&config.detect, &config.site).detections(&[], &[], &[], &mut detections);
    /// assert!(detections.is_empty());
    /// ```
    pub fn new(config: &DetectConfig, site: &Site) -> Self {
        Self {
            position: config.position,
            size: if config.position == PositionMethod::BoxCenter { ADAPTED } else { OURS },
            seated: !config.without.contains(&Mechanism::ChildrenAndSeated),
            sensors_m: site.sensors.iter().map(|s| DVec3::from_array(s.position_m)).collect(),
            hall: site.hall.clone(),
            pose: pose::shipped(),
            is_taken: Vec::new(),
            overhead_m: Vec::new(),
            looks: Looks::default(),
            spare: Vec::new(),
        }
    }

    /// One detection a cluster that has a person's size, or lies where a person is expected.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # use umbracast::Config;
    /// # let points = somebody();
    /// use umbracast::detect::Measurer;
    ///
    /// // The lowest ten points are nobody: 0.4 m is no person's height.
    /// let config = Config::default();
    /// let mut detections = Vec::new();
    /// Measurer::new(&config.detect, &config.site).detections(&points, &[(0..10).collect()], &[], &mut detections);
    /// assert!(detections.is_empty());
    /// ```
    pub fn detections(
        &mut self,
        points: &[Point],
        clusters: &[Cluster],
        priors: &[Prior],
        detections: &mut Vec<Detection>,
    ) {
        self.spare.extend(detections.drain(..).map(|detection| detection.reaches));
        let mut looks = std::mem::take(&mut self.looks);
        looks.clear();
        self.look_up(points, clusters);
        for (c, cluster) in clusters.iter().enumerate() {
            let aabb = self.above_floor(points, cluster).1;
            let expected = self.is_expected(points, cluster, &aabb, priors);
            // Legs are somebody only where nobody is known.
            let full_body = self.has_size_of_person(cluster.len(), &aabb)
                && !(expected && aabb.max_m.z < FULL_BODY_TOP_M);
            if full_body || expected {
                looks.people.push((c, full_body));
                self.look(points, cluster, priors, &mut looks);
            }
        }
        self.find_poses(&mut looks);
        for (person, &(c, full_body)) in looks.people.iter().enumerate() {
            let mut reaches = self.spare.pop().unwrap_or_default();
            reaches.clear();
            reaches.reserve(LEVELS * self.sensors_m.len());
            let detection = self.detection_within(looks.of(person), reaches, points, &clusters[c], priors);
            detections.push(Detection { full_body, ..detection });
        }
        self.looks = looks;
    }

    /// Finds what hangs over people: no cluster has it.
    fn look_up(&mut self, points: &[Point], clusters: &[Cluster]) {
        self.is_taken.clear();
        self.is_taken.resize(points.len(), false);
        clusters.iter().flatten().for_each(|&i| self.is_taken[i as usize] = true);
        let nobodys = points.iter().zip(&self.is_taken).filter(|(_, taken)| !**taken);
        let above_floor_m = nobodys.map(|(p, _)| (p, super::above_floor(&self.hall, p.position_m)));
        let high = above_floor_m.filter(|(_, above_floor_m)| above_floor_m.z > OVERHEAD_M);
        self.overhead_m.clear();
        self.overhead_m.extend(high.map(|(p, above_floor_m)| {
            let sensor_m = self.sensors_m.get(usize::from(p.sensor)).copied().unwrap_or(p.position_m);
            let away = (p.position_m - sensor_m).truncate().normalize_or_zero();
            (above_floor_m + (away * SHIFT_M).extend(0.0), p.sensor)
        }));
    }

    /// How high the floor is where a person's points are in the middle, and the box of the points from there.
    fn above_floor(&self, points: &[Point], cluster: &[u32]) -> (f64, Aabb) {
        let of = || cluster.iter().map(|&i| points[i as usize].position_m);
        let floor_m = match self.hall.floors.is_empty() {
            true => 0.0,
            false => self.hall.floor_m(of().sum::<DVec3>().truncate() / cluster.len().max(1) as f64),
        };
        (floor_m, Aabb::around(of().map(|p| p - DVec3::Z * floor_m)))
    }

    fn has_size_of_person(&self, points: usize, aabb: &Aabb) -> bool {
        let within = |value: f64, [least, most]: [f64; 2]| value > least && value < most;
        let size_m = aabb.size_m();
        self.size.points.contains(&points)
            && within(diagonal_m(aabb), self.size.diagonal_m)
            && within(size_m.z, self.size.extent_m)
            && within(aabb.max_m.z, self.size.top_m)
    }

    /// True for what may be a part of somebody who is expected there.
    fn is_expected(&self, points: &[Point], cluster: &[u32], aabb: &Aabb, priors: &[Prior]) -> bool {
        let (length_m, middle_m) = (diagonal_m(aabb), aabb.center_m().truncate());
        let arms_m = if self.arms_out(points, cluster, aabb) { ARMS_OUT_M } else { self.size.diagonal_m[1] };
        // A wheelchair is longer than a stride, and who sits in it lower than who walks.
        let longest_m = |prior: &Prior| match self.seated && prior.height_m < SEATED_HEIGHT_M {
            true => SEATED_DIAGONAL_MAX_M,
            false => arms_m,
        };
        let near = |prior: &Prior| {
            let reach_m = EXPECTED_M + prior.position_sigma_m.min(EXPECTED_M);
            prior.confirmed && prior.position_m.distance(middle_m) < reach_m && length_m < longest_m(prior)
        };
        aabb.max_m.z < self.size.top_m[1] && priors.iter().any(near)
    }

    /// True where what is longer than a stride is so above the hips alone, and stands on legs.
    fn arms_out(&self, points: &[Point], cluster: &[u32], aabb: &Aabb) -> bool {
        if diagonal_m(aabb) < self.size.diagonal_m[1] {
            return false;
        }
        let hips_m = aabb.min_m.z + HIPS_SHARE * aabb.size_m().z;
        let low = cluster.iter().map(|&i| points[i as usize].position_m).filter(|p| p.z < hips_m);
        low.clone().next().is_some() && diagonal_m(&Aabb::around(low)) < LEGS_M
    }

    /// Of points that are one person's, whatever their size; at least one.
    #[doc(hidden)] // For scores that know whose points they are.
    pub fn detection(&self, points: &[Point], cluster: &[u32], priors: &[Prior]) -> Detection {
        let mut looks = Looks::default();
        self.look(points, cluster, priors, &mut looks);
        self.find_poses(&mut looks);
        self.detection_within(looks.of(0), Vec::new(), points, cluster, priors)
    }

    fn detection_within(
        &self,
        look: Look<'_>,
        mut all_reaches: Vec<Reach>,
        points: &[Point],
        cluster: &[u32],
        priors: &[Prior],
    ) -> Detection {
        let n = cluster.len() as f64;
        let of = || cluster.iter().map(|&i| &points[i as usize]);
        let (floor_m, aabb) = self.above_floor(points, cluster);
        let places_m = || of().map(|p| p.position_m - DVec3::Z * floor_m);
        let mean_m: DVec3 = places_m().sum::<DVec3>() / n;
        let first_ns = of().map(|p| p.time_ns).min().unwrap_or_default();
        let late_ns: i64 = of().map(|p| p.time_ns - first_ns).sum();
        let who = nearest(mean_m.truncate(), priors);
        let (mut facing, mut gait) = (None, None);
        let (position_m, z_m, covariance_m2) = match (look.pose, look.view) {
            (Some(pose), _) => {
                // Who is not known may walk or stand.
                (facing, gait) = (pose.facing.filter(|_| who.is_some()), pose.gait);
                (pose.position_m, mean_m.z, Some(pose.covariance_m2))
            }
            (None, Some(view)) => (view.base_m, mean_m.z, None),
            (None, None) => (aabb.center_m().truncate(), aabb.center_m().z, None),
        };
        let mut bands = [Moments::default(); BANDS];
        if covariance_m2.is_some() {
            look.seen.iter().for_each(|s| bands[band_of(s.z_m)].add(s.at_m - position_m));
        }
        let of_top = places_m().filter(|p| p.z >= aabb.max_m.z - HEAD_M);
        let axes = match self.position {
            PositionMethod::BoxCenter => ObbAxes::Eigenvectors,
            PositionMethod::ShiftedMean | PositionMethod::Fitted => ObbAxes::Yaw,
        };
        let time_ns = first_ns + late_ns / cluster.len() as i64;
        let feet_m = position_m.extend(floor_m);
        if let Some(who) = who {
            let (height_m, velocity_mps) = (who.height_m, who.velocity_mps);
            reaches(of(), &self.sensors_m, feet_m, time_ns, height_m, velocity_mps, &mut all_reaches);
        }
        Detection {
            position_m,
            covariance_m2,
            facing,
            gait,
            reaches: all_reaches,
            bands,
            overhead: Overhead::about(position_m, &self.overhead_m),
            z_m,
            time_ns,
            points: cluster.len() as u32,
            full_body: true,
            top_m: aabb.max_m.z,
            top_diagonal_m: diagonal_m(&Aabb::around(of_top)),
            aabb: aabb.raised_by(floor_m),
            obb: obb(places_m(), mean_m, axes).raised_by(floor_m),
        }
    }

    /// Looks at one more person, as the method asks.
    fn look(&self, points: &[Point], cluster: &[u32], priors: &[Prior], looks: &mut Looks) {
        let priors = match self.position {
            PositionMethod::BoxCenter => return,
            PositionMethod::ShiftedMean => &[],
            PositionMethod::Fitted => priors,
        };
        looks.add(|seen| self.pose_view_within(seen, points, cluster, priors));
    }

    fn find_poses(&self, looks: &mut Looks) {
        if self.position == PositionMethod::Fitted {
            looks.find_poses(&self.pose);
        }
    }

    /// A cluster as the network of the pose sees it; who walks there is the nearest of `priors`.
    #[doc(hidden)] // For the fit of the network of the pose.
    pub fn pose_view(&self, points: &[Point], cluster: &[u32], priors: &[Prior]) -> PoseView {
        self.pose_view_within(&mut Vec::new(), points, cluster, priors)
    }

    fn pose_view_within(
        &self,
        memory: &mut Vec<Seen>,
        points: &[Point],
        cluster: &[u32],
        priors: &[Prior],
    ) -> PoseView {
        let seen = cluster.iter().map(|&i| &points[i as usize]);
        let mean_m =
            seen.clone().map(|p| p.position_m.truncate()).sum::<DVec2>() / cluster.len().max(1) as f64;
        let velocity_mps = nearest(mean_m, priors).map(|prior| prior.velocity_mps);
        let floor_m = self.hall.floor_m(mean_m);
        PoseView::new(memory, seen, &self.sensors_m, floor_m, SHIFT_M, velocity_mps)
    }
}

/// From corner to corner in plan view.
fn diagonal_m(aabb: &Aabb) -> f64 {
    aabb.size_m().truncate().length()
}

/// Who is known to walk here.
fn nearest(at_m: DVec2, priors: &[Prior]) -> Option<&Prior> {
    let off_m = |prior: &Prior| prior.position_m.distance(at_m);
    let near =
        priors.iter().filter(|p| p.confirmed).map(|p| (off_m(p), p)).filter(|(off_m, _)| *off_m < OWN_M);
    near.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, who)| who)
}

/// The box along the points' own axes: extremes in object space (paper, section IV-A).
fn obb(points_m: impl Iterator<Item = DVec3> + Clone, mean_m: DVec3, axes: ObbAxes) -> Obb {
    let mut covariance = DMat3::ZERO;
    for p in points_m.clone() {
        let d = p - mean_m;
        covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    let site_from_box = match axes {
        ObbAxes::Eigenvectors => eigenvectors(covariance),
        ObbAxes::Yaw => {
            let (xx, xy, yy) = (covariance.x_axis.x, covariance.x_axis.y, covariance.y_axis.y);
            DMat3::from_rotation_z(0.5 * f64::atan2(2.0 * xy, xx - yy))
        }
    };
    let box_from_site = site_from_box.transpose();
    let extremes = Aabb::around(points_m.map(|p| box_from_site * (p - mean_m)));
    Obb {
        center_m: mean_m + site_from_box * extremes.center_m(),
        half_m: extremes.size_m() * 0.5,
        site_from_box,
    }
}

/// Eigenvectors of a symmetric matrix as the columns of a rotation, by Jacobi's cyclic rotations.
fn eigenvectors(symmetric: DMat3) -> DMat3 {
    let mut a = symmetric.to_cols_array_2d();
    let mut v = DMat3::IDENTITY;
    // Convergence is quadratic; six sweeps reach the last bit.
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(18) {
        if a[p][q] == 0.0 {
            continue;
        }
        let angle = 0.5 * f64::atan2(2.0 * a[p][q], a[p][p] - a[q][q]);
        let (sin, cos) = angle.sin_cos();
        let mut turn = DMat3::IDENTITY.to_cols_array_2d();
        (turn[p][p], turn[p][q]) = (cos, sin);
        (turn[q][p], turn[q][q]) = (-sin, cos);
        let turn = DMat3::from_cols_array_2d(&turn);
        a = (turn.transpose() * DMat3::from_cols_array_2d(&a) * turn).to_cols_array_2d();
        v *= turn;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn eigenvectors_turn_a_matrix_diagonal() {
        let m = DMat3::from_cols(
            DVec3::new(2.0, 0.3, -0.5),
            DVec3::new(0.3, 1.0, 0.7),
            DVec3::new(-0.5, 0.7, 3.0),
        );
        let v = eigenvectors(m);
        let d = v.transpose() * m * v;
        let off = d.x_axis.y.abs() + d.x_axis.z.abs() + d.y_axis.z.abs();
        assert!(off < 1e-12, "{d}");
        assert!((v.determinant() - 1.0).abs() < 1e-12);
    }

    /// What the default settings find of points in a box of 1 m by 0.95 m by 1.3 m that somebody `height_m` tall is
    /// expected in.
    fn found_of_a_wheelchair(height_m: f64) -> usize {
        let corner =
            |k: usize| DVec3::new((k % 2) as f64, 0.95 * (k / 2 % 2) as f64, 0.1 + 0.4 * (k % 4) as f64);
        let points: Vec<Point> =
            (0..16).map(|k| Point { position_m: corner(k), time_ns: 0, sensor: 0 }).collect();
        let cluster: Cluster = (0..16).collect();
        let sitting = Prior {
            position_m: DVec2::new(0.5, 0.475),
            velocity_mps: DVec2::X,
            position_sigma_m: 0.1,
            height_m,
            confirmed: true,
            walked: false,
            is_furniture: false,
            shape: None,
        };
        let config = Config::default();
        let mut detections = Vec::new();
        Measurer::new(&config.detect, &config.site).detections(
            &points,
            &[cluster],
            &[sitting],
            &mut detections,
        );
        detections.len()
    }

    #[test]
    fn who_sits_in_a_wheelchair_is_not_too_long_once_known() {
        assert_eq!((found_of_a_wheelchair(1.34), found_of_a_wheelchair(1.75)), (1, 0));
    }

    #[test]
    fn somebody_known_is_found_with_both_arms_stretched_out_and_a_table_is_not() {
        let body = (0..30).map(|k| DVec3::new(0.1 * f64::from(k % 3), 0.1, 0.05 * f64::from(k) + 0.1));
        let span = |z_m: f64| (0..20).map(move |k| DVec3::new(0.09 * f64::from(k) - 0.8, 0.1, z_m));
        let found = |span_z_m: f64, known: bool| {
            let points: Vec<Point> = body
                .clone()
                .chain(span(span_z_m))
                .map(|position_m| Point { position_m, time_ns: 0, sensor: 0 })
                .collect();
            let prior = Prior {
                position_m: DVec2::splat(0.1),
                velocity_mps: DVec2::ZERO,
                position_sigma_m: 0.05,
                height_m: 1.7,
                confirmed: true,
                walked: false,
                is_furniture: false,
                shape: None,
            };
            let config = Config::default();
            let mut detections = Vec::new();
            let priors = if known { vec![prior] } else { Vec::new() };
            let cluster: Cluster = (0..points.len() as u32).collect();
            let mut measurer = Measurer::new(&config.detect, &config.site);
            measurer.detections(&points, &[cluster], &priors, &mut detections);
            detections.len()
        };
        assert_eq!([found(1.4, true), found(1.4, false), found(0.4, true)], [1, 0, 0]);
    }

    #[test]
    fn an_upright_box_finds_the_turn_of_its_points() {
        let turn = DMat3::from_rotation_z(0.6);
        let corners = [(-0.3, -0.1), (-0.3, 0.1), (0.3, -0.1), (0.3, 0.1)];
        let points: Vec<DVec3> = corners.iter().map(|&(x, y)| turn * DVec3::new(x, y, x)).collect();
        let found = obb(points.iter().copied(), DVec3::ZERO, ObbAxes::Yaw);
        assert!((found.half_m - DVec3::new(0.3, 0.1, 0.3)).length() < 1e-12, "{}", found.half_m);
        assert!(found.site_from_box.x_axis.dot(turn.x_axis).abs() > 1.0 - 1e-12);
    }
}
