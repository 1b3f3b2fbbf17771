//! The probability that a link is blocked, now and within each window: everybody's trajectory is sampled together
//! from the forecast's joint distribution, with body sizes, headings and the phase of the gait, and rays are cast in
//! every sample. Steps of a window, and links that share a blocker, hang together as they do in reality.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use super::body::{self, Posture, distance2_to_segment};
use super::draws::Draws;
use super::numbers::Numbers;
use super::steps::{heading_at, position_at};
use crate::forecast::Forecast;
use crate::gait::{self, GaitPhase, WALKS_FROM_MPS};
use crate::geometry::{DVec2, DVec3};
use crate::site::Ue;
use crate::track::Track;
use crate::{STEP_S, STEPS};

/// Quantiles of times that are reported.
const LEVELS: [f64; 3] = [0.1, 0.5, 0.9];

/// What the samples say of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chances {
    /// That it is blocked now.
    pub p_now: f64,
    /// Index w - 1: that it is blocked at any of steps 1..=w.
    pub p: [f64; STEPS],
    /// Quantiles of the time until it is blocked, over the samples in which it is in sight now.
    pub onset_s: [Option<f64>; 3],
    /// Quantiles of the time until it is clear, over the samples in which it is blocked now.
    pub clear_s: [Option<f64>; 3],
    /// Quantiles of the time until it is clear again, over the samples in which it is in sight now and will be
    /// blocked. `None` where the chance of that is too small for an onset.
    pub clear_again_s: [Option<f64>; 3],
}

/// Samples of all people in one frame.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    samples: usize,
    /// By track: what a person's samples are made of, drawn once.
    draws: BTreeMap<u64, Draws>,
    people: Vec<Trajectories>,
    /// By sample: bit s set where the link is blocked at step s.
    blocked: Vec<u16>,
}

/// Samples of one person. Positions of step s, sample k at `s * samples + k`; step 0 is now.
#[derive(Debug, Clone, Default)]
struct Trajectories {
    positions_m: Vec<DVec2>,
    /// By step: the heading's unit vector, to be turned by the sample's `turn`.
    ahead: [DVec2; STEPS + 1],
    traits: Vec<Traits>,
    /// By step: middle of the samples and how far the farthest lies from it.
    center_m: [DVec2; STEPS + 1],
    spread_m: [f64; STEPS + 1],
    height_min_m: f64,
    height_max_m: f64,
    reach_m: f64,
}

/// What stays through the steps of a sample.
#[derive(Debug, Clone, Copy)]
struct Traits {
    turn: DVec2,
    height_m: f64,
    width_scale: f64,
    speed_mps: f64,
    phase_rad: f64,
    phase_step_rad: f64,
    arm_swing: f64,
}

impl Sampler {
    /// Draws everybody's trajectories. A person's draws depend on the seed, the track and nothing else, so the samples
    /// of one frame and the next differ only by what the tracks learned.
    pub fn draw(&mut self, numbers: &Numbers, people: &[(&Track, &Forecast)]) {
        self.samples = numbers.samples;
        self.people.resize_with(people.len(), Trajectories::default);
        self.draws.retain(|&id, _| people.iter().any(|(track, _)| track.id == id));
        for (trajectories, (track, forecast)) in self.people.iter_mut().zip(people) {
            let draws = self
                .draws
                .entry(track.id)
                .or_insert_with(|| Draws::new(numbers.samples, numbers.seed, track.id));
            trajectories.fill(numbers, draws, track, forecast);
        }
    }

    /// What becomes of the link of `person`.
    pub fn chances(&mut self, numbers: &Numbers, ue: &Ue, ap_m: DVec3, person: usize) -> Chances {
        self.blocked.clear();
        self.blocked.resize(self.samples, 0);
        for step in 0..=STEPS {
            self.mark(numbers, ue, ap_m, person, step);
        }
        let blocked = &self.blocked;
        let share =
            |steps: u16| blocked.iter().filter(|&&at| at & steps != 0).count() as f64 / blocked.len() as f64;
        // Steps after now until the bits are no longer zero; 16 where they never are.
        let first = |bits: u16| bits.trailing_zeros();
        let onsets = blocked.iter().filter(|&&at| at & 1 == 0).map(|&at| first(at));
        let clears = blocked.iter().filter(|&&at| at & 1 == 1).map(|&at| first(!at & ALL_STEPS));
        // From the first blocked step on.
        let coming = blocked.iter().filter(|&&at| at & 1 == 0 && at != 0);
        let again = coming.map(|&at| first(!at & ALL_STEPS & (u16::MAX << first(at))));
        let onset_s = quantiles_s(onsets);
        Chances {
            p_now: share(1),
            p: std::array::from_fn(|w| share((1 << (w + 2)) - 2)),
            onset_s,
            clear_s: quantiles_s(clears),
            clear_again_s: if onset_s[0].is_some() { quantiles_s(again) } else { [None; 3] },
        }
    }

