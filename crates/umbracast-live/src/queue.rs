//! A queue between two threads: bounded in items and in bytes, with a rule for when it is full.

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
    most_bytes: usize,
    /// Bytes of an item, the same for as long as it waits.
    weigh: fn(&T) -> usize,
    when_full: WhenFull,
}

#[derive(Debug)]
struct State<T> {
    items: VecDeque<T>,
    bytes: usize,
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
    /// An empty queue for `capacity` items, whatever they weigh: for few, or for such as cannot be large.
    pub fn new(capacity: usize, when_full: WhenFull) -> Self {
        Self::of_bytes(capacity, usize::MAX, |_| 0, when_full)
    }

    /// An empty queue for `capacity` items that have `most_bytes` together, by what `weigh` says of each.
    pub fn of_bytes(capacity: usize, most_bytes: usize, weigh: fn(&T) -> usize, when_full: WhenFull) -> Self {
        let state = State { items: VecDeque::with_capacity(capacity), bytes: 0, lost: 0, closed: false };
        Self { state: Mutex::new(state), filled: Condvar::new(), capacity, most_bytes, weigh, when_full }
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
        let bytes = (self.weigh)(&item);
        let mut all_kept = true;
        while state.items.len() == self.capacity || state.bytes.saturating_add(bytes) > self.most_bytes {
            all_kept = false;
            state.lost += 1;
            // For one that is larger than all may be, nobody else makes room.
            if self.when_full == WhenFull::DropNewest || bytes > self.most_bytes {
                return false;
            }
            self.taken(&mut state);
        }
        state.bytes += bytes;
        state.items.push_back(item);
        drop(state);
        self.filled.notify_one();
        all_kept
    }

    /// The item that waited longest.
    fn taken(&self, state: &mut State<T>) -> Option<T> {
        let item = state.items.pop_front()?;
        state.bytes -= (self.weigh)(&item);
        Some(item)
    }

    /// Waits for the next item; `None` once the queue is closed and empty.
    pub fn pop(&self) -> Option<T> {
        let mut state = self.lock();
        loop {
            if let Some(item) = self.taken(&mut state) {
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
        match self.taken(&mut state) {
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
    fn large_items_fill_a_queue_that_has_room_for_more_of_them() {
        for (when_full, kept, lost) in
            [(WhenFull::DropNewest, vec![4, 5, 1], 3), (WhenFull::DropOldest, vec![8, 1, 1], 3)]
        {
            let queue = Queue::<usize>::of_bytes(9, 10, |bytes| *bytes, when_full);
            let taken: Vec<bool> = [4, 5, 8, 11, 1, 1].map(|bytes| queue.offer(bytes)).into();
            assert_eq!(taken, [true, true, false, false, true, when_full == WhenFull::DropOldest]);
            assert_eq!(queue.lost(), lost, "{when_full:?}");
            queue.close();
            assert_eq!(std::iter::from_fn(|| queue.pop()).collect::<Vec<_>>(), kept, "{when_full:?}");
        }
    }

    #[test]
    fn what_was_taken_makes_room() {
        let queue = Queue::<usize>::of_bytes(9, 10, |bytes| *bytes, WhenFull::DropNewest);
        for _ in 0..100 {
            assert!(queue.offer(6) && queue.offer(4) && !queue.offer(1));
            assert_eq!((queue.pop(), queue.pop_within(Duration::ZERO)), (Some(6), Popped::Item(4)));
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
