//! Terms: of two trackers that both lead, the one of the newer term does. Pure: the caller gives the time of day.
//!
//! Two trackers that do not hear each other may both lead. Every result therefore carries the term of the tracker that led. A
//! term is newer than all that its leader had heard of when it took over. Whoever receives results gives up those of an
//! older term ([`Terms`]), and so hears one leader at a time.

use sha2::{Digest, Sha256};

/// The last bits of a term are its tracker's, so that two trackers that take over at once do not take the same.
const TAG_BITS: u32 = 16;
/// Who is born in a term has a number from here on: a million births for each term, with terms of 130,000 changes in what
/// JSON's numbers hold (2^53).
const BORN_BITS: u32 = 20;
/// A term that has been silent for so long is over: the hall may have begun anew, where nobody remembered the term.
const SILENCE_NS: i64 = 1_000_000_000;

/// The bits of a term that are a tracker's own.
pub fn tag(tracker: &str) -> u64 {
    let digest = Sha256::digest(tracker);
    u64::from(digest[0]) << 8 | u64::from(digest[1])
}

/// The term that a tracker takes over in, after the newest that it has heard of. The first of a hall is the tag alone.
pub fn next(newest: Option<u64>, tag: u64) -> u64 {
    newest.map_or(0, |newest| (newest >> TAG_BITS).saturating_add(1)) << TAG_BITS | tag
}

/// The number of the first who is born in a term: 0 in a hall's first, as in one process. No two terms share a number.
pub fn first_number(term: u64) -> u64 {
    if term >> TAG_BITS == 0 { 0 } else { term << BORN_BITS }
}

/// What one receiver has heard of terms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Terms {
    newest: Option<(u64, i64)>,
    /// Messages of an older term.
    pub given_up: u64,
}

impl Terms {
    /// Whether a message of a term is to be taken that came at `now_ns`; else it is given up and counted.
    pub fn takes(&mut self, term: u64, now_ns: i64) -> bool {
        let older = self
            .newest
            .is_some_and(|(newest, heard_ns)| term < newest && now_ns.saturating_sub(heard_ns) <= SILENCE_NS);
        match older {
            true => self.given_up += 1,
            false => self.newest = Some((term, now_ns)),
        }
        !older
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_term_is_given_up_until_the_newer_one_has_been_silent_for_a_second() {
        let mut terms = Terms::default();
        let heard = [
            (5, 0),
            (6, 10),
            (5, 20),
            (6, 30),
            (5, SILENCE_NS + 30),
            (5, SILENCE_NS + 31),
            (5, SILENCE_NS + 40),
        ];
        let taken = heard.map(|(term, now_ns)| terms.takes(term, now_ns));
        assert_eq!(taken, [true, true, false, true, false, true, true]);
        assert_eq!(terms.given_up, 2);
    }

    #[test]
    fn no_two_terms_share_a_number_and_the_first_begins_at_0() {
        let (a, b) = (tag("a"), tag("b"));
        let first = next(None, a);
        assert_eq!((first_number(first), a == b), (0, false));
        let (second, third) = (next(Some(first), b), next(Some(next(Some(first), b)), a));
        assert!(first < second && second < third && next(Some(first), a) != second);
        let numbers = [second, third].map(first_number);
        assert!(numbers[1] - numbers[0] >= 1 << BORN_BITS && numbers[1] < 1 << 53, "{numbers:?}");
    }
}
