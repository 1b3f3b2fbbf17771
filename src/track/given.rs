//! Tracks from elsewhere, of which a position and a velocity may be all that is known.

use std::collections::BTreeMap;

use super::followed::{OBSERVED, Observed, Track, WIDTH_SCALE_SIGMA};
use super::height::HEIGHT_MEAN_M;
use crate::STEP_NS;
use crate::gait::{Gait, WALKS_FROM_MPS};
use crate::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};

/// What is taken of a position and a velocity of which nobody says how sure they are, one standard deviation of an axis: a good
/// tracker with LiDARs or cameras. Who knows better sets the covariance.
const POSITION_SIGMA_M: f64 = 0.05;
const VELOCITY_SIGMA_MPS: f64 = 0.1;
/// One standard deviation of adults' heights, as our own tracker has it.
const HEIGHT_SIGMA_M: f64 = 0.09;
/// Half depth and half width of a usual body's returns together, as a share of the height, measured on simulated people.
const STANDING_SHARE: f64 = 0.226;
/// Any heading: even over a turn.
const ANY_HEADING_RAD: f64 = 1.813_799_364_234_217_8;
/// A frame counts as a step after the last one in the observation window when it is no earlier than this.
const STEP_LEAST_NS: i64 = STEP_NS - STEP_NS / 20;

impl Track {
    /// Somebody whom another program follows. Position and velocity suffice: the rest is what is usual of an adult, and may be
    /// changed in the fields. The heading is the velocity's, or any while the person stands. The boxes stand on a floor at z = 0.
    ///
    /// ```
    /// use umbracast::{Config, Pipeline, geometry::DVec2, track::Track};
    ///
    /// // Somebody walks between the access point `side` at (14, 0) m and somebody who stands.
    /// let stands = Track::new(7, DVec2::new(4.0, 0.0), DVec2::ZERO);
    /// let walks = Track::new(8, DVec2::new(6.0, -0.8), DVec2::new(0.0, 1.3));
    /// let mut pipeline = Pipeline::new(&Config::default(), None)?;
    /// let links = &pipeline.step_tracks(0, 100_000_000, &[stands, walks]).blockages;
    /// assert!(links[0].p_now < 0.5 && links[0].p[8] > 0.5, "{:?}", links[0]);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn new(id: u64, position_m: DVec2, velocity_mps: DVec2) -> Self {
        let variances = [POSITION_SIGMA_M, POSITION_SIGMA_M, VELOCITY_SIGMA_MPS, VELOCITY_SIGMA_MPS];
        let mut covariance = [[0.0; 4]; 4];
        (0..4).for_each(|i| covariance[i][i] = variances[i] * variances[i]);
        let mut track = Self {
            id,
            position_m,
            velocity_mps,
            covariance,
            heading_rad: 0.0,
            heading_sigma_rad: ANY_HEADING_RAD,
            heading_behind: 0.0,
            height_m: HEIGHT_MEAN_M,
            height_sigma_m: HEIGHT_SIGMA_M,
            width_scale: 1.0,
            width_scale_sigma: WIDTH_SCALE_SIGMA,
            outline_m: Default::default(),
            canopy: None,
            gait: Gait::UNKNOWN,
            points: 0,
            confirmed: true,
            part_of: None,
            aabb: Aabb { min_m: DVec3::ZERO, max_m: DVec3::ZERO },
            obb: Obb { center_m: DVec3::ZERO, half_m: DVec3::ZERO, site_from_box: DMat3::IDENTITY },
            observed: Default::default(),
        };
        track.face_ahead();
        track.stand_up(0.0);
        track
    }

    /// The heading that velocity and covariance tell; any while the person stands.
    pub fn face_ahead(&mut self) {
        let (v, c) = (self.velocity_mps, &self.covariance);
        let speed_mps = v.length();
        if speed_mps <= WALKS_FROM_MPS {
            (self.heading_rad, self.heading_sigma_rad) = (0.0, ANY_HEADING_RAD);
            return;
        }
        let across = v.perp() / speed_mps;
        let variance = c[2][2] * across.x * across.x
            + 2.0 * c[2][3] * across.x * across.y
            + c[3][3] * across.y * across.y;
        self.heading_rad = v.to_angle();
        self.heading_sigma_rad = (variance.max(0.0).sqrt() / speed_mps).min(ANY_HEADING_RAD);
    }

    /// Boxes of a usual body of the track's height and width at its position, on a floor at `floor_m`.
    pub fn stand_up(&mut self, floor_m: f64) {
        let half_m = 0.5 * STANDING_SHARE * self.height_m * self.width_scale;
        let half_m = DVec3::new(half_m, half_m, 0.5 * self.height_m);
        let center_m = self.position_m.extend(floor_m + half_m.z);
        self.aabb = Aabb { min_m: center_m - half_m, max_m: center_m + half_m };
        self.obb = Obb { center_m, half_m, site_from_box: DMat3::from_rotation_z(self.heading_rad) };
    }
}

