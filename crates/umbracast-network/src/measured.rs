//! Losses told beside those that a network measured: recordings of LiDARs with reports of power.
//!
//! Nobody tells who carries a device, nor how loud it is in sight. The binder says the one; the other is the median, for each device and
//! access point, of how much louder than Friis' equation a device was heard while its link was foreseen to be clear.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::{Value, json};
use umbracast::geometry::DVec3;
use umbracast::radio::Report;
use umbracast::{Outcome, STEP_NS, STEPS, Site};

/// A device is of somebody who carries it with this probability or more.
const BOUND_P: f64 = 0.9;
/// A link is clear where the 90 % quantile of its loss is below this, dB.
const CLEAR_DB: f64 = 1.0;
/// Fewer clear reports tell no level.
const CLEAR_REPORTS: usize = 50;
/// What is compared: now, and these steps ahead.
pub const STEPS_AHEAD: [usize; 3] = [0, 3, 5];
/// The window of what is told of outages.
const WINDOW: usize = 3;
/// A link is told to go out from this probability on.
const LIKELY: f64 = 0.5;

/// What one frame told of the link of a bound device.
#[derive(Debug, Clone, Copy)]
struct Told {
    /// Power in sight of a device of the usual level, dBm.
    in_sight_dbm: f64,
    /// Now, then at each step: quantiles of the loss, dB.
    loss_db: [[f64; 3]; 1 + STEPS],
    p_out: f64,
}

/// Collects a recording frame by frame, then compares.
#[derive(Debug, Clone, Default)]
pub struct Measured {
    reports: Vec<Report>,
    /// By device and access point, then by the frame's time.
    told: BTreeMap<(u64, usize), BTreeMap<i64, Told>>,
}

/// How well what was told fits what was measured.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fit {
    /// Devices and access points whose level in sight was learned.
    pub links: u64,
    /// Reports of them.
    pub reports: u64,
    /// By step ahead: reports that count, for either loss is above half the margin.
    pub count: [u64; 3],
    /// By step ahead: sums of squared differences of the median told, dB^2.
    pub squares_db2: [f64; 3],
    /// By step ahead: how many lie within the 10 and 90 % told.
    pub within: [u64; 3],
    /// Frames with the link in sight that were told to go out within 300 ms, that went out, and both.
    pub outages: [u64; 3],
}

impl Measured {
    /// Takes a frame's outcome, and what was heard before it.
    pub fn take(&mut self, site: &Site, heard: &[Report], outcome: &Outcome) {
        self.reports.extend_from_slice(heard);
        // Devices in order, the likeliest person first.
        let mut device = None;
        for binding in &outcome.bindings {
            let is_first = device.replace(binding.device) != Some(binding.device);
            if !is_first || binding.p < BOUND_P {
                continue;
            }
            let Some(track) = outcome.tracks.iter().find(|track| track.id == binding.track) else { continue };
            let ue_m = site.ue_m(track.position_m, track.heading_rad, track.height_m);
            for loss in outcome.losses.iter().filter(|loss| loss.track == track.id) {
                let ap = &site.access_points[loss.access_point];
                let Some(radio) = ap.radio else { continue };
                let in_sight_dbm = radio.received_dbm(ue_m.distance(DVec3::from(ap.position_m)).max(0.1));
                let mut loss_db = [loss.now_db; 1 + STEPS];
                loss_db[1..].copy_from_slice(&loss.steps_db);
                let told = Told { in_sight_dbm, loss_db, p_out: loss.p_out[WINDOW - 1] };
                self.told
                    .entry((binding.device, loss.access_point))
                    .or_default()
                    .insert(outcome.time_ns, told);
            }
        }
    }

    /// Compares all that was taken.
    pub fn fit(&self, site: &Site) -> Fit {
        let mut of_link: BTreeMap<(u64, usize), Vec<Report>> = BTreeMap::new();
        for report in &self.reports {
            of_link.entry((report.device, report.access_point)).or_default().push(*report);
        }
        let mut fit = Fit::default();
        for (key, reports) in &mut of_link {
            let radio = site.access_points.get(key.1).and_then(|ap| ap.radio);
            if let (Some(told), Some(radio)) = (self.told.get(key), radio) {
                reports.sort_by_key(|report| report.time_ns);
                fit.add(told, reports, radio.margin_db);
            }
        }
        fit
    }
}

