//! What is really blocked: segments from access points to UEs against meshes and the hall.

mod mesh;
pub mod fixtures;

pub use mesh::BodyMesh;

use umbracast::Site;

use crate::body::Walker;

/// One link at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkTruth {
    /// Index into the site's access points.
    pub access_point: usize,
    /// The person.
    pub person: u32,
    /// By the mesh of another person.
    pub blocked: bool,
    /// By a pillar or furniture.
    pub static_blocked: bool,
    /// By the own mesh; `None` while the UE is inside it.
    pub self_blocked: Option<bool>,
}

/// Casts the true segments of a frame. Keeps the meshes of the moment, so that nothing is allocated twice.
#[derive(Debug, Default)]
pub struct Truth {
    meshes: Vec<BodyMesh>,
}

impl Truth {
    /// Every link at `time_ns`: access points in the site's order, within each the people in theirs. The meshes
    /// are those of `time_ns`; who is not in the scene neither blocks nor has a link.
    pub fn links(&mut self, site: &Site, walkers: &[Walker], time_ns: i64) -> Vec<LinkTruth> {
        self.meshes.resize_with(walkers.len(), BodyMesh::new);
        for (mesh, walker) in self.meshes.iter_mut().zip(walkers) {
            mesh.update(walker.surface(), |vertices| {
                walker.mesh_at(time_ns, vertices);
            });
        }
        let mut links = Vec::with_capacity(site.access_points.len() * walkers.len());
        for (access_point, at) in site.access_points.iter().enumerate() {
            let start = at.position();
            for (own, walker) in walkers.iter().enumerate() {
                let Some(ue) = walker.ue_m_at(&site.ue, time_ns) else { continue };
                let cuts = |i: usize| self.meshes[i].blocks(walkers[i].surface(), start, ue);
                let inside = self.meshes[own].holds(walker.surface(), ue);
                links.push(LinkTruth {
                    access_point,
                    person: walker.trajectory.person,
                    blocked: (0..walkers.len()).any(|other| other != own && cuts(other)),
                    static_blocked: fixtures::block(site, start, ue),
                    self_blocked: (!inside).then(|| cuts(own)),
                });
            }
        }
        links
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crowd::Trajectory;
    use umbracast::Config;
    use umbracast::geometry::DVec2;

    fn standing(person: u32, at: DVec2) -> Walker {
        let way = Trajectory {
            person,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m: vec![at; 101],
            arrived_ns: None,
            height_m: Some(1.75),
        };
        Walker::new(way, u64::from(person)).looking_ahead()
    }

    fn site() -> Site {
        Config::default().site
    }

    #[test]
    fn the_nearer_body_blocks_the_farther_one_and_not_the_reverse() {
        let people = [standing(0, DVec2::new(5.0, 0.0)), standing(1, DVec2::new(4.0, 0.0))];
        let links = Truth::default().links(&site(), &people, 500_000_000);
        let side = |person: u32| links.iter().find(|l| l.access_point == 0 && l.person == person).unwrap();
        assert!(!side(0).blocked && side(1).blocked);
        assert!(!side(0).static_blocked);
    }

    #[test]
    fn the_own_body_blocks_only_a_ue_outside_it() {
        let mut site = site();
        let person = [standing(0, DVec2::new(5.0, 0.0))];
        let mut own = |forward_m: f64, height_share: f64| {
            site.ue.forward_m = forward_m;
            site.ue.height_share = height_share;
            Truth::default().links(&site, &person, 500_000_000)[0].self_blocked
        };
        // The body looks along +x, towards the access point `side`.
        assert_eq!(own(0.0, 0.6), None);
        assert_eq!(own(0.4, 0.75), Some(false));
        assert_eq!(own(-0.4, 0.75), Some(true));
    }

    #[test]
    fn a_pillar_in_the_way_is_told_apart_from_people() {
        let mut site = site();
        site.pillars[0].position_m = [8.0, 0.0];
        let links = Truth::default().links(&site, &[standing(0, DVec2::ZERO)], 0);
        assert!(links[0].static_blocked && !links[0].blocked);
    }

    #[test]
    fn who_has_left_has_no_link() {
        let links = Truth::default().links(&site(), &[standing(0, DVec2::ZERO)], 2_000_000_000);
        assert!(links.is_empty());
    }
}
