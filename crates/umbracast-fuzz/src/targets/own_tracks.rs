//! Tracks of other programs.

use std::fs;
use std::sync::LazyLock;

use umbracast::forecast::Weights;
use umbracast::{Config, Outcome};
use umbracast_io::own_tracks::OwnTracks;
use umbracast_io::tables::{self, Values};

use super::files::in_file;
use super::{Target, settings};

/// A table of another program gives links with probabilities that never fall, of a person and an access point each, or an error. The
/// first byte of the input says whether it is CSV or Parquet.
pub const OWN_TRACKS: Target = Target { name: "own_tracks", corpus: written, check: cast };

/// A table of more rows is read, but not cast.
const ROWS_MAX: usize = 200;

static WEIGHTS: LazyLock<Weights> =
    LazyLock::new(|| Weights::from_safetensors(&settings::small_lstm()).expect("weights of ours"));

fn written() -> Vec<Vec<u8>> {
    let short = "id,time_s,x,y,vx,vy,height_m\n1,0.1,4,0,0,0,1.7\n2,0.1,6,-1.9,0,1.3,1.1\n1,0.2,4,0,0,0,\n";
    let place = |k: u32, name: &str| {
        (name.to_owned(), Values::F64((0..8).map(|row| 0.1 * f64::from(row * k)).collect()))
    };
    let mut columns = vec![
        ("id".to_owned(), Values::U32((0..8).map(|row| row % 2).collect())),
        ("time_s".to_owned(), Values::F64((0..8).map(|row| 0.1 * f64::from(row / 2 + 1)).collect())),
    ];
    columns.extend((0..).zip(["x", "y", "vx", "vy"]).map(|(k, name)| place(k, name)));
    let folder = tempfile::tempdir().expect("a folder");
    tables::write_columns(folder.path(), "tracks", &columns).expect("the folder can be written to");
    let file = |name: &str| fs::read(folder.path().join(name)).expect("it was written");
    vec![
        [b"\0", short.as_bytes()].concat(),
        [b"\0".to_vec(), file("tracks.csv")].concat(),
        [b"\x01".to_vec(), file("tracks.parquet")].concat(),
    ]
}

fn cast(input: &[u8]) -> bool {
    let Some((kind, bytes)) = input.split_first() else { return false };
    let name = if kind.is_multiple_of(2) { "own.csv" } else { "own.parquet" };
    let Ok(own) = in_file(name, bytes, |folder| OwnTracks::read(&folder.join(name))) else { return false };
    if own.rows().len() > ROWS_MAX {
        return true;
    }
    let config = Config::default();
    let told = own.cast(&config, &WEIGHTS, |_, outcome| {
        check(outcome, config.site.access_points.len());
        Ok(())
    });
    told.is_ok()
}

fn check(outcome: &Outcome, access_points: usize) {
    assert!(outcome.blockages.len() <= access_points * outcome.tracks.len());
    for link in &outcome.blockages {
        assert!(
            link.access_point < access_points && outcome.tracks.iter().any(|track| track.id == link.track)
        );
        assert!(
            (0.0..=1.0).contains(&link.p_now) && link.p.iter().all(|p| (0.0..=1.0).contains(p)),
            "{link:?}"
        );
        assert!(link.p.is_sorted(), "{link:?}");
    }
}
