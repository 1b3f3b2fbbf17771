//! What somebody outside sees of a hall's frames, and the row of the table that is made of it.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use umbracast::Error;
use umbracast_io::fields;
use umbracast_io::nodes::Followed;
use umbracast_node::hall::Hall;
use umbracast_node::keys::Keys;
use umbracast_node::network::Network;

/// What a failure of no duration costs the others is looked at for as long.
const LOOKED_AT: Duration = Duration::from_secs(3);
/// A frame every 100 ms: after a longer gap than this something was missing.
const GAP: Duration = Duration::from_millis(150);

/// A frame's results as they came.
pub struct Seen {
    pub at: Instant,
    pub time_ns: i64,
    pub sensors: usize,
    pub people: BTreeSet<u64>,
}

/// Looks at the frames that stage 2 publishes, from outside of the three places.
pub fn look(watch: &Arc<Mutex<Vec<Seen>>>, connect: &[String]) -> Result<impl Sized + use<>, Error> {
    let network = Network { connect: connect.to_vec(), ..Network::default() };
    let hall = Hall::new(network.open()?, Keys::new("lab"));
    let seen = watch.clone();
    let heard = hall.hear(&hall.keys().of("tracks"), move |_, bytes| {
        let Some(followed) = fields::decode::<Followed>(&bytes.to_bytes()) else { return };
        let confirmed = followed.tracks.iter().filter(|track| track.confirmed);
        seen.lock().unwrap_or_else(PoisonError::into_inner).push(Seen {
            at: clock(),
            time_ns: followed.time_ns,
            sensors: followed.sensors.len(),
            people: confirmed.map(|track| track.id).collect(),
        });
    })?;
    Ok((hall, heard))
}

#[expect(clippy::disallowed_methods, reason = "what is measured is time")]
pub fn clock() -> Instant {
    Instant::now()
}

/// What became of a run; its text is the row of the table.
#[derive(Debug, Default)]
pub struct Account {
    frames: usize,
    /// Frames without results from the first to the last.
    pub lost: i64,
    gap: Duration,
    later_ms: f64,
    /// From the end of the failure until all was well; none where it never was.
    recovered_s: Option<f64>,
    /// People of the last frame who had another number before the failure.
    pub renumbered: usize,
}

impl Account {
    /// Whether frames came, and all was well within so long after the failure.
    pub fn is_well(&self, within_s: f64) -> bool {
        self.frames > 0 && self.recovered_s.is_some_and(|s| s <= within_s)
    }
}

impl std::fmt::Display for Account {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { frames, lost, later_ms, renumbered, .. } = self;
        if *frames == 0 {
            return write!(f, "no frame came");
        }
        let gap_ms = self.gap.as_secs_f64() * 1e3;
        let recovers = self.recovered_s.map_or("never".to_owned(), |s| format!("{s:.2}"));
        write!(f, "{frames:7} {lost:7} {gap_ms:9.0} {later_ms:9.1} {recovers:>11} {renumbered:10}")
    }
}

pub fn account(seen: Vec<Seen>, failed: Instant, restored: Instant) -> Account {
    let times: BTreeSet<i64> = seen.iter().map(|frame| frame.time_ns).collect();
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Account::default();
    };
    let all = (last - first) / umbracast::STEP_NS + 1;
    let gap = seen.windows(2).map(|pair| pair[1].at - pair[0].at).max().unwrap_or_default();
    let before: Vec<&Seen> = seen.iter().filter(|frame| frame.at < failed).collect();
    let known: BTreeSet<u64> = before.iter().flat_map(|frame| frame.people.iter().copied()).collect();
    let followed = before.last().map_or(0, |frame| frame.people.len());
    let in_time = |pair: &[Seen]| pair[1].at - pair[0].at < GAP;
    let well = |frame: &Seen| frame.sensors == 2 && frame.people.len() + 1 > followed;
    let recovered = seen.windows(2).find(|pair| pair[1].at > restored && in_time(pair) && well(&pair[1]));
    let recovered_s = recovered.map(|pair| (pair[1].at - restored).as_secs_f64());
    let renumbered = seen.last().map_or(0, |frame| frame.people.difference(&known).count());
    let lost = all - times.len() as i64;
    let until = restored.max(failed + LOOKED_AT);
    let (ahead, during): (Vec<&Seen>, Vec<&Seen>) =
        seen.iter().filter(|frame| frame.at < until).partition(|frame| frame.at < failed);
    let later_ms = median_delay_ms(&during, seen[0].at) - median_delay_ms(&ahead, seen[0].at);
    Account { frames: times.len(), lost, gap, later_ms, recovered_s, renumbered }
}

/// Half of the frames came later after their own time than this, up to a constant that all frames of a run share.
fn median_delay_ms(frames: &[&Seen], origin: Instant) -> f64 {
    let delay_ms = |frame: &&Seen| (frame.at - origin).as_secs_f64() * 1e3 - frame.time_ns as f64 * 1e-6;
    let mut delays_ms: Vec<f64> = frames.iter().map(delay_ms).collect();
    delays_ms.sort_by(f64::total_cmp);
    delays_ms.get(delays_ms.len() / 2).copied().unwrap_or(f64::NAN)
}
