use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Config;
use crate::radio::links::tests::somebody;
use crate::site::AccessPoint;

const PEOPLE: u64 = 8;
const FRAME_NS: i64 = 100_000_000;
/// Between two reports of one access point.
const REPORT_NS: i64 = 20_000_000;
/// So much later the reports come.
const LATE: i64 = 1;

fn site() -> Site {
    let mut site = Config::default().site;
    let place = |(i, [x, y]): (usize, [f64; 2])| AccessPoint {
        name: format!("ap{i}"),
        position_m: [x, y, 3.0],
        radio: Some(Radio::default()),
    };
    site.access_points =
        [[14.0, 0.0], [0.0, 14.0], [-14.0, 0.0], [0.0, -14.0]].into_iter().enumerate().map(place).collect();
    site
}

/// Eight people on two circles, opposite to each other; those on the inner one go the other way about.
fn place_m(person: u64, time_ns: i64) -> DVec2 {
    let (radius_m, turn) = if person.is_multiple_of(2) { (8.0, 0.15) } else { (7.4, -0.12) };
    let angle = person as f64 * std::f64::consts::TAU / PEOPLE as f64 + turn * time_ns as f64 * 1e-9;
    radius_m * DVec2::from_angle(angle)
}

/// Half a second in every three, person by person, something stands between one access point and one person.
fn loss_db(person: u64, access_point: usize, time_ns: i64) -> f64 {
    let phase = (time_ns / 500_000_000 + 2 * person as i64 + access_point as i64).rem_euclid(6);
    if phase == 0 { 14.0 } else { 0.0 }
}

/// A hall that is heard for some seconds. `named` gives the track of a person at a time, `None` where he is not followed.
fn heard(seconds: i64, named: impl Fn(u64, i64) -> Option<u64>) -> (Binder, Vec<Binding>) {
    let site = site();
    let mut random = Pcg64::seed_from_u64(11);
    let mut noise = move |most: f64| random.random_range(-most..most);
    let gains_db: Vec<f64> = (0..PEOPLE * 4).map(|_| noise(6.0)).collect();
    let (mut binder, mut bindings) = (Binder::new(&site), Vec::new());
    for frame in 0..seconds * 10 {
        let now_ns = frame * FRAME_NS;
        let mut tracks = Vec::new();
        let mut losses = Vec::new();
        let mut reports = Vec::new();
        for person in 0..PEOPLE {
            let Some(id) = named(person, now_ns) else { continue };
            tracks.push(somebody(id, place_m(person, now_ns), DVec2::ZERO));
            for access_point in 0..4 {
                let db = loss_db(person, access_point, now_ns);
                losses.push(Loss { now_db: [0.7 * db, db, 1.3 * db], ..Loss::clear(access_point, id) });
            }
        }
        for (person, access_point) in (0..PEOPLE).flat_map(|person| (0..4).map(move |ap| (person, ap))) {
            for k in 0..FRAME_NS / REPORT_NS {
                let time_ns = now_ns - LATE * FRAME_NS + k * REPORT_NS;
                let ue_m = site.ue.on_body(place_m(person, time_ns), 0.0, 1.75);
                let m = ue_m.distance(site.access_points[access_point].position_m.into());
                let power_dbm = Radio::default().received_dbm(m) - loss_db(person, access_point, time_ns)
                    + gains_db[(person * 4) as usize + access_point]
                    + noise(1.0);
                // Names of devices say nothing of ids of tracks.
                reports.push(Report {
                    time_ns,
                    access_point,
                    device: 900 - person,
                    power_dbm: power_dbm.round(),
                    // Served by the access point of his own number.
                    serves: access_point as u64 == person % 4,
                });
            }
        }
        tracks.sort_by_key(|track| track.id);
        losses.sort_by_key(|loss| (loss.access_point, loss.track));
        binder.hear(&reports);
        binder.bind(now_ns, &tracks, &losses, &mut bindings);
    }
    (binder, bindings)
}

/// The likeliest track of a person's device, and how likely.
fn carrier(bindings: &[Binding], person: u64) -> Option<(u64, f64)> {
    bindings.iter().find(|binding| binding.device == 900 - person).map(|binding| (binding.track, binding.p))
}

