//! The pages of a Parquet column, compared with what is there before room is made for them. The reader's crate believes
//! what a page's header says: what it unpacks to, and how many values it holds.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::{Compression, Encoding};
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::column::reader::{ColumnReader, get_column_reader};
use parquet::errors::ParquetError;
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::reader::{ChunkReader, Length};
use parquet::file::serialized_reader::SerializedPageReader;
use umbracast::Error;

/// A byte of a dictionary holds as many values at most: those of a column of bits.
const VALUES_A_BYTE: usize = 8;

/// The reader of a flat column of a row group of so many rows.
pub(super) fn column_reader(
    file: &Arc<File>,
    column: &ColumnChunkMetaData,
    rows: usize,
) -> Result<ColumnReader, ParquetError> {
    let chunk = Chunk { file: file.clone(), file_bytes: file.len(), growth: growth(column.compression()) };
    let pages = SerializedPageReader::new(Arc::new(chunk), column, rows, None)?;
    Ok(get_column_reader(column.column_descr_ptr(), Box::new(Pages { pages, rows })))
}

/// What a byte unpacks to at most. Snappy copies up to 64 bytes by three (`format_description.txt`, 2.2); a block of zstd
/// repeats a byte 128 KiB long by four (RFC 8878, 3.1.1.2).
fn growth(codec: Compression) -> u64 {
    match codec {
        Compression::UNCOMPRESSED => 1,
        Compression::SNAPPY => 22,
        _ => 1 << 15,
    }
}

fn wrong(story: String) -> ParquetError {
    ParquetError::General(story)
}

/// The bytes of a column.
struct Chunk {
    file: Arc<File>,
    file_bytes: u64,
    growth: u64,
}

impl Length for Chunk {
    fn len(&self) -> u64 {
        self.file_bytes
    }
}

impl ChunkReader for Chunk {
    type T = BufReader<File>;

    /// Called where a page's header begins.
    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let mut header = self.file.get_read(start)?;
        let Some([packed, unpacked]) = sizes(header.fill_buf()?) else {
            return Err(wrong(format!(
                "expected the header of a page at byte {start}, found something else"
            )));
        };
        if unpacked > packed.saturating_mul(self.growth) {
            return Err(wrong(format!("a page of {packed} bytes that claims to unpack to {unpacked}")));
        }
        Ok(header)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        if start.checked_add(length as u64).is_none_or(|end| end > self.file_bytes) {
            return Err(wrong(format!("a page of {length} bytes at byte {start} of {}", self.file_bytes)));
        }
        self.file.get_bytes(start, length)
    }
}

/// The sizes of a page, as it is stored and unpacked. They are the third and the second field of a page's header in Thrift's
/// compact protocol, behind the type: each a byte that says "the next field, an i32", and a number.
fn sizes(mut header: &[u8]) -> Option<[u64; 2]> {
    const NEXT_I32: u8 = 0x15;
    let mut field = || {
        let (&NEXT_I32, mut rest) = header.split_first()? else { return None };
        let (mut zigzag, mut shift) = (0_u64, 0);
        loop {
            let (&byte, behind) = rest.split_first()?;
            rest = behind;
            zigzag |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                header = rest;
                // Even numbers are positive ones twice; a page has no negative size.
                return (zigzag % 2 == 0).then_some(zigzag / 2);
            }
            if shift > 28 {
                return None;
            }
        }
    };
    let (_kind, unpacked, packed) = (field()?, field()?, field()?);
    Some([packed, unpacked])
}

/// Pages with as many values as their bytes and the rows of the group account for.
struct Pages {
    pages: SerializedPageReader<Chunk>,
    rows: usize,
}

impl Pages {
    fn checked(&self, page: Page) -> Result<Page, ParquetError> {
        let (values, bytes) = (page.num_values() as usize, page.buffer().len());
        let most = match page {
            Page::DictionaryPage { .. } => VALUES_A_BYTE.saturating_mul(bytes),
            _ => self.rows,
        };
        if values > most {
            return Err(wrong(format!(
                "a page of {bytes} bytes with {values} values, expected {most} at most"
            )));
        }
        // The crate makes room for as many lengths as these say themselves.
        if matches!(page.encoding(), Encoding::DELTA_LENGTH_BYTE_ARRAY | Encoding::DELTA_BYTE_ARRAY) {
            return Err(wrong(format!(
                "values encoded as {}, expected a plain page or a dictionary",
                page.encoding()
            )));
        }
        Ok(page)
    }
}

