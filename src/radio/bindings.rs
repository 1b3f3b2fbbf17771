//! Which person carries which device, told by the power that access points hear of it.
//!
//! A device's power follows the person who carries it: it falls with distance, and it falls where somebody stands in the way. The
//! losses foreseen for each track are therefore compared with what is heard. Each device has a hidden Markov model whose states are
//! the tracks, and one more for nobody who is followed. Each state keeps its own estimate of the device's level in sight, one for each
//! access point, for antennas and hands differ. States exchange probability and levels as an interacting multiple model filter does
//! (Blom and Bar-Shalom 1988): what was learned of a device goes with it when its track is swapped or born again.

use std::collections::BTreeMap;

use super::level::Level;
use super::report::{Binding, Report, Served};
use crate::Site;
use crate::geometry::DVec2;
use crate::radio::Loss;
use crate::site::{Radio, Ue};
use crate::track::Track;

/// What a link lost as it was heard, if the device is carried by the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heard {
    pub(super) access_point: usize,
    pub(super) track: u64,
    pub(super) time_ns: i64,
    /// Less than the device's own level in sight, dB, and the variance of that.
    pub(super) lost_db: f64,
    pub(super) variance: f64,
    /// How likely the person carries the device.
    pub(super) p: f64,
}

impl Heard {
    /// Whether both are of one access point and one person.
    pub(super) fn is_of_same_link(&self, other: &Self) -> bool {
        (self.access_point, self.track) == (other.access_point, other.track)
    }
}

/// Less likely bindings are not told.
const LEAST_P: f64 = 0.01;
/// Who carries a device at least so likely is heard with it, and is served as it is.
const MAY_P: f64 = 0.2;
const SERVED_P: f64 = 0.5;
/// Devices that are followed at most; reports of others are skipped.
const DEVICES_MAX: usize = 4096;
/// Reports that wait for a frame at most: half a second of every device and eight access points, every 20 ms, would be more, but no
/// network tells all of it. What comes beyond is skipped.
const WAITING_MAX: usize = 1 << 18;
/// A device that was not heard for so long is forgotten.
const FORGOTTEN_NS: i64 = 60_000_000_000;
/// Reports may come so late, and be so far ahead of the frames. Frames of that time are kept.
pub(super) const LATE_NS: i64 = 500_000_000;
/// How far a level wanders, dB in the root of a second.
const WANDERS_DB: f64 = 0.3;
/// Shares of a loss's three quantiles.
const SHARES: [f64; 3] = [0.3, 0.4, 0.3];
/// Of a person who is not followed nothing is foreseen but that the power stays about what it was. It wanders so far, dB in the root of
/// a second; before the first report it is anywhere.
const UNSEEN_DB: f64 = 20.0;
const ANYWHERE: Level = Level { mean_db: -80.0, variance: 900.0 };
/// Errors go on for seconds (a hand at the ear, a bag), so that a frame counts for this share of an independent one. Chosen on the scenes
/// of seeds 132900 to 132903; [`UNSEEN_DB`] on those of 130000 and 130001.
const COUNTS: f64 = 0.05;
/// Two tracks that are this near (one standard deviation, metres) may be swapped, so often a second.
const SWAP_M: f64 = 0.5;
const SWAP_HZ: f64 = 0.2;
/// Elsewhere a device changes hands, or its person is lost, so often a second; and it is found again so often.
const CHANGE_HZ: f64 = 1.0 / 300.0;
const FOUND_HZ: f64 = 1.0 / 3.0;
/// How likely a device that is heard is carried by somebody who is followed.
const CARRIED: f64 = 0.8;
/// How likely a person carries no second device: an assumption. So many rounds bring what devices leave each other to rest.
const ONE_DEVICE: f64 = 0.99;
const ROUNDS: usize = 12;

/// Finds out who carries which device.
#[derive(Debug, Clone)]
pub struct Binder {
    radios: Vec<Option<(Radio, [f64; 3])>>,
    ue: Ue,
    /// The last frames, oldest first.
    frames: Vec<Seen>,
    devices: BTreeMap<u64, Device>,
    /// Heard, and not yet compared: a frame of their time is awaited.
    reports: Vec<Report>,
    /// Of the last frame: what devices lost, by access point and track.
    heard: Vec<Heard>,
    skipped: u64,
}

/// What a frame says of everybody's links.
#[derive(Debug, Clone, Default)]
struct Seen {
    time_ns: i64,
    tracks: Vec<u64>,
    places_m: Vec<DVec2>,
    /// By track and access point: power in sight of a device of the usual level, dBm, and the quantiles of its loss, dB.
    links: Vec<(f64, [f64; 3])>,
}

