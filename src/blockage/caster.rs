//! Casts a ray from every access point to every person, by the method of the config.

use super::Blockage;
use super::algorithm1::{PersonBox, Rays};
use super::counts::Chances;
use super::numbers::Numbers;
use super::probability::{Drawn, Sampler};
use super::steps::{heading_at, position_at};
use crate::config::{BlockageConfig, BlockageMethod, BoxKind};
use crate::forecast::Forecast;
use crate::geometry::{DVec2, DVec3};
use crate::site::{Hall, Ue};
use crate::track::Track;
use crate::{STEPS, Site};

/// Stage 3 with what it needs to know.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// # let config = umbracast::Config::default();
/// # let tracks = two_people();
/// # let forecasts = forecasts_of(&tracks);
/// use umbracast::blockage::Caster;
///
/// // Two people stand in line with the access point `side`, at 10 and 14 m: the farther one is hidden.
/// let (mut caster, mut blockages) = (Caster::new(&config.blockage, &config.site), Vec::new());
/// caster.cast(&tracks, &forecasts, &mut blockages);
/// let of_side = |track: u64| blockages.iter().find(|link| link.access_point == 0 && link.track == track);
/// assert!(of_side(0).is_some_and(|link| link.blocked_now));
/// assert!(of_side(1).is_some_and(|link| !link.blocked_now));
/// ```
#[derive(Debug, Clone)]
pub struct Caster {
    method: BlockageMethod,
    person_box: BoxKind,
    threshold: f64,
    numbers: Numbers,
    access_points_m: Vec<DVec3>,
    ue: Ue,
    hall: Hall,
    sampler: Sampler,
}

impl Caster {
    /// Needs the site's access points and where the UE is.
    ///
    /// ```
    /// use umbracast::{Config, blockage::Caster};
    ///
    /// let config = Config::default();
    /// let mut blockages = Vec::new();
    /// Caster::new(&config.blockage, &config.site).cast(&[], &[], &mut blockages);
    /// assert!(blockages.is_empty(), "nobody, no link");
    /// ```
    pub fn new(config: &BlockageConfig, site: &Site) -> Self {
        Self::with_numbers(config, Numbers::new(config), site)
    }

    /// The same with numbers of one's own.
    #[doc(hidden)] // For tests and ablations.
    pub fn with_numbers(config: &BlockageConfig, numbers: Numbers, site: &Site) -> Self {
        Self {
            method: config.method,
            person_box: config.person_box,
            threshold: config.threshold,
            sampler: Sampler::new(&numbers, site),
            numbers,
            access_points_m: site.access_points.iter().map(|ap| ap.position()).collect(),
            ue: site.ue,
            hall: site.hall.clone(),
        }
    }

    /// Lets so many threads share the links of a frame that has many; one does from the start. What is told of links does not depend
    /// on it, and where links are few the caller's thread asks them alone.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// # let tracks = two_people();
    /// # let forecasts = forecasts_of(&tracks);
    /// use umbracast::blockage::Caster;
    ///
    /// let cast = |threads: usize| {
    ///     let (mut caster, mut blockages) = (Caster::new(&config.blockage, &config.site), Vec::new());
    ///     caster.use_threads(threads);
    ///     caster.cast(&tracks, &forecasts, &mut blockages);
    ///     blockages
    /// };
    /// assert_eq!(cast(1), cast(8));
    /// ```
    pub fn use_threads(&mut self, threads: usize) {
        self.sampler.use_threads(threads);
    }

    /// How many may share a frame.
    pub(crate) fn threads(&self) -> usize {
        self.sampler.threads()
    }

    /// One blockage for each access point and confirmed track, access points first. `forecasts[i]` belongs to
    /// `tracks[i]`.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// # let tracks = two_people();
    /// # let forecasts = forecasts_of(&tracks);
    /// use umbracast::blockage::Caster;
    ///
    /// let mut blockages = Vec::new();
    /// Caster::new(&config.blockage, &config.site).cast(&tracks, &forecasts, &mut blockages);
    /// assert_eq!(blockages.len(), config.site.access_points.len() * tracks.len());
    /// ```
    pub fn cast(&mut self, tracks: &[Track], forecasts: &[Forecast], blockages: &mut Vec<Blockage>) {
        blockages.clear();
        let all = tracks.iter().zip(forecasts);
        let people = all.clone().filter(|(track, _)| track.confirmed);
        match self.method {
            BlockageMethod::Algorithm1 => self.cast_boxes(&people.collect::<Vec<_>>(), blockages),
            BlockageMethod::Probability => {
                let things = all.filter(|(track, _)| !track.confirmed && track.part_of.is_some());
                self.cast_samples(people, things, blockages);
            }
        }
    }

