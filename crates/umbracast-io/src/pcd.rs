//! Point clouds from and to PCD files: every version up to 0.7, every encoding, every field type, fields in any
//! order. Format: pointclouds.org, "The PCD file format".
//!
//! Written by hand: it reads any field of any type by its name, and errors name line, expected and found.

mod cloud;
mod header;

use umbracast::Error;

use crate::lzf;
pub use cloud::{PcdCloud, PcdEncoding, PcdField, PcdKind};
use header::Header;

/// Reads a PCD file. `name` is the file's, for messages.
///
/// # Errors
/// What does not fit the format, with file, line or field, what was expected and what was found.
pub fn read_pcd(bytes: &[u8], name: &str) -> Result<PcdCloud, Error> {
    read(bytes).map_err(|e| e.within(name))
}

/// Writes a cloud as PCD 0.7.
pub fn write_pcd(cloud: &PcdCloud, encoding: PcdEncoding) -> Vec<u8> {
    let mut bytes = header::text(cloud, encoding).into_bytes();
    let points = cloud.width * cloud.height;
    match encoding {
        PcdEncoding::Ascii => {
            for p in 0..points {
                let values = cloud.fields.iter().flat_map(|f| f.point(p).iter().map(|&v| f.kind.to_text(v)));
                bytes.extend_from_slice(values.collect::<Vec<_>>().join(" ").as_bytes());
                bytes.push(b'\n');
            }
        }
        PcdEncoding::Binary => {
            for p in 0..points {
                for field in &cloud.fields {
                    field.point(p).iter().for_each(|&value| field.kind.push(value, &mut bytes));
                }
            }
        }
        PcdEncoding::BinaryCompressed => {
            let mut raw = Vec::new();
            for field in &cloud.fields {
                field.values.iter().for_each(|&value| field.kind.push(value, &mut raw));
            }
            let compressed = lzf::compress(&raw);
            bytes.extend_from_slice(&(compressed.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&(raw.len() as u32).to_le_bytes());
            bytes.extend_from_slice(&compressed);
        }
    }
    bytes
}

fn read(bytes: &[u8]) -> Result<PcdCloud, Error> {
    let (header, data) = Header::read(bytes)?;
    let mut cloud = header.cloud;
    let points = cloud.width * cloud.height;
    let record: usize = cloud.fields.iter().map(|f| f.count * f.kind.size()).sum();
    match header.encoding {
        PcdEncoding::Ascii => read_ascii(&mut cloud.fields, points, data, header.lines)?,
        PcdEncoding::Binary => {
            let data = exactly(data, points, record)?;
            let mut at = 0;
            for field in &mut cloud.fields {
                let (kind, bytes) = (field.kind, field.count * field.kind.size());
                let values =
                    data.chunks_exact(record).flat_map(|r| r[at..at + bytes].chunks_exact(kind.size()));
                field.values = values.map(|value| kind.value(value)).collect();
                at += bytes;
            }
        }
        PcdEncoding::BinaryCompressed => {
            let size = |at: usize| {
                let bytes = data.get(at..at + 4).and_then(|b| b.try_into().ok());
                bytes.map(u32::from_le_bytes).ok_or_else(|| Error::new("compressed data: no sizes before it"))
            };
            let (packed, unpacked) = (size(0)? as usize, size(4)? as usize);
            let packed = data[8..].get(..packed).ok_or_else(|| {
                Error::new(format!("compressed data: expected {packed} bytes, found {}", data.len() - 8))
            })?;
            let raw = lzf::decompress(packed, unpacked)
                .ok_or_else(|| Error::new(format!("compressed data: does not unpack to {unpacked} bytes")))?;
            let mut raw = exactly(&raw, points, record)?;
            for field in &mut cloud.fields {
                let (column, rest) = raw.split_at(points * field.count * field.kind.size());
                field.values = column.chunks_exact(field.kind.size()).map(|v| field.kind.value(v)).collect();
                raw = rest;
            }
        }
    }
    Ok(cloud)
}

/// The bytes of all records; more may follow them.
fn exactly(data: &[u8], points: usize, record: usize) -> Result<&[u8], Error> {
    points.checked_mul(record).and_then(|bytes| data.get(..bytes)).ok_or_else(|| {
        let found = data.len();
        Error::new(format!("data: expected {points} points of {record} bytes, found {found} bytes"))
    })
}

fn read_ascii(fields: &mut [PcdField], points: usize, data: &[u8], header_lines: usize) -> Result<(), Error> {
    let lines = data.split(|&byte| byte == b'\n').zip(header_lines + 1..);
    let mut lines = lines.filter(|(line, _)| !line.trim_ascii().is_empty());
    for p in 0..points {
        let (line, number) =
            lines.next().ok_or_else(|| Error::new(format!("data: expected {points} points, found {p}")))?;
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        for field in &mut *fields {
            for _ in 0..field.count {
                let word = words.next().map(String::from_utf8_lossy).unwrap_or_default();
                let value: f64 = word.parse().map_err(|_| {
                    let place = format!("line {number}, field {:?}", field.name);
                    Error::new(format!("{place}: expected a number, found {word:?}"))
                })?;
                field.values.push(if field.kind == PcdKind::F32 { f64::from(value as f32) } else { value });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