    /// Sets the bit of `step` in the samples whose link is blocked then.
    fn mark(&mut self, numbers: &Numbers, ue: &Ue, ap_m: DVec3, person: usize, step: usize) {
        let q = &self.people[person];
        let ap = ap_m.truncate();
        let ue_reach_m = ue.forward_m.abs() + ue.left_m.abs();
        for (other, p) in self.people.iter().enumerate() {
            if other == person || !may_block(ap_m, ue, q, p, step) {
                continue;
            }
            let reach_m = p.reach_m + ue_reach_m;
            for (k, blocked) in self.blocked.iter_mut().enumerate() {
                let i = step * self.samples + k;
                let (at_p, at_q) = (p.positions_m[i], q.positions_m[i]);
                // Already blocked by another, or nobody near the segment seen from above.
                if *blocked & (1 << step) != 0 || distance2_to_segment(at_p, ap, at_q) > reach_m * reach_m {
                    continue;
                }
                let heading_rad = || q.ahead[step].rotate(q.traits[k].turn).to_angle();
                let facing_rad = if ue_reach_m > 0.0 { heading_rad() } else { 0.0 };
                let ue_m = ue.on_body(at_q, facing_rad, q.traits[k].height_m);
                if body::blocks(&numbers.body, &p.posture(step, k, at_p), ap_m, ue_m) {
                    *blocked |= 1 << step;
                }
            }
        }
    }
}

/// Bits of now and all steps.
const ALL_STEPS: u16 = (1 << (STEPS + 1)) - 1;

/// Of times given in steps; `None` where a quantile lies beyond the last step, or over nothing.
fn quantiles_s(steps: impl Iterator<Item = u32>) -> [Option<f64>; 3] {
    let mut counts = [0_usize; STEPS + 1];
    let mut total = 0;
    for step in steps {
        total += 1;
        if let Some(count) = counts.get_mut(step as usize) {
            *count += 1;
        }
    }
    LEVELS.map(|level| {
        let mut sum = 0;
        let reached = |step: &usize| {
            sum += counts[*step];
            sum > 0 && sum as f64 >= level * total as f64
        };
        (0..=STEPS).find(reached).map(|step| step as f64 * STEP_S)
    })
}

