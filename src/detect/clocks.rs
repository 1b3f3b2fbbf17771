//! Checks whether the sensors' clocks agree, from people whom several sensors see, and corrects times if they do not.
//!
//! A sensor whose clock is ahead gives people a late time stamp. Compared with the other sensors' view, a person then
//! lies behind by the clock's error times the velocity. Two sensors' views of one body differ for other reasons too:
//! each sees its own side, and poses have errors. But these do not turn with the walking direction. Least squares
//! separate the three once people have walked in different directions. The mean of all clocks cannot be determined,
//! so the correction leaves it unchanged.

use super::{Cluster, Point, Prior};
use crate::Site;
use crate::config::DetectConfig;
use crate::geometry::{DVec2, DVec3, cholesky};

/// Every so many-th frame is looked at: half a step later the legs of the same walker tell something new.
const EVERY: u32 = 3;
/// After so many looks the sums are asked,
const LOOKS: u32 = 50;
/// and forgotten, with this many, whatever they said: clocks drift.
const LOOKS_MAX: u32 = 600;
/// Who walks slower tells little; slower than this and he turns on the spot.
const WALKS_MPS: f64 = 0.5;
/// Nobody else may be so near: of two people each sensor could see another one.
const ALONE_M: f64 = 1.2;
/// Points of a person lie about where he is expected.
const OWN_M: f64 = 0.5;
/// Fewer points of a sensor show a limb.
const POINTS_MIN: f64 = 8.0;
/// Two views of one body that lie farther apart are of two.
const APART_M: f64 = 0.4;
/// Less than this is left as it is: somebody who walks is 1 cm elsewhere.
const AHEAD_MIN_S: f64 = 0.006;
/// What is found has to be known so well, one standard deviation, and lie so many of these from nothing.
const SIGMA_MAX_S: f64 = 0.003;
const SIGMAS: f64 = 4.0;
/// The same of what has been put right before: that it was wrong is known, by how much is found better and better.
const AGAIN_MIN_S: f64 = 0.002;
const AGAIN_SIGMAS: f64 = 2.0;
/// What is more is not a small error: `umbracast calibrate` finds it.
const AHEAD_MAX_S: f64 = 0.06;
/// Rows of one walker are much alike: what they tell is this much less sure than if each were by itself. Measured: in 8
/// simulated scenes what was found of clocks that agree was off by up to 2.8 of what rows by themselves would give.
const ALIKE: f64 = 1.5;
/// What is known before, one standard deviation: of a clock, of a place, of how deep a body is seen, seconds and metres; and how
/// large a row's error is taken to be beside that.
const KNOWN: f64 = 0.1;
const ROW_M: f64 = 0.05;
/// Fewer rows tell nothing, not even how far they scatter.
const ROWS_MIN: f64 = 20.0;
/// Half the depth of a body, by which its near side lies nearer to a sensor.
const DEPTH_M: f64 = 0.1;

/// Follows how far every sensor's clock is ahead of the others'.
///
/// ```
/// use umbracast::{Config, detect::Clocks};
///
/// let config = Config::default();
/// let mut clocks = Clocks::new(&config.detect, &config.site);
/// clocks.follow(&[], &[], &[]);
/// assert_eq!(clocks.ahead_s(0), 0.0, "nobody walks: nothing can be told");
/// ```
#[derive(Debug, Clone)]
pub struct Clocks {
    /// None where sensors are not to be followed.
    sensors: Vec<Clock>,
    frames: u32,
    looks: u32,
    corrected: u64,
}

/// One sensor's.
#[derive(Debug, Clone)]
struct Clock {
    place_m: DVec2,
    /// What is taken to be the error.
    ahead_s: f64,
    /// Of the person that is looked at.
    view: View,
    sums: Sums,
}

/// What a sensor sees of somebody: how many points, where they are and where it stands from there, both summed up.
#[derive(Debug, Clone, Copy, Default)]
struct View {
    points: f64,
    sum_m: DVec2,
    towards: DVec2,
}

