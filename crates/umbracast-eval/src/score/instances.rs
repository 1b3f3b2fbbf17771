//! Blockage instances (docs/CONVENTIONS.md, who counts): each is one comparison of a link's prediction with the
//! truth.

use umbracast::STEPS;
use umbracast::track::OBSERVED;
use umbracast_io::rows::PeopleLinkRow;

use crate::score::scene::TruthIndex;

/// What blocks a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Other people's bodies. A link that hall or furniture blocks does not count.
    Others,
    /// The owner's own body. While the UE is inside it, a link does not count.
    Owner,
    /// Walls, pillars and furniture.
    Hall,
    /// Any of them.
    Any,
}

impl Cause {
    /// Whether it blocks a link; `None` where that does not count.
    fn blocks(self, link: &PeopleLinkRow) -> Option<bool> {
        let by_owner = link.self_blocked == Some(true);
        match self {
            Self::Others => (!link.static_blocked).then_some(link.blocked),
            Self::Owner => link.self_blocked,
            Self::Hall => Some(link.static_blocked),
            Self::Any => Some(link.blocked || link.static_blocked || by_owner),
        }
    }
}

/// One link at one instant `t_e`, with what really happened after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instance {
    /// Index into the site's access points.
    pub access_point: u32,
    /// Whose link.
    pub person: u32,
    /// The frame that ends at `t_e`.
    pub frame: u64,
    /// `t_e`.
    pub time_ns: i64,
    /// Blocked at `t_e`.
    pub blocked_now: bool,
    /// The first step from 1 to 9 at which it is blocked.
    pub first_blocked: Option<usize>,
}

impl Instance {
    /// Blocked at any of the steps 1..=w.
    pub fn blocked_within(&self, w: usize) -> bool {
        self.first_blocked.is_some_and(|step| step <= w)
    }
}

/// All instances of a scene: by access point, then person, then frame.
///
/// A person of the truth counts at `t_e` when not arrived then, with truth in the 10 frames up to and with `t_e`
/// and in the 9 after. A link counts when nothing of hall or furniture blocks it in any of those frames.
pub fn instances(truth: &TruthIndex) -> Vec<Instance> {
    instances_of(truth, Cause::Others)
}

/// The same where another cause is asked for.
pub fn instances_of(truth: &TruthIndex, cause: Cause) -> Vec<Instance> {
    let mut all = Vec::new();
    for &access_point in &truth.access_points {
        for &person in &truth.persons {
            all.extend(
                truth.frames.iter().filter_map(|&frame| instance(truth, cause, access_point, person, frame)),
            );
        }
    }
    all
}

/// True when the person counts at this frame, whatever the links.
pub fn person_counts(truth: &TruthIndex, person: u32, frame: u64) -> bool {
    truth.person(frame, person).is_some_and(|row| !row.arrived)
        && around(frame).is_some_and(|mut frames| frames.all(|k| truth.person(k, person).is_some()))
}

/// The 10 frames up to and with `frame` and the 9 after; `None` where the scene is too young.
fn around(frame: u64) -> Option<std::ops::RangeInclusive<u64>> {
    Some(frame.checked_sub(OBSERVED as u64 - 1)?..=frame + STEPS as u64)
}

