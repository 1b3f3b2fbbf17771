//! Searches for the stage 1, the box and the scene with which the paper's stages 2 and 3 give the published blockage
//! figures.

use rayon::prelude::*;
use umbracast::config::{BoxKind, Rollout};
use umbracast::forecast::Weights;
use umbracast::{Error, STEPS};

use super::replay::{BoxModel, Noise, Replay, Surroundings};
use crate::report::published::{AT_300_MS, BASE_RATE_AT_300_MS, F1_FROM_800_MS};
use crate::score::bootstrap::Pooled;
use crate::score::counts::Counts;

/// One published figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// As the table calls it.
    pub name: &'static str,
    /// What the paper prints.
    pub value: f64,
    /// How far off it may be: the rounding of what is printed, or the breadth of "around".
    pub rounding: f64,
    /// More is as good.
    pub at_least: bool,
}

const fn figure(name: &'static str, value: f64, rounding: f64) -> Published {
    Published { name, value, rounding, at_least: false }
}
const fn at_least(name: &'static str) -> Published {
    Published { name, value: 0.0, rounding: 0.0025, at_least: true }
}

/// Everything that is printed about blockage. Where no box is named, the mean of both boxes stands beside it: the
/// paper gives one figure for the two. The base rate is not printed and follows from the first three.
pub const PUBLISHED: [Published; 14] = [
    figure("accuracy, 300 ms", AT_300_MS[0].1, 0.005),
    figure("precision, 300 ms", AT_300_MS[1].1, 0.005),
    figure("recall, 300 ms", AT_300_MS[2].1, 0.005),
    figure("precision meets recall, windows", 3.0, 0.5),
    figure("F1, 800 ms", F1_FROM_800_MS, 0.005),
    figure("F1, 900 ms", F1_FROM_800_MS, 0.005),
    figure("accuracy, 100 ms", 0.88, 0.01),
    figure("base rate, 300 ms", BASE_RATE_AT_300_MS, 0.02),
    at_least("recall, OBB over AABB"),
    at_least("precision, AABB over OBB"),
    at_least("F1, OBB over AABB"),
    figure("accuracy, OBB over AABB", 0.0, 0.01),
    at_least("precision, 100 over 900 ms"),
    at_least("recall, 900 over 100 ms"),
];

/// The same figures, found.
pub type Figures = [f64; PUBLISHED.len()];

/// What stage 2 is fed with, and how it goes on.
#[derive(Debug, Clone, PartialEq)]
pub struct Fed {
    /// In words.
    pub name: String,
    /// On the tracks.
    pub noise: Noise,
    /// Mean or draw.
    pub rollout: Rollout,
}

/// One setting: indices into what is tried, in the order crowd, body width, access point, tracks, box, missed.
pub type Setting = [usize; 6];

/// What a setting is made of, in that order.
pub const DIMENSIONS: [&str; 6] = ["crowd", "true width", "access point", "tracks", "box", "missed"];

/// What is tried: every setting of the product.
#[derive(Debug, Clone)]
pub struct Space {
    /// Widths and access points.
    pub around: Surroundings,
    /// What stage 2 is fed with.
    pub fed: Vec<Fed>,
    /// Times the true width of our bodies.
    pub scales: Vec<f64>,
    /// Shares of people who are lost.
    pub missed: Vec<f64>,
}

/// A setting with what it prints.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Which.
    pub setting: Setting,
    /// What came out.
    pub figures: Figures,
    /// See [`deviation`].
    pub deviation: f64,
    /// Precision and recall, index w - 1: the mean of both boxes.
    pub curves: [[f64; 2]; STEPS],
}

/// How many roundings a figure is off.
pub fn off(published: &Published, found: f64) -> f64 {
    let difference = found - published.value;
    if published.at_least {
        difference.min(0.0) / published.rounding
    } else {
        difference / published.rounding
    }
}

