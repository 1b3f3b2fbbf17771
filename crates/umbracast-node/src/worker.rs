//! A thread that processes a queue.

use std::sync::Arc;
use std::thread::JoinHandle;

use umbracast_live::queue::Queue;

/// The thread and its queue.
pub struct Worker<T> {
    queue: Arc<Queue<T>>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Worker<T> {
    /// Runs `work` until the queue is closed.
    pub fn start(queue: Arc<Queue<T>>, work: impl FnOnce(&Queue<T>) + Send + 'static) -> Self {
        let items = queue.clone();
        Self { queue, thread: Some(std::thread::spawn(move || work(&items))) }
    }

    /// True while its thread works.
    pub fn is_well(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Lets it do what has come, and end.
    pub fn stop(&mut self) {
        self.queue.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
