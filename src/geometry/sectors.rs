//! Who is seen in which direction: people sorted into sectors of a turn, each into all that they cover.

use super::DVec2;

/// Rounding lies below, metres.
const ROOM_M: f64 = 1e-6;

/// So many sectors from the first on, round the turn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Covered {
    first: usize,
    count: usize,
}

/// People by sector, `SECTORS` to a turn; not all are as wide.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sectors<const SECTORS: usize> {
    /// Where each sector's people begin in `people`, and one past the last.
    starts: Vec<u32>,
    people: Vec<u32>,
}

impl Covered {
    /// Those of a turn of `SECTORS` in which something is seen of what lies within `radius_m` of a place that far off; all where
    /// nobody knows where it is.
    pub(crate) fn of<const SECTORS: usize>(off_m: DVec2, radius_m: f64) -> Self {
        let radius_m = radius_m + ROOM_M;
        let sine2 = radius_m * radius_m / off_m.length_squared();
        if sine2.is_nan() || sine2 >= 1.0 {
            return Self { first: 0, count: SECTORS };
        }
        let tangent = DVec2::new((1.0 - sine2).sqrt(), sine2.sqrt());
        let right = DVec2::new(tangent.x, -tangent.y);
        let [first, last] = [right, tangent].map(|side| number_of::<SECTORS>(side.rotate(off_m)));
        Self { first, count: (last + SECTORS - first) % SECTORS + 1 }
    }

    #[inline(always)]
    pub(crate) fn each<const SECTORS: usize>(self) -> impl Iterator<Item = usize> {
        (self.first..self.first + self.count).map(|sector| sector % SECTORS)
    }
}

/// Of the sector in a direction: counter-clockwise from x, by what grows with the angle as the angle does, without its arc tangent.
fn number_of<const SECTORS: usize>(direction: DVec2) -> usize {
    let DVec2 { x, y } = direction;
    let across = y / (x.abs() + y.abs());
    let quarters = match (x < 0.0, y < 0.0) {
        (false, false) => across,
        (true, _) => 2.0 - across,
        (false, true) => 4.0 + across,
    };
    (quarters * (SECTORS as f64 / 4.0)) as usize % SECTORS
}

impl<const SECTORS: usize> Sectors<SECTORS> {
    /// Sorts people, in place of those before, by what each covers; within a sector they are in order.
    pub(crate) fn sort(&mut self, covered: &[Covered]) {
        let Self { starts, people } = self;
        starts.clear();
        starts.resize(SECTORS + 1, 0);
        covered.iter().flat_map(|covered| covered.each::<SECTORS>()).for_each(|sector| starts[sector] += 1);
        let mut sum = 0;
        for start in starts.iter_mut() {
            sum += *start;
            *start = sum;
        }
        people.clear();
        people.resize(sum as usize, 0);
        // A counting sort: as a sector is filled from its end, its start moves from one past its last person to its first.
        for (person, covered) in covered.iter().enumerate().rev() {
            for sector in covered.each::<SECTORS>() {
                starts[sector] -= 1;
                people[starts[sector] as usize] = person as u32;
            }
        }
    }

    /// All who cover the sector in which a place is seen.
    pub(crate) fn towards(&self, off_m: DVec2) -> &[u32] {
        self.people(number_of::<SECTORS>(off_m))
    }

    /// All who cover a sector.
    #[inline(always)]
    pub(crate) fn people(&self, sector: usize) -> &[u32] {
        &self.people[self.starts[sector] as usize..self.starts[sector + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_is_in_all_sectors_that_they_cover_in_order() {
        let covered = [(3, 2), (0, 1), (3, 4)].map(|(first, count)| Covered { first, count });
        let mut sectors = Sectors::<4>::default();
        for _ in 0..2 {
            sectors.sort(&covered);
            let people: Vec<&[u32]> = (0..4).map(|sector| sectors.people(sector)).collect();
            assert_eq!(people, [&[0, 1, 2][..], &[2], &[2], &[0, 2]]);
        }
    }

    #[test]
    fn whoever_a_line_of_sight_touches_covers_its_sector() {
        let place = |i: usize| DVec2::from_angle(i as f64 * 0.37) * (0.1 + 0.3 * (i % 70) as f64);
        let covered: Vec<Covered> = (0..300).map(|i| Covered::of::<64>(place(i), 0.3)).collect();
        let mut sectors = Sectors::<64>::default();
        sectors.sort(&covered);
        let mut touched = 0;
        for i in 0..2000 {
            let off_m = DVec2::from_angle(i as f64 * 0.011) * 30.0;
            let nearest_m = |at_m: DVec2| off_m * (at_m.dot(off_m) / off_m.length_squared()).clamp(0.0, 1.0);
            for body in (0..300).filter(|i| place(*i).distance(nearest_m(place(*i))) <= 0.3) {
                touched += 1;
                assert!(sectors.towards(off_m).contains(&(body as u32)), "{off_m}, {}", place(body));
            }
        }
        assert!(touched > 1000, "{touched}");
    }
}
