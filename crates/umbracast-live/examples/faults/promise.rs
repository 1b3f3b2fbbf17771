//! What a row promises, and whether it was kept.

use std::collections::BTreeSet;

use umbracast_live::Summary;

use super::clients::Page;
use super::disk::Recorded;
use super::hall::{FAILS_NS, PEOPLE, S};

/// What must be true of a run.
#[derive(Debug, Clone, Copy)]
pub enum Promise {
    /// A frame every tenth of a second, from the first to the last, and none of them skipped.
    EveryFrame,
    /// So many frames at least.
    Frames(u64),
    /// So many people are followed at least, in every frame while it fails.
    Followed(usize),
    /// No more people are followed than so many, ever.
    NobodyInvented(usize),
    /// No more than so many are followed in the last second.
    NobodyLeft(usize),
    /// Who was followed before has the same number after it.
    SameNumbers,
    /// All is well again so many seconds after the end of the failure.
    Well(f64),
    /// Something is counted under this name.
    Counted(&'static str),
    /// Nothing is counted.
    NothingCounted,
    /// Every packet and every frame's results are recorded.
    AllRecorded,
    /// What is not in the files is counted as lost.
    RecordedOrCounted,
    /// While it failed, the recorder said that it does.
    Told,
    /// So many others at least were connected to the page. Who looks at it beside them sees nine of ten frames, and waits for no
    /// frame longer than a second.
    PageBears(usize),
}

/// What one frame was like: when it was published, who was followed, which sensors gave.
pub struct Seen {
    pub published_ns: i64,
    pub people: BTreeSet<u64>,
    pub sensors: usize,
}

/// What happened in a run.
pub struct Outcome {
    pub begun_ns: i64,
    pub seconds: u64,
    pub seen: Vec<Seen>,
    pub summary: Summary,
    pub recorded: Recorded,
    pub page: Option<Page>,
}

impl Outcome {
    fn during(&self) -> impl Iterator<Item = &Seen> {
        self.seen.iter().filter(|seen| FAILS_NS.contains(&(seen.published_ns - self.begun_ns)))
    }

    /// People followed while it failed, at least.
    pub fn fewest(&self) -> usize {
        self.during().map(|seen| seen.people.len()).min().unwrap_or(0)
    }

    /// People followed at any time, at most.
    pub fn most(&self) -> usize {
        self.seen.iter().map(|seen| seen.people.len()).max().unwrap_or(0)
    }

    /// The longest time between two frames.
    pub fn gap_ns(&self) -> i64 {
        self.seen.windows(2).map(|pair| pair[1].published_ns - pair[0].published_ns).max().unwrap_or(0)
    }

    /// People of the last frame who had another number before it failed.
    pub fn renumbered(&self) -> usize {
        let before = self.seen.iter().take_while(|seen| seen.published_ns - self.begun_ns < FAILS_NS.start);
        let known: BTreeSet<u64> = before.flat_map(|seen| seen.people.iter().copied()).collect();
        self.seen.last().map_or(0, |seen| seen.people.difference(&known).count())
    }

    /// From the end of the failure until everybody is followed with both sensors, and recorded where that failed.
    pub fn recovers_s(&self) -> Option<f64> {
        let over_ns = self.begun_ns + FAILS_NS.end;
        let well =
            |seen: &&Seen| seen.published_ns >= over_ns && seen.people.len() >= PEOPLE && seen.sensors == 2;
        let seen_ns = self.seen.iter().find(well)?.published_ns;
        let recorded_ns = match self.recorded.again_ns {
            Some(again_ns) => again_ns?,
            None => over_ns,
        };
        Some((seen_ns.max(recorded_ns) - over_ns) as f64 * 1e-9)
    }

    /// What is not zero.
    pub fn counted(&self) -> Vec<(String, u64)> {
        let health = serde_json::to_value(self.summary.health).unwrap_or_default();
        let skipped = health.as_object().into_iter().flatten();
        let skipped = skipped.map(|(name, count)| (name.clone(), count.as_u64().unwrap_or(0)));
        let not_recorded = ("not_recorded".to_owned(), self.summary.recorded.lost);
        skipped.chain([not_recorded]).filter(|(_, count)| *count > 0).collect()
    }

    /// Why a promise was not kept; `None` where it was.
    pub fn breaks(&self, promise: Promise) -> Option<String> {
        let summary = &self.summary;
        let (kept, found) = match promise {
            Promise::EveryFrame => (
                summary.frames_skipped == 0 && summary.frames >= self.seconds * 10,
                format!("{} frames, {} skipped", summary.frames, summary.frames_skipped),
            ),
            Promise::Frames(least) => (summary.frames >= least, format!("{} frames", summary.frames)),
            Promise::Followed(least) => (self.fewest() >= least, format!("{} followed", self.fewest())),
            Promise::NobodyInvented(most) => (self.most() <= most, format!("{} followed", self.most())),
            Promise::NobodyLeft(most) => {
                let last = self.seen.iter().rev().take(10).map(|seen| seen.people.len()).max();
                (last.is_some_and(|last| last <= most), format!("{last:?} followed at the end"))
            }
            Promise::SameNumbers => {
                (self.renumbered() == 0, format!("{} with another number", self.renumbered()))
            }
            Promise::Well(within_s) => (
                self.recovers_s().is_some_and(|s| s <= within_s),
                self.recovers_s().map_or("never well again".to_owned(), |s| format!("well after {s:.2} s")),
            ),
            Promise::Counted(name) => {
                (self.counted().iter().any(|(counted, _)| counted == name), self.counts())
            }
            Promise::NothingCounted => (self.counted().is_empty(), self.counts()),
            Promise::AllRecorded => {
                (summary.recorded.lost == 0 && summary.recorded.failing.is_none(), self.counts())
            }
            Promise::RecordedOrCounted => {
                let all = summary.packets + summary.frames;
                let known = self.recorded.found + summary.recorded.lost;
                let found =
                    format!("{} recorded, {} counted of {all}", self.recorded.found, summary.recorded.lost);
                (known >= all, found)
            }
            Promise::Told => (self.recorded.told.is_some(), "nothing told".to_owned()),
            Promise::PageBears(others) => {
                let nobody = Page { frames: 0, gap_ns: i64::MAX, others: 0 };
                let page = self.page.as_ref().unwrap_or(&nobody);
                let published = self.during().count();
                let kept = page.others >= others && page.frames * 10 >= published * 9 && page.gap_ns <= S;
                (kept, format!("{page}, of {published} published"))
            }
        };
        (!kept).then(|| format!("expected {promise:?}, found {found}"))
    }

    fn counts(&self) -> String {
        let counted = self.counted();
        if counted.is_empty() {
            return "nothing counted".to_owned();
        }
        counted.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
    }
}
