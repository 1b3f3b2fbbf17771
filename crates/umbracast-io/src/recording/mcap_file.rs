//! Messages of an MCAP file, in the order of the file.
//!
//! Schemas, channels and messages are parsed here. The crate's own parser makes room for a string by the length that stands
//! before it, up to 4 GB, before it looks whether the string is there.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// One message after the other.
pub struct Messages {
    input: BufReader<File>,
    reader: LinearReader,
    /// The names of types, by their number.
    schemas: BTreeMap<u16, String>,
    /// Topic and type, by the channel's number.
    channels: BTreeMap<u16, (String, String)>,
}

impl Messages {
    /// Of a file whose records are believed to be no longer than so many bytes.
    pub fn new(file: File, longest_bytes: usize) -> Self {
        let options = LinearReaderOptions::default().with_record_length_limit(longest_bytes);
        Self {
            input: BufReader::new(file),
            reader: LinearReader::new_with_options(options),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        }
    }

    /// What `understand` makes of the next message: its topic, its type and its bytes. `None` behind the last.
    ///
    /// # Errors
    /// What is wrong with the file, in words.
    pub fn next<T>(&mut self, understand: impl FnOnce(&str, &str, &[u8]) -> T) -> Result<Option<T>, String> {
        while let Some(event) = self.reader.next_event() {
            match event.map_err(|error| plain(&error))? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read =
                        retried(&mut self.input, self.reader.insert(wanted)).map_err(|e| e.to_string())?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { opcode: op::SCHEMA, data } => {
                    let (number, name) = schema(data).ok_or("a schema that is cut off")?;
                    declare(&mut self.schemas, number, name, "schema")?;
                }
                LinearReadEvent::Record { opcode: op::CHANNEL, data } => {
                    let (number, schema, topic) = channel(data).ok_or("a channel that is cut off")?;
                    let kind = match (schema, self.schemas.get(&schema)) {
                        (0, _) => String::new(),
                        (_, Some(kind)) => kind.clone(),
                        (_, None) => {
                            return Err(format!(
                                "a channel {topic:?} of schema {schema}, which is not there"
                            ));
                        }
                    };
                    declare(&mut self.channels, number, (topic, kind), "channel")?;
                }
                LinearReadEvent::Record { opcode: op::MESSAGE, data } => {
                    let (number, message) = message(data).ok_or("a message that is cut off")?;
                    let (topic, kind) = self
                        .channels
                        .get(&number)
                        .ok_or_else(|| format!("a message of channel {number}, which is not there"))?;
                    return Ok(Some(understand(topic, kind, message)));
                }
                // Indices, attachments and the summary say nothing new.
                LinearReadEvent::Record { .. } => {}
            }
        }
        Ok(None)
    }
}

/// Notes what a number stands for; the summary says it again.
fn declare<T: PartialEq>(
    known: &mut BTreeMap<u16, T>,
    number: u16,
    value: T,
    what: &str,
) -> Result<(), String> {
    match known.get(&number) {
        Some(before) if *before != value => Err(format!("another {what} of number {number} than before")),
        _ => {
            known.insert(number, value);
            Ok(())
        }
    }
}

/// Reads, once more where a signal came between.
fn retried(input: &mut impl Read, into: &mut [u8]) -> io::Result<usize> {
    loop {
        match input.read(into) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            read => return read,
        }
    }
}

/// Number and name.
fn schema(mut record: &[u8]) -> Option<(u16, String)> {
    let number = u16::from_le_bytes(take(&mut record)?);
    Some((number, string(&mut record)?))
}

/// Number, schema's number and topic.
fn channel(mut record: &[u8]) -> Option<(u16, u16, String)> {
    let number = u16::from_le_bytes(take(&mut record)?);
    let schema = u16::from_le_bytes(take(&mut record)?);
    Some((number, schema, string(&mut record)?))
}

/// Channel's number and bytes, behind the message's count and its two times.
fn message(mut record: &[u8]) -> Option<(u16, &[u8])> {
    let number = u16::from_le_bytes(take(&mut record)?);
    take::<20>(&mut record)?;
    Some((number, record))
}

fn take<const N: usize>(record: &mut &[u8]) -> Option<[u8; N]> {
    let (now, rest) = record.split_first_chunk()?;
    *record = rest;
    Some(*now)
}

/// A length and as many bytes of UTF-8.
fn string(record: &mut &[u8]) -> Option<String> {
    let length = u32::from_le_bytes(take(record)?) as usize;
    let (text, rest) = record.split_at_checked(length)?;
    *record = rest;
    std::str::from_utf8(text).ok().map(str::to_owned)
}

/// An error in words: the library's leave out what the disk said.
pub(super) fn plain(error: &McapError) -> String {
    match error {
        McapError::Io(error) => error.to_string(),
        McapError::BadMagic => "other bytes at its beginning".to_owned(),
        McapError::UnexpectedEof => "its end before the first message".to_owned(),
        McapError::UnsupportedCompression(codec) => format!(
            "chunks in {codec}, which this program reads if it is built with `--features compression`; `mcap \
             decompress` writes the recording without"
        ),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel's topic of 1.9 GB was made room for, in a file of 20 kB.
    #[test]
    fn a_string_is_no_longer_than_its_record() {
        let record = |length: u32| [&[1, 0, 2, 0][..], &length.to_le_bytes(), b"/scan"].concat();
        assert_eq!(channel(&record(5)), Some((1, 2, "/scan".to_owned())));
        assert_eq!(channel(&record(4)), Some((1, 2, "/sca".to_owned())));
        for length in [6, 1_919_053_073, u32::MAX] {
            assert_eq!(channel(&record(length)), None, "{length}");
            assert_eq!(schema(&record(length)), None, "{length}");
        }
    }
}