#[derive(Debug, Clone)]
struct Device {
    heard_ns: i64,
    /// The last report of an access point that serves it: when, and which.
    served: Option<(i64, usize)>,
    /// State 0 is nobody; the others are the tracks of `tracks`.
    p: Vec<f64>,
    /// The same, given that most people carry one device.
    told: Vec<f64>,
    tracks: Vec<u64>,
    /// By state and access point.
    levels: Vec<Level>,
    /// By access point: the power itself, as far as nothing but the last reports foretells it.
    powers: Vec<Level>,
}

impl Binder {
    /// Needs the site's access points, their radios and where devices are on a body.
    pub fn new(site: &Site) -> Self {
        Self {
            radios: site.access_points.iter().map(|ap| ap.radio.map(|r| (r, ap.position_m))).collect(),
            ue: site.ue,
            frames: Vec::new(),
            devices: BTreeMap::new(),
            reports: Vec::new(),
            heard: Vec::new(),
            skipped: 0,
        }
    }

    /// Takes what was heard, in any order, up to half a second late. A report of an access point without a radio, of no finite
    /// power, or of a device too many is skipped and counted.
    pub fn hear(&mut self, reports: &[Report]) {
        for report in reports {
            let known = self.radios.get(report.access_point).is_some_and(Option::is_some);
            if known && report.power_dbm.is_finite() && self.reports.len() < WAITING_MAX {
                self.reports.push(*report);
            } else {
                self.skipped += 1;
            }
        }
    }

    /// Everybody has another number from now on.
    ///
    /// ```
    /// use umbracast::{Config, radio::Binder};
    ///
    /// Binder::new(&Config::default().site).renumber(|track| track + 1000);
    /// ```
    pub fn renumber(&mut self, number: impl Fn(u64) -> u64) {
        let of_frames = self.frames.iter_mut().flat_map(|frame| &mut frame.tracks);
        let of_devices = self.devices.values_mut().flat_map(|device| &mut device.tracks);
        of_frames.chain(of_devices).for_each(|track| *track = number(*track));
    }

    /// How many reports were of no use since the start.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Whether no device is known.
    pub(super) fn is_idle(&self) -> bool {
        self.devices.is_empty()
    }

    /// What was compared at the last frame, by access point and track, of devices that are likely with somebody.
    pub(super) fn heard(&self) -> &[Heard] {
        &self.heard
    }

    /// Compares what was heard with a frame's tracks and its losses, in the order of [`Fader::fade`](super::Fader::fade), and tells who may carry what, devices in order, likeliest first.
    pub fn bind(&mut self, time_ns: i64, tracks: &[Track], losses: &[Loss], bindings: &mut Vec<Binding>) {
        bindings.clear();
        self.heard.clear();
        if self.radios.iter().all(Option::is_none) {
            return;
        }
        self.see(time_ns, tracks, losses);
        let seconds = match &self.frames[..] {
            [.., before, now] => (now.time_ns - before.time_ns) as f64 * 1e-9,
            _ => 0.0,
        };
        let heard = self.due(time_ns);
        for report in &heard {
            if self.devices.len() >= DEVICES_MAX && !self.devices.contains_key(&report.device) {
                self.skipped += 1;
                continue;
            }
            let unheard = || Device::new(report.time_ns, self.radios.len());
            let device = self.devices.entry(report.device).or_insert_with(unheard);
            device.heard_ns = device.heard_ns.max(report.time_ns);
            if report.serves {
                device.served = device.served.max(Some((report.time_ns, report.access_point)));
            }
        }
        self.devices.retain(|_, device| time_ns - device.heard_ns < FORGOTTEN_NS);
        let Some(now) = self.frames.last() else { return };
        let moves = moves(now, seconds);
        for (name, device) in &mut self.devices {
            device.follow(&now.tracks, self.radios.len());
            device.exchange(&moves, seconds);
            for of_access_point in of_device(&heard, *name).chunk_by(|a, b| a.access_point == b.access_point)
            {
                device.weigh(of_access_point, &self.frames, self.radios.len());
            }
        }
        share_out(&mut self.devices, now.tracks.len());
        for (name, device) in &self.devices {
            let told = device.tracks.iter().zip(&device.told[1..]).filter(|(_, p)| **p >= LEAST_P);
            let from = bindings.len();
            bindings.extend(told.map(|(&track, &p)| Binding { device: *name, track, p }));
            bindings[from..].sort_by(|a, b| b.p.total_cmp(&a.p).then(a.track.cmp(&b.track)));
            device.note(of_device(&heard, *name), &self.frames, self.radios.len(), &mut self.heard);
        }
        self.heard.sort_by_key(|heard| (heard.access_point, heard.track));
    }

