//! What changes of a link from frame to frame, for those who act on it: a warning begins, the link is blocked, it is
//! clear again.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use umbracast_io::rows::LinkRow;

/// What a link has come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// In sight, and likely to stay so for 900 ms.
    Clear,
    /// In sight, and likely to be blocked within 900 ms.
    Warned,
    /// Blocked.
    Blocked,
    /// Nobody is followed there any more, who was warned of or blocked before.
    Gone,
}

/// A change of one link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// The link, with its probabilities and quantiles.
    pub link: LinkRow,
    /// What it is from now on.
    pub state: State,
}

/// What every link was in the frame before.
#[derive(Debug, Clone, Default)]
pub struct Warnings(BTreeMap<(u32, u64), (State, LinkRow)>);

impl State {
    /// Its name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clear => "clear",
            Self::Warned => "warning",
            Self::Blocked => "blocked",
            Self::Gone => "gone",
        }
    }

    fn of(link: &LinkRow) -> Self {
        match (link.blocked_now, link.blocked.last()) {
            (true, _) => Self::Blocked,
            (false, Some(true)) => Self::Warned,
            _ => Self::Clear,
        }
    }
}

impl Warnings {
    /// The links that are something else than in the frame before. A link is clear before its first frame; one that was
    /// not when its track ended is gone, with the row that it had.
    pub fn changes(&mut self, links: &[LinkRow]) -> Vec<Event> {
        let mut now = BTreeMap::new();
        let mut events = Vec::new();
        for &link in links {
            let (key, state) = ((link.access_point, link.track), State::of(&link));
            if self.0.remove(&key).map_or(State::Clear, |(before, _)| before) != state {
                events.push(Event { link, state });
            }
            now.insert(key, (state, link));
        }
        let gone = self.0.values().filter(|(before, _)| *before != State::Clear);
        events.extend(gone.map(|&(_, link)| Event { link, state: State::Gone }));
        self.0 = now;
        events
    }
}

impl Event {
    /// As events are sent.
    pub fn json(&self, access_points: &[String]) -> Value {
        let Self { link, state } = self;
        json!({
            "event": state.name(),
            "access_point": access_points.get(link.access_point as usize),
            "track": link.track,
            "frame": link.frame,
            "time_ns": link.time_ns,
            "p_now": link.p_now,
            "p_w9": link.p[link.p.len() - 1],
            "onset_p10_s": link.onset_s[0],
            "onset_p50_s": link.onset_s[1],
            "onset_p90_s": link.onset_s[2],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(blocked_now: bool, within_900_ms: bool) -> LinkRow {
        let mut blocked = [false; umbracast::STEPS];
        blocked[umbracast::STEPS - 1] = within_900_ms;
        LinkRow { track: 5, blocked_now, blocked, ..LinkRow::default() }
    }

    #[test]
    fn a_link_speaks_when_it_changes_and_only_then() {
        let mut warnings = Warnings::default();
        let frames = [(false, false), (false, true), (false, true), (true, true), (false, false)];
        let said: Vec<Vec<&str>> = frames
            .iter()
            .map(|&(now, soon)| {
                warnings.changes(&[link(now, soon)]).iter().map(|event| event.state.name()).collect()
            })
            .collect();
        assert_eq!(said, [vec![], vec!["warning"], vec![], vec!["blocked"], vec!["clear"]]);
    }

    #[test]
    fn a_link_whose_track_ends_is_gone_and_begins_anew() {
        let mut warnings = Warnings::default();
        assert_eq!(warnings.changes(&[link(false, true)]).len(), 1);
        let gone = warnings.changes(&[]);
        assert_eq!((gone[0].state, gone[0].link.track), (State::Gone, 5));
        assert!(warnings.changes(&[]).is_empty(), "said once");
        assert_eq!(warnings.changes(&[link(false, true)])[0].state, State::Warned);
    }
}
