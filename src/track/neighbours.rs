//! Who is near whom, of many people in a large hall.

use crate::geometry::DVec2;

/// Places in order of their x: who is near lies in a strip.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    by_x: Vec<(f64, usize)>,
}

impl Neighbours {
    /// Of other places.
    pub(super) fn renew(&mut self, places_m: impl Iterator<Item = DVec2>) {
        self.by_x.clear();
        self.by_x.extend(places_m.enumerate().map(|(i, place_m)| (place_m.x, i)));
        self.by_x.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// The numbers of all places within `reach_m` of a place along x, and of no others; in no order that means anything.
    pub(super) fn about(&self, at_m: DVec2, reach_m: f64) -> impl Iterator<Item = usize> + Clone {
        let first = self.by_x.partition_point(|(x, _)| at_m.x - x > reach_m);
        let within = move |(x, _): &&(f64, usize)| x - at_m.x <= reach_m;
        self.by_x[first..].iter().take_while(within).map(|(_, i)| *i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_who_are_near_are_among_the_neighbours() {
        let place = |k: u32, m: f64| f64::from(k.wrapping_mul(2_654_435_761) % 997) / 997.0 * m;
        let places_m: Vec<DVec2> =
            (0..200).map(|k| DVec2::new(place(k, 30.0), place(k + 500, 20.0))).collect();
        let mut neighbours = Neighbours::default();
        neighbours.renew(places_m.iter().copied());
        for (i, at_m) in places_m.iter().enumerate() {
            let mut about: Vec<usize> = neighbours.about(*at_m, 1.5).collect();
            about.sort_unstable();
            let along_x: Vec<usize> = (0..200).filter(|&k| (places_m[k].x - at_m.x).abs() <= 1.5).collect();
            assert!(about == along_x && about.contains(&i) && about.len() < 100, "{about:?}");
        }
        assert_eq!(Neighbours::default().about(DVec2::ZERO, 1.0).count(), 0);
    }
}