#[test]
fn devices_are_found_on_those_who_carry_them_after_a_blind_start() {
    let (binder, bindings) = heard(10, |person, _| Some(person));
    for person in 0..PEOPLE {
        let (track, p) = carrier(&bindings, person).unwrap();
        assert!(track == person && p > 0.9, "device of {person}: {track} with {p}");
    }
    let sums = bindings.chunk_by(|a, b| a.device == b.device).map(|of| of.iter().map(|b| b.p).sum::<f64>());
    assert!(sums.into_iter().all(|sum| sum < 1.0 + 1e-9));
    let served: Vec<(u64, usize)> = binder.served().map(|of| (of.track, of.access_point)).collect();
    let mut expected: Vec<(u64, usize)> = (0..PEOPLE).map(|person| (person, person as usize % 4)).collect();
    expected.reverse(); // Devices are numbered the other way round.
    assert_eq!(served, expected);
    // Those before the first frame.
    assert_eq!(binder.skipped(), PEOPLE * 4 * 5);
}

#[test]
fn a_device_stays_with_its_person_where_two_tracks_are_swapped() {
    // Persons 0 and 1 are swapped for good where they pass each other; the others keep theirs.
    let meet_ns = (0..100).map(|k| k * FRAME_NS).min_by(|a, b| {
        let apart = |t: i64| place_m(0, t).distance(place_m(1, t));
        apart(*a).total_cmp(&apart(*b))
    });
    let meet_ns = meet_ns.unwrap();
    let swapped = |person: u64, time_ns: i64| match person {
        0 | 1 if time_ns > meet_ns => Some(1 - person),
        _ => Some(person),
    };
    let (_, bindings) = heard(meet_ns / 1_000_000_000 + 10, swapped);
    for (person, track) in [(0, 1), (1, 0), (2, 2), (3, 3)] {
        assert_eq!(carrier(&bindings, person).map(|(track, _)| track), Some(track), "device of {person}");
    }
}

#[test]
fn a_device_is_found_again_whose_person_was_lost_and_found_under_another_id() {
    let lost = |person: u64, time_ns: i64| match (person, time_ns / 1_000_000_000) {
        (3, 12) => None,
        (3, 13..) => Some(70),
        _ => Some(person),
    };
    let (_, found) = heard(20, lost);
    assert!(carrier(&found, 3).is_some_and(|(track, p)| track == 70 && p > 0.9), "{:?}", carrier(&found, 3));
}

#[test]
fn broken_reports_are_counted_and_cost_nobody_anything() {
    let mut binder = Binder::new(&site());
    let whole = Report { time_ns: 0, access_point: 0, device: 1, power_dbm: -60.0, serves: false };
    let year_ns = 365 * 86_400 * 1_000_000_000;
    binder.hear(&[
        Report { access_point: 9, ..whole },
        Report { power_dbm: f64::NAN, ..whole },
        Report { time_ns: year_ns, ..whole },
        Report { time_ns: -year_ns, ..whole },
        whole,
    ]);
    let mut bindings = Vec::new();
    binder.bind(0, &[somebody(7, DVec2::ZERO, DVec2::ZERO)], &[], &mut bindings);
    assert_eq!(binder.skipped(), 4);
    assert!(bindings.iter().all(|binding| binding.device == 1 && binding.p.is_finite()), "{bindings:?}");
}

#[test]
fn one_batch_of_devices_too_many_is_skipped_beyond_those_that_are_followed() {
    let (mut binder, mut bindings) = (Binder::new(&site()), Vec::new());
    let report = |device| Report { time_ns: 0, access_point: 0, device, power_dbm: -60.0, serves: false };
    let many: Vec<Report> = (0..2 * DEVICES_MAX as u64).map(report).collect();
    binder.hear(&many);
    binder.bind(0, &[somebody(1, DVec2::ZERO, DVec2::ZERO)], &[Loss::clear(0, 1)], &mut bindings);
    assert_eq!((binder.devices.len(), binder.skipped()), (DEVICES_MAX, DEVICES_MAX as u64));
    let flood = vec![report(7); WAITING_MAX + 5];
    binder.hear(&flood);
    assert_eq!(binder.skipped(), DEVICES_MAX as u64 + 5);
}