    /// Which access points serve whom, as far as reports said so and it is known who carries their devices.
    ///
    /// ```
    /// use umbracast::{Config, radio::Binder};
    ///
    /// assert_eq!(Binder::new(&Config::default().site).served().count(), 0, "nothing was heard");
    /// ```
    pub fn served(&self) -> impl Iterator<Item = Served> {
        self.devices.values().filter_map(|device| {
            let (heard_ns, access_point) = device.served?;
            let state = (1..device.told.len()).find(|&state| device.told[state] > SERVED_P)?;
            Some(Served { track: device.tracks[state - 1], access_point, heard_ns })
        })
    }

    /// Keeps what a frame says, and of the frames before as many as late reports may ask for.
    fn see(&mut self, time_ns: i64, tracks: &[Track], losses: &[Loss]) {
        let mut seen = Seen::default();
        while self.frames.first().is_some_and(|frame| frame.time_ns < time_ns - LATE_NS) {
            seen = self.frames.remove(0);
        }
        seen.time_ns = time_ns;
        seen.tracks.clear();
        seen.places_m.clear();
        seen.links.clear();
        let people = tracks.iter().filter(|track| track.confirmed).count();
        for (person, track) in tracks.iter().filter(|track| track.confirmed).enumerate() {
            seen.tracks.push(track.id);
            seen.places_m.push(track.position_m);
            let ue_m = self.ue.on_body(track.position_m, track.heading_rad, track.height_m);
            let mut radios = 0;
            for (access_point, radio) in self.radios.iter().enumerate() {
                let Some((radio, place_m)) = radio else {
                    seen.links.push((0.0, [0.0; 3]));
                    continue;
                };
                // Losses come access points with radios first, in the order of confirmed tracks.
                let of_link = |loss: &&Loss| loss.track == track.id && loss.access_point == access_point;
                let loss = losses.get(radios * people + person).filter(of_link);
                let in_sight_dbm = radio.received_dbm(ue_m.distance((*place_m).into()).max(0.1));
                seen.links.push((in_sight_dbm, loss.map_or([0.0; 3], |loss| loss.now_db)));
                radios += 1;
            }
        }
        self.frames.push(seen);
    }

    /// Takes out the reports that frames cover, by device and access point; those too old are skipped.
    fn due(&mut self, time_ns: i64) -> Vec<Report> {
        let oldest_ns = self.frames.first().map_or(time_ns, |frame| frame.time_ns);
        // What is said to be heard long after now will be as little believed then.
        let of_use = |report: &Report| (oldest_ns..=time_ns + LATE_NS).contains(&report.time_ns);
        let before = self.reports.len();
        self.reports.retain(of_use);
        self.skipped += (before - self.reports.len()) as u64;
        let due = |report: &mut Report| report.time_ns <= time_ns;
        let mut due: Vec<Report> = self.reports.extract_if(.., due).collect();
        due.sort_by_key(|report| (report.device, report.access_point, report.time_ns));
        due
    }
}

/// What was heard of one device. Reports are in the order of devices.
fn of_device(reports: &[Report], device: u64) -> &[Report] {
    let from = reports.partition_point(|report| report.device < device);
    &reports[from..from + reports[from..].partition_point(|report| report.device == device)]
}

/// Most people carry one device: a track that is likely another device's is less likely this one's (mean field, a few rounds).
fn share_out(devices: &mut BTreeMap<u64, Device>, tracks: usize) {
    devices.values_mut().for_each(|device| device.told.clone_from(&device.p));
    let mut told = vec![0.0; tracks + 1];
    for _ in 0..ROUNDS {
        let mut free = vec![1.0; tracks + 1];
        for device in devices.values() {
            (1..=tracks).for_each(|state| free[state] *= 1.0 - ONE_DEVICE * device.told[state]);
        }
        for device in devices.values_mut() {
            told[0] = device.p[0];
            (1..=tracks).for_each(|s| told[s] = device.p[s] * free[s] / (1.0 - ONE_DEVICE * device.told[s]));
            let sum: f64 = told.iter().sum();
            // Half way, in logarithms: else two devices of one track leave it together and come back together.
            device.told.iter_mut().zip(&told).for_each(|(old, new)| *old = (*old * new / sum).sqrt());
            let sum: f64 = device.told.iter().sum();
            device.told.iter_mut().for_each(|p| *p /= sum);
        }
    }
}

