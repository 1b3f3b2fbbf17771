//! The power that access points hear of every device, as a network reports it: on a grid of 20 ms, in whole dB, with noise, and late.

use rand_distr::{Distribution, StandardNormal};
use umbracast::Site;
use umbracast::radio::Report;
use umbracast_sim::random::stream;

use crate::device::{REPORT_NOISE_DB, REPORT_TICKS};
use crate::truth::{TICK_NS, TICK_S, Traces};

/// Reports come so much later than they were heard.
pub const LATE_NS: i64 = 100_000_000;
/// Standard deviation of the gain of one device toward one access point, dB: antennas, hands and pockets differ. The predictor does not
/// know it.
const GAIN_DB: f64 = 3.0;
/// The same of what changes as the device is moved, and how long that stays alike.
const CHANGING_DB: f64 = 1.0;
const CHANGING_S: f64 = 2.0;

/// All reports of a scene, in order of time. `device_of` names each person's device.
pub fn of_scene(site: &Site, traces: &Traces, seed: u64, device_of: impl Fn(usize) -> u64) -> Vec<Report> {
    let mut reports = Vec::new();
    for person in 0..traces.people {
        let mut random = stream(seed, "power heard", person as u64);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        for (access_point, ap) in site.access_points.iter().enumerate() {
            let Some(radio) = ap.radio else { continue };
            let (gain_db, mut changing_db) = (GAIN_DB * normal(), CHANGING_DB * normal());
            let alike = (-(REPORT_TICKS as f64) * TICK_S / CHANGING_S).exp();
            for tick in (0..traces.ticks).step_by(REPORT_TICKS) {
                changing_db = alike * changing_db + CHANGING_DB * (1.0 - alike * alike).sqrt() * normal();
                let length_m = traces.length_m(tick, access_point, person);
                // Who has no body yet has no link.
                if length_m <= 0.0 {
                    continue;
                }
                let power_dbm = radio.received_dbm(length_m) - traces.loss_db(tick, access_point, person)
                    + gain_db
                    + changing_db
                    + REPORT_NOISE_DB * normal();
                let (time_ns, device) = (tick as i64 * TICK_NS, device_of(person));
                let power_dbm = power_dbm.round();
                reports.push(Report { time_ns, access_point, device, power_dbm, serves: false });
            }
        }
    }
    reports.sort_by_key(|report| report.time_ns);
    reports
}

/// Takes those reports of a scene that have arrived at an instant from the front of those that have not.
pub fn take_arrived<'a>(waiting: &mut &'a [Report], time_ns: i64) -> &'a [Report] {
    let count = waiting.iter().take_while(|report| report.time_ns + LATE_NS <= time_ns).count();
    let (arrived, still_waiting) = waiting.split_at(count);
    *waiting = still_waiting;
    arrived
}