/// What is unknown of how a sensor sees people beside the others: its clock, its place (two), and how deep bodies are.
#[derive(Debug, Clone, Default)]
struct Sums {
    rows: f64,
    matrix: [[f64; 4]; 4],
    right: [f64; 4],
    squares: f64,
}

impl Clocks {
    /// Of a site's sensors, whose clocks agree until they are seen not to.
    pub fn new(config: &DetectConfig, site: &Site) -> Self {
        let clock = |sensor: &crate::site::Sensor| Clock {
            place_m: DVec3::from_array(sensor.position_m).truncate(),
            ahead_s: 0.0,
            view: View::default(),
            sums: Sums::default(),
        };
        let several = config.follow_sensors && site.sensors.len() > 1;
        let sensors = site.sensors.iter().filter(|_| several).map(clock).collect();
        Self { sensors, frames: 0, looks: 0, corrected: 0 }
    }

    /// How far a sensor's clock is taken to be ahead of the mean of all.
    ///
    /// ```
    /// # use umbracast::{Config, detect::Clocks};
    /// # let config = Config::default();
    /// assert_eq!(Clocks::new(&config.detect, &config.site).ahead_s(1), 0.0);
    /// ```
    pub fn ahead_s(&self, sensor: usize) -> f64 {
        self.sensors.get(sensor).map_or(0.0, |clock| clock.ahead_s)
    }

    /// How often clocks were put right.
    ///
    /// ```
    /// # use umbracast::{Config, detect::Clocks};
    /// # let config = Config::default();
    /// assert_eq!(Clocks::new(&config.detect, &config.site).corrected(), 0);
    /// ```
    pub fn corrected(&self) -> u64 {
        self.corrected
    }

    /// Gives points the times that the others' clocks would have given them.
    ///
    /// ```
    /// # use umbracast::{Config, detect::{Clocks, Point}, geometry::DVec3};
    /// # let config = Config::default();
    /// let mut points = [Point { position_m: DVec3::ZERO, time_ns: 70_000_000, sensor: 1 }];
    /// Clocks::new(&config.detect, &config.site).put_right(&mut points);
    /// assert_eq!(points[0].time_ns, 70_000_000, "nothing is wrong as far as is known");
    /// ```
    pub fn put_right(&self, points: &mut [Point]) {
        if self.sensors.iter().any(|clock| clock.ahead_s != 0.0) {
            for point in points {
                point.time_ns -= (self.ahead_s(point.sensor.into()) * 1e9) as i64;
            }
        }
    }

    /// Looks at the people of a frame, whose times are put right as far as is known.
    ///
    /// ```
    /// # use umbracast::{Config, detect::Clocks};
    /// # let config = Config::default();
    /// let mut clocks = Clocks::new(&config.detect, &config.site);
    /// clocks.follow(&[], &[], &[]);
    /// assert_eq!(clocks.corrected(), 0);
    /// ```
    pub fn follow(&mut self, points: &[Point], clusters: &[Cluster], priors: &[Prior]) {
        let look = self.frames.is_multiple_of(EVERY);
        self.frames = self.frames.wrapping_add(1);
        if self.sensors.is_empty() || !look {
            return;
        }
        for cluster in clusters {
            if let Some(who) = walks_alone(points, cluster, priors) {
                self.look(points, cluster, who.velocity_mps);
            }
        }
        self.looks += 1;
        if self.looks.is_multiple_of(LOOKS) {
            self.judge();
        }
        if self.looks >= LOOKS_MAX {
            self.forget();
        }
    }

