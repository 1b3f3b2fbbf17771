//! The best places of sensors and access points, and what each further one would bring.

use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;
use umbracast::site::{AccessPoint, Sensor};
use umbracast::{Error, Site};

use crate::candidates::Hangs;
use crate::choose::{EXACT_MOST, after, choose, value_of};
use crate::crowd::Crowd;
use crate::floor::Floor;
use crate::{map, rays};

/// Cells of a search, metres: coarser than a map, as many candidates are looked at.
const STEP_M: f64 = 1.0;
/// Rays of a candidate.
const RAYS: usize = 9_000;
/// So many further ones are told of.
const FURTHER: usize = 3;
/// How far the best places are moved to better ones beside them; each time half as far.
const NEARER: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// How many more are placed.
    pub count: usize,
    /// Beside those that the site has; otherwise in their place.
    pub beside: bool,
}

/// Places of so many things of one kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Best<T> {
    /// Those that were placed.
    pub placed: Vec<T>,
    /// Share of time in which a person is seen, or some link is free, in the mean over the floor: with each of them and
    /// those before it.
    pub values: Vec<f64>,
    /// No choice of so many of the places that were tried is better than this.
    pub bound: f64,
    /// Whether no choice of the places that were tried is better than the one that was moved to these.
    pub exact: bool,
    /// How many places were tried.
    pub candidates: usize,
    /// The value with one, two, three more.
    pub further: Vec<f64>,
}

/// The best places of so many sensors, each like the site's first one.
///
/// # Errors
/// A hall without a floor, a site without a sensor to hang more of.
pub fn best<T: Placed>(site: &Site, wanted: Wanted, people: f64, height_m: f64) -> Result<Best<T>, Error> {
    let search = Search::new(site, wanted.beside, people, height_m)?;
    let like = search.like::<T>()?;
    let candidates = like.candidates(site);
    let values =
        candidates.par_iter().map(|candidate| search.value(candidate)).collect::<Result<Vec<_>, Error>>()?;
    let choice = choose(&values, &search.unserved::<T>()?, wanted.count, EXACT_MOST);
    let mut placed: Vec<T> = choice.picked.iter().map(|&c| candidates[c].clone()).collect();
    let reached = search.moved(&mut placed)?;
    let mut left = search.unserved::<T>()?;
    let mut reached_with = Vec::new();
    for one in &placed {
        left = after(&left, &search.value(one)?);
        reached_with.push(value_of(&[], &left, &[]));
    }
    let further = choose(&values, &left, FURTHER, 0).values;
    let names = T::of(site).iter().map(|one| one.name().to_owned()).collect();
    placed = named(placed, if wanted.beside { names } else { Vec::new() });
    let (exact, bound) = (choice.exact, choice.bound.max(reached));
    Ok(Best { placed, values: reached_with, bound, exact, candidates: candidates.len(), further })
}

/// The best and the mean value of so many random placements of as many things, in place of those that the site has.
///
/// # Errors
/// As [`best`].
pub fn versus_random<T: Placed>(
    site: &Site,
    count: usize,
    people: f64,
    height_m: f64,
    (placements, seed): (usize, u64),
) -> Result<[f64; 2], Error> {
    let search = Search::new(site, false, people, height_m)?;
    let (like, unserved) = (search.like::<T>()?, search.unserved::<T>()?);
    let value = |number: usize| {
        let mut draws = Pcg64::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(number as u64));
        let values = (0..count)
            .map(|_| search.value(&like.random(site, &mut draws)))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(value_of(&values, &unserved, &(0..count).collect::<Vec<_>>()))
    };
    let values = (0..placements).into_par_iter().map(value).collect::<Result<Vec<f64>, Error>>()?;
    let most = values.iter().copied().fold(0.0, f64::max);
    Ok([most, values.iter().sum::<f64>() / values.len().max(1) as f64])
}

/// Sensors or access points.
#[expect(private_bounds, reason = "there are these two kinds")]
pub trait Placed: Hangs {
    /// What it is called.
    fn name(&self) -> &str;
    /// The same under another name.
    fn called(self, name: String) -> Self;
    /// Those of a site.
    fn of(site: &Site) -> &[Self];
    /// What stands before the number in a new name.
    const STEM: &str;
    /// Share of time in which it serves a person in each cell.
    ///
    /// # Errors
    /// A sensor whose beams nobody knows.
    fn serves(&self, site: &Site, floor: &Floor, people: f64, height_m: f64) -> Result<Vec<f32>, Error>;
}

