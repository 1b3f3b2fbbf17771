//! The probability that a link is blocked, now and within each window: everybody's way is sampled together
//! from the forecast's joint distribution, with body sizes and headings, and rays are cast in every sample.
//! Steps of a window, and links that share a blocker, hang together as they do in reality.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;

use super::body::{BodySize, UprightBody};
use super::caster::{heading_at, position_at};
use crate::config::BlockageConfig;
use crate::forecast::Forecast;
use crate::geometry::{DVec2, DVec3};
use crate::site::Ue;
use crate::track::Track;
use crate::{STEP_S, STEPS};

/// Nobody's body reaches farther from its axis than this, metres.
const REACH_M: f64 = 0.6;

/// Samples of all people in one frame.
#[derive(Debug, Default)]
pub struct Sampler {
    samples: usize,
    people: Vec<Ways>,
    blocked: Vec<bool>,
}

/// Samples of one person. Positions of step s, sample k at `s * samples + k`; step 0 is now.
#[derive(Debug, Default)]
struct Ways {
    positions_m: Vec<DVec2>,
    /// Unit vector of the heading, the same indices.
    ahead: Vec<DVec2>,
    /// By sample.
    height_m: Vec<f64>,
    /// By sample: factor on the trunk's width and depth.
    girth: Vec<f64>,
    /// By step: middle of the samples and how far the farthest lies from it.
    center_m: [DVec2; STEPS + 1],
    spread_m: [f64; STEPS + 1],
    height_max_m: f64,
}

impl Sampler {
    /// Draws everybody's ways. A person's draws depend on the seed, the track and nothing else, so the samples
    /// of one frame and the next differ only by what the tracks learned.
    pub fn draw(&mut self, config: &BlockageConfig, people: &[(&Track, &Forecast)]) {
        self.samples = config.samples.max(1);
        self.people.resize_with(people.len(), Ways::default);
        for (ways, (track, forecast)) in self.people.iter_mut().zip(people) {
            ways.draw(config, self.samples, track, forecast);
        }
    }

    /// Probability that the link of `person` is blocked now, and within each window.
    pub fn probabilities(
        &mut self,
        size: &BodySize,
        ue: &Ue,
        ap_m: DVec3,
        person: usize,
    ) -> (f64, [f64; STEPS]) {
        let n = self.samples;
        let share = |blocked: &[bool]| blocked.iter().filter(|&&b| b).count() as f64 / n as f64;
        self.blocked.clear();
        self.blocked.resize(n, false);
        self.mark(size, ue, ap_m, person, 0);
        let p_now = share(&self.blocked);
        self.blocked.fill(false);
        let mut p = [0.0; STEPS];
        for step in 1..=STEPS {
            self.mark(size, ue, ap_m, person, step);
            p[step - 1] = share(&self.blocked);
        }
        (p_now, p)
    }

    /// Marks the samples whose link is blocked at `step`; those marked already stay so.
    fn mark(&mut self, size: &BodySize, ue: &Ue, ap_m: DVec3, person: usize, step: usize) {
        let q = &self.people[person];
        let ap = ap_m.truncate();
        let reach_m = REACH_M + ue.forward_m.abs() + ue.left_m.abs();
        for (other, p) in self.people.iter().enumerate() {
            if other == person || !may_block(ap_m, ue, q, p, step) {
                continue;
            }
            for (k, blocked) in self.blocked.iter_mut().enumerate() {
                let i = step * self.samples + k;
                let (at_p, at_q) = (p.positions_m[i], q.positions_m[i]);
                // Whoever stands beyond the UE cannot be in the way.
                if *blocked || at_p.distance_squared(ap) > (at_q.distance(ap) + reach_m).powi(2) {
                    continue;
                }
                let heading_rad = q.ahead[i].to_angle();
                let ue_m = ue.on_body(at_q, heading_rad, q.height_m[k]);
                let girth = p.girth[k];
                let size = BodySize {
                    trunk_depth_m: size.trunk_depth_m * girth,
                    trunk_width_m: size.trunk_width_m * girth,
                    ..*size
                };
                *blocked = UprightBody::new(&size, at_p, p.ahead[i], p.height_m[k]).hit(ap_m, ue_m).is_some();
            }
        }
    }
}

