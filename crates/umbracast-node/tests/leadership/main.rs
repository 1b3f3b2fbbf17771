//! Leadership in simulated time, over thousands of random cuts, stops and returns: no socket, no thread, no clock.
//!
//! Two front ends see half of the people each. Two or three trackers join their frames, and two receivers hear the trackers. Every
//! pair of them has a wire of its own, which may be cut: what is sent meanwhile comes late, or never where the cut is longer
//! than the connection's patience. Trackers may be stopped and go on, or die and come back without memory.

mod numbering;

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use numbering::{Numbering, Results, Seen};
use umbracast_node::lead::Lead;
use umbracast_node::seat::Seat;
use umbracast_node::terms::Terms;

const MS: i64 = 1_000_000;
const TICK_NS: i64 = 25 * MS;
const FRAME_NS: i64 = 100 * MS;
/// A frame waits so long for a front end.
const WAIT_NS: i64 = 100 * MS;
/// Results later than this are of use to nobody.
const STALE_NS: i64 = 1_000 * MS;
/// A connection that is silent for so long is given up.
const LEASE_NS: i64 = 2_000 * MS;
/// Faults come until then; what follows is calm.
const FAULTS_UNTIL_NS: i64 = 9_000 * MS;
const END_NS: i64 = 15_000 * MS;
const FRONTS: usize = 2;
const RECEIVERS: usize = 2;
const BODIES: u64 = 6;

/// Xorshift: the test needs no better one.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: i64) -> i64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as i64 % sides
    }
}

#[derive(Clone)]
enum Message {
    Foreground(usize, Seen),
    Published(usize, u64, Results),
    State(u64, Numbering),
}

/// A message under way: the earliest first, of equal ones in the order of sending.
struct Sent {
    at_ns: i64,
    sent_ns: i64,
    count: u64,
    from: usize,
    to: usize,
    message: Message,
}

impl Ord for Sent {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (other.at_ns, other.count).cmp(&(self.at_ns, self.count))
    }
}
impl PartialOrd for Sent {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Sent {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Sent {}

/// From, to.
type Span = (i64, i64);

struct Tracker {
    id: String,
    seat: Seat<Numbering>,
    /// Frames that wait for a front end: since when, what was seen, and by whom.
    open: BTreeMap<i64, (i64, Seen, BTreeSet<usize>)>,
    /// Connections of the process that died went with it.
    born_ns: i64,
    joined_ns: i64,
    frames: u64,
    /// It is stopped, or dead, meanwhile.
    stops: Vec<Span>,
    deaths: Vec<Span>,
}

#[derive(Default)]
struct Receiver {
    terms: Terms,
    last_ns: i64,
    taken: Vec<i64>,
    /// It keeps the newest state, as a caster does.
    state: Option<(u64, Numbering)>,
}

/// Places: front ends, then trackers, then receivers.
struct World {
    seed: u64,
    dice: Dice,
    trackers: Vec<Tracker>,
    receivers: Vec<Receiver>,
    /// Of a pair of places, the smaller first.
    cuts: BTreeMap<(usize, usize), Vec<Span>>,
    under_way: BinaryHeap<Sent>,
    /// When what was sent last comes, by wire and direction: order is kept.
    last_at_ns: BTreeMap<(usize, usize), i64>,
    count: u64,
    /// Whose a number is.
    owners: BTreeMap<u64, u64>,
    bodies: Vec<Vec<Span>>,
    now_ns: i64,
}

impl World {
    fn new(seed: u64) -> Self {
        let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        for _ in 0..8 {
            dice.roll(2);
        }
        let trackers = 2 + usize::from(dice.roll(4) == 0);
        let places = FRONTS + trackers + RECEIVERS;
        let mut cuts = BTreeMap::<_, Vec<Span>>::new();
        let mut span = |dice: &mut Dice| {
            let from_ns = 1_000 * MS + dice.roll(FAULTS_UNTIL_NS - 1_500 * MS);
            (from_ns, (from_ns + 20 * MS + dice.roll(6_000 * MS)).min(FAULTS_UNTIL_NS))
        };
        // Wires one by one, and places that lose all at once.
        for _ in 0..dice.roll(5) {
            let (a, b) = (dice.roll(places as i64) as usize, dice.roll(places as i64) as usize);
            cuts.entry((a.min(b), a.max(b))).or_default().push(span(&mut dice));
        }
        for _ in 0..dice.roll(3) {
            let (alone, cut) = (dice.roll(places as i64) as usize, span(&mut dice));
            for other in (0..places).filter(|other| *other != alone) {
                cuts.entry((alone.min(other), alone.max(other))).or_default().push(cut);
            }
        }
        let trackers = (0..trackers)
            .map(|k| {
                let faults = |n: i64, dice: &mut Dice, span: &mut dyn FnMut(&mut Dice) -> Span| {
                    (0..dice.roll(n)).map(|_| span(dice)).collect::<Vec<_>>()
                };
                let (stops, deaths) = (faults(3, &mut dice, &mut span), faults(2, &mut dice, &mut span));
                Tracker::new(k, stops, deaths)
            })
            .collect();
        let stay = |dice: &mut Dice| {
            let from_ns = dice.roll(END_NS);
            (from_ns, from_ns + 300 * MS + dice.roll(5_000 * MS))
        };
        let bodies = (0..BODIES).map(|_| (0..3).map(|_| stay(&mut dice)).collect()).collect();
        Self {
            seed,
            dice,
            trackers,
            receivers: (0..RECEIVERS).map(|_| Receiver::default()).collect(),
            cuts,
            under_way: BinaryHeap::new(),
            last_at_ns: BTreeMap::new(),
            count: 0,
            owners: BTreeMap::new(),
            bodies,
            now_ns: 0,
        }
    }

