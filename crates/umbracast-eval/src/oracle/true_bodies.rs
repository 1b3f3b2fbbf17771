//! The error budget's third row: the body replaced by the truth. Each tracked person stands at the forecast position
//! with the true walking mesh and heading; the rest is the mode's own.

use std::collections::{BTreeMap, BTreeSet};

use umbracast::geometry::{DVec2, DVec3};
use umbracast::{STEP_NS, STEPS, Site};
use umbracast_io::rows::TrackRow;
use umbracast_sim::body::Walker;
use umbracast_sim::truth::BodyMesh;

use crate::oracle::replaced::forecast_of;
use crate::score::link_counts::Prediction;
use crate::score::links::Said;
use crate::score::scene::{Matching, SceneRun};

/// Casts, yes or no, at the forecast means. Who is not followed blocks nobody; a track of nobody has no body.
///
/// A true mesh at the forecast position is the mesh of that instant, moved. So the meshes of an instant serve
/// every forecast that reaches it, and each ray is moved back instead.
pub fn true_bodies(run: &SceneRun, matching: &Matching, walkers: &[Walker], site: &Site) -> Said {
    let rows: BTreeMap<(u64, u64), &TrackRow> = run.tracks.iter().map(|r| ((r.frame, r.track), r)).collect();
    let mut followed: BTreeMap<i64, Vec<(&TrackRow, u32)>> = BTreeMap::new();
    for (&(frame, person), &track) in matching {
        if let Some(row) = rows.get(&(frame, track)) {
            followed.entry(row.time_ns).or_default().push((row, person));
        }
    }
    let steps_of = |&time_ns: &i64| (1..=STEPS as i64).map(move |h| time_ns + h * STEP_NS);
    let instants: BTreeSet<i64> = followed.keys().flat_map(steps_of).collect();
    let mut meshes = vec![BodyMesh::new(); walkers.len()];
    let mut blocked_at: BTreeMap<(u64, u32, u64), [bool; STEPS]> = BTreeMap::new();
    for instant_ns in instants {
        for (mesh, walker) in meshes.iter_mut().zip(walkers) {
            mesh.update(walker.surface(), |vertices| {
                walker.mesh_at(instant_ns, vertices);
            });
        }
        for h in 1..=STEPS {
            let Some(people) = followed.get(&(instant_ns - h as i64 * STEP_NS)) else { continue };
            let bodies: Vec<Body> = people
                .iter()
                .filter_map(|&(row, person)| body(row, person, h, instant_ns, walkers, site))
                .collect();
            for (access_point, at) in site.access_points.iter().enumerate() {
                for q in &bodies {
                    let cuts = |p: &Body| {
                        let (start_m, end_m) = (at.position() - p.offset_m, q.ue_m - p.offset_m);
                        p.walker != q.walker
                            && meshes[p.walker].blocks(walkers[p.walker].surface(), start_m, end_m)
                    };
                    blocked_at.entry((q.frame, access_point as u32, q.track)).or_default()[h - 1] =
                        bodies.iter().any(cuts);
                }
            }
        }
    }
    let mut said = Said::default();
    for ((frame, access_point, track), steps) in blocked_at {
        said.add_link(frame, access_point, track, Prediction::from_steps(steps));
    }
    said
}

/// Somebody at his forecast position.
struct Body {
    frame: u64,
    track: u64,
    walker: usize,
    /// From where he truly is.
    offset_m: DVec3,
    ue_m: DVec3,
}

fn body(
    row: &TrackRow,
    person: u32,
    h: usize,
    instant_ns: i64,
    walkers: &[Walker],
    site: &Site,
) -> Option<Body> {
    let walker = walkers.iter().position(|walker| walker.trajectory.person == person)?;
    let truth = walkers[walker].state_at(instant_ns)?;
    let position_m: DVec2 = forecast_of(row)[h - 1].mean_m;
    let up_m = site.hall.floor_m(position_m) - site.hall.floor_m(truth.position_m);
    Some(Body {
        frame: row.frame,
        track: row.track,
        walker,
        offset_m: (position_m - truth.position_m).extend(up_m),
        ue_m: site.ue_m(position_m, truth.heading_rad, truth.height_m),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;
    use umbracast_sim::crowd::Trajectory;

    fn standing(person: u32, x_m: f64) -> Walker {
        let trajectory = Trajectory {
            person,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m: vec![DVec2::new(x_m, 0.0); 300],
            arrived_ns: None,
            height_m: Some(1.75),
        };
        Walker::new(trajectory, u64::from(person))
    }

    fn track(track: u64, x_m: f64, moves_to_y_m: f64) -> TrackRow {
        let steps = std::array::from_fn(|i| [x_m, moves_to_y_m * (i + 1) as f64 / 9.0, 0.0, 0.0, 0.0]);
        TrackRow { frame: 4, time_ns: 5 * STEP_NS, track, x_m, confirmed: true, steps, ..TrackRow::default() }
    }

    #[test]
    fn bodies_stand_where_the_forecast_has_them_not_where_they_are() {
        // Person 1 stands between the access point `side` and person 0, but is foreseen to step aside.
        let site = Config::default().site;
        let walkers = [standing(0, 0.0), standing(1, 1.0)];
        let matching = Matching::from([((4, 0), 10), ((4, 1), 11)]);
        let said = |aside_m| {
            let run =
                SceneRun { tracks: vec![track(10, 0.0, 0.0), track(11, 1.0, aside_m)], links: Vec::new() };
            true_bodies(&run, &matching, &walkers, &site)
        };
        let of_person_0 = |said: &Said| {
            let instance = crate::score::instances::Instance {
                access_point: 0,
                person: 0,
                frame: 4,
                time_ns: 5 * STEP_NS,
                blocked_now: true,
                first_blocked: Some(1),
            };
            said.of_tracks(&[instance], &matching)[0]
        };
        assert_eq!(of_person_0(&said(0.0)), Prediction::constant(true));
        let aside = of_person_0(&said(9.0));
        assert_eq!(aside, Prediction::CLEAR, "1 m aside at the first step");
    }
}
