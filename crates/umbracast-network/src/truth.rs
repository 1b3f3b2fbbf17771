//! The radio truth of a scene: what every link loses to bodies, every 10 ms.

use rayon::prelude::*;
use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};
use umbracast_sim::body::Walker;

use crate::fresnel::Fresnel;
use crate::silhouette::Outline;
pub use crate::silhouette::TruthModel;

/// Between two instants of the truth.
pub const TICK_NS: i64 = 10_000_000;
/// The same in seconds.
pub const TICK_S: f64 = 0.01;

/// A body farther from a path costs it nothing: its half width and three Fresnel zones of the longest wave.
const ASIDE_M: f64 = 1.3;

/// Losses of all links of a scene.
#[derive(Debug, Clone)]
pub struct Traces {
    /// How many instants, from 0 on.
    pub ticks: usize,
    /// How many access points.
    pub access_points: usize,
    /// How many people.
    pub people: usize,
    /// By instant, access point and person, dB.
    loss_db: Vec<f32>,
    /// By instant and person: where everybody is.
    place_m: Vec<DVec2>,
    /// By instant, access point and person: how long the link is, metres.
    length_m: Vec<f32>,
}

impl Traces {
    /// Of a scene's bodies, for `ticks` instants, at the carrier of each access point with a radio (others lose nothing).
    /// `own_body` says whether the owner's own body counts.
    pub fn of_scene(
        site: &Site,
        walkers: &[Walker],
        ticks: usize,
        model: TruthModel,
        own_body: bool,
    ) -> Self {
        let fresnel = Fresnel::new();
        let (access_points, people) = (site.access_points.len(), walkers.len());
        let instants: Vec<Instant> = (0..ticks)
            .into_par_iter()
            .map(|tick| Instant::new(site, walkers, tick as i64 * TICK_NS, model, own_body, &fresnel))
            .collect();
        let mut traces = Self {
            ticks,
            access_points,
            people,
            loss_db: Vec::new(),
            place_m: Vec::new(),
            length_m: Vec::new(),
        };
        for instant in instants {
            traces.loss_db.extend(instant.loss_db);
            traces.place_m.extend(instant.place_m);
            traces.length_m.extend(instant.length_m);
        }
        traces
    }

    /// What a link loses at an instant.
    pub fn loss_db(&self, tick: usize, access_point: usize, person: usize) -> f64 {
        f64::from(self.loss_db[self.at(tick, access_point, person)])
    }

    /// How long a link is at an instant.
    pub fn length_m(&self, tick: usize, access_point: usize, person: usize) -> f64 {
        f64::from(self.length_m[self.at(tick, access_point, person)])
    }

    /// Where a person is at an instant.
    pub fn place_m(&self, tick: usize, person: usize) -> DVec2 {
        self.place_m[tick * self.people + person]
    }

    fn at(&self, tick: usize, access_point: usize, person: usize) -> usize {
        (tick * self.access_points + access_point) * self.people + person
    }
}

struct Instant {
    loss_db: Vec<f32>,
    place_m: Vec<DVec2>,
    length_m: Vec<f32>,
}

impl Instant {
    fn new(
        site: &Site,
        walkers: &[Walker],
        time_ns: i64,
        model: TruthModel,
        own_body: bool,
        fresnel: &Fresnel,
    ) -> Self {
        let states: Vec<_> = walkers.iter().map(|walker| walker.state_at(time_ns)).collect();
        let mut meshes = vec![Vec::new(); walkers.len()];
        for (mesh, walker) in meshes.iter_mut().zip(walkers) {
            walker.mesh_at(time_ns, mesh);
        }
        let ue_m = |person: usize| {
            states[person].map(|state| {
                site.ue.on_body(state.position_m, state.heading_rad, state.height_m)
                    + DVec3::Z * state.floor_m
            })
        };
        let mut outline = Outline::default();
        let mut instant = Self { loss_db: Vec::new(), place_m: Vec::new(), length_m: Vec::new() };
        instant.place_m.extend(states.iter().map(|state| state.map_or(DVec2::NAN, |state| state.position_m)));
        for ap in &site.access_points {
            for person in 0..walkers.len() {
                let (mut loss_db, mut length_m) = (0.0, 0.0);
                if let (Some(ue_m), Some(radio)) = (ue_m(person), &ap.radio) {
                    length_m = ap.position().distance(ue_m);
                    for (body, mesh) in meshes.iter().enumerate() {
                        if (body != person || own_body) && outline.look(ap.position(), ue_m, mesh, ASIDE_M) {
                            loss_db += outline.loss_db(model, fresnel, radio.wavelength_m());
                        }
                    }
                }
                instant.loss_db.push(loss_db as f32);
                instant.length_m.push(length_m as f32);
            }
        }
        instant
    }
}
