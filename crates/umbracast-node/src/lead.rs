//! Two trackers of one hall: one leads, the other stands by. Pure: the caller gives the time of day.
//!
//! Both compute every frame. The leader publishes. The other one keeps its results until it hears that the leader has
//! finished the frame. If that takes too long it publishes them itself, so nothing is lost. If both lead, the one
//! that has led for longer stays leader.

use std::collections::VecDeque;

use umbracast_io::nodes::Priors;

/// The leader's results are waited for so long. Then it is gone, or so slow that it had better be.
const PATIENCE_NS: i64 = 250_000_000;
/// So many frames are kept for a leader that does not answer.
const KEPT: usize = 32;

/// Where one tracker stands beside the others.
#[derive(Debug)]
pub struct Lead<T> {
    id: String,
    since_ns: Option<i64>,
    /// The priors that the leader has published last are for this time.
    done_ns: Option<i64>,
    kept: VecDeque<Kept<T>>,
}

#[derive(Debug)]
struct Kept<T> {
    /// The next frame's: what the priors carry that are published with it.
    priors_ns: i64,
    /// When it was done here.
    at_ns: i64,
    results: T,
}

impl<T> Lead<T> {
    /// Stands by.
    pub fn new(id: String) -> Self {
        Self { id, since_ns: None, done_ns: None, kept: VecDeque::new() }
    }

    /// Since when it leads; `None` while it stands by.
    pub fn since_ns(&self) -> Option<i64> {
        self.since_ns
    }

    /// Leads from now on; gives what was kept, to be published.
    pub fn take_over(&mut self, now_ns: i64) -> Vec<T> {
        self.since_ns.get_or_insert(now_ns);
        self.kept.drain(..).map(|kept| kept.results).collect()
    }

    /// The results of a frame whose priors are for `priors_ns`: given back where they are to be published now.
    pub fn done(&mut self, priors_ns: i64, results: T, now_ns: i64) -> Option<T> {
        if self.since_ns.is_some() {
            return Some(results);
        }
        if self.done_ns.is_none_or(|done_ns| done_ns < priors_ns) {
            self.kept.push_back(Kept { priors_ns, at_ns: now_ns, results });
            if self.kept.len() > KEPT {
                self.kept.pop_front();
            }
        }
        None
    }

    /// A tracker that leads has done a frame. True where this one leads no longer: the other has led for longer.
    pub fn hear(&mut self, priors: &Priors) -> bool {
        if priors.tracker == self.id {
            return false;
        }
        if let Some(since_ns) = self.since_ns
            && (since_ns, &self.id) < (priors.leads_since_ns, &priors.tracker)
        {
            return false;
        }
        self.done_ns = Some(priors.time_ns);
        self.kept.retain(|kept| kept.priors_ns > priors.time_ns);
        self.since_ns.take().is_some()
    }

    /// True where the leader has had its time: [`Self::take_over`].
    pub fn is_overdue(&self, now_ns: i64) -> bool {
        self.kept.front().is_some_and(|kept| now_ns - kept.at_ns >= PATIENCE_NS)
    }

    /// When that will be.
    pub fn due_ns(&self) -> Option<i64> {
        self.kept.front().map(|kept| kept.at_ns + PATIENCE_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn priors(tracker: &str, leads_since_ns: i64, time_ns: i64) -> Priors {
        Priors { time_ns, tracker: tracker.to_owned(), leads_since_ns, priors: Vec::new() }
    }

    #[test]
    fn what_stands_by_keeps_what_the_leader_has_not_done_and_takes_over_in_time() {
        let mut lead = Lead::new("b".to_owned());
        assert_eq!(lead.done(200 * MS, "frame 1", 100 * MS), None);
        assert!(!lead.hear(&priors("a", 0, 200 * MS)));
        assert_eq!(lead.due_ns(), None, "the leader has done it");
        for k in 2..5 {
            assert_eq!(lead.done((k + 1) * 100 * MS, "later", k * 100 * MS), None);
        }
        assert!(!lead.is_overdue(449 * MS) && lead.is_overdue(450 * MS));
        assert_eq!(lead.take_over(450 * MS), ["later"; 3]);
        assert_eq!(lead.done(600 * MS, "own", 500 * MS), Some("own"));
        assert_eq!(lead.since_ns(), Some(450 * MS));
    }

    #[test]
    fn of_two_leaders_the_one_that_has_led_for_longer_stays() {
        let mut lead = Lead::<()>::new("b".to_owned());
        lead.take_over(100 * MS);
        assert!(!lead.hear(&priors("a", 200 * MS, MS)) && lead.since_ns().is_some(), "the other came later");
        assert!(!lead.hear(&priors("b", 0, MS)), "its own voice");
        assert!(lead.hear(&priors("a", 50 * MS, MS)) && lead.since_ns().is_none());
        lead.take_over(100 * MS);
        assert!(lead.hear(&priors("a", 100 * MS, MS)), "of the same age: by name");
    }
}
