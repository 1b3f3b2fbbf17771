//! IPv4 in an Ethernet frame (RFC 791).

/// Of a head without options.
pub(super) const IPV4_BYTES: usize = 20;

/// An IPv4 packet that holds UDP, or a piece of it.
pub(super) struct Ipv4<'a> {
    pub from: [u8; 4],
    pub to: [u8; 4],
    /// Tells packets apart whose pieces come mixed.
    pub identification: u16,
    pub more_follows: bool,
    /// Where the body belongs in the whole.
    pub offset: usize,
    pub body: &'a [u8],
}

impl<'a> Ipv4<'a> {
    /// Of an Ethernet frame.
    pub fn of(frame: &'a [u8]) -> Option<Self> {
        let mut at = 12;
        let mut kind = frame.get(at..at + 2)?;
        while kind == [0x81, 0x00] || kind == [0x88, 0xa8] {
            at += 4;
            kind = frame.get(at..at + 2)?;
        }
        let ip = frame.get(at + 2..).filter(|_| kind == [0x08, 0x00])?;
        let head_bytes = usize::from(ip.first()? & 0x0f) * 4;
        if ip[0] >> 4 != 4 || head_bytes < IPV4_BYTES || ip.get(9)? != &17 {
            return None;
        }
        let word = |at: usize| Some(u16::from_be_bytes([*ip.get(at)?, *ip.get(at + 1)?]));
        let fragment = word(6)?;
        // Short frames are filled up; a capture on the sending host may hold 0 for a length that the card works out.
        let end = match usize::from(word(2)?) {
            0 => ip.len(),
            length => length.min(ip.len()),
        };
        Some(Self {
            from: ip.get(12..16)?.try_into().ok()?,
            to: ip.get(16..20)?.try_into().ok()?,
            identification: word(4)?,
            more_follows: fragment & 0x2000 != 0,
            offset: usize::from(fragment & 0x1fff) * 8,
            body: ip.get(head_bytes..end)?,
        })
    }

    pub fn is_whole(&self) -> bool {
        !self.more_follows && self.offset == 0
    }
}
