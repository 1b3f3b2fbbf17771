//! Two processes that each run all stages behind the front ends: what a controller hears of them while one is stopped, or while
//! they do not hear each other.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;
use umbracast_io::rows::LinkRow;
use umbracast_io::wire;
use umbracast_live::HostClock;
use umbracast_node::hall::Hall;
use umbracast_node::keys::Keys;
use umbracast_node::network::Network;
use umbracast_node::terms::Terms;

use super::{Bench, FAILS_AFTER, PLACES, shell};

/// Links that come so much later after their frame than the promptest of all are stale: frames have the recording's time.
const STALE_NS: i64 = 1_000_000_000;

/// A controller: what came of the links, of every leader, and what is left to who gives up older terms.
#[derive(Default)]
struct Heard {
    terms: Terms,
    /// Frames that were taken, and how many came twice.
    frames: BTreeSet<i64>,
    twice: usize,
    /// From a frame's time until its links came.
    ages_ns: Vec<i64>,
    /// Messages that were given up.
    given_up: u64,
    /// Everybody's numbers, in the order of frames.
    people: Vec<(i64, BTreeSet<u64>)>,
}

/// What fails, from `FAILS_AFTER` on, and for how long; whether it is among the few.
const CASES: [(&str, Fails, u64, bool); 4] = [
    ("of two whole processes the leader is stopped for 3 s", Fails::Leader, 3, false),
    ("of two whole processes the other is stopped for 3 s", Fails::Other, 3, false),
    ("of two whole processes the leader is cut off for 6 s", Fails::Wire, 6, false),
    ("of two whole processes the leader is cut off for 12 s", Fails::Wire, 12, true),
];

#[derive(Clone, Copy)]
enum Fails {
    Leader,
    Other,
    /// The leader's, to everybody.
    Wire,
}

impl Bench {
    /// A row for each case. Seconds of the recording: 24 at least.
    pub fn leaders(&self, recording: &str) -> Result<(), Error> {
        for (what, fails, seconds, _) in CASES.into_iter().filter(|case| case.3 || !self.short) {
            let (happened, well) = self.two_whole(recording, fails, seconds)?;
            let must = "no link twice, none stale, no number again";
            println!("{what:56} {must:44} {happened}");
            self.expect(well, what, must);
        }
        Ok(())
    }

    fn two_whole(&self, recording: &str, fails: Fails, seconds: u64) -> Result<(String, bool), Error> {
        let empty = format!("{}/empty.mcap", self.path("sim"));
        let [(_, edge), (_, server), (_, radio)] = PLACES;
        let whole = |own: &str, other: &str| {
            format!("track,forecast,cast --listen tcp/{own}:7447 --connect tcp/{other}:7447,tcp/{edge}:7447")
        };
        let first = self.node("server", &whole(server, radio))?;
        sleep(Duration::from_secs(1));
        let second = self.node("radio", &whole(radio, server))?;
        let front = format!("sensor --port 2368 --empty {empty} --listen tcp/{edge}:7447");
        let _front = self.node("edge", &front)?;
        let heard = Arc::<Mutex<Heard>>::default();
        let _controller = controller(&heard, &[format!("tcp/{edge}:7447")])?;
        sleep(Duration::from_secs(2));
        let mut replay = self.replay(recording)?;
        sleep(FAILS_AFTER);
        let (begins, ends) = match fails {
            Fails::Leader => (format!("kill -STOP {}", first.0.id()), format!("kill -CONT {}", first.0.id())),
            Fails::Other => {
                (format!("kill -STOP {}", second.0.id()), format!("kill -CONT {}", second.0.id()))
            }
            Fails::Wire => ("ip link set server0 down".to_owned(), "ip link set server0 up".to_owned()),
        };
        let failed_ns = heard.lock().unwrap_or_else(PoisonError::into_inner).frames.last().copied();
        shell(&begins)?;
        sleep(Duration::from_secs(seconds));
        shell(&ends)?;
        replay.0.wait().map_err(|e| Error::new(e.to_string()))?;
        sleep(Duration::from_secs(1));
        let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(heard.account(failed_ns.unwrap_or(i64::MIN)))
    }
}

impl Heard {
    fn account(&mut self, failed_ns: i64) -> (String, bool) {
        self.people.sort();
        let (first, last) = (self.frames.first().copied(), self.frames.last().copied());
        let all = first.zip(last).map_or(0, |(first, last)| (last - first) / umbracast::STEP_NS + 1);
        let lost = all - self.frames.len() as i64;
        let again = self.reused();
        let promptest_ns = self.ages_ns.iter().min().copied().unwrap_or_default();
        let stale = self.ages_ns.iter().filter(|age_ns| **age_ns - promptest_ns > STALE_NS).count();
        let early = self.people.iter().filter(|(time_ns, _)| *time_ns <= failed_ns);
        let before: BTreeSet<u64> = early.flat_map(|(_, people)| people.iter().copied()).collect();
        let after = self.people.last().map(|(_, people)| people.clone()).unwrap_or_default();
        let new = after.difference(&before).count();
        let well = self.twice == 0 && stale == 0 && again == 0 && all > 0;
        let text = format!(
            "{} frames, {lost} lost, {} twice, {} stale, {} of an older term given up, {new} of {} have another number, \
             {again} numbers used again",
            self.frames.len(),
            self.twice,
            stale,
            self.given_up,
            after.len()
        );
        (text, well)
    }

    /// Numbers that were away for more than five seconds and came back: nobody who is lost for so long is known again.
    fn reused(&self) -> usize {
        let ids: BTreeSet<u64> = self.people.iter().flat_map(|(_, people)| people.iter().copied()).collect();
        let comes_back = |id: &&u64| {
            let times: Vec<i64> =
                self.people.iter().filter(|(_, people)| people.contains(id)).map(|(time, _)| *time).collect();
            times.windows(2).any(|pair| pair[1] - pair[0] > 5 * STALE_NS)
        };
        ids.iter().filter(comes_back).count()
    }
}

/// Hears links as a controller does, beside the front end.
fn controller(heard: &Arc<Mutex<Heard>>, connect: &[String]) -> Result<impl Sized + use<>, Error> {
    let network = Network { connect: connect.to_vec(), ..Network::default() };
    let hall = Hall::new(network.open()?, Keys::new("lab"));
    let (heard, clock) = (heard.clone(), HostClock::start());
    // The rows carry names of access points; here none is asked for.
    let names: Vec<String> = umbracast::Config::default()
        .site
        .access_points
        .iter()
        .map(|access_point| access_point.name.clone())
        .collect();
    let hearing = hall.hear_rows(&hall.keys().of("links"), move |term, bytes| {
        let Some((_, time_ns, rows)) = wire::decode::<LinkRow>(&bytes.to_bytes(), &names) else { return };
        let now_ns = clock.now_ns();
        let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
        if !heard.terms.takes(term, now_ns) {
            heard.given_up += 1;
            return;
        }
        heard.twice += usize::from(!heard.frames.insert(time_ns));
        heard.ages_ns.push(now_ns - time_ns);
        heard.people.push((time_ns, rows.iter().map(|row| row.track).collect()));
    })?;
    Ok((hall, hearing))
}
