//! A recording that is looked at: its computed frames on disk, so that any of them is shown at once.
//!
//! One thread computes and adds; the page asks for frames by their number. What is written lies in a file without a name,
//! which is gone with the program.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};
use umbracast::Error;

use crate::published::{Published, Wanted};

/// A whole scan is kept of every so many frames: the hall stands still.
pub const SCAN_EVERY: u64 = 5;
/// No more than that is written to disk: some hours of a few people.
const BYTES_MAX: u64 = 16 << 30;
/// Frames in one answer, and their bytes: at least one frame is in it.
const FRAMES_MAX: u64 = 64;
const ANSWER_BYTES: u64 = 16 << 20;

/// The frames that are computed so far.
#[derive(Debug)]
pub struct Recording {
    modes: Vec<String>,
    rate: f64,
    again: bool,
    truth: bool,
    kept: Mutex<Kept>,
}

#[derive(Debug)]
struct Kept {
    file: File,
    /// Where each frame's text ends; it begins behind the frame before it and that one's scan.
    frames: Vec<Piece>,
    scans: Vec<Piece>,
    length: u64,
    done: bool,
    told: Option<String>,
}

/// A part of the file.
#[derive(Debug, Clone, Copy)]
struct Piece {
    at: u64,
    bytes: u64,
}

impl Recording {
    /// An empty one, of so many modes side by side. `rate` and `again` are how the page begins to play it; `truth`:
    /// frames come with it.
    ///
    /// # Errors
    /// A folder for temporary files that cannot be written to.
    pub fn new(modes: Vec<String>, rate: f64, again: bool, truth: bool) -> Result<Self, Error> {
        let file = tempfile::tempfile().map_err(|e| {
            Error::new(e.to_string()).within("a temporary file for the frames of the recording")
        })?;
        let kept = Kept { file, frames: Vec::new(), scans: Vec::new(), length: 0, done: false, told: None };
        Ok(Self { modes, rate, again, truth, kept: Mutex::new(kept) })
    }

    /// Adds the next frame: what each mode says, the truth where there is one, and the whole scan of every
    /// [`SCAN_EVERY`]th. False where the disk holds no more; the reason is told to the page.
    pub fn add(&self, of_modes: &[Published], truth: Option<&Value>, scan: impl FnOnce() -> Vec<u8>) -> bool {
        let frames: Vec<_> = of_modes.iter().map(|published| published.json(&Wanted::WHOLE, None)).collect();
        let Ok(text) = serde_json::to_vec(&json!({ "frames": frames, "truth": truth })) else { return false };
        let mut kept = self.lock();
        let scanned = (kept.frames.len() as u64).is_multiple_of(SCAN_EVERY).then(scan);
        let result = kept.write(&text).and_then(|piece| {
            kept.frames.push(piece);
            scanned.map_or(Ok(()), |scan| {
                let piece = kept.write(&scan)?;
                kept.scans.push(piece);
                Ok(())
            })
        });
        if let Err(error) = result {
            kept.told = Some(format!("only the first {} frames: {error}", kept.frames.len()));
            return false;
        }
        true
    }

    /// No more frames come; what was lost of them.
    pub fn finish(&self, told: Option<String>) {
        let mut kept = self.lock();
        kept.done = true;
        kept.told = kept.told.take().or(told);
    }

    /// Whether no more frames are taken: the disk holds no more.
    pub fn is_full(&self) -> bool {
        self.lock().told.is_some()
    }

    /// How many frames there are, and what is shown.
    pub fn about(&self) -> Value {
        let kept = self.lock();
        json!({
            "frames": kept.frames.len(), "done": kept.done, "told": kept.told, "modes": self.modes, "rate": self.rate,
            "again": self.again, "truth": self.truth, "scan_every": SCAN_EVERY,
        })
    }

