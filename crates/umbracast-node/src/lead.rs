//! Several trackers of one hall: one leads, the others stand by. Pure: the caller gives messages and the time of day.
//!
//! All compute every frame. The leader publishes. One that stands by keeps its results until it hears that the leader has
//! finished the frame. If that takes too long it takes over in a new term ([`crate::terms`]) and publishes them itself,
//! so nothing is lost.
//!
//! A tracker that was away does not take the lead again:
//! - One that slept for longer than the others wait for it stands by. Its next results are late, and somebody else may lead.
//! - One that hears of a newer term stands by, and takes up the new leader's people.
//! - One that stands by and was cut off itself is in no hurry: it hears the hall again before it hears the leader.
//!
//! No number is given to two people. Who is born under a leader has a number of its term. One that stands by computes births
//! too, perhaps others than the leader's, and gives those that the leader has not confirmed new numbers when it takes over.

use std::collections::VecDeque;

use crate::terms;
use umbracast::geometry::DVec2;

/// The leader's results are waited for so long. Then it is gone, or so slow that it had better be.
const PATIENCE_NS: i64 = 250_000_000;
/// A tracker that was cut off waits so long before it takes over: connections are given up after two seconds of silence, and are made
/// anew within another one.
const RETURNS_NS: i64 = 3_000_000_000;
/// One that was away for less hears what was said meanwhile: connections are held.
const HELD_NS: i64 = 1_500_000_000;
/// A gap of this length between frames means that it was cut off.
const GAP_NS: i64 = 1_000_000_000;
/// So many frames are kept for a leader that does not answer.
const KEPT: usize = 32;
/// Both expect a person at the same place: another processor may round otherwise.
const SAME_PLACE_M: f64 = 0.3;
/// The least delay of frames is looked for among those of so long.
const DELAY_WINDOW_NS: i64 = 5_000_000_000;

/// Where one tracker stands beside the others.
#[derive(Debug)]
pub struct Lead<T> {
    id: String,
    /// Results that are later than this are published no more.
    stale_ns: i64,
    /// The term that it leads in; `None` while it stands by.
    term: Option<u64>,
    /// The last term that it led in.
    held: Option<u64>,
    /// The newest term that it has heard of.
    newest: Option<u64>,
    /// The leader's last word.
    said: Option<Said>,
    /// The next number as it was after the last frame in which the leader had the same people by the same numbers;
    /// `None`: not since it heard of this leader.
    agreed: Option<u64>,
    /// Whether other trackers are there, as far as it is known.
    others: bool,
    kept: VecDeque<Kept<T>>,
    /// When it was awake last.
    awake_ns: Option<i64>,
    /// When its last frame was done.
    done_ns: Option<i64>,
    /// Until when it is in no hurry, since it was away.
    returns_ns: Option<i64>,
    delay: Delay,
    /// Frames that were too late to be published.
    pub stale: u64,
}

/// A frame that a tracker has done.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame<T> {
    /// What the others hear of it where it is published.
    pub said: Said,
    /// The number of who is born next.
    pub next_number: u64,
    /// When its last front end closed it, by that host's clock.
    pub closed_ns: i64,
    /// What is published.
    pub results: T,
}

/// What a leader says with every frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    /// The next frame's time.
    pub priors_ns: i64,
    /// A digest of everybody's number.
    pub numbers: u64,
    /// Where everybody is expected, in the order of numbers.
    pub places_m: Vec<DVec2>,
}

/// What [`Lead::take_over`] gives.
#[derive(Debug, PartialEq)]
pub struct Taken<T> {
    /// What was kept, to be published.
    pub kept: Vec<T>,
    /// Everybody with a number from the first on has one from the second on instead.
    pub renumbered: Option<(u64, u64)>,
}

#[derive(Debug)]
struct Kept<T> {
    frame: Frame<T>,
    /// When it would have been done without delay.
    at_ns: i64,
}

impl<T> Lead<T> {
    /// Stands by. Results later than `stale_ns` are of use to nobody.
    pub fn new(id: String, stale_ns: i64) -> Self {
        Self {
            id,
            stale_ns,
            term: None,
            held: None,
            newest: None,
            said: None,
            agreed: None,
            others: false,
            kept: VecDeque::new(),
            awake_ns: None,
            done_ns: None,
            returns_ns: None,
            delay: Delay::default(),
            stale: 0,
        }
    }

    /// The term that it leads in; `None` while it stands by.
    pub fn term(&self) -> Option<u64> {
        self.term
    }

    /// The newest term that it has heard of.
    pub fn newest(&self) -> Option<u64> {
        self.newest
    }

    /// True while the leader's people are not known here by their numbers: then its state is to be taken up.
    pub fn is_out_of_step(&self) -> bool {
        self.term.is_none() && self.newest.is_some() && self.held != self.newest && self.agreed.is_none()
    }

    /// Whether other trackers are there.
    pub fn others(&mut self, there: bool) {
        self.others = there;
        if there {
            // One that leads may be heard by others before it is heard here.
            self.newest.get_or_insert(0);
        }
    }

    /// Whoever runs it calls this often. One that has slept leads no more.
    pub fn wake(&mut self, now_ns: i64) {
        let slept_ns = self.awake_ns.map_or(0, |awake_ns| now_ns - awake_ns);
        self.awake_ns = Some(now_ns);
        if slept_ns > PATIENCE_NS {
            self.term = None;
            self.returns(slept_ns, now_ns);
        }
    }

    /// The state of a leader was taken up: its term, and the number of who is born next.
    pub fn take_up(&mut self, term: u64, next_number: u64) {
        if self.newest <= Some(term) {
            (self.newest, self.agreed) = (Some(term), Some(next_number));
            self.kept.clear();
        }
    }

