//! Reads numbers off the bytes of an input, for targets whose input is no file.

/// What is left of an input. Past its end every number is 0.
#[derive(Debug)]
pub struct Given<'a>(pub &'a [u8]);

impl Given<'_> {
    /// Whether nothing is left.
    pub fn is_over(&self) -> bool {
        self.0.is_empty()
    }

    /// The next bytes.
    pub fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (now, rest) = self.0.split_at(N.min(self.0.len()));
        self.0 = rest;
        let mut bytes = [0; N];
        bytes[..now.len()].copy_from_slice(now);
        bytes
    }

    /// The next byte.
    pub fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.bytes())
    }

    /// The next two.
    pub fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.bytes())
    }

    /// The next eight.
    pub fn i64(&mut self) -> i64 {
        i64::from_le_bytes(self.bytes())
    }

    /// Any number of this kind, not a number too.
    pub fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.bytes())
    }

    /// The same.
    pub fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.bytes())
    }
}
