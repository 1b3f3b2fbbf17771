//! The best few of many, where each serves every place for some share of the time.
//!
//! The value of a choice is the share of time in which at least one of it serves, in the mean over places:
//! F(S) = mean over p of 1 - product over s in S of (1 - q(s, p)). F never falls when one is added, and what one adds
//! never grows with what is there already: it is monotone and submodular. Picking the one that adds most, again and
//! again, therefore reaches at least 1 - 1/e of the best (Nemhauser, Wolsey, Fisher 1978). What the remaining ones would
//! add to the choice bounds the best from above as well, and more tightly. With that bound few choices need be tried to
//! know the best.

use rayon::prelude::*;

/// Places times candidates that are looked at for the exact answer; beyond, the answer is greedy and says its bound.
pub const EXACT_MOST: u64 = 3_000_000_000;

/// What was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Which of the candidates, in the order in which they add most.
    pub picked: Vec<usize>,
    /// Share of time with each of them and those before it.
    pub values: Vec<f64>,
    /// No choice of so many candidates is better than this.
    pub bound: f64,
    /// Whether it is the best of all choices of candidates.
    pub exact: bool,
}

/// Chooses `count` of the candidates, each with its share of time for each place, beside what leaves `unserved` of the
/// time at each place already. Candidates may be fewer.
pub fn choose(candidates: &[Vec<f32>], unserved: &[f32], count: usize, effort: u64) -> Choice {
    let count = count.min(candidates.len());
    let greedy = greedy(candidates, unserved, count);
    let value = value_of(candidates, unserved, &greedy);
    let bound = bound(candidates, unserved, &greedy, count).min(1.0).min(value / (1.0 - (-1.0_f64).exp()));
    let mut search = Search { candidates, best: greedy, value, left: effort, count };
    let base = mean(unserved, |u| 1.0 - f64::from(u));
    let whole = count == 0 || search.below(unserved, base, &mut Vec::new(), 0);
    let picked = self_ordered(candidates, unserved, search.best);
    let values: Vec<f64> = (1..=picked.len()).map(|k| value_of(candidates, unserved, &picked[..k])).collect();
    let reached = values.last().copied().unwrap_or(base);
    Choice { picked, values, bound: if whole { reached } else { bound.max(reached) }, exact: whole }
}

/// Share of time with these candidates.
pub(crate) fn value_of(candidates: &[Vec<f32>], unserved: &[f32], picked: &[usize]) -> f64 {
    let left = picked.iter().fold(unserved.to_vec(), |left, &c| after(&left, &candidates[c]));
    mean(&left, |u| 1.0 - f64::from(u))
}

/// What is left unserved when one more serves.
pub(crate) fn after(unserved: &[f32], serves: &[f32]) -> Vec<f32> {
    unserved.iter().zip(serves).map(|(u, q)| u * (1.0 - q)).collect()
}

fn mean(of: &[f32], value: impl Fn(f32) -> f64) -> f64 {
    of.iter().map(|&u| value(u)).sum::<f64>() / of.len().max(1) as f64
}

/// What a candidate adds. In 32 bits, eight places beside each other.
fn gain(unserved: &[f32], serves: &[f32]) -> f64 {
    let mut sums = [0.0_f32; 8];
    let (whole, rest) = (unserved.chunks_exact(8), serves.chunks_exact(8));
    let tail: f32 = whole.remainder().iter().zip(rest.remainder()).map(|(u, q)| u * q).sum();
    for (u, q) in whole.zip(rest) {
        for k in 0..8 {
            sums[k] += u[k] * q[k];
        }
    }
    (f64::from(tail) + sums.iter().map(|&sum| f64::from(sum)).sum::<f64>()) / unserved.len().max(1) as f64
}

fn gains(candidates: &[Vec<f32>], unserved: &[f32]) -> Vec<f64> {
    candidates.par_iter().map(|serves| gain(unserved, serves)).collect()
}

/// The greatest, the first of equals.
fn greatest(gains: &[f64]) -> Option<usize> {
    (0..gains.len()).reduce(|a, b| if gains[b] > gains[a] { b } else { a })
}

fn greedy(candidates: &[Vec<f32>], unserved: &[f32], count: usize) -> Vec<usize> {
    let (mut left, mut picked) = (unserved.to_vec(), Vec::new());
    for _ in 0..count {
        let mut gains = gains(candidates, &left);
        picked.iter().for_each(|&c: &usize| gains[c] = f64::NEG_INFINITY);
        let Some(next) = greatest(&gains) else { break };
        left = after(&left, &candidates[next]);
        picked.push(next);
    }
    picked
}

