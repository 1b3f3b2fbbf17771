//! The state of a tracker as words of 64 bits, from which another tracker continues. One visitor serves both writing
//! and reading.

use crate::geometry::{DVec2, DVec3};

/// More people than any hall that is watched holds.
pub(super) const PEOPLE_MAX: usize = 10_000;
/// More pieces of furniture than are put into one.
pub(super) const FURNITURE_MAX: usize = 1_000;

/// Something of which every word can be shown, always in the same order.
pub(super) trait Remembered {
    fn visit(&mut self, words: &mut impl Words);
}

impl Remembered for DVec2 {
    fn visit(&mut self, words: &mut impl Words) {
        words.vec2(self);
    }
}

/// Who is shown words: writes them down, or puts others in their place.
pub(super) trait Words {
    fn word(&mut self, word: &mut u64);

    fn i64(&mut self, value: &mut i64) {
        let mut word = *value as u64;
        self.word(&mut word);
        *value = word as i64;
    }

    fn u32(&mut self, value: &mut u32) {
        let mut word = u64::from(*value);
        self.word(&mut word);
        *value = word as u32;
    }

    fn bool(&mut self, value: &mut bool) {
        let mut word = u64::from(*value);
        self.word(&mut word);
        *value = word != 0;
    }

    fn f64(&mut self, value: &mut f64);

    fn f64s(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.f64(value));
    }

    fn vec2(&mut self, value: &mut DVec2) {
        self.f64s(AsMut::<[f64; 2]>::as_mut(value));
    }

    fn vec3(&mut self, value: &mut DVec3) {
        self.f64s(AsMut::<[f64; 3]>::as_mut(value));
    }

    /// A number of things, of which `most` can be there: 0 where the words say more.
    fn count(&mut self, count: usize, most: usize) -> usize;

    /// As many things as there are, each at first `blank`.
    fn list<T: Remembered + Clone>(&mut self, things: &mut Vec<T>, most: usize, blank: impl FnOnce() -> T)
    where
        Self: Sized,
    {
        let count = self.count(things.len(), most);
        if count != things.len() {
            things.resize(count, blank());
        }
        for thing in things {
            thing.visit(self);
        }
    }

    /// A number that may not be there.
    fn maybe_word(&mut self, value: &mut Option<u64>) {
        let (mut there, mut word) = (value.is_some(), value.unwrap_or(0));
        self.bool(&mut there);
        self.word(&mut word);
        *value = there.then_some(word);
    }

    /// A time that may not be there.
    fn maybe_i64(&mut self, value: &mut Option<i64>) {
        let (mut there, mut time) = (value.is_some(), value.unwrap_or(0));
        self.bool(&mut there);
        self.i64(&mut time);
        *value = there.then_some(time);
    }
}

/// Words as bytes, little-endian.
#[derive(Debug, Default)]
pub(super) struct Writing(pub(super) Vec<u8>);

impl Words for Writing {
    fn word(&mut self, word: &mut u64) {
        self.0.extend(word.to_le_bytes());
    }

    fn f64(&mut self, value: &mut f64) {
        self.word(&mut value.to_bits());
    }

    fn count(&mut self, count: usize, _: usize) -> usize {
        self.word(&mut (count as u64));
        count
    }
}

/// Reads them. Not whole where a word is missing, a number is none, or a count cannot be.
#[derive(Debug)]
pub(super) struct Reading<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) whole: bool,
}

impl Words for Reading<'_> {
    fn word(&mut self, word: &mut u64) {
        match self.bytes.split_first_chunk() {
            Some((first, rest)) => (*word, self.bytes) = (u64::from_le_bytes(*first), rest),
            None => self.whole = false,
        }
    }

    fn f64(&mut self, value: &mut f64) {
        let mut bits = 0;
        self.word(&mut bits);
        let read = f64::from_bits(bits);
        if read.is_nan() {
            self.whole = false;
        } else {
            *value = read;
        }
    }

    fn count(&mut self, _: usize, most: usize) -> usize {
        let mut count = 0;
        self.word(&mut count);
        // Every thing has a word at least.
        let there = (self.bytes.len() / 8).min(most);
        match usize::try_from(count).ok().filter(|&count| count <= there) {
            Some(count) => count,
            None => {
                self.whole = false;
                0
            }
        }
    }
}