    /// A tracker that leads has done a frame. True where it leads in an older term than this one: whoever heard it has
    /// to be told again what holds.
    pub fn hear(&mut self, tracker: &str, term: u64, said: Said) -> bool {
        if tracker == self.id {
            return false;
        }
        // Two of one tag may take over at once: then by name.
        let older = self.newest.is_some_and(|newest| term < newest)
            || self.held == Some(term) && self.newest == Some(term) && *self.id > *tracker;
        if older {
            return self.term.is_some();
        }
        if self.newest != Some(term) || self.held == Some(term) {
            (self.newest, self.held, self.agreed) = (Some(term), None, None);
            self.term = None;
        }
        if let Some(own) = self.kept.iter().find(|kept| kept.frame.said.priors_ns == said.priors_ns) {
            self.agreed = agreed(&own.frame, &said);
        }
        self.kept.retain(|kept| kept.frame.said.priors_ns > said.priors_ns);
        self.said = Some(said);
        false
    }

    /// A frame is done here: given back where it is to be published now.
    pub fn done(&mut self, frame: Frame<T>, now_ns: i64) -> Option<T> {
        self.wake(now_ns);
        let at_ns = self.delay.undelayed_ns(frame.closed_ns, now_ns);
        let gap_ns = self.done_ns.map_or(0, |done_ns| now_ns - done_ns);
        if gap_ns > GAP_NS {
            self.returns(gap_ns, now_ns);
        }
        self.done_ns = Some(now_ns);
        let is_stale = now_ns - at_ns > self.stale_ns;
        self.stale += u64::from(is_stale);
        if self.term.is_some() {
            return (!is_stale).then_some(frame.results);
        }
        if let Some(said) = self.said.as_ref().filter(|said| said.priors_ns == frame.said.priors_ns) {
            self.agreed = agreed(&frame, said);
        }
        if !is_stale && self.said.as_ref().is_none_or(|said| said.priors_ns < frame.said.priors_ns) {
            self.kept.push_back(Kept { frame, at_ns });
            if self.kept.len() > KEPT {
                self.kept.pop_front();
            }
        }
        None
    }

    /// When the leader will have had its time: [`Self::take_over`].
    pub fn due_ns(&self) -> Option<i64> {
        let first = self.kept.front().filter(|_| self.term.is_none())?;
        if self.resumes() {
            return Some(first.at_ns + PATIENCE_NS);
        }
        let patience_ns = match () {
            () if !self.others => 0,
            // Everybody would get another number: the leader's state comes first, if there is one still.
            () if self.said.is_some() && self.is_out_of_step() => RETURNS_NS,
            () => PATIENCE_NS,
        };
        let due_ns = first.at_ns + patience_ns;
        Some(self.returns_ns.map_or(due_ns, |returns_ns| due_ns.max(returns_ns)))
    }

    /// Leads from now on.
    pub fn take_over(&mut self, now_ns: i64) -> Taken<T> {
        let (resumes, first) = (self.resumes(), self.newest.is_none());
        let own = self.held.filter(|_| resumes);
        let term = own.unwrap_or_else(|| terms::next(self.newest, terms::tag(&self.id)));
        let renumbered = (!resumes && !first).then(|| (self.agreed.unwrap_or(0), terms::first_number(term)));
        (self.term, self.held, self.newest, self.agreed) = (Some(term), Some(term), Some(term), None);
        (self.returns_ns, self.awake_ns) = (None, Some(now_ns));
        let stale_ns = self.stale_ns;
        let fresh = |kept: Kept<T>| (now_ns - kept.at_ns <= stale_ns).then_some(kept.frame.results);
        Taken { kept: self.kept.drain(..).filter_map(fresh).collect(), renumbered }
    }

    fn returns(&mut self, away_ns: i64, now_ns: i64) {
        let returns_ns = now_ns + if away_ns < HELD_NS { PATIENCE_NS } else { RETURNS_NS };
        self.returns_ns = self.returns_ns.max(Some(returns_ns));
    }

    /// True where nobody has led since it did: it goes on in its term.
    fn resumes(&self) -> bool {
        self.held.is_some() && self.held == self.newest
    }
}

/// The next number, where the leader's people have the same numbers and places as one's own.
fn agreed<T>(own: &Frame<T>, said: &Said) -> Option<u64> {
    let near = |(a, b): (&DVec2, &DVec2)| a.distance(*b) < SAME_PLACE_M;
    let same = own.said.numbers == said.numbers
        && own.said.places_m.len() == said.places_m.len()
        && own.said.places_m.iter().zip(&said.places_m).all(near);
    same.then_some(own.next_number)
}

/// How late frames come, by clocks that may differ: against the least difference of late.
#[derive(Debug, Default)]
struct Delay {
    /// The least difference of the window that runs, and of the one before.
    least_ns: [Option<i64>; 2],
    since_ns: i64,
}

impl Delay {
    /// When a frame would have come, had it come with the least delay.
    fn undelayed_ns(&mut self, closed_ns: i64, now_ns: i64) -> i64 {
        let difference_ns = now_ns.saturating_sub(closed_ns);
        if now_ns - self.since_ns > DELAY_WINDOW_NS {
            (self.least_ns, self.since_ns) = ([None, self.least_ns[0].or(self.least_ns[1])], now_ns);
        }
        let least_ns = self.least_ns[0].map_or(difference_ns, |least_ns| least_ns.min(difference_ns));
        self.least_ns[0] = Some(least_ns);
        let least_ns = self.least_ns[1].map_or(least_ns, |before_ns| before_ns.min(least_ns));
        now_ns - difference_ns.saturating_sub(least_ns)
    }
}