impl Iterator for Pages {
    type Item = Result<Page, ParquetError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>, ParquetError> {
        let page = self.pages.get_next_page()?;
        page.map(|page| self.checked(page)).transpose()
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>, ParquetError> {
        self.pages.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<(), ParquetError> {
        self.pages.skip_next_page()
    }
}

/// Who writes a table with another program may not know how it is compressed; polars does it with zstd.
pub(super) fn refuse_codec(codec: Compression) -> Result<(), Error> {
    let with_zstd = cfg!(feature = "compression");
    let found = match codec {
        Compression::UNCOMPRESSED | Compression::SNAPPY => return Ok(()),
        Compression::ZSTD(_) if with_zstd => return Ok(()),
        Compression::ZSTD(_) => "zstd, which a build with `--features compression` reads".to_owned(),
        other => format!("{other:?}"),
    };
    let known = if with_zstd { "snappy, zstd" } else { "snappy" };
    Err(Error::new(format!(
        "expected values compressed with {known} or not at all, found {found}; polars writes snappy with \
         `write_parquet(file, compression=\"snappy\")`"
    )))
}

#[cfg(test)]
mod tests {
    use super::super::{path_in, read, write};
    use super::*;
    use crate::rows::MatchRow;

    /// The largest i32, as Thrift writes it.
    const LARGEST: [u8; 5] = [0xfe, 0xff, 0xff, 0xff, 0x0f];

    /// What is said of a table in whose first dictionary page the number behind these bytes of the header is the largest
    /// there is; `None` stands for a number.
    fn told_with_largest_behind(before: &[Option<u8>]) -> String {
        let directory = tempfile::tempdir().unwrap();
        let rows: Vec<MatchRow> = (0..20).map(|k| MatchRow { frame: k, ..MatchRow::default() }).collect();
        write(directory.path(), &[], false, &rows).unwrap();
        let path = path_in::<MatchRow>(directory.path());
        let mut bytes = std::fs::read(&path).unwrap();
        let is_header =
            |window: &[u8]| window.iter().zip(before).all(|(b, known)| known.is_none_or(|k| k == *b));
        let at = bytes.windows(before.len()).position(is_header).unwrap() + before.len();
        bytes.splice(at..=at, LARGEST);
        std::fs::write(&path, bytes).unwrap();
        read::<MatchRow>(directory.path(), &[]).unwrap_err().to_string()
    }

    /// The header of a dictionary page: type 2, two sizes, the dictionary's own header with the count of values.
    const COUNT: [Option<u8>; 8] =
        [Some(0x15), Some(4), Some(0x15), None, Some(0x15), None, Some(0x4c), Some(0x15)];

    /// Room for two billion values was made, 8 GB of numbers or 64 GB of names.
    #[test]
    fn a_dictionary_holds_no_more_values_than_its_page() {
        let told = told_with_largest_behind(&COUNT);
        assert!(
            told.contains("matches.parquet: column scene") && told.contains("2147483647 values"),
            "{told}"
        );
    }

    /// Two gigabytes were filled with zeros before the page was unpacked.
    #[test]
    fn a_page_does_not_unpack_to_more_than_its_codec_can() {
        let told = told_with_largest_behind(&COUNT[..3]);
        assert!(told.contains("claims to unpack to 2147483647"), "{told}");
    }

    #[test]
    fn the_sizes_of_a_page_are_read_off_its_header() {
        // Type 0, 300 bytes unpacked, 64 stored.
        assert_eq!(sizes(&[0x15, 0, 0x15, 0xd8, 0x04, 0x15, 0x80, 0x01, 0x2c]), Some([64, 300]));
        assert_eq!(sizes(&[0x15, 0, 0x15, 0xd8]), None, "cut off");
        assert_eq!(sizes(&[0x15, 0, 0x15, 1, 0x15, 2]), None, "a negative size");
        assert_eq!(sizes(&[0x25, 0, 0x15, 2, 0x15, 2]), None, "another field first");
        assert_eq!(sizes(&[0x15, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0]), None, "more than 32 bits");
    }
}