fn instance(
    truth: &TruthIndex,
    cause: Cause,
    access_point: u32,
    person: u32,
    frame: u64,
) -> Option<Instance> {
    if !person_counts(truth, person, frame) {
        return None;
    }
    for k in around(frame)? {
        cause.blocks(truth.link(k, person, access_point)?)?;
    }
    let now = truth.link(frame, person, access_point)?;
    let is_blocked = |link: &PeopleLinkRow| cause.blocks(link) == Some(true);
    let blocked_at =
        |step: usize| truth.link(frame + step as u64, person, access_point).is_some_and(is_blocked);
    Some(Instance {
        access_point,
        person,
        frame,
        time_ns: now.time_ns,
        blocked_now: is_blocked(now),
        first_blocked: (1..=STEPS).find(|&step| blocked_at(step)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::truth_of;

    #[test]
    fn the_first_and_the_last_instant_leave_room_for_both_windows() {
        let truth = truth_of(1, 40, |_, _| false);
        let frames: Vec<u64> = instances(&TruthIndex::new(&truth)).iter().map(|i| i.frame).collect();
        assert_eq!(frames, (9..=30).collect::<Vec<_>>());
    }

    #[test]
    fn a_window_is_blocked_when_any_of_its_steps_is() {
        let truth = truth_of(1, 40, |_, frame| frame == 23);
        let all = instances(&TruthIndex::new(&truth));
        let at = |frame| all.iter().find(|i| i.frame == frame).unwrap();
        assert_eq!(at(20).first_blocked, Some(3));
        assert!(!at(20).blocked_within(2) && at(20).blocked_within(3) && at(20).blocked_within(9));
        assert_eq!(at(14).first_blocked, Some(9));
        assert_eq!(at(13).first_blocked, None);
        // The instant itself is no part of the window.
        assert!(at(23).blocked_now && at(23).first_blocked.is_none());
    }

    #[test]
    fn who_has_arrived_counts_no_more_but_may_arrive_within_the_window() {
        let mut truth = truth_of(1, 40, |_, _| false);
        truth.people.iter_mut().for_each(|row| row.arrived = row.frame >= 20);
        let last = instances(&TruthIndex::new(&truth)).iter().map(|i| i.frame).max();
        assert_eq!(last, Some(19));
    }

    #[test]
    fn a_gap_in_the_truth_excludes_every_instant_that_needs_it() {
        let mut truth = truth_of(1, 60, |_, _| false);
        truth.people.retain(|row| row.frame != 30);
        let frames: Vec<u64> = instances(&TruthIndex::new(&truth)).iter().map(|i| i.frame).collect();
        assert_eq!(frames, (9..=20).chain(40..=50).collect::<Vec<_>>());
    }

    #[test]
    fn a_link_that_a_pillar_blocks_anywhere_around_does_not_count_but_the_others_do() {
        let mut truth = truth_of(2, 40, |_, _| false);
        truth.links.iter_mut().filter(|row| row.person == 1 && row.frame == 39).for_each(|row| {
            row.static_blocked = true;
        });
        let all = instances(&TruthIndex::new(&truth));
        let last = |person| all.iter().filter(|i| i.person == person).map(|i| i.frame).max();
        assert_eq!((last(0), last(1)), (Some(30), Some(29)));
    }

    #[test]
    fn every_cause_has_its_own_instances_and_truth() {
        let mut truth = truth_of(1, 40, |_, frame| frame == 12);
        for row in &mut truth.links {
            row.static_blocked = row.frame == 36;
            row.self_blocked = (row.frame < 30).then_some(row.frame == 14);
        }
        let index = TruthIndex::new(&truth);
        let of = |cause| instances_of(&index, cause);
        let firsts = |cause| of(cause).iter().map(|i| i.first_blocked).take(4).collect::<Vec<_>>();
        assert_eq!(firsts(Cause::Others), [Some(3), Some(2), Some(1), None]);
        assert_eq!(firsts(Cause::Owner), [Some(5), Some(4), Some(3), Some(2)]);
        assert_eq!(firsts(Cause::Any), [Some(3), Some(2), Some(1), Some(2)]);
        let last = |cause| of(cause).last().map(|i| i.frame);
        let lasts = [Cause::Others, Cause::Owner, Cause::Hall, Cause::Any].map(last);
        assert_eq!(lasts, [Some(26), Some(20), Some(30), Some(30)]);
    }

    #[test]
    fn each_access_point_is_an_instance_of_its_own() {
        let mut truth = truth_of(1, 20, |_, _| false);
        let second = truth.links.iter().map(|row| umbracast_io::rows::PeopleLinkRow {
            access_point: 1,
            blocked: true,
            ..*row
        });
        let second = second.collect::<Vec<_>>();
        truth.links.extend(second);
        let all = instances(&TruthIndex::new(&truth));
        assert_eq!(all.len(), 4);
        assert!(all.iter().all(|i| i.blocked_now == (i.access_point == 1)));
    }
}