    /// One person, seen by each sensor and by all others together.
    fn look(&mut self, points: &[Point], cluster: &[u32], velocity_mps: DVec2) {
        let begin_ns = points[cluster[0] as usize].time_ns;
        self.sensors.iter_mut().for_each(|clock| clock.view = View::default());
        for point in cluster.iter().map(|&i| &points[i as usize]) {
            let Some(clock) = self.sensors.get_mut(usize::from(point.sensor)) else { continue };
            let late_s = (point.time_ns - begin_ns) as f64 * 1e-9;
            let at_m = point.position_m.truncate() - velocity_mps * late_s;
            clock.view = clock.view.plus(1.0, at_m, (clock.place_m - at_m).normalize_or_zero());
        }
        let all = self
            .sensors
            .iter()
            .fold(View::default(), |all, Clock { view, .. }| all.plus(view.points, view.sum_m, view.towards));
        for Clock { view, sums, .. } in &mut self.sensors {
            let rest = all.plus(-view.points, -view.sum_m, -view.towards);
            if view.points.min(rest.points) < POINTS_MIN {
                continue;
            }
            let off_m = view.sum_m / view.points - rest.sum_m / rest.points;
            let sides = view.towards / view.points - rest.towards / rest.points;
            let left_m = off_m - DEPTH_M * sides;
            if left_m.length() < APART_M {
                sums.add([-velocity_mps.x, 1.0, 0.0, sides.x], left_m.x);
                sums.add([-velocity_mps.y, 0.0, 1.0, sides.y], left_m.y);
            }
        }
    }

    /// Takes over what is known well enough.
    fn judge(&mut self) {
        // Against the mean of the others a clock is ahead by more than against the mean of all.
        let share = 1.0 - 1.0 / self.sensors.len() as f64;
        let (least_s, sigmas) =
            if self.corrected == 0 { (AHEAD_MIN_S, SIGMAS) } else { (AGAIN_MIN_S, AGAIN_SIGMAS) };
        let mut changed = false;
        for clock in &mut self.sensors {
            let Some((ahead_s, sigma_s)) = clock.sums.ahead_s() else { continue };
            let all_s = clock.ahead_s + share * ahead_s;
            let is_known = sigma_s < SIGMA_MAX_S && ahead_s.abs() > least_s.max(sigmas * sigma_s);
            if is_known && all_s.abs() < AHEAD_MAX_S {
                clock.ahead_s = all_s;
                changed = true;
            }
        }
        if changed {
            self.corrected += 1;
            self.forget();
        }
    }

    fn forget(&mut self) {
        self.sensors.iter_mut().for_each(|clock| clock.sums = Sums::default());
        self.looks = 0;
    }
}

impl View {
    fn plus(self, points: f64, sum_m: DVec2, towards: DVec2) -> Self {
        Self { points: self.points + points, sum_m: self.sum_m + sum_m, towards: self.towards + towards }
    }
}

impl Sums {
    fn add(&mut self, slopes: [f64; 4], value_m: f64) {
        self.rows += 1.0;
        self.squares += value_m * value_m;
        for i in 0..4 {
            self.right[i] += slopes[i] * value_m;
            for j in 0..4 {
                self.matrix[i][j] += slopes[i] * slopes[j];
            }
        }
    }

    /// How far the clock is ahead of the others', and one standard deviation of that.
    fn ahead_s(&self) -> Option<(f64, f64)> {
        if self.rows < ROWS_MIN {
            return None;
        }
        let mut matrix = self.matrix;
        (0..4).for_each(|i| matrix[i][i] += (ROW_M / KNOWN).powi(2));
        let found = cholesky(matrix, self.right)?;
        let explained: f64 = found.iter().zip(&self.right).map(|(x, b)| x * b).sum();
        let variance_m2 = (self.squares - explained).max(0.0) / self.rows;
        let inverse = cholesky(matrix, [1.0, 0.0, 0.0, 0.0])?;
        Some((found[0], ALIKE * (variance_m2 * inverse[0]).sqrt()))
    }
}