/// How likely a device comes from one track to another within a frame, as (from, to, probability): only of tracks that are near.
fn moves(now: &Seen, seconds: f64) -> Vec<(usize, usize, f64)> {
    let mut moves = Vec::new();
    for (i, a) in now.places_m.iter().enumerate() {
        for (j, b) in now.places_m.iter().enumerate() {
            let apart = a.distance_squared(*b) / (2.0 * SWAP_M * SWAP_M);
            if i != j && apart < 10.0 {
                moves.push((i + 1, j + 1, SWAP_HZ * seconds * (-apart).exp()));
            }
        }
    }
    moves
}

impl Device {
    fn new(heard_ns: i64, access_points: usize) -> Self {
        Self {
            heard_ns,
            served: None,
            p: vec![1.0],
            told: vec![1.0],
            tracks: Vec::new(),
            levels: vec![Level::UNKNOWN; access_points],
            powers: vec![ANYWHERE; access_points],
        }
    }

    /// Takes over a frame's tracks: who is gone leaves his share to nobody.
    fn follow(&mut self, tracks: &[u64], access_points: usize) {
        if self.tracks == tracks {
            return;
        }
        let (old_p, old_levels) = (std::mem::take(&mut self.p), std::mem::take(&mut self.levels));
        let mut nobody: Vec<(f64, usize)> = vec![(old_p[0], 0)];
        for (state, track) in self.tracks.iter().enumerate() {
            if !tracks.contains(track) {
                nobody.push((old_p[state + 1], state + 1));
            }
        }
        self.p.push(nobody.iter().map(|(p, _)| p).sum());
        for access_point in 0..access_points {
            let of = |&(p, state): &(f64, usize)| (p, old_levels[state * access_points + access_point]);
            self.levels.push(Level::mixed(nobody.iter().map(of)));
        }
        for track in tracks {
            let before = self.tracks.iter().position(|known| known == track).map(|state| state + 1);
            self.p.push(before.map_or(0.0, |state| old_p[state]));
            let from = before.unwrap_or(0) * access_points;
            self.levels.extend_from_slice(&old_levels[from..from + access_points]);
        }
        if self.tracks.is_empty() && !tracks.is_empty() {
            // A device that is heard for the first time, or whose hall was empty, is with anybody.
            let each = self.p[0] * CARRIED / tracks.len() as f64;
            self.p[1..].iter_mut().for_each(|p| *p += each);
            self.p[0] *= 1.0 - CARRIED;
        }
        self.tracks.clear();
        self.tracks.extend_from_slice(tracks);
    }

    /// Lets states exchange probability and levels, as long as a frame is.
    fn exchange(&mut self, near: &[(usize, usize, f64)], seconds: f64) {
        let (states, access_points) = (self.p.len(), self.levels.len() / self.p.len());
        let everybody = (states - 1).max(1) as f64;
        let (lost, found) = (CHANGE_HZ * seconds, if states > 1 { FOUND_HZ * seconds } else { 0.0 });
        let mut leaves = vec![0.0; states];
        let mut comes: Vec<(usize, usize, f64)> = Vec::new();
        for state in 1..states {
            comes.push((state, 0, lost));
            comes.push((0, state, found / everybody));
        }
        comes.extend(near);
        comes.iter().for_each(|&(from, _, share)| leaves[from] += share);
        for power in &mut self.powers {
            power.variance = (power.variance + UNSEEN_DB * UNSEEN_DB * seconds).min(ANYWHERE.variance);
        }
        let (p, levels) = (self.p.clone(), self.levels.clone());
        let stays = |state: usize| (1.0 - leaves[state]).max(0.0);
        let mut parts: Vec<Vec<(f64, usize)>> = (0..states).map(|s| vec![(p[s] * stays(s), s)]).collect();
        comes.iter().for_each(|&(from, to, share)| parts[to].push((p[from] * share, from)));
        for (state, parts) in parts.iter().enumerate() {
            self.p[state] = parts.iter().map(|(p, _)| p).sum();
            for access_point in 0..access_points {
                let of = |&(p, from): &(f64, usize)| (p, levels[from * access_points + access_point]);
                let level = &mut self.levels[state * access_points + access_point];
                *level = Level::mixed(parts.iter().map(of));
                level.variance =
                    (level.variance + WANDERS_DB * WANDERS_DB * seconds).min(Level::UNKNOWN.variance);
            }
        }
    }

