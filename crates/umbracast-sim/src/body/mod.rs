//! Walking bodies: articulated meshes of published proportions with a gait that follows the speed.

use umbracast::geometry::{DVec2, DVec3};

use crate::crowd::Trajectory;

/// Corner indices of a body's triangles: the same for every pose of every body.
pub type Triangles = Vec<[u32; 3]>;

/// Where a person is and how he stands, at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonState {
    /// Ground point of the body axis.
    pub position_m: DVec2,
    /// Its velocity.
    pub velocity_mps: DVec2,
    /// The trunk's, held while standing.
    pub heading_rad: f64,
    /// Standing height with shoes.
    pub height_m: f64,
}

/// A body drawn at random, walking along a trajectory: pose and mesh at any time.
#[derive(Debug, Clone)]
pub struct Walker {
    /// Whose.
    pub trajectory: Trajectory,
}

impl Walker {
    /// Draws a body (sex, height, build, proportions) from `seed` and lets it walk along the trajectory.
    pub fn new(trajectory: Trajectory, _seed: u64) -> Self {
        Self { trajectory }
    }

    /// The person's state, or `None` while not in the scene.
    pub fn state_at(&self, _time_ns: i64) -> Option<PersonState> {
        None
    }

    /// Writes the vertices of the walking body in the site frame; false (and nothing written) while the person
    /// is not in the scene.
    pub fn mesh_at(&self, _time_ns: i64, vertices: &mut Vec<DVec3>) -> bool {
        vertices.clear();
        false
    }

    /// The same body standing upright, arms hanging, at any place: what the ladder of oracles casts.
    pub fn upright_mesh(&self, _position_m: DVec2, _heading_rad: f64, vertices: &mut Vec<DVec3>) {
        vertices.clear();
    }

    /// The walking mesh of `time_ns` moved so that its axis stands at `position_m` with `heading_rad`.
    pub fn mesh_moved(
        &self,
        _time_ns: i64,
        _position_m: DVec2,
        _heading_rad: f64,
        vertices: &mut Vec<DVec3>,
    ) {
        vertices.clear();
    }

    /// The triangles of every mesh this walker makes.
    pub fn triangles(&self) -> &Triangles {
        static NONE: Triangles = Triangles::new();
        &NONE
    }
}