/// F(S) and what the `count` best further ones would add to it, over every beginning S of the greedy choice.
fn bound(candidates: &[Vec<f32>], unserved: &[f32], picked: &[usize], count: usize) -> f64 {
    let bounds = (0..=picked.len()).map(|k| {
        let left = picked[..k].iter().fold(unserved.to_vec(), |left, &c| after(&left, &candidates[c]));
        let mut gains = gains(candidates, &left);
        gains.sort_by(|a, b| b.total_cmp(a));
        mean(&left, |u| 1.0 - f64::from(u)) + gains.iter().take(count).sum::<f64>()
    });
    bounds.fold(f64::INFINITY, f64::min)
}

/// The same ones in the order in which they add most.
fn self_ordered(candidates: &[Vec<f32>], unserved: &[f32], mut picked: Vec<usize>) -> Vec<usize> {
    let (mut left, mut ordered) = (unserved.to_vec(), Vec::new());
    while !picked.is_empty() {
        let gains: Vec<f64> = picked.iter().map(|&c| gain(&left, &candidates[c])).collect();
        let Some(next) = greatest(&gains) else { break };
        left = after(&left, &candidates[picked[next]]);
        ordered.push(picked.remove(next));
    }
    ordered
}

/// Branch and bound over choices in ascending order of their candidates.
struct Search<'a> {
    candidates: &'a [Vec<f32>],
    best: Vec<usize>,
    value: f64,
    /// Effort that is left.
    left: u64,
    count: usize,
}

impl Search<'_> {
    /// Tries all choices that begin with `picked`; false where the effort ran out.
    fn below(&mut self, unserved: &[f32], value: f64, picked: &mut Vec<usize>, first: usize) -> bool {
        let effort = (unserved.len() * (self.candidates.len() - first)) as u64;
        if effort > self.left {
            return false;
        }
        self.left -= effort;
        let wanted = self.count - picked.len();
        let gains = gains(&self.candidates[first..], unserved);
        if wanted == 1 {
            if let Some(k) = greatest(&gains).filter(|&k| value + gains[k] > self.value + 1e-9) {
                self.value = value + gains[k];
                self.best = picked.iter().copied().chain([first + k]).collect();
            }
            return true;
        }
        // After candidate k only those behind it follow, and none adds more than it adds now.
        let mut order: Vec<usize> = (0..gains.len()).collect();
        order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
        for &k in &order {
            let behind = order.iter().filter(|&&other| other > k).take(wanted - 1);
            if value + gains[k] + behind.map(|&other| gains[other]).sum::<f64>() <= self.value + 1e-9 {
                continue;
            }
            let next = after(unserved, &self.candidates[first + k]);
            picked.push(first + k);
            let whole = self.below(&next, value + gains[k], picked, first + k + 1);
            picked.pop();
            if !whole {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    fn drawn(candidates: usize, places: usize, seed: u64) -> Vec<Vec<f32>> {
        let mut draws = Pcg64::seed_from_u64(seed);
        let mut one = || {
            let middle: f32 = draws.random();
            (0..places)
                .map(|p| (1.2 - 4.0 * (p as f32 / places as f32 - middle).abs()).clamp(0.0, 1.0))
                .collect()
        };
        (0..candidates).map(|_| one()).collect()
    }

    #[test]
    fn the_exact_choice_is_the_best_of_all_and_the_greedy_one_is_within_its_bound() {
        for seed in 0..20 {
            let candidates = drawn(14, 50, seed);
            let unserved = vec![1.0; 50];
            let exact = choose(&candidates, &unserved, 3, u64::MAX);
            let mut best = 0.0_f64;
            for a in 0..14 {
                for b in a + 1..14 {
                    for c in b + 1..14 {
                        best = best.max(value_of(&candidates, &unserved, &[a, b, c]));
                    }
                }
            }
            let reached = exact.values[2];
            assert!(exact.exact && (reached - best).abs() < 1e-5, "seed {seed}: {reached} {best}");
            let greedy = choose(&candidates, &unserved, 3, 0);
            let found = greedy.values[2];
            assert!(!greedy.exact && found <= best + 1e-5 && best <= greedy.bound + 1e-5, "seed {seed}");
            assert!(found >= (1.0 - (-1.0_f64).exp()) * best, "seed {seed}");
        }
    }

    #[test]
    fn what_is_there_already_counts_and_nothing_may_be_asked_for() {
        let candidates = vec![vec![0.9, 0.0], vec![0.0, 0.5]];
        assert_eq!(choose(&candidates, &[0.1, 1.0], 1, u64::MAX).picked, [1]);
        let none = choose(&candidates, &[0.25, 0.75], 0, u64::MAX);
        assert_eq!((none.picked.len(), none.exact, none.bound), (0, true, 0.5));
        assert_eq!(choose(&[], &[1.0], 3, u64::MAX).picked.len(), 0);
    }
}
