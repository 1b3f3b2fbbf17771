//! How somebody who stands shifts the weight from leg to leg and turns the trunk.
//!
//! Times and sizes: M. Duarte and V. M. Zatsiorsky 1999, "Patterns of center of pressure migration during prolonged
//! unconstrained standing": in half an hour the pressure shifts to a side every 199 +- 148 s, by 22 +- 38 mm, and fidgets
//! every 49 +- 16 s. People who wait shift oftener (from memory), so a fidget's time is taken for a shift's.

use rand::RngExt;
use rand_pcg::Pcg64;

use super::feet::smoothstep;
use super::individual::normal;
use crate::random::stream;

/// Between two shifts, mean and spread, seconds.
const STAYS_S: (f64, f64) = (49.0, 16.0);
/// A shift takes so long (from memory).
const SHIFTS_S: f64 = 1.6;
/// How far the pelvis goes to a side. That relaxed people stand mostly on one leg is of Prado-Rico and Duarte 2019,
/// "Asymmetry of body weight distribution during quiet and relaxed standing tasks".
const SHIFT_M: f64 = 0.022;
/// How far the trunk turns, each time anew (from memory).
const TWIST_RAD: f64 = 0.12;

/// What somebody does while standing.
#[derive(Debug, Clone, PartialEq)]
pub struct Fidget {
    rng: Pcg64,
    /// Where pelvis and trunk come from, and where they go or are.
    from: [f64; 2],
    to: [f64; 2],
    since_s: f64,
    stays_s: f64,
}

impl Fidget {
    /// Of the person with this seed.
    pub fn draw(seed: u64) -> Self {
        let mut rng = stream(seed, "fidget", 0);
        let to = [SHIFT_M * normal(&mut rng), TWIST_RAD * normal(&mut rng)];
        let stays_s = SHIFTS_S + STAYS_S.0 * rng.random::<f64>();
        Self { rng, from: to, to, since_s: SHIFTS_S, stays_s }
    }

    /// So much later: the pelvis' shift to the left, metres, and the trunk's turn to the left, radians.
    pub fn after(&mut self, step_s: f64) -> [f64; 2] {
        self.since_s += step_s;
        if self.since_s > self.stays_s {
            self.from = self.to;
            // To the other leg.
            let side = if self.to[0] > 0.0 { -1.0 } else { 1.0 };
            let shift_m = SHIFT_M * (0.5 + normal(&mut self.rng).abs());
            self.to = [side * shift_m, TWIST_RAD * normal(&mut self.rng)];
            self.stays_s = (STAYS_S.0 + STAYS_S.1 * normal(&mut self.rng)).max(2.0 * SHIFTS_S);
            self.since_s = 0.0;
        }
        let way = smoothstep(self.since_s / SHIFTS_S);
        [0, 1].map(|i| self.from[i] + way * (self.to[i] - self.from[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_stands_shifts_the_weight_now_and_then_and_never_jumps() {
        let mut shifts = 0;
        for seed in 0..50 {
            let mut fidget = Fidget::draw(seed);
            let mut before = fidget.after(0.01);
            for _ in 0..60_000 {
                let now = fidget.after(0.01);
                assert!((now[0] - before[0]).abs() < 0.002 && (now[1] - before[1]).abs() < 0.008, "{now:?}");
                assert!(now[0].abs() < 3.1 * SHIFT_M);
                shifts += usize::from(now[0] * before[0] < 0.0);
                before = now;
            }
        }
        // Fifty people, ten minutes each.
        assert!((450..750).contains(&shifts), "{shifts} changes of the leg");
    }
}