impl Fit {
    fn add(&mut self, told: &BTreeMap<i64, Told>, reports: &[Report], margin_db: f64) {
        let of_frame = |time_ns: i64| told.range(time_ns - STEP_NS / 2..time_ns + STEP_NS / 2).next();
        let louder_db = |report: &Report| {
            let (_, told) = of_frame(report.time_ns)?;
            (told.loss_db[0][2] < CLEAR_DB).then_some(report.power_dbm - told.in_sight_dbm)
        };
        let mut levels_db: Vec<f64> = reports.iter().filter_map(louder_db).collect();
        if levels_db.len() < CLEAR_REPORTS {
            return;
        }
        let middle = levels_db.len() / 2;
        let level_db = *levels_db.select_nth_unstable_by(middle, f64::total_cmp).1;
        self.links += 1;
        self.reports += reports.len() as u64;
        let mut lost_db: Vec<(i64, f64)> = Vec::new();
        for report in reports {
            let Some((_, now)) = of_frame(report.time_ns) else { continue };
            let loss_db = now.in_sight_dbm + level_db - report.power_dbm;
            lost_db.push((report.time_ns, loss_db));
            for (ahead, step) in STEPS_AHEAD.into_iter().enumerate() {
                let Some((_, then)) = of_frame(report.time_ns - step as i64 * STEP_NS) else { continue };
                let [low_db, median_db, high_db] = then.loss_db[step];
                if loss_db.max(median_db) < 0.5 * margin_db {
                    continue;
                }
                self.count[ahead] += 1;
                self.squares_db2[ahead] += (loss_db - median_db).powi(2);
                self.within[ahead] += u64::from((low_db..=high_db).contains(&loss_db));
            }
        }
        for (&time_ns, frame) in told {
            let until_ns = time_ns + WINDOW as i64 * STEP_NS;
            let from = lost_db.partition_point(|(at_ns, _)| *at_ns < time_ns);
            let mut within = lost_db[from..].iter().take_while(|(at_ns, _)| *at_ns <= until_ns).peekable();
            // Nobody knows of a link that is out already, or of which nothing was heard.
            if within.peek().is_none_or(|(_, loss_db)| *loss_db >= margin_db) {
                continue;
            }
            let (is_told, goes_out) = (frame.p_out >= LIKELY, within.any(|(_, db)| *db >= margin_db));
            for (count, counts) in self.outages.iter_mut().zip([is_told, goes_out, is_told && goes_out]) {
                *count += u64::from(counts);
            }
        }
    }

    /// Of several recordings.
    pub fn sum(all: &[Self]) -> Self {
        let mut sum = Self::default();
        for one in all {
            sum.links += one.links;
            sum.reports += one.reports;
            for ahead in 0..STEPS_AHEAD.len() {
                sum.count[ahead] += one.count[ahead];
                sum.squares_db2[ahead] += one.squares_db2[ahead];
                sum.within[ahead] += one.within[ahead];
                sum.outages[ahead] += one.outages[ahead];
            }
        }
        sum
    }

    /// Root of the mean squared difference of a step ahead, dB.
    pub fn rmse_db(&self, ahead: usize) -> f64 {
        (self.squares_db2[ahead] / self.count[ahead].max(1) as f64).sqrt()
    }

    /// The share of measured losses within the 10 and 90 % told.
    pub fn coverage(&self, ahead: usize) -> f64 {
        self.within[ahead] as f64 / self.count[ahead].max(1) as f64
    }

    /// Of links in sight that go out within 300 ms.
    pub fn f1(&self) -> f64 {
        let [told, true_, both] = self.outages;
        2.0 * both as f64 / (told + true_).max(1) as f64
    }

    /// As a table.
    pub fn to_text(&self) -> String {
        let mut text = format!("links with a level {}, reports {}\n", self.links, self.reports);
        for (ahead, step) in STEPS_AHEAD.into_iter().enumerate() {
            let _ = writeln!(
                text,
                "{} ms ahead: RMSE of the median told {:.2} dB, within 10 to 90 % {:.3}, of {} reports with either above half the margin",
                100 * step,
                self.rmse_db(ahead),
                self.coverage(ahead),
                self.count[ahead]
            ); // To a string.
        }
        let [told, true_, both] = self.outages;
        let f1 = self.f1();
        text + &format!(
            "out within 300 ms, in sight now: F1 {f1:.3} ({both} frames told and true, {told} told, {true_} true)\n"
        )
    }

    /// The same as JSON.
    pub fn to_json(&self) -> Value {
        let ahead = |ahead: usize| {
            json!({ "ms": 100 * STEPS_AHEAD[ahead], "rmse_db": self.rmse_db(ahead), "coverage": self.coverage(ahead),
                    "reports": self.count[ahead] })
        };
        let [told, true_, both] = self.outages;
        json!({ "links": self.links, "reports": self.reports, "ahead": [ahead(0), ahead(1), ahead(2)],
                "f1_out_300_ms": self.f1(), "told": told, "true": true_, "both": both })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fade_that_was_told_is_found_in_reports_of_any_level() {
        let told = |step_of_fade: usize, p_out: f64| {
            let mut loss_db = [[0.0; 3]; 1 + STEPS];
            if step_of_fade <= STEPS {
                loss_db[step_of_fade] = [10.0, 15.0, 20.0];
            }
            Told { in_sight_dbm: -50.0, loss_db, p_out }
        };
        // Frame 10 is a fade of 14 dB; it was told from frame 7 on, and the device is 4 dB louder than usual.
        let frames: BTreeMap<i64, Told> = (0..20_usize)
            .map(|k| {
                let (steps, soon) = (10_usize.wrapping_sub(k), (7..10).contains(&k));
                (k as i64 * STEP_NS, told(if k >= 7 { steps } else { STEPS + 1 }, f64::from(u8::from(soon))))
            })
            .collect();
        let report = |k: i64| Report {
            time_ns: k * STEP_NS / 5,
            access_point: 0,
            device: 1,
            // The frame that is nearest.
            power_dbm: if (k + 2) / 5 == 10 { -60.0 } else { -46.0 },
            serves: false,
        };
        let reports: Vec<Report> = (0..95).map(report).collect();
        let mut fit = Fit::default();
        fit.add(&frames, &reports, 10.0);
        assert_eq!((fit.links, fit.reports), (1, 95));
        assert_eq!((fit.rmse_db(1), fit.count[1], fit.coverage(1)), (1.0, 5, 1.0), "{fit:?}");
        let [told, true_, both] = fit.outages;
        assert_eq!((told, both), (3, 3), "{fit:?}");
        assert!((3..=4).contains(&true_), "{fit:?}");
    }
}