    /// Notes what the links of those lost who may well carry the device.
    fn note(&self, reports: &[Report], frames: &[Seen], access_points: usize, heard: &mut Vec<Heard>) {
        for report in reports {
            let Some(around) = Around::new(frames, report.time_ns) else { continue };
            let access_point = report.access_point;
            for (state, &track) in (1..).zip(&self.tracks).filter(|(state, _)| self.told[*state] >= MAY_P) {
                let link_of = |at: usize| at * access_points + access_point;
                let Some([early, late]) = around.links(track, link_of) else { continue };
                let in_sight_dbm = (1.0 - around.share) * early.0 + around.share * late.0;
                let level = self.levels[state * access_points + access_point];
                heard.push(Heard {
                    access_point,
                    track,
                    time_ns: report.time_ns,
                    lost_db: in_sight_dbm + level.mean_db - report.power_dbm,
                    variance: level.variance,
                    p: self.told[state],
                });
            }
        }
    }

    /// Weighs every state by what one access point heard since the last frame, taken as one report.
    fn weigh(&mut self, reports: &[Report], frames: &[Seen], access_points: usize) {
        let Some(first) = reports.first() else { return };
        let count = reports.len() as f64;
        let power_dbm = reports.iter().map(|report| report.power_dbm).sum::<f64>() / count;
        let time_ns = first.time_ns
            + (reports.iter().map(|r| (r.time_ns - first.time_ns) as f64).sum::<f64>() / count) as i64;
        let access_point = first.access_point;
        let unseen = self.powers[access_point].weigh(power_dbm, &[(1.0, 0.0, 0.0)]);
        let around = Around::new(frames, time_ns);
        let mut sum = 0.0;
        for state in 0..self.p.len() {
            let level = &mut self.levels[state * access_points + access_point];
            let track = state.checked_sub(1).map(|track| self.tracks[track]);
            let foreseen = around
                .as_ref()
                .zip(track)
                .and_then(|(around, track)| around.expected(track, |at| at * access_points + access_point));
            let likelihood = foreseen.map_or(unseen, |expected| level.weigh(power_dbm, &expected));
            self.p[state] *= likelihood.powf(COUNTS);
            sum += self.p[state];
        }
        self.p.iter_mut().for_each(|p| *p /= sum);
    }
}

/// The frames before and after an instant, and how near to the later one it lies, from 0 to 1.
struct Around<'a> {
    before: &'a Seen,
    after: &'a Seen,
    share: f64,
}

impl<'a> Around<'a> {
    /// `None` where no frame is as late.
    fn new(frames: &'a [Seen], time_ns: i64) -> Option<Self> {
        let at = frames.iter().position(|frame| frame.time_ns >= time_ns)?;
        let (before, after) = (&frames[at.saturating_sub(1)], &frames[at]);
        let span_ns = (after.time_ns - before.time_ns).max(1);
        let share = ((time_ns - before.time_ns) as f64 / span_ns as f64).clamp(0.0, 1.0);
        Some(Self { before, after, share })
    }

    /// A track's link in the frame before and in that after.
    fn links(&self, track: u64, link_of: impl Fn(usize) -> usize) -> Option<[(f64, [f64; 3]); 2]> {
        let of = |frame: &Seen| {
            let at = frame.tracks.iter().position(|id| *id == track)?;
            Some(frame.links[link_of(at)])
        };
        let (early, late) = (of(self.before), of(self.after));
        Some([early.or(late)?, late.or(early)?])
    }

    /// What a track's device of the usual level would be heard with, as (share, dBm, standard deviation): quantiles of the frame
    /// before and of that after. `link_of` gives the link of the track at a place of a frame. `None` where the track is in neither.
    fn expected(&self, track: u64, link_of: impl Fn(usize) -> usize) -> Option<[(f64, f64, f64); 6]> {
        let [early, late] = self.links(track, link_of)?;
        let mut parts = [(0.0, 0.0, 0.0); 6];
        for (frame, (weight, (in_sight_dbm, losses_db))) in
            [(1.0 - self.share, early), (self.share, late)].into_iter().enumerate()
        {
            let spread_db = (losses_db[2] - losses_db[0]) / 4.0;
            for i in 0..3 {
                parts[3 * frame + i] = (weight * SHARES[i], in_sight_dbm - losses_db[i], spread_db);
            }
        }
        Some(parts)
    }
}

#[cfg(test)]
#[path = "bindings_tests.rs"]
mod tests;
