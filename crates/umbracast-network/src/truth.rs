//! The radio truth of a scene: what every link loses to bodies, every 10 ms.

use rayon::prelude::*;
use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};
use umbracast_sim::body::Walker;

use crate::fresnel::Fresnel;
use crate::reflection::{Plane, planes, reflects};
pub use crate::silhouette::TruthModel;
use crate::silhouette::{Body, Outline};

/// Between two instants of the truth.
pub const TICK_NS: i64 = 10_000_000;
/// The same in seconds.
pub const TICK_S: f64 = 0.01;

/// A body farther from a path costs it nothing: its half width and three Fresnel zones of the longest wave.
const ASIDE_M: f64 = 1.3;

/// What losses are worked out for.
#[derive(Debug, Clone, PartialEq)]
pub struct Air {
    /// What a body costs.
    pub model: TruthModel,
    /// By access point; `None` without a radio.
    pub wavelengths_m: Vec<Option<f64>>,
}

impl Air {
    /// Of the radios of a site.
    pub fn of(site: &Site, model: TruthModel) -> Self {
        let wavelength_m = |ap: &umbracast::site::AccessPoint| ap.radio.map(|radio| radio.wavelength_m());
        Self { model, wavelengths_m: site.access_points.iter().map(wavelength_m).collect() }
    }
}

/// What else than others' bodies between both ends counts.
#[derive(Debug, Clone, Copy)]
pub struct Counted {
    /// The owner's own body.
    pub own_body: bool,
    /// Ways by a reflection that lose less than this without anybody. Where there is none, [`Traces::reflected_db`] is infinite.
    pub reflections_db: f64,
}

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
    /// The same by the best single reflection, beside the straight way in sight; infinite where nobody asks for it.
    reflected_db: Vec<f32>,
    /// By instant and person: where everybody is.
    place_m: Vec<DVec2>,
    /// By instant, access point and person: how long the link is, metres.
    length_m: Vec<f32>,
}

impl Traces {
    /// Of a scene's bodies, for `ticks` instants, one for each of `airs` (access points without a radio lose nothing).
    pub fn of_scene(
        site: &Site,
        walkers: &[Walker],
        ticks: usize,
        airs: &[Air],
        counted: Counted,
    ) -> Vec<Self> {
        let fresnel = Fresnel::new();
        let of = site.reflections.filter(|_| counted.reflections_db > 0.0);
        let planes = of.map_or(Vec::new(), |of| planes(&site.hall, of));
        let view = View { site, airs, counted, fresnel: &fresnel, planes };
        let instants: Vec<Instant> =
            (0..ticks).into_par_iter().map(|tick| view.at(walkers, tick as i64 * TICK_NS)).collect();
        let of_air = |air: usize| {
            let mut traces = Self {
                ticks,
                access_points: site.access_points.len(),
                people: walkers.len(),
                loss_db: Vec::new(),
                reflected_db: Vec::new(),
                place_m: Vec::new(),
                length_m: Vec::new(),
            };
            for instant in &instants {
                traces.loss_db.extend(&instant.loss_db[air]);
                traces.reflected_db.extend(&instant.reflected_db[air]);
                traces.place_m.extend(&instant.place_m);
                traces.length_m.extend(&instant.length_m);
            }
            traces
        };
        (0..airs.len()).map(of_air).collect()
    }

    /// What a link loses at an instant.
    pub fn loss_db(&self, tick: usize, access_point: usize, person: usize) -> f64 {
        f64::from(self.loss_db[self.at(tick, access_point, person)])
    }

