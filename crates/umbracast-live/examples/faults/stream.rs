//! A stream of the page as somebody without a browser reads it.

/// The request for it.
pub fn upgrade(path: &str) -> String {
    format!(
        "GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
}

/// What came of it so far and is not yet a whole message.
#[derive(Debug, Default)]
pub struct Messages {
    bytes: Vec<u8>,
    is_open: bool,
}

impl Messages {
    /// Takes what was read; `each` is given the length of every message that is whole by then.
    pub fn take(&mut self, read: &[u8], mut each: impl FnMut(usize)) {
        self.bytes.extend_from_slice(read);
        if !self.is_open
            && let Some(end) = self.bytes.windows(4).position(|four| four == b"\r\n\r\n")
        {
            self.bytes.drain(..end + 4);
            self.is_open = true;
        }
        while self.is_open
            && let Some(length) = message_bytes(&self.bytes)
        {
            self.bytes.drain(..length);
            each(length);
        }
    }
}

/// Length of the WebSocket message that the bytes begin with, once it is there: a server's are not masked.
fn message_bytes(bytes: &[u8]) -> Option<usize> {
    let (head, length) = match *bytes.get(1)? {
        126 => (4, usize::from(u16::from_be_bytes(bytes.get(2..4)?.try_into().ok()?))),
        127 => (10, u64::from_be_bytes(bytes.get(2..10)?.try_into().ok()?) as usize),
        short => (2, usize::from(short)),
    };
    (bytes.len() >= head + length).then_some(head + length)
}