/// False where no sample of `p` can stand in the way of any sample of `q`: seen from above it is too far from
/// the segment.
fn may_block(ap_m: DVec3, ue: &Ue, q: &Ways, p: &Ways, step: usize) -> bool {
    let (start, end) = (ap_m.truncate(), q.center_m[step]);
    let along = end - start;
    let t = ((p.center_m[step] - start).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
    let reach = REACH_M + ue.forward_m.abs() + ue.left_m.abs() + p.spread_m[step] + q.spread_m[step];
    if p.center_m[step].distance_squared(start + along * t) > reach * reach {
        return false;
    }
    // The ray comes down to the UE: near the access point it passes over everybody's head.
    let slack = (reach / along.length().max(1e-6)).min(1.0);
    let low = ap_m.z + (ue.height_share * q.height_max_m - ap_m.z) * (t + slack).min(1.0);
    low.min(ap_m.z.max(ue.height_share * q.height_max_m)) <= p.height_max_m
}

impl Ways {
    fn draw(&mut self, config: &BlockageConfig, samples: usize, track: &Track, forecast: &Forecast) {
        let mut random = Pcg64Mcg::seed_from_u64(config.seed ^ track.id.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut normal = || random.sample::<f64, _>(StandardNormal);
        let state_root = root(&forecast.coupling.state);
        // A constant acceleration over each step with the step's share of the white one.
        let kick_root_mps2 = root(&forecast.coupling.acceleration_psd.map(|row| row.map(|psd| psd / STEP_S)));
        self.positions_m.resize((STEPS + 1) * samples, DVec2::ZERO);
        self.ahead.resize((STEPS + 1) * samples, DVec2::X);
        self.height_m.clear();
        self.girth.clear();
        let means: [(DVec2, f64); STEPS + 1] =
            std::array::from_fn(|s| (position_at(track, forecast, s), heading_at(track, forecast, s)));
        for k in 0..samples {
            let z = [normal(), normal(), normal(), normal()];
            let e: [f64; 4] = std::array::from_fn(|r| (0..=r).map(|c| state_root[r][c] * z[c]).sum());
            let (mut offset, mut drift) = (DVec2::new(e[0], e[1]), DVec2::new(e[2], e[3]));
            let turn = config.heading_sigma_deg.to_radians() * normal();
            self.height_m.push((track.height_m + config.height_sigma_m * normal()).max(0.5));
            self.girth.push((1.0 + config.size_sigma_share * normal()).clamp(0.5, 1.8));
            for (s, &(mean_m, heading_rad)) in means.iter().enumerate() {
                if s > 0 {
                    let z = [normal(), normal()];
                    let [[xx, _], [xy, yy]] = kick_root_mps2;
                    let kick = DVec2::new(xx * z[0], xy * z[0] + yy * z[1]);
                    offset += drift * STEP_S + kick * (0.5 * STEP_S * STEP_S);
                    drift += kick * STEP_S;
                }
                self.positions_m[s * samples + k] = mean_m + offset;
                self.ahead[s * samples + k] = DVec2::from_angle(heading_rad + turn);
            }
        }
        self.height_max_m = self.height_m.iter().fold(0.0, |a, &b| a.max(b));
        for s in 0..=STEPS {
            let center = means[s].0;
            self.center_m[s] = center;
            self.spread_m[s] = self.positions_m[s * samples..(s + 1) * samples]
                .iter()
                .fold(0.0_f64, |a, p| a.max(p.distance_squared(center)))
                .sqrt();
        }
    }
}

/// Lower Cholesky factor of a covariance; a direction without variance gets none.
fn root<const N: usize>(a: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut l = [[0.0; N]; N];
    for r in 0..N {
        for c in 0..=r {
            let rest = a[r][c] - (0..c).map(|i| l[r][i] * l[c][i]).sum::<f64>();
            l[r][c] = if r == c {
                rest.max(0.0).sqrt()
            } else if l[c][c] > 0.0 {
                rest / l[c][c]
            } else {
                0.0
            };
        }
    }
    l
}
