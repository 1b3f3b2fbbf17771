//! Memory that splitting and merging keep from frame to frame, so that a frame allocates nothing.

use super::guided::{self, find_owners};
use super::part::Part;
use super::{Cluster, Prior};
use crate::geometry::{DVec2, DVec3};

/// Of so many points is nearly everybody, unless he is beside a sensor: lists are made for that many at once.
const POINTS_OF_ONE: usize = 512;
/// No more people stand in one cluster, but in a crowd.
pub(super) const PEOPLE_OF_CLUSTER: usize = 32;
/// So many lists of a kind are kept.
const KEPT_MAX: usize = 256;

/// Kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory {
    /// Parts from west to east.
    pub(super) order: Vec<usize>,
    /// Pairs of parts near each other, with how far apart.
    pub(super) candidates: Vec<(f64, usize, usize)>,
    pub(super) into: Vec<usize>,
    /// By prior: confirmed, and nobody's body is there.
    pub(super) without_body: Vec<bool>,
    guided: guided::Memory,
    /// Lists by what they hold: points, parts, places of means, people by their priors.
    pub(super) points: Pool<u32>,
    pub(super) parts: Pool<Part>,
    pub(super) places: Pool<DVec2>,
    pub(super) people: Pool<usize>,
    /// Of the positions of each mean's points, and how many they are.
    pub(super) sums: Vec<(DVec2, f64)>,
}

/// Lists that nobody uses.
#[derive(Debug, Clone)]
pub(super) struct Pool<T>(Vec<Vec<T>>);

impl<T> Default for Pool<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Pool<T> {
    /// An empty list with room for as many.
    pub(super) fn take(&mut self, room: usize) -> Vec<T> {
        let mut list = self.0.pop().unwrap_or_default();
        list.reserve(room);
        list
    }

    /// A list that is no longer needed.
    pub(super) fn give(&mut self, mut list: Vec<T>) {
        if self.0.len() < KEPT_MAX {
            list.clear();
            self.0.push(list);
        }
    }
}

impl Memory {
    /// An empty list of points.
    pub(super) fn take_points(&mut self) -> Cluster {
        self.points.take(POINTS_OF_ONE)
    }

    /// Parts that are no longer needed, with their points.
    pub(super) fn give_parts(&mut self, mut parts: Vec<Part>) {
        parts.drain(..).for_each(|part| self.points.give(part.points));
        self.parts.give(parts);
    }

    /// The points of each of `people`, not looked at yet, and those of nobody among them.
    pub(super) fn share_out<'a>(
        &mut self,
        moved_m: &[DVec3],
        points: &[u32],
        people: impl Iterator<Item = &'a Prior> + Clone,
        sigma_min_m: f64,
    ) -> (Vec<Part>, Cluster) {
        let (mut own, mut nobodys) = (self.parts.take(PEOPLE_OF_CLUSTER), self.take_points());
        own.extend(people.clone().map(|_| Part::new(&[], self.take_points())));
        find_owners(moved_m, points, people, sigma_min_m, &mut self.guided);
        for (&i, owner) in points.iter().zip(&self.guided.owners) {
            owner.map_or(&mut nobodys, |k| &mut own[k].points).push(i);
        }
        (own, nobodys)
    }
}
