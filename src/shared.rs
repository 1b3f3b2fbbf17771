//! Work that several threads share: the only place of the runtime that begins a thread. What comes of it does not depend on their
//! number, for each piece of work is done by itself and leaves its result in a place of its own.

use std::sync::{Mutex, PoisonError};
use std::thread::{Builder, scope};

/// Does `work` on every item: the first worker on the caller's thread, each of the others on one of its own. Whoever is free takes the
/// next item.
pub(crate) fn share<W: Send, T: Send>(
    workers: &mut [W],
    items: impl Iterator<Item = T> + Send,
    work: impl Fn(&mut W, T) + Sync,
) {
    let items = Mutex::new(items);
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let work_on = |worker: &mut W| {
        while let Some(item) = next() {
            work(worker, item);
        }
    };
    match workers {
        [] => {}
        [alone] => work_on(alone),
        [first, others @ ..] => scope(|scope| {
            for worker in others {
                // Where the system refuses a thread, the others do its share.
                let _ = Builder::new().spawn_scoped(scope, || work_on(worker));
            }
            work_on(first);
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_done_once_by_however_many() {
        for workers in 1..5 {
            let (mut done, mut count) = ([0; 100], vec![0; workers]);
            share(&mut count, done.iter_mut().enumerate(), |count, (i, place)| {
                *place += i;
                *count += 1;
            });
            assert!(done.iter().enumerate().all(|(i, place)| i == *place), "{workers} workers");
            assert_eq!(count.iter().sum::<usize>(), 100);
        }
    }
}
