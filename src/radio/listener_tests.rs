use super::*;
use crate::config::BlockageMethod;
use crate::geometry::DVec2;
use crate::radio::Report;
use crate::site::{Radio, Ue};
use crate::{Config, Pipeline, STEP_NS};

const REPORT_NS: i64 = 20_000_000;

fn config() -> Config {
    let mut config = Config::default();
    config.site.access_points.truncate(1);
    config.site.access_points[0].position_m = [14.0, 0.0, 3.0];
    config.site.access_points[0].radio = Some(Radio::default());
    config.site.ue = Ue { forward_m: 0.3, left_m: -0.2, height_share: 0.6, spread_m: 0.1 };
    config
}

/// One frame: people who walk at these places and velocities, and each one's device heard with so many dB less than in sight.
fn step<'a>(
    pipeline: &'a mut Pipeline,
    frame: i64,
    ways: &[(DVec2, DVec2)],
    lost_db: &[Option<f64>],
) -> &'a [Blockage] {
    let now_ns = frame * STEP_NS;
    let ap_m = DVec2::new(14.0, 0.0);
    for (device, (lost_db, (place_m, _))) in (0..).zip(lost_db.iter().zip(ways)) {
        let in_sight_dbm = Radio::default().received_dbm(place_m.distance(ap_m));
        let report = |k: i64| Report {
            time_ns: now_ns - STEP_NS - k * REPORT_NS,
            access_point: 0,
            device,
            power_dbm: in_sight_dbm - lost_db.unwrap_or_default(),
            serves: false,
        };
        let reports: Vec<Report> = (0..5).map(report).filter(|report| report.time_ns >= 0).collect();
        pipeline.hear(if lost_db.is_some() { &reports } else { &[] });
    }
    let track =
        |(id, (place_m, velocity_mps)): (u64, &(DVec2, DVec2))| Track::new(id, *place_m, *velocity_mps);
    let tracks: Vec<Track> = (0..).zip(ways).map(track).collect();
    &pipeline.step_tracks(frame as u64, now_ns, &tracks).blockages
}

/// Somebody who walks toward the access point, the device before the body.
fn walks(frame: i64, from_m: DVec2) -> (DVec2, DVec2) {
    let velocity_mps = DVec2::new(1.2, 0.0);
    (from_m + velocity_mps * 0.1 * frame as f64, velocity_mps)
}

fn any_now(blockage: &Blockage) -> f64 {
    blockage.any.map_or(f64::NAN, |any| any.p_now)
}

#[test]
fn a_link_that_is_heard_to_be_cut_is_told_so_until_the_reports_end() {
    let mut pipeline = Pipeline::new(&config(), None).expect("a site that works");
    let mut told = Vec::new();
    for frame in 1..70 {
        let lost_db = if frame < 40 { Some(0.0) } else { Some(15.0).filter(|_| frame < 50) };
        let alone = [walks(frame, DVec2::new(0.0, 0.0))];
        told.push(any_now(&step(&mut pipeline, frame, &alone, &[lost_db])[0]));
    }
    let at = |frame: usize| told[frame - 1];
    assert!(at(39) < 0.1, "in sight: {:.3}", at(39));
    assert!(at(43) > 0.65 && at(49) > 0.65, "a hand before it: {:.3}, {:.3}", at(43), at(49));
    assert!(at(69) < 0.2, "and nothing was heard for two seconds: {:.3}", at(69));
}

#[test]
fn a_link_that_is_heard_in_sight_is_not_told_blocked_whatever_stands_there() {
    let [mut deaf, mut hears] = [(); 2].map(|()| Pipeline::new(&config(), None).expect("a site that works"));
    for frame in 1..70 {
        // Who walks behind comes into line with who walks in front, and is heard less, four times: whose device is whose is known.
        // Then once more, and nothing is heard of it: a body that is narrower than was thought.
        let in_line = frame / 7 % 2 == 1;
        let ways = [
            walks(frame, DVec2::new(0.0, if in_line { 0.2 } else { 1.5 })),
            walks(frame, DVec2::new(1.0, 0.0)),
        ];
        let lost_db = if in_line && frame < 60 { 15.0 } else { 0.0 };
        let unheard = step(&mut deaf, frame, &ways, &[None, None])[0];
        let heard = step(&mut hears, frame, &ways, &[Some(lost_db), Some(0.0)])[0];
        if frame > 65 {
            assert!(any_now(&unheard) > 0.5, "{:.3}", any_now(&unheard));
            assert!(any_now(&heard) < 0.5 * any_now(&unheard), "{:.3} {:.3}", heard.p_now, any_now(&heard));
        }
    }
}

#[test]
fn any_cause_is_as_likely_as_each_of_them_and_windows_never_fall() {
    let mut pipeline = Pipeline::new(&config(), None).expect("a site that works");
    for frame in 1..120 {
        let ways =
            [walks(frame, DVec2::new(-4.0, 0.0)), walks(frame, DVec2::new(-3.0, 3.0 - 0.05 * frame as f64))];
        let lost_db = [Some(if frame / 7 % 3 == 0 { 12.0 } else { 1.0 }), Some(f64::from(frame as i32 % 5))];
        for link in step(&mut pipeline, frame, &ways, &lost_db) {
            let others = Chance { p_now: link.p_now, p: link.p };
            let any = link.any.expect("a device in a hand");
            for cause in [Some(others), link.own, link.hall].into_iter().flatten() {
                assert!(cause.p_now <= any.p_now + 1e-9, "{frame}: {cause:?} {any:?}");
                assert!(
                    cause.p.iter().zip(&any.p).all(|(p, any)| *p <= any + 1e-9),
                    "{frame}: {cause:?} {any:?}"
                );
                assert!(
                    (0.0..=1.0).contains(&cause.p_now) && cause.p.iter().all(|p| (0.0..=1.0).contains(p))
                );
                assert!(cause.p.is_sorted(), "{frame}: {cause:?}");
            }
            assert!(any.p_now <= 1.0 && any.p.is_sorted() && any.p[8] <= 1.0, "{frame}: {any:?}");
        }
    }
}

#[test]
fn the_authors_method_says_the_same_whatever_is_heard() {
    let mut config = config();
    config.blockage.method = BlockageMethod::Algorithm1;
    let [mut deaf, mut hears] = [(); 2].map(|()| Pipeline::new(&config, None).expect("a site that works"));
    for frame in 1..40 {
        let ways = [walks(frame, DVec2::new(0.0, 0.2)), walks(frame, DVec2::new(1.0, 0.0))];
        let unheard = step(&mut deaf, frame, &ways, &[None, None]).to_vec();
        assert_eq!(step(&mut hears, frame, &ways, &[Some(20.0), Some(0.0)]), unheard);
    }
}

#[test]
fn states_exchange_what_they_lose() {
    let mut states = [0.2, 0.7, 0.1];
    for _ in 0..50 {
        let next = moved(states, 0.1, 0.1);
        assert!((next.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        states = next;
    }
    assert!((states[1] - states[2]).abs() < 1e-3 && states[0] > 0.85, "{states:?}");
}
