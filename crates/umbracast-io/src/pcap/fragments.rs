//! Datagrams in fragments: a sensor's packet of 8 or 25 kB does not fit into an Ethernet frame (RFC 791, 3.2).

use super::ip::Ipv4;

/// So many datagrams may be under way: some of each of a dozen sensors. The oldest gives way; half a megabyte or so.
const UNDER_WAY_MAX: usize = 16;
/// An IPv4 packet is no longer.
const BYTES_MAX: usize = 65_535;

/// Datagrams whose pieces have not all come, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    under_way: Vec<UnderWay>,
}

#[derive(Debug)]
struct UnderWay {
    from: [u8; 4],
    to: [u8; 4],
    identification: u16,
    bytes: Vec<u8>,
    /// Spans of `bytes` that have come: sorted, apart from each other.
    come: Vec<(usize, usize)>,
    /// Known from the last piece.
    length: Option<usize>,
}

impl Fragments {
    /// Takes a piece; gives the datagram that it completes.
    pub fn put(&mut self, piece: &Ipv4) -> Option<Vec<u8>> {
        let end = piece.offset + piece.body.len();
        // All but the last piece hold whole units of 8 bytes.
        let whole_units = piece.body.len().is_multiple_of(8) || !piece.more_follows;
        if piece.body.is_empty() || end > BYTES_MAX || !whole_units {
            return None;
        }
        let is_of = |u: &UnderWay| {
            u.identification == piece.identification && u.from == piece.from && u.to == piece.to
        };
        let place = self.under_way.iter().position(is_of).unwrap_or_else(|| {
            if self.under_way.len() == UNDER_WAY_MAX {
                self.under_way.remove(0);
            }
            self.under_way.push(UnderWay {
                from: piece.from,
                to: piece.to,
                identification: piece.identification,
                bytes: Vec::new(),
                come: Vec::new(),
                length: None,
            });
            self.under_way.len() - 1
        });
        let under_way = &mut self.under_way[place];
        under_way.take(piece.offset, end, piece.body);
        if !piece.more_follows {
            under_way.length = Some(end);
        }
        let length = under_way.length?;
        if under_way.come.as_slice() != [(0, length)] {
            return None;
        }
        Some(self.under_way.remove(place).bytes)
    }
}

impl UnderWay {
    fn take(&mut self, start: usize, end: usize, body: &[u8]) {
        if self.bytes.len() < end {
            self.bytes.resize(end, 0);
        }
        self.bytes[start..end].copy_from_slice(body);
        self.come.push((start, end));
        self.come.sort_unstable();
        let mut joined: Vec<(usize, usize)> = Vec::with_capacity(self.come.len());
        for &(start, end) in &self.come {
            match joined.last_mut() {
                Some(last) if start <= last.1 => last.1 = last.1.max(end),
                _ => joined.push((start, end)),
            }
        }
        self.come = joined;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of `bytes` of this identification, 1480 bytes each as Ethernet has them.
    fn pieces(bytes: &[u8], identification: u16) -> Vec<Ipv4<'_>> {
        let last = bytes.len().div_ceil(1480) - 1;
        let piece = |(i, body)| Ipv4 {
            from: [10, 0, 0, 1],
            to: [10, 0, 0, 2],
            identification,
            more_follows: i != last,
            offset: i * 1480,
            body,
        };
        bytes.chunks(1480).enumerate().map(piece).collect()
    }

    fn example() -> Vec<u8> {
        (0..8456_u32).map(|i| (i * 7) as u8).collect()
    }

    #[test]
    fn pieces_in_any_order_twice_and_mixed_are_put_together() {
        let (one, other) = (example(), vec![9; 24_904]);
        let mut fragments = Fragments::default();
        let mut whole = Vec::new();
        let (mut ones, others) = (pieces(&one, 1), pieces(&other, 2));
        ones.reverse();
        for (i, piece) in others.iter().enumerate() {
            if let Some(mixed) = ones.get(i) {
                whole.extend(fragments.put(mixed));
                whole.extend(fragments.put(&ones[i / 2]).filter(|_| i + 1 < ones.len()));
            }
            whole.extend(fragments.put(piece));
        }
        assert!(whole == [one, other]);
    }

    #[test]
    fn what_lacks_a_piece_gives_way_and_memory_is_bounded() {
        let bytes = example();
        let mut fragments = Fragments::default();
        for identification in 0..1000 {
            for piece in pieces(&bytes, identification).iter().skip(1) {
                assert_eq!(fragments.put(piece), None);
            }
            assert!(fragments.under_way.len() <= UNDER_WAY_MAX);
        }
        assert!(pieces(&bytes, 999).first().and_then(|first| fragments.put(first)) == Some(bytes));
    }

    #[test]
    fn what_is_too_long_or_of_odd_length_is_no_piece() {
        let mut fragments = Fragments::default();
        let bytes = vec![0; 1480];
        let mut piece = pieces(&bytes, 3).remove(0);
        (piece.offset, piece.more_follows) = (65_528, true);
        assert_eq!(fragments.put(&piece), None);
        (piece.offset, piece.body) = (0, &bytes[..1479]);
        assert_eq!(fragments.put(&piece), None);
        assert!(fragments.under_way.is_empty());
    }
}
