//! What is seen of a frame's people before all their poses are found at once.

use super::point_network::PointNetwork;
use super::pose::{self, Pose};
use super::pose_view::{PoseView, Seen};

/// Of all people of a frame. It is kept from frame to frame as memory.
#[derive(Debug, Clone, Default)]
pub struct Looks {
    /// By person: which cluster is theirs, and whether from head to foot.
    pub people: Vec<(usize, bool)>,
    /// By person.
    views: Vec<PoseView>,
    poses: Vec<Pose>,
    /// Everybody's points, moved, and by person where theirs end.
    seen: Vec<Seen>,
    seen_until: Vec<usize>,
}

/// Of one person. Nothing where the method does not ask for it.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    pub view: Option<&'a PoseView>,
    pub pose: Option<Pose>,
    pub seen: &'a [Seen],
}

impl Looks {
    pub fn clear(&mut self) {
        let Self { people, views, poses, seen, seen_until } = self;
        people.clear();
        views.clear();
        poses.clear();
        seen.clear();
        seen_until.clear();
    }

    /// One more person, whose points `view` appends.
    pub fn add(&mut self, view: impl FnOnce(&mut Vec<Seen>) -> PoseView) {
        self.views.push(view(&mut self.seen));
        self.seen_until.push(self.seen.len());
    }

    /// Of everybody at once: the network's weights take longer to read than to multiply by.
    pub fn find_poses(&mut self, network: &PointNetwork) {
        self.poses.extend(pose::poses(network, &self.views));
    }

    pub fn of(&self, person: usize) -> Look<'_> {
        let until = |person: usize| self.seen_until.get(person).copied();
        let from = person.checked_sub(1).and_then(until).unwrap_or(0);
        let seen = &self.seen[from..until(person).unwrap_or(from)];
        Look { view: self.views.get(person), pose: self.poses.get(person).copied(), seen }
    }
}
