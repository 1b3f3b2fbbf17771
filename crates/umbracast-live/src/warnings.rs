//! The events of a link, for programs that act on them: a warning begins, the link is blocked, the link is clear
//! again.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use umbracast::STEPS;
use umbracast_io::rows::LinkRow;

/// What a link has come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// In sight, and likely to stay so for 900 ms.
    Clear,
    /// In sight, and likely to be blocked within 900 ms: by others, the owner or the hall.
    Warned,
    /// Blocked by any of them.
    Blocked,
    /// Nobody is followed there any more, who was warned of or blocked before.
    Gone,
}

/// A change of one link.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// The access point's name.
    pub access_point: String,
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
        match (link.is_blocked(), link.is_warned_of()) {
            (true, _) => Self::Blocked,
            (false, true) => Self::Warned,
            (false, false) => Self::Clear,
        }
    }
}

impl Warnings {
    /// The links that are something else than in the frame before. A link is clear before its first frame; one that was
    /// not when its track ended is gone, with the row that it had.
    pub fn changes(&mut self, links: &[LinkRow], access_points: &[String]) -> Vec<Event> {
        let event = |link: LinkRow, state| Event::of(link, state, access_points);
        let mut now = BTreeMap::new();
        let mut events = Vec::new();
        for &link in links {
            let (key, state) = ((link.access_point, link.track), State::of(&link));
            if self.0.remove(&key).map_or(State::Clear, |(before, _)| before) != state {
                events.push(event(link, state));
            }
            now.insert(key, (state, link));
        }
        let gone = self.0.values().filter(|(before, _)| *before != State::Clear);
        events.extend(gone.map(|&(_, link)| event(link, State::Gone)));
        self.0 = now;
        events
    }

    /// Tracks have other numbers. What was said of an old number is not forgotten: it is gone with the next frame.
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        let renumbered = |(&(access_point, track), &(state, link)): (&(u32, u64), &(State, LinkRow))| {
            let track = number(track);
            ((access_point, track), (state, LinkRow { track, ..link }))
        };
        let renumbered: Vec<_> = self.0.iter().map(renumbered).collect();
        self.0.extend(renumbered);
    }

    /// Other access points from now on: what a link was goes with its access point's name. Links of names that are no
    /// more are gone.
    pub fn rename(&mut self, before: &[String], after: &[String]) -> Vec<Event> {
        let mut events = Vec::new();
        for ((index, track), (state, link)) in std::mem::take(&mut self.0) {
            let name = before.get(index as usize);
            match after.iter().position(|other| Some(other) == name) {
                Some(place) => {
                    let link = LinkRow { access_point: place as u32, ..link };
                    self.0.insert((place as u32, track), (state, link));
                }
                None if state != State::Clear => events.push(Event::of(link, State::Gone, before)),
                None => {}
            }
        }
        events
    }
}

impl Event {
    fn of(link: LinkRow, state: State, access_points: &[String]) -> Self {
        let access_point = access_points.get(link.access_point as usize).cloned().unwrap_or_default();
        Self { access_point, link, state }
    }

    /// As events are sent.
    pub fn json(&self) -> Value {
        let Self { access_point, link, state } = self;
        json!({
            "event": state.name(),
            "access_point": access_point,
            "track": link.track,
            "frame": link.frame,
            "time_ns": link.time_ns,
            "p_now": link.p_now,
            "p_w9": link.p[STEPS - 1],
            "p_any_now": link.p_of_any(0),
            "p_any_w9": link.p_of_any(STEPS),
            "cause": matches!(state, State::Warned | State::Blocked).then(|| link.cause()),
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
                warnings.changes(&[link(now, soon)], &[]).iter().map(|event| event.state.name()).collect()
            })
            .collect();
        assert_eq!(said, [vec![], vec!["warning"], vec![], vec!["blocked"], vec!["clear"]]);
    }

    /// A link behind a pillar was once clear: nobody was told of it.
    #[test]
    fn a_link_that_a_pillar_blocks_is_not_clear() {
        let mut warnings = Warnings::default();
        let mut behind = link(false, false);
        (behind.p_any[STEPS], behind.p_hall[STEPS]) = (Some(0.9), Some(0.9));
        let told = &warnings.changes(&[behind], &[])[0];
        assert_eq!((told.state, &told.json()["cause"]), (State::Warned, &"hall".into()));
        (behind.p_any[0], behind.p_own[0]) = (Some(0.7), Some(0.7));
        let told = &warnings.changes(&[behind], &[])[0];
        assert_eq!((told.state, &told.json()["cause"]), (State::Blocked, &"owner".into()));
        let told = &warnings.changes(&[link(false, false)], &[])[0];
        assert_eq!((told.state, &told.json()["cause"]), (State::Clear, &Value::Null));
    }

    #[test]
    fn a_link_whose_track_ends_is_gone_and_begins_anew() {
        let mut warnings = Warnings::default();
        assert_eq!(warnings.changes(&[link(false, true)], &[]).len(), 1);
        let gone = warnings.changes(&[], &[]);
        assert_eq!((gone[0].state, gone[0].link.track), (State::Gone, 5));
        assert!(warnings.changes(&[], &[]).is_empty(), "said once");
        assert_eq!(warnings.changes(&[link(false, true)], &[])[0].state, State::Warned);
    }

    #[test]
    fn who_is_renumbered_is_gone_by_the_old_number_and_not_warned_of_again_by_the_new_one() {
        let mut warnings = Warnings::default();
        let of = |track: u64| LinkRow { track, ..link(false, true) };
        assert_eq!(warnings.changes(&[of(3), of(5)], &[]).len(), 2);
        warnings.renumber(|track| if track == 5 { 100 } else { track });
        let events = warnings.changes(&[of(3), of(100)], &[]);
        assert_eq!((events.len(), events[0].state, events[0].link.track), (1, State::Gone, 5));
    }

    #[test]
    fn other_access_points_keep_what_their_links_were_by_name() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let (before, after) = (names(&["side", "centre"]), names(&["door", "side"]));
        let of = |access_point: u32| LinkRow { access_point, ..link(false, true) };
        let mut warnings = Warnings::default();
        assert_eq!(warnings.changes(&[of(0), of(1)], &before).len(), 2);
        let gone = warnings.rename(&before, &after);
        assert_eq!((gone.len(), gone[0].access_point.as_str(), gone[0].state), (1, "centre", State::Gone));
        let events = warnings.changes(&[of(0), of(1)], &after);
        assert_eq!((events.len(), events[0].access_point.as_str()), (1, "door"), "side is warned of already");
    }
}
