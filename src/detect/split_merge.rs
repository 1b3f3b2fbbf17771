//! One cluster, one person: Haselich's split-merge, or evidence for one person more or fewer.

use super::canopy::Canopies;
use super::cluster::PlanGrid;
use super::dp_means::MergeMean;
use super::memory::Memory;
use super::part::{POINTS_MIN, Part};
use super::pose_view::away;
use super::{Cluster, Point, Prior, above_floor, dp_means, evidence};
use crate::Site;
use crate::config::{ClusterMethod, DetectConfig, Mechanism};
use crate::geometry::{DVec2, DVec3};
use crate::site::Hall;

/// When points belong together in plan view.
#[derive(Debug, Clone, Copy)]
struct Radius {
    /// Points nearer than this belong together.
    radius_m: f64,
    /// It grows by this for each metre from the nearest sensor.
    per_range: f64,
    /// How far a point is first moved along the horizontal line of sight, so that front and back, seen by two sensors,
    /// come together on the body axis.
    shift_m: f64,
    /// Smaller clusters are dropped.
    points_min: usize,
}

/// A body is 0.26 m deep: both sides seen must stay together. At 20 m a person has few returns; 16 points lose 3 % of
/// the people.
const OURS: Radius = Radius { radius_m: 0.2, per_range: 0.005, shift_m: 0.1, points_min: POINTS_MIN };
/// As hdl_people_tracking has it.
const ADAPTED: Radius = Radius { radius_m: 0.2, per_range: 0.0, shift_m: 0.0, points_min: 16 };

/// Groups foreground points into people.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # use umbracast::Config;
/// # let points = somebody();
/// use umbracast::detect::Clusterer;
///
/// let config = Config::default();
/// let (mut clusterer, mut clusters) = (Clusterer::new(&config.detect, &config.site), Vec::new());
/// clusterer.clusters(&points, &[], &mut clusters);
/// assert_eq!(clusters, [(0..40).collect::<Vec<u32>>()], "one person, every point");
/// ```
#[derive(Debug, Clone)]
pub struct Clusterer {
    method: ClusterMethod,
    radius: Radius,
    /// Whether expected people guide split and merge.
    guided: bool,
    sensors_m: Vec<DVec3>,
    hall: Hall,
    grid: PlanGrid,
    /// Each point, moved behind the surface that its sensor saw, with its height above the floor.
    moved_m: Vec<DVec3>,
    canopies: Canopies,
    /// The points that are of no canopy.
    shown: Vec<u32>,
    plan_m: Vec<DVec2>,
    radius_m: Vec<f64>,
    labels: Vec<u32>,
    components: Vec<Cluster>,
    parts: Vec<Part>,
    memory: Memory,
    /// Clusters with the first point of each in the order of space.
    firsts: Vec<([f64; 3], Cluster)>,
}

impl Clusterer {
    /// Needs the site to know how far each point is from a sensor.
    ///
    /// ```
    /// use umbracast::{Config, detect::Clusterer};
    ///
    /// let config = Config::default();
    /// let mut clusters = vec![vec![7]];
    /// Clusterer::new(&config.detect, &config.site).clusters(&[], &[], &mut clusters);
    /// assert!(clusters.is_empty());
    /// ```
    pub fn new(config: &DetectConfig, site: &Site) -> Self {
        Self {
            method: config.clusters,
            radius: if config.clusters == ClusterMethod::Evidence { OURS } else { ADAPTED },
            guided: !config.without.contains(&Mechanism::GuidedAssignment),
            sensors_m: site.sensors.iter().map(|s| DVec3::from_array(s.position_m)).collect(),
            hall: site.hall.clone(),
            grid: PlanGrid::default(),
            moved_m: Vec::new(),
            canopies: Canopies::default(),
            shown: Vec::new(),
            plan_m: Vec::new(),
            radius_m: Vec::new(),
            labels: Vec::new(),
            components: Vec::new(),
            parts: Vec::new(),
            memory: Memory::default(),
            firsts: Vec::new(),
        }
    }