/// The observation windows of such tracks.
#[derive(Debug, Clone, Default)]
pub struct Windows(BTreeMap<u64, Vec<Observed>>);

impl Windows {
    /// Takes a frame's tracks and gives each its window: states a step apart and this one. Who is not there is forgotten.
    pub fn follow(&mut self, time_ns: i64, tracks: &mut [Track]) {
        self.0.retain(|id, _| tracks.iter().any(|track| track.id == *id));
        let longest_ns = STEP_NS * OBSERVED as i64;
        for track in tracks {
            let seen = self.0.entry(track.id).or_default();
            seen.retain(|observed| observed.time_ns < time_ns && time_ns - observed.time_ns < longest_ns);
            let Track { position_m, velocity_mps, .. } = *track;
            seen.push(Observed { time_ns, position_m, velocity_mps });
            track.observed.clear();
            for observed in seen.iter().rev() {
                let after_ns = track.observed.front().map(|next| next.time_ns - observed.time_ns);
                if after_ns.is_none_or(|after_ns| after_ns >= STEP_LEAST_NS)
                    && track.observed.len() < OBSERVED
                {
                    track.observed.push_front(*observed);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walker(id: u64, k: i64) -> Track {
        Track::new(id, DVec2::new(0.12 * k as f64, 0.0), DVec2::new(1.2, 0.0))
    }

    #[test]
    fn a_window_is_of_states_a_step_apart_however_often_they_come() {
        for often in [1, 2, 4] {
            let mut windows = Windows::default();
            let mut tracks = Vec::new();
            for k in 0..40 * often {
                tracks = vec![walker(3, k)];
                windows.follow((k + 1) * STEP_NS / often, &mut tracks);
            }
            let times: Vec<i64> =
                tracks[0].observed.iter().map(|observed| observed.time_ns / STEP_NS).collect();
            assert_eq!(times, (31..=40).collect::<Vec<_>>(), "{often} a step");
        }
    }

    #[test]
    fn who_comes_back_is_somebody_new() {
        let mut windows = Windows::default();
        for k in 0..5 {
            windows.follow((k + 1) * STEP_NS, &mut [walker(3, k)]);
        }
        windows.follow(6 * STEP_NS, &mut []);
        let mut back = [walker(3, 6)];
        windows.follow(7 * STEP_NS, &mut back);
        assert_eq!(back[0].observed.len(), 1);
    }

    #[test]
    fn who_walks_faces_ahead_and_who_stands_may_face_anywhere() {
        let walks = Track::new(0, DVec2::ZERO, DVec2::new(0.0, 1.0));
        assert!((walks.heading_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((walks.heading_sigma_rad - 0.1).abs() < 1e-12, "{}", walks.heading_sigma_rad);
        let stands = Track::new(0, DVec2::ZERO, DVec2::new(0.0, 0.1));
        assert!((stands.heading_sigma_rad - std::f64::consts::PI / 3.0_f64.sqrt()).abs() < 1e-12);
        assert!((walks.aabb.max_m.z - walks.height_m).abs() < 1e-12);
    }
}
