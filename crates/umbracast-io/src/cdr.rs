//! CDR as ROS 2 writes it (XCDR1, little-endian): values aligned to their size, counted from behind the four
//! bytes of the encapsulation header.
//!
//! Written by hand: serde (`cdr-encoding` 0.11) writes the packets' `uint8[1206]` byte by byte, 30 times slower.

/// Builds one message.
#[derive(Debug)]
pub struct Encoder {
    bytes: Vec<u8>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self { bytes: vec![0, 1, 0, 0] }
    }
}

impl Encoder {
    /// With room for so many bytes: what is long is then not moved while it grows.
    pub fn with_room(bytes: usize) -> Self {
        let mut encoder = Self::default();
        encoder.bytes.reserve(bytes);
        encoder
    }

    /// The message.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    fn align(&mut self, size: usize) {
        while !(self.bytes.len() - 4).is_multiple_of(size) {
            self.bytes.push(0);
        }
    }

    /// `uint8`
    pub fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    /// `bool`
    pub fn bool(&mut self, value: bool) {
        self.bytes.push(value.into());
    }

    /// `uint32`, also the length of a sequence.
    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    /// `int32`
    pub fn i32(&mut self, value: i32) {
        self.u32(value as u32);
    }

    /// `float32`
    pub fn f32(&mut self, value: f32) {
        self.u32(value.to_bits());
    }

    /// `uint64`
    pub fn u64(&mut self, value: u64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    /// `float64`
    pub fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend(value.to_le_bytes());
    }

    /// `string`: length with the final zero, the bytes, the zero.
    pub fn string(&mut self, value: &str) {
        self.u32(value.len() as u32 + 1);
        self.bytes.extend(value.as_bytes());
        self.bytes.push(0);
    }

    /// `uint8[N]`: no length before it.
    pub fn array(&mut self, value: &[u8]) {
        self.bytes.extend(value);
    }

    /// `builtin_interfaces/Time`
    pub fn time(&mut self, time_ns: i64) {
        self.u32(time_ns.div_euclid(1_000_000_000) as u32);
        self.u32(time_ns.rem_euclid(1_000_000_000) as u32);
    }

    /// `std_msgs/Header`
    pub fn header(&mut self, time_ns: i64, frame_id: &str) {
        self.time(time_ns);
        self.string(frame_id);
    }
}

/// Reads one message. Every read is `None` past the end, so hostile bytes end in `None`, never in a panic.
#[derive(Debug)]
pub struct Decoder<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    /// `None` unless the bytes begin like little-endian CDR.
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        (bytes.get(..2)? == [0, 1]).then_some(Self { bytes: bytes.get(4..)?, at: 0 })
    }

    fn take<const N: usize>(&mut self, align: usize) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(align);
        let value = self.bytes.get(self.at..self.at + N)?.try_into().ok()?;
        self.at += N;
        Some(value)
    }

    /// `uint8`
    pub fn u8(&mut self) -> Option<u8> {
        self.take(1).map(|[b]: [u8; 1]| b)
    }

    /// `bool`
    pub fn bool(&mut self) -> Option<bool> {
        self.u8().map(|b| b != 0)
    }

    /// `uint32`
    pub fn u32(&mut self) -> Option<u32> {
        self.take(4).map(u32::from_le_bytes)
    }

    /// `uint64`
    pub fn u64(&mut self) -> Option<u64> {
        self.take(8).map(u64::from_le_bytes)
    }

    /// `float64`
    pub fn f64(&mut self) -> Option<f64> {
        self.take(8).map(f64::from_le_bytes)
    }

    /// `string`
    pub fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let text = self.array(length)?;
        std::str::from_utf8(text.strip_suffix(&[0]).unwrap_or(text)).ok()
    }

    /// `uint8[N]`
    pub fn array(&mut self, length: usize) -> Option<&'a [u8]> {
        let value = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(value)
    }

    /// `builtin_interfaces/Time`, nanoseconds.
    pub fn time(&mut self) -> Option<i64> {
        Some(i64::from(self.u32()? as i32) * 1_000_000_000 + i64::from(self.u32()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_at_multiples_of_their_size_behind_the_header() {
        let mut e = Encoder::default();
        e.u8(7);
        e.f64(1.5);
        e.string("ab");
        e.u32(9);
        let bytes = e.finish();
        assert_eq!(bytes.len(), 4 + 8 + 8 + 4 + 3 + 1 + 4);
        let mut d = Decoder::new(&bytes).unwrap();
        assert_eq!((d.u8(), d.f64(), d.string(), d.u32()), (Some(7), Some(1.5), Some("ab"), Some(9)));
        assert_eq!(d.u8(), None);
    }

    #[test]
    fn a_time_before_the_epoch_survives() {
        let mut e = Encoder::default();
        e.time(-1);
        let bytes = e.finish();
        assert_eq!(Decoder::new(&bytes).unwrap().time(), Some(-1));
    }

    #[test]
    fn a_length_past_the_end_is_none() {
        let mut e = Encoder::default();
        e.u32(u32::MAX);
        let bytes = e.finish();
        assert_eq!(Decoder::new(&bytes).unwrap().string(), None);
        assert!(Decoder::new(&bytes[..3]).is_none());
    }
}
