//! The mutator: a target's whole inputs, damaged, each by a seed of its own. The first seeds are the whole inputs
//! themselves.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, Once, PoisonError};
use std::time::Duration;

use crate::bounded;
use crate::mutate::{Random, damage};
use crate::targets::Target;

/// How often it is looked whether time is up, and whether an input hangs.
const TICK: Duration = Duration::from_millis(20);
/// An input that takes so many of them hangs: half a minute.
const HANGS_TICKS: u32 = 1500;
/// A thread that has nothing to do.
const IDLE: u64 = u64::MAX;

/// When a target has had enough.
#[derive(Debug, Clone, Copy)]
pub enum Until {
    /// After so many inputs.
    Inputs(u64),
    /// After about so many seconds.
    Seconds(f64),
}

/// What became of a target's inputs.
#[derive(Debug, Default)]
pub struct Tally {
    /// How many there were.
    pub inputs: u64,
    /// Of them, those that were understood.
    pub understood: u64,
    /// A broken promise by its place in the source: the first seed that broke it, and what was said.
    pub broken: BTreeMap<String, (u64, String)>,
}

/// The input of a seed.
pub fn input(corpus: &[Vec<u8>], seed: u64, bytes: &mut Vec<u8>) {
    let place = (seed % corpus.len() as u64) as usize;
    let mut random = Random::new(seed);
    match seed < corpus.len() as u64 {
        true => bytes.clone_from(&corpus[place]),
        false => damage(&corpus[place], &mut random, bytes),
    }
}

/// Gives a target inputs from the seed `from` on, on so many threads. `hangs` is called with the seed of an input that takes
/// half a minute; a thread cannot be stopped, so it should end the program.
pub fn run(target: &'static Target, from: u64, until: Until, threads: usize, hangs: impl Fn(u64)) -> Tally {
    listen();
    let corpus = (target.corpus)();
    let end = match until {
        Until::Inputs(inputs) => from.saturating_add(inputs),
        Until::Seconds(_) => IDLE,
    };
    let ticks_max = match until {
        Until::Inputs(_) => u64::MAX,
        Until::Seconds(seconds) => (seconds / TICK.as_secs_f64()).ceil() as u64,
    };
    let (next, over) = (AtomicU64::new(from), AtomicBool::new(false));
    let tally = Mutex::new(Tally::default());
    let work = |at: &AtomicU64| {
        let (mut own, mut bytes) = (Tally::default(), Vec::new());
        while !over.load(Ordering::Relaxed) {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= end {
                break;
            }
            at.store(seed, Ordering::Relaxed);
            input(&corpus, seed, &mut bytes);
            own.note(seed, checked(target, seed, &bytes));
        }
        at.store(IDLE, Ordering::Relaxed);
        tally.lock().unwrap_or_else(PoisonError::into_inner).add(own);
    };
    let seeds: Vec<AtomicU64> = (0..threads.max(1)).map(|_| AtomicU64::new(IDLE)).collect();
    std::thread::scope(|scope| {
        let work = &work;
        let workers: Vec<_> = seeds.iter().map(|at| scope.spawn(move || work(at))).collect();
        let mut watched = vec![(IDLE, 0); seeds.len()];
        let mut ticks = 0;
        while !workers.iter().all(|worker| worker.is_finished()) {
            std::thread::sleep(TICK);
            ticks += 1;
            over.fetch_or(ticks >= ticks_max, Ordering::Relaxed);
            for (at, (seed, same)) in seeds.iter().zip(&mut watched) {
                let now = at.load(Ordering::Relaxed);
                *same = if now == *seed && now != IDLE { *same + 1 } else { 0 };
                *seed = now;
                if *same == HANGS_TICKS {
                    hangs(now);
                }
            }
        }
    });
    tally.into_inner().unwrap_or_else(PoisonError::into_inner)
}

impl Tally {
    fn note(&mut self, seed: u64, checked: Result<bool, (String, String)>) {
        self.inputs += 1;
        match checked {
            Ok(understood) => self.understood += u64::from(understood),
            Err((place, story)) => {
                self.broken.entry(place).or_insert((seed, story));
            }
        }
    }

    fn add(&mut self, other: Self) {
        self.inputs += other.inputs;
        self.understood += other.understood;
        for (place, first) in other.broken {
            let known = self.broken.entry(place).or_insert_with(|| first.clone());
            if first.0 < known.0 {
                *known = first;
            }
        }
    }
}

thread_local! {
    /// Whether this thread checks an input, and the panic that it ended with: place and message.
    static CHECKS: Cell<bool> = const { Cell::new(false) };
    static LAST: RefCell<Option<(String, String)>> = const { RefCell::new(None) };
}
/// A panic of another thread, such as the server's.
static ELSEWHERE: Mutex<Option<(String, String)>> = Mutex::new(None);

/// Keeps panics of who checks an input in place of printing them, and notes those of others.
fn listen() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            let place = info.location().map(ToString::to_string).unwrap_or_default();
            let said = info.payload_as_str().unwrap_or_default().to_owned();
            if CHECKS.get() {
                LAST.set(Some((place, said)));
            } else {
                *ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner) = Some((place, said));
                usual(info);
            }
        }));
    });
}

/// Checks one input. A broken promise is told by its place in the source and its message.
///
/// # Errors
/// A broken promise.
pub fn checked(target: &'static Target, seed: u64, bytes: &[u8]) -> Result<bool, (String, String)> {
    listen();
    bounded::begin(target.name, seed);
    CHECKS.set(true);
    let done = panic::catch_unwind(AssertUnwindSafe(|| (target.check)(bytes)));
    CHECKS.set(false);
    let elsewhere = ELSEWHERE.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (done, elsewhere) {
        (Err(_), _) => Err(LAST.take().unwrap_or_default()),
        (Ok(_), Some(panic)) => Err(panic),
        (Ok(understood), None) => Ok(understood),
    }
}
