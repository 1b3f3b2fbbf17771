//! Named random streams: the draws of one part never change those of another part.

use rand::SeedableRng;
use rand_pcg::Pcg64;

/// A generator that depends on the scene's seed, what is drawn with it, and a count (a person, an attempt).
pub fn stream(seed: u64, name: &str, count: u64) -> Pcg64 {
    // FNV-1a over seed, count and name.
    let bytes = seed.to_le_bytes().into_iter().chain(count.to_le_bytes()).chain(name.bytes());
    let key = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x100_0000_01b3));
    Pcg64::seed_from_u64(key)
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::stream;

    #[test]
    fn streams_differ_by_seed_name_and_count_and_repeat() {
        let mut draws: Vec<u64> = [(1, "a", 0), (2, "a", 0), (1, "b", 0), (1, "a", 1)]
            .map(|(seed, name, count)| stream(seed, name, count).next_u64())
            .to_vec();
        assert_eq!(draws[0], stream(1, "a", 0).next_u64());
        draws.sort_unstable();
        draws.dedup();
        assert_eq!(draws.len(), 4);
    }
}