/// Who is known to walk where these points are, and nobody else near.
fn walks_alone<'a>(points: &[Point], cluster: &[u32], priors: &'a [Prior]) -> Option<&'a Prior> {
    let sum_m: DVec2 = cluster.iter().map(|&i| points[i as usize].position_m.truncate()).sum();
    let mean_m = sum_m / cluster.len().max(1) as f64;
    let mut near = priors.iter().filter(|prior| prior.position_m.distance(mean_m) < ALONE_M);
    let who = near.next().filter(|_| near.next().is_none())?;
    let walks =
        who.confirmed && who.velocity_mps.length() > WALKS_MPS && who.position_m.distance(mean_m) < OWN_M;
    walks.then_some(who)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::Config;

    /// What is found of the second sensor after two minutes of five people who walk about at `speed_mps`, if its clock is ahead
    /// by so much, and how often clocks were put right. Each sensor sees the side that looks at it, legs at random.
    fn found_s(ahead_s: f64, speed_mps: f64) -> (f64, u64) {
        let config = Config::default();
        let mut clocks = Clocks::new(&config.detect, &config.site);
        let sensors_m: Vec<DVec2> =
            config.site.sensors.iter().map(|s| DVec3::from_array(s.position_m).truncate()).collect();
        for frame in 0..1200_i32 {
            let (mut points, mut clusters, mut priors) = (Vec::new(), Vec::new(), Vec::new());
            let noise = |k: i32| (f64::from(frame * 7 + k) * 12.9898).sin() * 43_758.547 % 0.5;
            for person in 0..5 {
                let turn = 0.13 * f64::from(frame) * 0.1 + TAU / 5.0 * f64::from(person);
                let velocity_mps = DVec2::from_angle(1.7 * turn) * speed_mps;
                let position_m = DVec2::from_angle(turn) * 6.0;
                let first = points.len() as u32;
                for (sensor, at_m) in sensors_m.iter().enumerate() {
                    let error_s = if sensor == 1 { ahead_s } else { 0.0 };
                    let seen_s = 0.03 * sensor as f64 - clocks.ahead_s(sensor);
                    let side_m = (*at_m - position_m).normalize() * 0.13
                        + DVec2::new(noise(person * 4 + sensor as i32), noise(person * 9 + sensor as i32))
                            * 0.2;
                    for k in 0..12 {
                        let along_m = velocity_mps * 0.03 * sensor as f64;
                        let place_m = position_m + along_m + side_m;
                        points.push(Point {
                            position_m: place_m.extend(0.1 * f64::from(k)),
                            time_ns: ((0.1 * f64::from(frame) + seen_s + error_s) * 1e9) as i64,
                            sensor: sensor as u16,
                        });
                    }
                }
                clusters.push((first..points.len() as u32).collect::<Cluster>());
                priors.push(Prior {
                    position_m,
                    velocity_mps,
                    position_sigma_m: 0.05,
                    height_m: 1.7,
                    confirmed: true,
                    walked: false,
                    is_furniture: false,
                    shape: None,
                });
            }
            clocks.follow(&points, &clusters, &priors);
        }
        (clocks.ahead_s(1) - clocks.ahead_s(0), clocks.corrected())
    }

    #[test]
    fn a_clock_that_is_ahead_or_behind_is_found_by_who_walks_and_shared_out_evenly() {
        for ahead_s in [0.02, -0.045] {
            let (found_s, corrected) = found_s(ahead_s, 1.2);
            assert!((found_s - ahead_s).abs() < 0.005 && corrected > 0, "{found_s} for {ahead_s}");
        }
    }

    #[test]
    fn clocks_that_agree_are_left_and_who_stands_tells_nothing() {
        assert_eq!(found_s(0.0, 1.2), (0.0, 0));
        assert_eq!(found_s(0.03, 0.2), (0.0, 0));
    }

    #[test]
    fn what_is_more_than_a_small_error_is_left_to_calibrate() {
        assert_eq!(found_s(0.15, 1.2), (0.0, 0));
    }

    #[test]
    fn times_are_put_right_by_what_was_found() {
        let config = Config::default();
        let mut clocks = Clocks::new(&config.detect, &config.site);
        clocks.sensors[1].ahead_s = 0.01;
        let mut points = [0, 1].map(|sensor| Point { position_m: DVec3::ZERO, time_ns: 50_000_000, sensor });
        clocks.put_right(&mut points);
        assert_eq!(points.map(|p| p.time_ns), [50_000_000, 40_000_000]);
    }
}