    /// What its best single reflection loses, beside the straight way in sight; infinite where none was asked for.
    pub fn reflected_db(&self, tick: usize, access_point: usize, person: usize) -> f64 {
        f64::from(self.reflected_db[self.at(tick, access_point, person)])
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

/// One instant: by air, then by access point and person.
struct Instant {
    loss_db: Vec<Vec<f32>>,
    reflected_db: Vec<Vec<f32>>,
    place_m: Vec<DVec2>,
    length_m: Vec<f32>,
}

struct View<'a> {
    site: &'a Site,
    airs: &'a [Air],
    counted: Counted,
    fresnel: &'a Fresnel,
    planes: Vec<Plane>,
}

impl View<'_> {
    fn at(&self, walkers: &[Walker], time_ns: i64) -> Instant {
        let states: Vec<_> = walkers.iter().map(|walker| walker.state_at(time_ns)).collect();
        let body = |walker: &Walker| {
            let mut mesh = Vec::new();
            walker.mesh_at(time_ns, &mut mesh);
            Body::new(mesh)
        };
        let bodies: Vec<Option<Body>> = walkers.iter().map(body).collect();
        let ue_m = |person: usize| walkers[person].ue_m_at(&self.site.ue, time_ns);
        let mut instant = Instant {
            loss_db: vec![Vec::new(); self.airs.len()],
            reflected_db: vec![Vec::new(); self.airs.len()],
            place_m: states.iter().map(|state| state.map_or(DVec2::NAN, |state| state.position_m)).collect(),
            length_m: Vec::new(),
        };
        let mut outline = Outline::default();
        let (mut losses_db, mut ways_db) = (vec![0.0; self.airs.len()], vec![0.0; self.airs.len()]);
        for (access_point, ap) in self.site.access_points.iter().enumerate() {
            for person in 0..walkers.len() {
                let (ap_m, ue_m) = (ap.position(), ue_m(person).filter(|_| ap.radio.is_some()));
                let length_m = ue_m.map_or(0.0, |ue_m| ap_m.distance(ue_m));
                instant.length_m.push(length_m as f32);
                losses_db.fill(0.0);
                if let Some(ue_m) = ue_m {
                    self.add_bodies(
                        &mut outline,
                        [ap_m, ue_m],
                        access_point,
                        person,
                        &bodies,
                        &mut losses_db,
                    );
                }
                let mut reflected_db = vec![f64::INFINITY; self.airs.len()];
                if let Some(ue_m) = ue_m {
                    for plane in 0..self.planes.len() {
                        let way = reflects(&self.planes, plane, ap_m, ue_m);
                        let Some(way) = way.filter(|way| way.loss_db < self.counted.reflections_db) else {
                            continue;
                        };
                        ways_db.fill(way.loss_db);
                        // Bodies stand on this side of the plane: of each unfolded way they meet the leg that is here.
                        for ends_m in [[way.ap_image_m, ue_m], [ap_m, way.ue_image_m]] {
                            self.add_bodies(
                                &mut outline,
                                ends_m,
                                access_point,
                                person,
                                &bodies,
                                &mut ways_db,
                            );
                        }
                        reflected_db.iter_mut().zip(&ways_db).for_each(|(least, db)| *least = least.min(*db));
                    }
                }
                for air in 0..self.airs.len() {
                    instant.loss_db[air].push(losses_db[air] as f32);
                    instant.reflected_db[air].push(reflected_db[air] as f32);
                }
            }
        }
        instant
    }

    /// Adds what bodies cost a straight way, by air.
    fn add_bodies(
        &self,
        outline: &mut Outline,
        [tx_m, rx_m]: [DVec3; 2],
        access_point: usize,
        person: usize,
        bodies: &[Option<Body>],
        losses_db: &mut [f64],
    ) {
        for (of, body) in bodies.iter().enumerate() {
            let Some(body) = body.as_ref().filter(|_| of != person || self.counted.own_body) else {
                continue;
            };
            if !outline.look(tx_m, rx_m, body, ASIDE_M) {
                continue;
            }
            for (air, loss_db) in self.airs.iter().zip(losses_db.iter_mut()) {
                if let Some(wavelength_m) = air.wavelengths_m[access_point] {
                    *loss_db += outline.loss_db(air.model, self.fresnel, wavelength_m);
                }
            }
        }
    }
}

#[cfg(test)]
impl Traces {
    /// Of one person and links of 5 m that lose what `[straight, reflected]` says, by instant and access point.
    pub(crate) fn by_hand(
        ticks: usize,
        access_points: usize,
        loss_db: impl Fn(usize, usize) -> [f32; 2],
    ) -> Self {
        let all = (0..ticks * access_points).map(|at| loss_db(at / access_points, at % access_points));
        let (loss_db, reflected_db) = all.map(|[straight, reflected]| (straight, reflected)).unzip();
        let place_m = vec![DVec2::ZERO; ticks];
        let length_m = vec![5.0; ticks * access_points];
        Self { ticks, access_points, people: 1, loss_db, reflected_db, place_m, length_m }
    }
}
