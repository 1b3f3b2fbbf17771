//! The header of a PCD file: lines of a key and its values, up to DATA.

use std::str::FromStr;

use umbracast::Error;

use super::cloud::{PcdCloud, PcdEncoding, PcdField, PcdKind};

/// What the header says.
pub struct Header {
    /// With fields that have no values yet.
    pub cloud: PcdCloud,
    /// Of what follows.
    pub encoding: PcdEncoding,
    /// Lines up to the data.
    pub lines: usize,
}

impl Header {
    /// The header, and the bytes after it.
    pub fn read(bytes: &[u8]) -> Result<(Self, &[u8]), Error> {
        let mut found: Vec<(usize, Vec<String>)> = Vec::new();
        let mut rest = bytes;
        let mut number = 0;
        loop {
            if rest.is_empty() {
                return Err(Error::new(format!("line {}: expected DATA, found the file's end", number + 1)));
            }
            number += 1;
            let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
            let line = String::from_utf8_lossy(&rest[..end]);
            rest = &rest[rest.len().min(end + 1)..];
            let words: Vec<_> = line.split_whitespace().map(str::to_owned).collect();
            match words.first().map(String::as_str) {
                None => {}
                Some(key) if key.starts_with('#') => {}
                Some("DATA") => {
                    found.push((number, words));
                    break;
                }
                Some(
                    "VERSION" | "FIELDS" | "COLUMNS" | "SIZE" | "TYPE" | "COUNT" | "WIDTH" | "HEIGHT"
                    | "VIEWPOINT" | "POINTS",
                ) => {
                    found.push((number, words));
                }
                Some(key) => {
                    let key: String = key.chars().take(40).collect();
                    return Err(Error::new(format!(
                        "line {number}: expected a key of a PCD header, found {key:?}"
                    )));
                }
            }
        }
        let lines = Lines { found };
        Ok((Self { cloud: lines.cloud()?, encoding: lines.encoding()?, lines: number }, rest))
    }
}

/// The header of a cloud, as text.
pub fn text(cloud: &PcdCloud, encoding: PcdEncoding) -> String {
    let all = |value: fn(&PcdField) -> String| cloud.fields.iter().map(value).collect::<Vec<_>>().join(" ");
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
         WIDTH {}\nHEIGHT {}\nVIEWPOINT {}\nPOINTS {}\nDATA {}\n",
        all(|f| f.name.clone()),
        all(|f| f.kind.size().to_string()),
        all(|f| f.kind.letter().to_string()),
        all(|f| f.count.to_string()),
        cloud.width,
        cloud.height,
        cloud.viewpoint.map(|v| v.to_string()).join(" "),
        cloud.width * cloud.height,
        encoding.name(),
    )
}

/// The lines of a header: number, then key and values.
struct Lines {
    found: Vec<(usize, Vec<String>)>,
}

impl Lines {
    fn cloud(&self) -> Result<PcdCloud, Error> {
        // Before version 0.6 the fields were called columns.
        let names_key = if self.line("FIELDS").is_some() { "FIELDS" } else { "COLUMNS" };
        let names: Vec<String> = self.values(names_key, None)?;
        let sizes: Vec<String> = self.values("SIZE", Some(names.len()))?;
        let kinds: Vec<String> = self.values("TYPE", Some(names.len()))?;
        let counts: Vec<usize> = match self.line("COUNT") {
            Some(_) => self.values("COUNT", Some(names.len()))?,
            None => vec![1; names.len()],
        };
        let fields =
            names.into_iter().zip(sizes).zip(kinds).zip(counts).map(|(((name, size), kind), count)| {
                let kind = PcdKind::from_header(&kind, &size).ok_or_else(|| {
                    let expected = "a type and size of I1 I2 I4 I8 U1 U2 U4 U8 F4 F8";
                    Error::new(format!("field {name:?}: expected {expected}, found {kind}{size}"))
                })?;
                Ok(PcdField { name, kind, count, values: Vec::new() })
            });
        let fields: Vec<_> = fields.collect::<Result<_, Error>>()?;

        let one = |key, missing| match self.line(key) {
            Some(_) => self.values(key, Some(1)).map(|values: Vec<usize>| Some(values[0])),
            None => Ok(missing),
        };
        let points = one("POINTS", None)?;
        let width = one("WIDTH", points)?.ok_or_else(|| Error::new("expected WIDTH, found none"))?;
        let height = one("HEIGHT", Some(1))?.unwrap_or(1);
        let product = width.checked_mul(height);
        if product.is_none() || points.is_some_and(|points| Some(points) != product) {
            let found = points.unwrap_or(0);
            return Err(Error::new(format!(
                "POINTS: expected WIDTH {width} x HEIGHT {height}, found {found}"
            )));
        }
        let record = fields.iter().try_fold(0_usize, |sum, f| sum.checked_add(f.count.checked_mul(8)?));
        if record.is_none() || fields.iter().any(|f| f.count == 0) {
            return Err(Error::new("COUNT: expected one or a few values a point and field"));
        }
        let viewpoint = match self.line("VIEWPOINT") {
            Some(_) => self.values("VIEWPOINT", Some(7))?.try_into().unwrap_or_default(),
            None => [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        };
        Ok(PcdCloud { width, height, viewpoint, fields })
    }

    fn encoding(&self) -> Result<PcdEncoding, Error> {
        let name = &self.values::<String>("DATA", Some(1))?[0];
        [PcdEncoding::Ascii, PcdEncoding::Binary, PcdEncoding::BinaryCompressed]
            .into_iter()
            .find(|encoding| encoding.name() == name)
            .ok_or_else(|| {
                Error::new(format!("DATA: expected ascii, binary or binary_compressed, found {name:?}"))
            })
    }

    fn line(&self, key: &str) -> Option<&(usize, Vec<String>)> {
        self.found.iter().find(|(_, words)| words[0] == key)
    }

    /// The values of a key, `expected` in number.
    fn values<T: FromStr>(&self, key: &str, expected: Option<usize>) -> Result<Vec<T>, Error> {
        let (number, words) =
            self.line(key).ok_or_else(|| Error::new(format!("header: expected {key}, found none")))?;
        let values = &words[1..];
        if let Some(expected) = expected.filter(|&expected| expected != values.len()) {
            let found = values.len();
            return Err(Error::new(format!(
                "line {number}, {key}: expected {expected} values, found {found}"
            )));
        }
        let value = |word: &String| {
            word.parse()
                .map_err(|_| Error::new(format!("line {number}, {key}: expected a number, found {word:?}")))
        };
        values.iter().map(value).collect()
    }
}

impl PcdEncoding {
    fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii",
            Self::Binary => "binary",
            Self::BinaryCompressed => "binary_compressed",
        }
    }
}

impl PcdKind {
    fn from_header(letter: &str, size: &str) -> Option<Self> {
        let all = [
            Self::I8,
            Self::I16,
            Self::I32,
            Self::I64,
            Self::U8,
            Self::U16,
            Self::U32,
            Self::U64,
            Self::F32,
            Self::F64,
        ];
        all.into_iter().find(|kind| kind.letter() == letter && kind.size().to_string() == size)
    }

    fn letter(self) -> &'static str {
        match self {
            Self::I8 | Self::I16 | Self::I32 | Self::I64 => "I",
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => "U",
            Self::F32 | Self::F64 => "F",
        }
    }
}