    /// A JSON list of at most `count` frames from the `from`th on; as many as there are and as one answer holds.
    ///
    /// # Errors
    /// A disk that cannot be read.
    pub fn frames(&self, from: u64, count: u64) -> Result<Vec<u8>, Error> {
        let mut kept = self.lock();
        let first = usize::try_from(from).unwrap_or(usize::MAX).min(kept.frames.len());
        let last = first.saturating_add(count.min(FRAMES_MAX) as usize).min(kept.frames.len());
        let (mut text, mut begun) = (b"[".to_vec(), false);
        for number in first..last {
            let piece = kept.frames[number];
            if begun && text.len() as u64 + piece.bytes > ANSWER_BYTES {
                break;
            }
            if std::mem::replace(&mut begun, true) {
                text.push(b',');
            }
            kept.read(piece, &mut text)?;
        }
        text.push(b']');
        Ok(text)
    }

    /// The whole scan of the frame that is the last one with a scan up to this one; `None` where there is none yet.
    ///
    /// # Errors
    /// A disk that cannot be read.
    pub fn scan(&self, frame: u64) -> Result<Option<Vec<u8>>, Error> {
        let mut kept = self.lock();
        let number = usize::try_from(frame / SCAN_EVERY).unwrap_or(usize::MAX);
        let Some(piece) = kept.scans.get(number).copied() else { return Ok(None) };
        let mut bytes = Vec::new();
        kept.read(piece, &mut bytes)?;
        Ok(Some(bytes))
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    fn write(&mut self, bytes: &[u8]) -> Result<Piece, Error> {
        let piece = Piece { at: self.length, bytes: bytes.len() as u64 };
        if self.length + piece.bytes > BYTES_MAX {
            return Err(Error::new(format!("expected at most {BYTES_MAX} bytes, found more")));
        }
        let failed = |e: std::io::Error| Error::new(e.to_string()).within("the temporary file");
        self.file.seek(SeekFrom::Start(piece.at)).map_err(failed)?;
        self.file.write_all(bytes).map_err(failed)?;
        self.length += piece.bytes;
        Ok(piece)
    }

    fn read(&mut self, piece: Piece, into: &mut Vec<u8>) -> Result<(), Error> {
        let failed = |e: std::io::Error| Error::new(e.to_string()).within("the temporary file");
        self.file.seek(SeekFrom::Start(piece.at)).map_err(failed)?;
        let read = (&mut self.file).take(piece.bytes).read_to_end(into).map_err(failed)?;
        match read as u64 == piece.bytes {
            true => Ok(()),
            false => {
                Err(Error::new("expected all of what was written, found less").within("the temporary file"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_frame_is_there_at_once_and_no_answer_is_without_bounds() {
        let recording = Recording::new(vec!["default".to_owned()], 1.0, false, true).unwrap();
        for k in 0..100 {
            let published = Published { frame: k, ..Published::default() };
            assert!(recording.add(&[published], Some(&json!({ "people": [k] })), || vec![k as u8; 3]));
        }
        recording.finish(None);
        let frames: Value = serde_json::from_slice(&recording.frames(57, 2).unwrap()).unwrap();
        assert_eq!(frames[1]["frames"][0]["frame"], 58);
        assert_eq!((&frames[0]["truth"]["people"][0], frames.as_array().unwrap().len()), (&json!(57), 2));
        let count = |from, count| {
            let frames: Value = serde_json::from_slice(&recording.frames(from, count).unwrap()).unwrap();
            frames.as_array().unwrap().len()
        };
        assert_eq!(
            [count(0, u64::MAX), count(99, 5), count(100, 5), count(u64::MAX, u64::MAX)],
            [64, 1, 0, 0]
        );
        assert_eq!(recording.scan(14).unwrap(), Some(vec![10; 3]));
        assert_eq!([recording.scan(100).unwrap(), recording.scan(u64::MAX).unwrap()], [None, None]);
        assert_eq!((&recording.about()["frames"], &recording.about()["done"]), (&json!(100), &json!(true)));
    }
}