    fn tracker(&self, place: usize) -> Option<&Tracker> {
        self.trackers.get(place.checked_sub(FRONTS)?)
    }

    /// The cut of a wire at this instant: where it was cut, or where an end of it was stopped or dead for so long that the connection
    /// was given up. It is made anew a while after.
    fn cut(&self, a: usize, b: usize) -> Option<Span> {
        let cuts = self.cuts.get(&(a.min(b), a.max(b))).into_iter().flatten();
        let ends = [a, b].into_iter().filter_map(|place| self.tracker(place));
        let gone =
            ends.flat_map(|t| t.stops.iter().filter(|stop| stop.1 - stop.0 > LEASE_NS).chain(&t.deaths));
        let again_ns = |span: &Span| {
            if span.1 - span.0 > LEASE_NS { span.1 + 200 * MS + (span.0 / MS) % 700 * MS } else { span.1 }
        };
        let mut spans = cuts.chain(gone).map(|span| (span.0, again_ns(span)));
        spans.find(|span| (span.0..span.1).contains(&self.now_ns))
    }

    fn send(&mut self, from: usize, to: usize, message: Message) {
        let cut = self.cut(from, to);
        if cut.is_some_and(|cut| cut.1 - cut.0 > LEASE_NS) {
            return;
        }
        // Now and then a packet is lost and sent again.
        let lost = self.dice.roll(50) == 0 && self.now_ns < FAULTS_UNTIL_NS;
        let again_ns = if lost { 300 * MS } else { 0 };
        let delay_ns = MS + self.dice.roll(20 * MS) + again_ns;
        let last_at_ns = self.last_at_ns.entry((from, to)).or_default();
        let at_ns = (cut.map_or(self.now_ns, |cut| cut.1) + delay_ns).max(*last_at_ns);
        *last_at_ns = at_ns;
        self.count += 1;
        self.under_way.push(Sent { at_ns, sent_ns: self.now_ns, count: self.count, from, to, message });
    }

    /// Which trackers know of others, as tokens tell: late.
    fn others(&self, k: usize) -> bool {
        (0..self.trackers.len()).filter(|other| *other != k).any(|other| {
            let silent_ns = self.cut(FRONTS + k, FRONTS + other).map_or(0, |cut| self.now_ns - cut.0);
            silent_ns <= LEASE_NS && !is_in(&self.trackers[other].deaths, self.now_ns)
        })
    }

    fn run(&mut self) {
        while self.now_ns < END_NS {
            self.now_ns += TICK_NS;
            if self.now_ns % FRAME_NS == 0 {
                self.see();
            }
            while self.under_way.peek().is_some_and(|sent| sent.at_ns <= self.now_ns) {
                let sent = self.under_way.pop().expect("it was looked at");
                self.receive(sent);
            }
            (0..self.trackers.len()).for_each(|k| self.go_on(k));
        }
    }

