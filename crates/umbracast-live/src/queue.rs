//! A queue between two threads: of bounded length, with a rule for when it is full.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What is given up when a queue is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// What waits longest: the newest is worth more.
    DropOldest,
    /// What comes: the order of what waits is worth more.
    DropNewest,
}

/// Hands items from threads to a thread. Nobody who pushes ever waits.
#[derive(Debug)]
pub struct Queue<T> {
    state: Mutex<State<T>>,
    filled: Condvar,
    capacity: usize,
    when_full: WhenFull,
}

#[derive(Debug)]
struct State<T> {
    items: VecDeque<T>,
    lost: u64,
    closed: bool,
}

/// What a [`Queue::pop_within`] found.
#[derive(Debug, PartialEq, Eq)]
pub enum Popped<T> {
    /// The item that waited longest.
    Item(T),
    /// Nothing came in time.
    Nothing,
    /// Nothing comes any more.
    Closed,
}

impl<T> Queue<T> {
    /// An empty queue for `capacity` items.
    pub fn new(capacity: usize, when_full: WhenFull) -> Self {
        let state = State { items: VecDeque::with_capacity(capacity), lost: 0, closed: false };
        Self { state: Mutex::new(state), filled: Condvar::new(), capacity, when_full }
    }

    /// Adds an item; a full queue gives one up and counts it. What comes after [`Self::close`] is lost, too.
    pub fn push(&self, item: T) {
        self.offer(item);
    }

    /// As [`Self::push`]; false where one was given up.
    pub fn offer(&self, item: T) -> bool {
        let mut state = self.lock();
        if state.closed {
            state.lost += 1;
            return false;
        }
        let is_full = state.items.len() == self.capacity;
        if is_full {
            state.lost += 1;
            if self.when_full == WhenFull::DropNewest {
                return false;
            }
            state.items.pop_front();
        }
        state.items.push_back(item);
        drop(state);
        self.filled.notify_one();
        !is_full
    }

    /// Waits for the next item; `None` once the queue is closed and empty.
    pub fn pop(&self) -> Option<T> {
        let mut state = self.lock();
        loop {
            if let Some(item) = state.items.pop_front() {
                return Some(item);
            }
            if state.closed {
                return None;
            }
            state = self.filled.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits for the next item, but no longer than this.
    pub fn pop_within(&self, wait: Duration) -> Popped<T> {
        let mut state = self.lock();
        if state.items.is_empty() && !state.closed {
            state = self.filled.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
        match state.items.pop_front() {
            Some(item) => Popped::Item(item),
            None if state.closed => Popped::Closed,
            None => Popped::Nothing,
        }
    }

    /// Nothing comes any more: who waits gets what is there, then the end.
    pub fn close(&self) {
        self.lock().closed = true;
        self.filled.notify_all();
    }

    /// Items given up so far.
    pub fn lost(&self) -> u64 {
        self.lock().lost
    }

    /// A thread that panicked with the lock left a whole queue behind: every change is one call.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(when_full: WhenFull) -> Queue<u32> {
        let queue = Queue::new(2, when_full);
        let taken: Vec<bool> = (1..=4).map(|item| queue.offer(item)).collect();
        assert_eq!(taken, [true, true, false, false]);
        queue.close();
        queue
    }

    #[test]
    fn a_full_queue_gives_up_what_its_rule_says_and_counts_it() {
        for (when_full, kept) in [(WhenFull::DropOldest, [3, 4]), (WhenFull::DropNewest, [1, 2])] {
            let queue = filled(when_full);
            assert_eq!(queue.lost(), 2);
            assert_eq!([queue.pop(), queue.pop(), queue.pop()], [Some(kept[0]), Some(kept[1]), None]);
        }
    }

    #[test]
    fn who_waits_is_woken_by_an_item_and_by_the_end() {
        let queue = Queue::new(1, WhenFull::DropNewest);
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| std::iter::from_fn(|| queue.pop()).collect::<Vec<u32>>());
            queue.push(7);
            queue.close();
            assert_eq!(reader.join().unwrap(), [7]);
        });
        queue.push(8);
        assert_eq!((queue.lost(), queue.pop_within(Duration::ZERO)), (1, Popped::Closed));
    }

    #[test]
    fn a_wait_ends_without_an_item() {
        let queue = Queue::<u32>::new(1, WhenFull::DropNewest);
        assert_eq!(queue.pop_within(Duration::from_millis(1)), Popped::Nothing);
    }
}