/// Root mean square of how many roundings the figures are off.
pub fn deviation(figures: &Figures) -> f64 {
    let squares = PUBLISHED.iter().zip(figures).map(|(published, &found)| off(published, found).powi(2));
    (squares.sum::<f64>() / PUBLISHED.len() as f64).sqrt()
}

/// The published figures that a row does not print.
pub fn missing(figures: &Figures) -> Vec<&'static str> {
    let unlike =
        PUBLISHED.iter().zip(figures).filter(|(published, found)| off(published, **found).abs() > 1.0);
    unlike.map(|(published, _)| published.name).collect()
}

/// What the counts of both boxes, index w - 1, come to. `None` where nobody was blocked or said to be.
pub fn tried(setting: Setting, aabb: &[Counts; STEPS], obb: &[Counts; STEPS]) -> Option<Tried> {
    let of = |score: fn(&Counts) -> Option<f64>, w: usize| Some([score(&aabb[w - 1])?, score(&obb[w - 1])?]);
    let mean = |[a, o]: [f64; 2]| (a + o) / 2.0;
    let gain = |[a, o]: [f64; 2]| o - a;
    let mut curves = [[0.0; 2]; STEPS];
    for (w, both) in (1..).zip(&mut curves) {
        *both = [mean(of(Counts::precision, w)?), mean(of(Counts::recall, w)?)];
    }
    let figures = [
        mean(of(Counts::accuracy, 3)?),
        curves[2][0],
        curves[2][1],
        crossing(&curves.map(|[precision, recall]| precision - recall)),
        mean(of(Counts::f1, 8)?),
        mean(of(Counts::f1, 9)?),
        mean(of(Counts::accuracy, 1)?),
        mean(of(Counts::base_rate, 3)?),
        gain(of(Counts::recall, 3)?),
        -gain(of(Counts::precision, 3)?),
        gain(of(Counts::f1, 3)?),
        gain(of(Counts::accuracy, 3)?),
        curves[0][0] - curves[STEPS - 1][0],
        curves[STEPS - 1][1] - curves[0][1],
    ];
    Some(Tried { setting, figures, deviation: deviation(&figures), curves })
}

/// The window at which precision has fallen to recall; 0 where it is below from the first, one more than there are
/// where it never is.
fn crossing(excess: &[f64]) -> f64 {
    match excess.iter().position(|&e| e <= 0.0) {
        None => excess.len() as f64 + 1.0,
        Some(0) => 0.0,
        Some(i) => i as f64 + excess[i - 1] / (excess[i - 1] - excess[i]),
    }
}

/// Every setting of the space on the replays of one crowd, the `crowd`th.
///
/// # Errors
/// As [`Replay::foresee`].
pub fn search(
    space: &Space,
    crowd: usize,
    replays: &[Replay],
    weights: &Weights,
) -> Result<Vec<Tried>, Error> {
    let of_tracks = |(fed, tracks): (usize, &Fed)| {
        let foreseen = |replay: &Replay| replay.foresee(&tracks.noise, tracks.rollout, weights);
        let foreseen = replays.iter().map(foreseen).collect::<Result<Vec<_>, Error>>()?;
        let mut all = Vec::new();
        for (scale_index, &scale) in space.scales.iter().enumerate() {
            for (missed_index, &missed) in space.missed.iter().enumerate() {
                let [aabb, obb] = [BoxKind::Aabb, BoxKind::Obb].map(|kind| {
                    let cast = replays.iter().zip(&foreseen).map(|(replay, foreseen)| {
                        replay.cast(foreseen, &BoxModel { kind, scale }, missed, &space.around.site)
                    });
                    pooled(cast)
                });
                for (width, (aabb, obb)) in aabb.iter().zip(&obb).enumerate() {
                    for (place, (aabb, obb)) in aabb.iter().zip(obb).enumerate() {
                        let setting = [crowd, width, place, fed, scale_index, missed_index];
                        all.extend(tried(setting, aabb, obb));
                    }
                }
            }
        }
        Ok(all)
    };
    let all = space.fed.par_iter().enumerate().map(of_tracks).collect::<Result<Vec<_>, Error>>()?;
    Ok(all.concat())
}