    fn see(&mut self) {
        for front in 0..FRONTS {
            let here = |body: &u64| is_in(&self.bodies[*body as usize], self.now_ns);
            let bodies = (0..BODIES).filter(|body| *body as usize % FRONTS == front).filter(here).collect();
            // The clock of its host is off.
            let seen = Seen { time_ns: self.now_ns, closed_ns: self.now_ns + front as i64 * 40 * MS, bodies };
            for k in 0..self.trackers.len() {
                self.send(front, FRONTS + k, Message::Foreground(front, seen.clone()));
            }
        }
    }

    fn receive(&mut self, sent: Sent) {
        let now_ns = self.now_ns;
        if let Some(tracker) = self.tracker(sent.to) {
            if is_in(&tracker.deaths, now_ns) || sent.sent_ns < tracker.born_ns {
                return;
            }
            if let Some(&(from_ns, until_ns)) = tracker.stops.iter().find(|stop| is_in(&[**stop], now_ns)) {
                // What comes meanwhile waits, as long as the connection is held.
                if sent.at_ns - from_ns <= LEASE_NS {
                    self.under_way.push(Sent { at_ns: until_ns, ..sent });
                }
                return;
            }
        }
        let Sent { to, from, message, .. } = sent;
        match message {
            Message::Foreground(front, seen) => {
                let tracker = &mut self.trackers[to - FRONTS];
                if seen.time_ns > tracker.joined_ns {
                    let open = tracker.open.entry(seen.time_ns);
                    let (_, joined, by) = open.or_insert_with(|| (now_ns, seen.clone(), BTreeSet::new()));
                    joined.bodies.extend(&seen.bodies);
                    joined.closed_ns = joined.closed_ns.max(seen.closed_ns);
                    by.insert(front);
                }
            }
            Message::Published(tracker, term, results) if to < FRONTS + self.trackers.len() => {
                let id = self.trackers[tracker].id.clone();
                self.trackers[to - FRONTS].seat.hear(&id, term, results.said);
            }
            Message::Published(_, term, results) => {
                let receiver = &mut self.receivers[to - FRONTS - self.trackers.len()];
                if receiver.terms.takes(term, now_ns) && results.time_ns > receiver.last_ns {
                    receiver.last_ns = results.time_ns;
                    receiver.taken.push(results.time_ns);
                    for (number, body) in results.numbers.into_iter().zip(results.bodies) {
                        let owner = *self.owners.entry(number).or_insert(body);
                        assert_eq!(
                            owner, body,
                            "schedule {}: number {number} was somebody else's, at {now_ns}",
                            self.seed
                        );
                    }
                }
            }
            Message::State(term, state) if to < FRONTS + self.trackers.len() => {
                let _ = from;
                self.trackers[to - FRONTS].seat.hear_state(term, &state, now_ns);
            }
            Message::State(term, state) => {
                let kept = &mut self.receivers[to - FRONTS - self.trackers.len()].state;
                if kept.as_ref().is_none_or(|(known, old)| (*known, old.last_ns) < (term, state.last_ns)) {
                    *kept = Some((term, state));
                }
            }
        }
    }

    fn go_on(&mut self, k: usize) {
        let now_ns = self.now_ns;
        if is_in(&self.trackers[k].stops, now_ns) || is_in(&self.trackers[k].deaths, now_ns) {
            return;
        }
        let back = |death: &Span| (death.1..death.1 + TICK_NS).contains(&now_ns);
        if self.trackers[k].deaths.iter().any(back) {
            self.come_back(k);
        }
        let others = self.others(k);
        let tracker = &mut self.trackers[k];
        tracker.seat.lead.others(others);
        let mut published = Vec::new();
        if k == 0 && now_ns == TICK_NS {
            // The first one of the hall.
            published.extend(tracker.seat.take_over(now_ns));
        }
        while let Some(open) = tracker.open.first_entry() {
            let (since_ns, _, by) = open.get();
            if by.len() < FRONTS && now_ns - since_ns < WAIT_NS {
                break;
            }
            let (_, seen, _) = open.remove();
            tracker.joined_ns = seen.time_ns;
            published.extend(tracker.seat.frame(seen, || now_ns));
        }
        published.extend(tracker.seat.go_on(now_ns));
        published.into_iter().for_each(|results| self.publish(k, results));
    }