/// False where no sample of `p` can stand in the way of any sample of `q`: seen from above it is too far from
/// the segment.
fn may_block(ap_m: DVec3, ue: &Ue, q: &Trajectories, p: &Trajectories, step: usize) -> bool {
    let (start, end) = (ap_m.truncate(), q.center_m[step]);
    let along = end - start;
    let t = ((p.center_m[step] - start).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
    let reach = p.reach_m + ue.forward_m.abs() + ue.left_m.abs() + p.spread_m[step] + q.spread_m[step];
    if p.center_m[step].distance_squared(start + along * t) > reach * reach {
        return false;
    }
    // The ray comes down to the UE: near the access point it passes over everybody's head. It is lowest towards the
    // lowest UE, at one end of the stretch near `p`.
    let slack = (reach / along.length().max(1e-6)).min(1.0);
    let rise_m = ue.height_share * q.height_min_m - ap_m.z;
    let lowest_m = ap_m.z + (rise_m * (t - slack).max(0.0)).min(rise_m * (t + slack).min(1.0));
    lowest_m <= p.height_max_m
}

impl Trajectories {
    fn fill(&mut self, numbers: &Numbers, draws: &Draws, track: &Track, forecast: &Forecast) {
        let samples = numbers.samples;
        let state_root = root(&forecast.coupling.state);
        // Process noise: a constant acceleration over each step with the step's share of the white one.
        let noise_root_mps2 =
            root(&forecast.coupling.acceleration_psd_m2ps3.map(|row| row.map(|psd| psd / STEP_S)));
        self.positions_m.resize((STEPS + 1) * samples, DVec2::ZERO);
        self.traits.clear();
        let means: [DVec2; STEPS + 1] = std::array::from_fn(|s| position_at(track, forecast, s));
        self.ahead = std::array::from_fn(|s| DVec2::from_angle(heading_at(track, forecast, s)));
        let velocity = track.velocity_mps;
        let phases = Phases::new(&track.gait);
        for k in 0..samples {
            let e: [f64; 4] =
                std::array::from_fn(|r| (0..=r).map(|c| state_root[r][c] * draws.state[c][k]).sum());
            let (mut offset, mut drift) = (DVec2::new(e[0], e[1]), DVec2::new(e[2], e[3]));
            self.traits.push(Traits::new(numbers, draws, k, track, velocity, drift, &phases));
            for (s, &mean_m) in means.iter().enumerate() {
                if s > 0 {
                    let [x, y] = &draws.process_noise[s - 1];
                    let [[xx, _], [xy, yy]] = noise_root_mps2;
                    let noise_mps2 = DVec2::new(xx * x[k], xy * x[k] + yy * y[k]);
                    offset += drift * STEP_S + noise_mps2 * (0.5 * STEP_S * STEP_S);
                    drift += noise_mps2 * STEP_S;
                }
                // Drawn each by itself: every step takes its positions from other samples.
                let at = if numbers.joint { k } else { (k + s * 37) % samples };
                self.positions_m[s * samples + at] = mean_m + offset;
            }
        }
        self.height_min_m = self.traits.iter().fold(f64::INFINITY, |a, b| a.min(b.height_m));
        self.height_max_m = self.traits.iter().fold(0.0, |a, b| a.max(b.height_m));
        let width_max = self.traits.iter().fold(1.0, |a: f64, b| a.max(b.width_scale));
        let fastest_mps = self.traits.iter().fold(0.0, |a: f64, b| a.max(b.speed_mps));
        self.reach_m = body::reach_m(&numbers.body, self.height_max_m, width_max, fastest_mps);
        for s in 0..=STEPS {
            let center = means[s];
            self.center_m[s] = center;
            self.spread_m[s] = self.positions_m[s * samples..(s + 1) * samples]
                .iter()
                .fold(0.0_f64, |a, p| a.max(p.distance_squared(center)))
                .sqrt();
        }
    }

    fn posture(&self, step: usize, k: usize, position_m: DVec2) -> Posture {
        let t = &self.traits[k];
        Posture {
            position_m,
            ahead: self.ahead[step].rotate(t.turn),
            height_m: t.height_m,
            width_scale: t.width_scale,
            speed_mps: t.speed_mps,
            phase_rad: t.phase_rad + step as f64 * t.phase_step_rad,
            arm_swing: t.arm_swing,
        }
    }
}

impl Traits {
    fn new(
        numbers: &Numbers,
        draws: &Draws,
        k: usize,
        track: &Track,
        velocity: DVec2,
        drift: DVec2,
        phases: &Phases,
    ) -> Self {
        let height_sigma_m = track.height_sigma_m.hypot(numbers.height_sigma_m);
        let height_m = (track.height_m + height_sigma_m * draws.height[k]).max(0.5);
        let width_sigma = track.width_scale_sigma.hypot(numbers.width_sigma);
        let speed_mps = (velocity + drift).length();
        let trunk_rad = numbers.heading_sigma_rad;
        let turn_rad = if velocity.length() > WALKS_FROM_MPS {
            // Who walks faces where he goes: an error of the velocity is one of the heading.
            velocity.perp_dot(drift) / velocity.length_squared() + trunk_rad * draws.heading[k]
        } else {
            track.heading_sigma_rad.hypot(trunk_rad) * draws.heading[k]
        };
        let stride_m = gait::stride_m(speed_mps, height_m);
        Self {
            turn: DVec2::from_angle(turn_rad),
            height_m,
            width_scale: (track.width_scale + width_sigma * draws.width[k]).clamp(0.5, 1.8),
            speed_mps,
            phase_rad: phases.at(draws.phase[k]),
            phase_step_rad: if stride_m > 0.0 { TAU * speed_mps * STEP_S / stride_m } else { 0.0 },
            arm_swing: if draws.arm_swing[k] < numbers.body.arms.still_share { 0.0 } else { 1.0 },
        }
    }
}

/// Quantiles of the phase of a gait.
#[derive(Debug, Clone)]
pub struct Phases {
    first_rad: f64,
    /// Share of the phases up to each of so many equal steps of a turn, the first from opposite the likeliest phase.
    shares: [f64; PHASES],
}

const PHASES: usize = 48;

impl Phases {
    /// Of a von Mises distribution.
    pub fn new(gait: &GaitPhase) -> Self {
        let width_rad = TAU / PHASES as f64;
        let density = |i: usize| {
            let off_rad = (i as f64 + 0.5) * width_rad - PI;
            (gait.concentration * (off_rad.cos() - 1.0)).exp()
        };
        let total: f64 = (0..PHASES).map(density).sum();
        let mut sum = 0.0;
        let shares = std::array::from_fn(|i| {
            sum += density(i) / total;
            sum
        });
        Self { first_rad: gait.phase_rad - PI, shares }
    }

    /// The phase below which a share of them lies.
    pub fn at(&self, share: f64) -> f64 {
        let i = self.shares.partition_point(|&up_to| up_to < share).min(PHASES - 1);
        let below = if i == 0 { 0.0 } else { self.shares[i - 1] };
        let within = (share - below) / (self.shares[i] - below).max(f64::MIN_POSITIVE);
        self.first_rad + TAU / PHASES as f64 * (i as f64 + within)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_count_those_who_come_later_than_the_last_step() {
        // Of ten, one at step 2, five at step 4, the rest never.
        let steps = [2, 4, 4, 4, 4, 4, 16, 16, 16, 16];
        assert_eq!(quantiles_s(steps.into_iter()), [Some(0.2), Some(0.4), None]);
        assert_eq!(quantiles_s([].into_iter()), [None; 3]);
    }
}
