//! Who is seen in which direction: people sorted into sectors of a turn, each into all that they cover.

/// So many sectors from the first on, round the turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Covered {
    pub(super) first: usize,
    pub(super) count: usize,
}

/// People by sector, `SECTORS` to a turn.
#[derive(Debug, Clone, Default)]
pub(super) struct Sectors<const SECTORS: usize> {
    /// Where each sector's people begin in `people`, and one past the last.
    starts: Vec<u32>,
    people: Vec<u32>,
}

impl Covered {
    #[inline(always)]
    pub(super) fn each<const SECTORS: usize>(self) -> impl Iterator<Item = usize> {
        (self.first..self.first + self.count).map(|sector| sector % SECTORS)
    }
}

impl<const SECTORS: usize> Sectors<SECTORS> {
    /// Sorts people, in place of those before, by what each covers; within a sector they are in order.
    pub(super) fn sort(&mut self, covered: &[Covered]) {
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

    /// All who cover a sector.
    #[inline(always)]
    pub(super) fn people(&self, sector: usize) -> &[u32] {
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
}