    /// One cluster a person, in an order that does not depend on the order of the points.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # use umbracast::{Config, detect::Point, geometry::DVec3};
    /// # let points = somebody();
    /// use umbracast::detect::Clusterer;
    ///
    /// let config = Config::default();
    /// let two = points.iter().flat_map(|p| [*p, Point { position_m: p.position_m + DVec3::X * 3.0, ..*p }]);
    /// let mut clusters = Vec::new();
    /// Clusterer::new(&config.detect, &config.site).clusters(&two.collect::<Vec<_>>(), &[], &mut clusters);
    /// assert_eq!(clusters.len(), 2);
    /// ```
    pub fn clusters(&mut self, points: &[Point], priors: &[Prior], clusters: &mut Vec<Cluster>) {
        clusters.drain(..).for_each(|cluster| self.memory.points.give(cluster));
        self.components(points);
        match self.method {
            ClusterMethod::Evidence => self.by_evidence(if self.guided { priors } else { &[] }, clusters),
            ClusterMethod::Haselich => self.by_dp_means(points, MergeMean::Mean, clusters),
            ClusterMethod::HaselichAsShipped => self.by_dp_means(points, MergeMean::Sum, clusters),
        }
        let first = |cluster: Cluster| {
            let places = cluster.iter().map(|&i| points[i as usize].position_m.to_array());
            (places.min_by(order).unwrap_or_default(), cluster)
        };
        self.firsts.extend(clusters.drain(..).map(first));
        self.firsts.sort_unstable_by(|(a, one), (b, other)| order(a, b).then_with(|| one.cmp(other)));
        clusters.extend(self.firsts.drain(..).map(|(_, cluster)| cluster));
    }

    /// Small components may be a limb of somebody, so what is too small is dropped last, and counts where somebody is
    /// expected.
    fn by_evidence(&mut self, priors: &[Prior], clusters: &mut Vec<Cluster>) {
        let Self { moved_m, parts, memory, .. } = self;
        for component in self.components.drain(..) {
            evidence::split(moved_m, priors, component, parts, memory);
        }
        evidence::merge(moved_m, parts, priors, memory);
        evidence::give_pieces(moved_m, parts, priors, memory);
        for part in parts.drain(..) {
            let is_person = part.expected || part.points.len() >= self.radius.points_min;
            if is_person { clusters.push(part.points) } else { memory.points.give(part.points) }
        }
    }

    fn by_dp_means(&mut self, points: &[Point], mean: MergeMean, clusters: &mut Vec<Cluster>) {
        for component in self.components.drain(..).filter(|c| c.len() >= self.radius.points_min) {
            haselich(points, &component, mean, clusters);
        }
    }

    /// Connected components in plan view.
    fn components(&mut self, points: &[Point]) {
        self.moved_m.clear();
        for point in points {
            let behind_m = (away(&self.sensors_m, point) * self.radius.shift_m).extend(0.0);
            self.moved_m.push(above_floor(&self.hall, point.position_m) + behind_m);
        }
        self.shown.clear();
        match self.method {
            ClusterMethod::Evidence => self.canopies.leave_out(&self.moved_m, &mut self.shown),
            ClusterMethod::Haselich | ClusterMethod::HaselichAsShipped => {
                self.shown.extend(0..points.len() as u32);
            }
        }
        self.plan_m.clear();
        self.radius_m.clear();
        for &i in &self.shown {
            let position_m = points[i as usize].position_m;
            let ranges_m2 = self.sensors_m.iter().map(|s| s.distance_squared(position_m));
            let range_m2 = ranges_m2.fold(f64::INFINITY, f64::min);
            let range_m = if range_m2.is_finite() { range_m2.sqrt() } else { 0.0 };
            self.plan_m.push(self.moved_m[i as usize].truncate());
            self.radius_m.push(self.radius.radius_m + self.radius.per_range * range_m);
        }
        let found =
            self.grid.components(&self.plan_m, &self.radius_m, self.radius.radius_m, &mut self.labels);
        self.components.resize_with(found, || self.memory.take_points());
        for (&label, &i) in self.labels.iter().zip(&self.shown) {
            self.components[label as usize].push(i);
        }
    }
}

fn order(a: &[f64; 3], b: &[f64; 3]) -> std::cmp::Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
}

/// DP-means and the merge; what is merged keeps the order of the points.
fn haselich(points: &[Point], component: &[u32], mean: MergeMean, clusters: &mut Vec<Cluster>) {
    let plan_m: Vec<DVec2> = component.iter().map(|&i| points[i as usize].position_m.truncate()).collect();
    let labels = dp_means::split(&plan_m);
    let mut parts: Vec<(Cluster, Vec<DVec2>)> = Vec::new();
    parts.resize_with(labels.iter().max().map_or(0, |&l| l + 1), Default::default);
    for ((&label, &i), &p) in labels.iter().zip(component).zip(&plan_m) {
        parts[label].0.push(i);
        parts[label].1.push(p);
    }
    parts.retain(|(part, _)| !part.is_empty());
    let (mut people, plans): (Vec<Cluster>, Vec<Vec<DVec2>>) = parts.into_iter().unzip();
    for (part, into) in dp_means::merge(&plans, mean).into_iter().enumerate() {
        if into != part {
            let moved = std::mem::take(&mut people[part]);
            people[into].extend(moved);
            people[into].sort_unstable();
        }
    }
    clusters.extend(people.into_iter().filter(|person| !person.is_empty()));
}