type ByPlace = Vec<Vec<[Counts; STEPS]>>;

fn pooled(mut scenes: impl Iterator<Item = ByPlace>) -> ByPlace {
    let mut sums = scenes.next().unwrap_or_default();
    for scene in scenes {
        for (sum, more) in sums.iter_mut().flatten().flatten().zip(scene.iter().flatten().flatten()) {
            *sum = sum.plus(more, 1);
        }
    }
    sums
}

/// The settings that differ from this one in a single dimension, by dimension, in the order of what is tried.
pub fn neighbours<'a>(tried: &'a [Tried], of: &Setting) -> Vec<(usize, &'a Tried)> {
    let apart = |other: &Setting| {
        let mut differing = (0..of.len()).filter(|&i| other[i] != of[i]);
        differing.next().filter(|_| differing.next().is_none())
    };
    let mut found: Vec<_> = tried.iter().filter_map(|t| Some((apart(&t.setting)?, t))).collect();
    found.sort_by_key(|(dimension, t)| (*dimension, t.setting));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(true_positive: u64, false_positive: u64, false_negative: u64, true_negative: u64) -> Counts {
        Counts { true_positive, false_positive, false_negative, true_negative }
    }

    #[test]
    fn what_is_published_lies_within_its_own_rounding() {
        // 0.30 of 1000 windows blocked; recall 0.79, precision 0.78, accuracy 0.87.
        let mut windows = [counts(237, 67, 63, 633); STEPS];
        let later = counts(2535, 686, 465, 6314);
        (windows[7], windows[8]) = (later, later);
        (windows[0], windows[1]) = (counts(200, 50, 70, 680), counts(230, 60, 64, 646));
        windows[3] = counts(240, 80, 60, 620);
        let figures = tried([0; 6], &windows, &windows).unwrap().figures;
        assert!(missing(&figures).is_empty(), "{:?} of {figures:?}", missing(&figures));
        assert!(deviation(&figures) < 1.0);
    }

    #[test]
    fn an_order_the_wrong_way_round_is_missing_and_the_right_way_is_no_deviation() {
        let (fewer, more) = ([counts(237, 67, 63, 633); STEPS], [counts(250, 75, 50, 625); STEPS]);
        let right = tried([0; 6], &fewer, &more).unwrap().figures;
        let wrong = tried([0; 6], &more, &fewer).unwrap().figures;
        assert!(!missing(&right).iter().any(|name| name.contains("recall, OBB")));
        assert!(missing(&wrong).contains(&"recall, OBB over AABB"));
        assert_eq!(off(&PUBLISHED[8], 0.2), 0.0);
    }

    #[test]
    fn precision_meets_recall_between_two_windows() {
        assert_eq!(crossing(&[0.2, 0.1, -0.1, -0.2]), 2.5);
        assert_eq!((crossing(&[-0.1, -0.2]), crossing(&[0.2, 0.1])), (0.0, 3.0));
    }

    #[test]
    fn neighbours_differ_in_one_thing() {
        let nothing = Tried {
            setting: [0; 6],
            figures: [0.0; PUBLISHED.len()],
            deviation: 0.0,
            curves: [[0.0; 2]; STEPS],
        };
        let tried = |setting| Tried { setting, ..nothing.clone() };
        let all = [[0; 6], [0, 0, 0, 1, 0, 0], [1, 0, 0, 1, 0, 0], [2, 0, 0, 0, 0, 0]].map(tried);
        let found: Vec<_> = neighbours(&all, &[0; 6]).iter().map(|(d, t)| (*d, t.setting[*d])).collect();
        assert_eq!(found, [(0, 2), (3, 1)]);
    }
}
