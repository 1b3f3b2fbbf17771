//! The sums of one scene as a file, so that a long experiment can stop and resume, or run on several machines.
//!
//! A file is: 16 bytes that say what it is, 8 bytes of checksum (little endian, FNV-1a), then a [`Stamp`] and the
//! sums as postcard writes them: floats keep every bit.

use serde::{Deserialize, Serialize};

use crate::oracle::ladder::SceneLadder;
use crate::run::chain::SceneResult;
use crate::run::scene_score::SceneScore;
use crate::score::fingerprint::fingerprint;

/// How every file begins; the last digit counts the formats.
const MAGIC: &[u8; 16] = b"umbracast scene1";
const CHECKSUM_END: usize = MAGIC.len() + 8;

/// What the sums were made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// Fingerprint of the program.
    pub program: u64,
    /// Fingerprint of the configurations, the weights, and the scene's people and seed.
    pub inputs: u64,
    /// Index of the scene.
    pub scene: u32,
}

/// Why a file cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// Cut off or changed: says what was found. The scene has to be run again.
    Damaged(String),
    /// Whole, but of another experiment.
    Foreign(Stamp),
}

/// The file's bytes. Rows that were kept are left out.
pub fn to_bytes(stamp: &Stamp, result: &SceneResult) -> Vec<u8> {
    let body = postcard::to_stdvec(&(stamp, &result.score, &result.ladder)).expect("sums are plain data");
    [MAGIC.as_slice(), &fingerprint(&[&body]).to_le_bytes(), &body].concat()
}

/// The sums of a file that was made with `stamp`.
///
/// # Errors
/// A file that is not whole, or of another experiment.
pub fn from_bytes(bytes: &[u8], stamp: &Stamp) -> Result<SceneResult, Fault> {
    if bytes.get(..MAGIC.len()) != Some(MAGIC.as_slice()) {
        return Err(Fault::Damaged("the sums of a scene: other first bytes".to_owned()));
    }
    let (checksum, body) = match (bytes.get(MAGIC.len()..CHECKSUM_END), bytes.get(CHECKSUM_END..)) {
        (Some(checksum), Some(body)) => (checksum, body),
        _ => return Err(Fault::Damaged(format!("a whole file: {} bytes", bytes.len()))),
    };
    if *checksum != fingerprint(&[body]).to_le_bytes() {
        return Err(Fault::Damaged(format!("a whole file: {} bytes with another checksum", bytes.len())));
    }
    // The stamp first: sums of another program may be laid out otherwise.
    let damaged = |e: postcard::Error| Fault::Damaged(format!("the sums of a scene: {e}"));
    let (found, sums) = postcard::take_from_bytes::<Stamp>(body).map_err(damaged)?;
    if found != *stamp {
        return Err(Fault::Foreign(found));
    }
    let (score, ladder) = postcard::from_bytes::<(SceneScore, Option<SceneLadder>)>(sums).map_err(damaged)?;
    Ok(SceneResult { score, ladder, kept: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::scene_score::{ModeRun, score_scene};
    use crate::score::hand_made::{link_row, track_row, truth_of};
    use crate::score::scene::SceneRun;
    use umbracast::{Config, Health, Mode};

    const STAMP: Stamp = Stamp { program: 1, inputs: 2, scene: 3 };

    fn result() -> SceneResult {
        let truth = truth_of(2, 40, |person, frame| person == 1 && frame % 7 == 0);
        let mut rows = SceneRun {
            tracks: (0..40).map(|frame| track_row(frame, 5, 9.9, 0.1)).collect(),
            links: (0..40).map(|frame| link_row(frame, 5, frame % 5 == 0)).collect(),
        };
        rows.links.iter_mut().for_each(|link| link.p = [0.1 + 0.2; umbracast::STEPS]);
        let config = Config::for_mode(Mode::Default);
        let run = ModeRun { config: &config, rows: &rows, health: Health::default() };
        let score = score_scene(3, "hand made", &truth, &[run], None, None).unwrap();
        SceneResult { score, ladder: Some(SceneLadder { rungs: Vec::new() }), kept: None }
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let mut result = result();
        // What JSON cannot hold, and what text loses.
        result.score.modes[0].displacement.steps[0].nll = f64::INFINITY;
        result.score.modes[0].stage1.distance_m = f64::from_bits(0x3fb9_9999_9999_999a);
        let bytes = to_bytes(&STAMP, &result);
        let read = from_bytes(&bytes, &STAMP).unwrap();
        assert_eq!((&read.score, &read.ladder), (&result.score, &result.ladder));
        assert_eq!(to_bytes(&STAMP, &read), bytes);
    }

    #[test]
    fn a_file_cut_anywhere_or_changed_is_damaged() {
        let bytes = to_bytes(&STAMP, &result());
        let mut changed = bytes.clone();
        changed[bytes.len() / 2] ^= 1;
        let cut = [0, 10, 16, 20, 24, 30, bytes.len() - 1].map(|length| bytes[..length].to_vec());
        for broken in cut.iter().chain([&changed]) {
            assert!(matches!(from_bytes(broken, &STAMP), Err(Fault::Damaged(_))), "{} bytes", broken.len());
        }
    }

    #[test]
    fn a_file_of_another_experiment_says_whose_it_is() {
        let other = Stamp { inputs: 4, ..STAMP };
        let fault = from_bytes(&to_bytes(&other, &result()), &STAMP).unwrap_err();
        assert_eq!(fault, Fault::Foreign(other));
    }
}