    /// Whether the last cast took fewer samples than the configuration says, because so many people could come in each
    /// other's way: probabilities are coarser then.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// # let config = umbracast::Config::default();
    /// # let tracks = two_people();
    /// # let forecasts = forecasts_of(&tracks);
    /// use umbracast::blockage::Caster;
    ///
    /// let mut caster = Caster::new(&config.blockage, &config.site);
    /// caster.cast(&tracks, &forecasts, &mut Vec::new());
    /// assert!(!caster.took_fewer_samples(), "two people leave time for all");
    /// ```
    pub fn took_fewer_samples(&self) -> bool {
        self.method == BlockageMethod::Probability && self.sampler.takes_fewer(&self.numbers)
    }

    /// The samples of the last cast; `None` where the method draws none.
    pub(crate) fn drawn(&self) -> Option<Drawn<'_>> {
        (self.method == BlockageMethod::Probability).then(|| self.sampler.drawn())
    }

    /// In which samples any cause blocks a link now, by its place among those of the last cast; in words, and nothing where no access
    /// point has a radio, or where the place of devices is known.
    pub(crate) fn blocked_now(&self, link: usize) -> impl Iterator<Item = u32> {
        self.sampler.blocked_now(link)
    }

    /// From which probability on a link counts as blocked.
    pub(crate) fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Tells a link anew, by its place among those of the last cast, as if its samples weighed so much.
    pub(crate) fn weigh(&self, link: usize, weights: &[f32], blockage: &mut Blockage) {
        let Some(chances) = self.sampler.weighed(link, weights, self.threshold) else { return };
        *blockage = told(blockage.access_point, blockage.track, &chances, self.threshold);
    }

    /// How many samples the configuration asks for.
    pub(crate) fn samples_asked(&self) -> usize {
        self.numbers.samples
    }

    /// The paper's way: boxes at the means, yes or no.
    fn cast_boxes(&self, people: &[(&Track, &Forecast)], blockages: &mut Vec<Blockage>) {
        let boxes_now: Vec<PersonBox> = people
            .iter()
            .map(|(track, _)| match self.person_box {
                BoxKind::Aabb => PersonBox::Aabb(track.aabb),
                BoxKind::Obb => PersonBox::Obb(track.obb),
            })
            .collect();
        let moved: Vec<Vec<(DVec2, PersonBox)>> = (0..=STEPS)
            .map(|step| {
                let place = |((track, forecast), person_box): (&(&Track, &Forecast), &PersonBox)| {
                    let position = position_at(track, forecast, step);
                    let turn = heading_at(track, forecast, step) - track.heading_rad;
                    let up_m = self.hall.floor_m(position) - self.hall.floor_m(track.position_m);
                    (position, person_box.moved_by(position - track.position_m, turn).raised_by(up_m))
                };
                people.iter().zip(&boxes_now).map(place).collect()
            })
            .collect();
        let mut rays = Rays::default();
        for (access_point, &ap_m) in self.access_points_m.iter().enumerate() {
            let mut now = vec![false; people.len()];
            rays.cast_step(ap_m, &moved[0], &mut now);
            let mut windows = vec![[false; STEPS]; people.len()];
            let mut blocked = vec![false; people.len()];
            for step in 1..=STEPS {
                // Algorithm 1, line 4
                rays.cast_step(ap_m, &moved[step], &mut blocked);
                windows.iter_mut().zip(&blocked).for_each(|(window, &b)| window[step - 1] = b);
            }
            blockages.extend(people.iter().enumerate().map(|(i, (track, _))| Blockage {
                access_point,
                track: track.id,
                blocked_now: now[i],
                p_now: f64::from(u8::from(now[i])),
                blocked: windows[i],
                p: windows[i].map(|b| f64::from(u8::from(b))),
                onset_s: [None; 3],
                duration_s: [None; 3],
                own: None,
                hall: None,
                any: None,
            }));
        }
    }

    /// Our way: bodies on sampled trajectories, a probability and a threshold.
    fn cast_samples<'a>(
        &mut self,
        people: impl Iterator<Item = (&'a Track, &'a Forecast)> + Clone,
        things: impl Iterator<Item = (&'a Track, &'a Forecast)> + Clone,
        blockages: &mut Vec<Blockage>,
    ) {
        let (numbers, ue) = (&self.numbers, &self.ue);
        self.sampler.draw(numbers, ue, people.clone().chain(things));
        let chances = self.sampler.ask(ue, &self.access_points_m, self.threshold);
        let links = (0..self.access_points_m.len())
            .flat_map(|ap| people.clone().map(move |(track, _)| (ap, track.id)));
        blockages.extend(
            links.zip(chances).map(|((ap, track), chances)| told(ap, track, chances, self.threshold)),
        );
    }
}

/// What is told of a link.
fn told(access_point: usize, track: u64, chances: &Chances, threshold: f64) -> Blockage {
    Blockage {
        access_point,
        track,
        blocked_now: chances.blocked_now,
        p_now: chances.p_now,
        blocked: chances.p.map(|p| p >= threshold),
        p: chances.p,
        onset_s: chances.onset_s,
        duration_s: chances.duration_s,
        own: chances.own,
        hall: chances.hall,
        any: chances.any,
    }
}