impl Placed for Sensor {
    const STEM: &str = "lidar";

    fn name(&self) -> &str {
        &self.name
    }

    fn called(self, name: String) -> Self {
        Self { name, ..self }
    }

    fn of(site: &Site) -> &[Self] {
        &site.sensors
    }

    fn serves(&self, site: &Site, floor: &Floor, people: f64, height_m: f64) -> Result<Vec<f32>, Error> {
        let crowd = Crowd { density_per_m2: people / floor.area_m2(), height_m };
        let returns = rays::returns(site, self, floor, height_m, Some(RAYS))?;
        Ok(map::sees(site, self, floor, &crowd, &returns))
    }
}

impl Placed for AccessPoint {
    const STEM: &str = "ap";

    fn name(&self) -> &str {
        &self.name
    }

    fn called(self, name: String) -> Self {
        Self { name, ..self }
    }

    fn of(site: &Site) -> &[Self] {
        &site.access_points
    }

    fn serves(&self, site: &Site, floor: &Floor, people: f64, height_m: f64) -> Result<Vec<f32>, Error> {
        let crowd = Crowd { density_per_m2: people / floor.area_m2(), height_m };
        Ok(map::blocked(site, self, floor, &crowd).iter().map(|blocked| 1.0 - blocked).collect())
    }
}

/// Gives what was placed names that nothing has yet.
fn named<T: Placed>(placed: Vec<T>, mut taken: Vec<String>) -> Vec<T> {
    let mut number = 0;
    placed
        .into_iter()
        .map(|one| {
            let name = loop {
                number += 1;
                let name = format!("{}_{number}", T::STEM);
                if !taken.contains(&name) {
                    break name;
                }
            };
            taken.push(name.clone());
            one.called(name)
        })
        .collect()
}

/// One hall in which something is placed.
struct Search<'a> {
    site: &'a Site,
    floor: Floor,
    beside: bool,
    people: f64,
    height_m: f64,
}

impl<'a> Search<'a> {
    fn new(site: &'a Site, beside: bool, people: f64, height_m: f64) -> Result<Self, Error> {
        let floor = Floor::of(site, Some(STEP_M))?;
        Ok(Self { site, floor, beside, people, height_m })
    }

    fn like<T: Placed>(&self) -> Result<T, Error> {
        let none =
            || Error::new(format!("expected one {} in the site to place more like it, found none", T::STEM));
        T::of(self.site).first().cloned().ok_or_else(none)
    }

    /// By open cell.
    fn value<T: Placed>(&self, one: &T) -> Result<Vec<f32>, Error> {
        let all = one.serves(self.site, &self.floor, self.people, self.height_m)?;
        Ok(all.into_iter().zip(&self.floor.open).filter(|(_, open)| **open).map(|(q, _)| q).collect())
    }

    fn unserved<T: Placed>(&self) -> Result<Vec<f32>, Error> {
        let there = if self.beside { T::of(self.site) } else { &[] };
        let whole = vec![1.0; self.floor.places()];
        there.iter().try_fold(whole, |left, one| Ok(after(&left, &self.value(one)?)))
    }

    /// Moves each to a better place beside it, as long as there is one; the value that this reaches.
    fn moved<T: Placed>(&self, placed: &mut [T]) -> Result<f64, Error> {
        let unserved = self.unserved::<T>()?;
        let mut values = placed.iter().map(|one| self.value(one)).collect::<Result<Vec<_>, _>>()?;
        let all: Vec<usize> = (0..placed.len()).collect();
        let mut reached = value_of(&values, &unserved, &all);
        for by in NEARER {
            for i in 0..placed.len() {
                let near: Vec<T> =
                    (0..T::WAYS).filter_map(|way| placed[i].near(self.site, way, by)).collect();
                let tried = near.par_iter().map(|one| self.value(one)).collect::<Result<Vec<_>, Error>>()?;
                for (one, value) in near.into_iter().zip(tried) {
                    let before = std::mem::replace(&mut values[i], value);
                    let now = value_of(&values, &unserved, &all);
                    match now > reached + 1e-9 {
                        true => (placed[i], reached) = (one, now),
                        false => values[i] = before,
                    }
                }
            }
        }
        Ok(reached)
    }
}