    fn publish(&mut self, k: usize, results: Results) {
        let age_ns = self.now_ns - results.time_ns;
        // Its wait for front ends and the least delay come on top. One that has just begun knows of no delay yet.
        let tracker = &mut self.trackers[k];
        let seed = self.seed;
        assert!(
            tracker.frames < 30 && tracker.born_ns > 0 || age_ns <= STALE_NS + WAIT_NS + 100 * MS,
            "schedule {seed}: at {} ms tracker {k} publishes results of {} ms ago; {:?} {:?}",
            self.now_ns / MS,
            age_ns / MS,
            tracker.stops,
            tracker.deaths,
        );
        let term = tracker.seat.lead.term().expect("only who leads publishes");
        tracker.frames += 1;
        let state = tracker.frames.is_multiple_of(5).then(|| tracker.seat.work.clone());
        for to in (FRONTS..FRONTS + self.trackers.len() + RECEIVERS).filter(|to| *to != FRONTS + k) {
            self.send(FRONTS + k, to, Message::Published(k, term, results.clone()));
            if let Some(state) = &state {
                self.send(FRONTS + k, to, Message::State(term, state.clone()));
            }
        }
    }

    /// A new process asks those whom it reaches for the newest state. Where it reaches nobody who knows one, it would begin
    /// the hall anew: then it waits.
    fn come_back(&mut self, k: usize) {
        let reached = |r: &usize| {
            self.cut(FRONTS + k, FRONTS + self.trackers.len() + r).is_none_or(|cut| cut.1 - cut.0 <= LEASE_NS)
        };
        let states = (0..RECEIVERS).filter(reached).filter_map(|r| self.receivers[r].state.clone());
        let newest = states.max_by_key(|(term, state)| (*term, state.last_ns));
        let old = &mut self.trackers[k];
        let (stops, mut deaths) = (old.stops.clone(), old.deaths.clone());
        let Some((term, state)) = newest else {
            deaths.push((self.now_ns, self.now_ns + 500 * MS));
            old.deaths = deaths;
            return;
        };
        let mut new = Tracker::new(k + 10 * (self.now_ns / MS) as usize, stops, deaths);
        let next = state.next;
        (new.joined_ns, new.born_ns) = (state.last_ns, self.now_ns);
        new.seat.work = state;
        new.seat.lead.take_up(term, next);
        self.trackers[k] = new;
    }
}

impl Tracker {
    fn new(name: usize, stops: Vec<Span>, deaths: Vec<Span>) -> Self {
        let id = format!("tracker {name}");
        Self {
            seat: Seat::new(Numbering::default(), Lead::new(id.clone(), STALE_NS)),
            id,
            open: BTreeMap::new(),
            born_ns: 0,
            joined_ns: 0,
            frames: 0,
            stops,
            deaths,
        }
    }
}

fn is_in(spans: &[Span], at_ns: i64) -> bool {
    spans.iter().any(|span| (span.0..span.1).contains(&at_ns))
}

/// What has to hold in every schedule; in calm it also goes on.
fn check(seed: u64) {
    let mut world = World::new(seed);
    world.run();
    let leaders = world.trackers.iter().filter(|tracker| tracker.seat.lead.term().is_some()).count();
    assert_eq!(leaders, 1, "schedule {seed}: who leads in the end");
    for receiver in &world.receivers {
        assert!(receiver.taken.windows(2).all(|pair| pair[0] < pair[1]));
        let calm = END_NS - 2_700 * MS..END_NS - 700 * MS;
        let frames = receiver.taken.iter().filter(|time_ns| calm.contains(time_ns)).count();
        assert_eq!(frames, 20, "schedule {seed}: frames of the last seconds");
    }
}

#[test]
fn no_cut_stop_or_return_makes_two_leaders_a_stale_result_or_a_number_of_two_people() {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64;
    std::thread::scope(|scope| {
        for thread in 0..threads {
            scope.spawn(move || (thread..10_000).step_by(threads as usize).for_each(check));
        }
    });
}
