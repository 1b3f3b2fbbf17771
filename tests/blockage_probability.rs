//! The sampled probability against answers known in closed form.

use umbracast::blockage::body_model::{Arms, BodyModel, Slice};
use umbracast::blockage::{Blockage, Caster, Numbers};
use umbracast::config::BlockageConfig;
use umbracast::forecast::{Coupling, Forecast, Gaussian2};
use umbracast::gait::Gait;
use umbracast::geometry::{Aabb, DVec2, DVec3, Obb};
use umbracast::track::{Observed, Track};
use umbracast::{Config, STEP_S, STEPS};

const HEIGHT_M: f64 = 1.75;

/// One access point at 1 m at the origin; what stage 3 computes with.
struct Setting {
    config: Config,
    numbers: Numbers,
}

/// Bodies of 0.56 m turned towards the access point, of exactly known size and heading.
fn setting(samples: usize) -> Setting {
    let mut config = Config::default();
    config.site.access_points.truncate(1);
    config.site.access_points[0].position_m = [0.0, 0.0, 1.0];
    let share = |half_m: f64| half_m / HEIGHT_M;
    let slice = Slice { top: 1.0, half_depth: share(0.13), half_width: share(0.28), ahead: 0.0, left: 0.0 };
    // Arms within the trunk.
    let arms = Arms {
        shoulder_out: 0.0,
        elbow_out: 0.0,
        hand_out: 0.0,
        upper_radius: 0.01,
        fore_radius: 0.01,
        elbow_swing: 0.0,
        hand_ahead: 0.0,
        hand_swing: 0.0,
        ..BodyModel::shipped().arms
    };
    let numbers = Numbers {
        samples,
        body: BodyModel { slices: vec![slice], sway_left: 0.0, arms, ..BodyModel::shipped() },
        width_sigma: 0.0,
        height_sigma_m: 0.0,
        heading_sigma_rad: 0.0,
        ..Numbers::new(&config.blockage)
    };
    Setting { config, numbers }
}

fn person(id: u64, position_m: DVec2, velocity_mps: DVec2, variance: [f64; 4]) -> (Track, Forecast) {
    let aabb = Aabb {
        min_m: position_m.extend(0.0) - DVec3::new(0.25, 0.25, 0.0),
        max_m: position_m.extend(HEIGHT_M) + DVec3::new(0.25, 0.25, 0.0),
    };
    let mut covariance = [[0.0; 4]; 4];
    (0..4).for_each(|i| covariance[i][i] = variance[i]);
    let track = Track {
        id,
        position_m,
        velocity_mps,
        covariance,
        heading_rad: 0.0,
        heading_sigma_rad: 0.0,
        heading_behind: 0.0,
        height_m: HEIGHT_M,
        height_sigma_m: 0.0,
        width_scale: 1.0,
        width_scale_sigma: 0.0,
        outline_m: Default::default(),
        canopy: None,
        gait: Gait::UNKNOWN,
        points: 30,
        confirmed: true,
        part_of: None,
        aabb,
        obb: Obb::from_aabb(&aabb),
        observed: [Observed { time_ns: 0, position_m, velocity_mps }].into(),
    };
    let mean = |s: usize| position_m + velocity_mps * (STEP_S * (s + 1) as f64);
    let steps = std::array::from_fn(|s| Gaussian2 { mean_m: mean(s), ..Gaussian2::default() });
    (
        track,
        Forecast {
            track: id,
            steps,
            coupling: Coupling { state: covariance, acceleration_psd_m2ps3: [[0.0; 2]; 2] },
        },
    )
}

fn cast(Setting { config, numbers }: &Setting, people: Vec<(Track, Forecast)>) -> Vec<Blockage> {
    let (tracks, forecasts): (Vec<_>, Vec<_>) = people.into_iter().unzip();
    let mut blockages = Vec::new();
    let mut caster = Caster::with_numbers(&config.blockage, numbers.clone(), &config.site);
    caster.cast(&tracks, &forecasts, &mut blockages);
    blockages
}

#[test]
fn without_uncertainty_the_probability_is_zero_or_one() {
    let still = DVec2::ZERO;
    let near = person(1, DVec2::new(4.0, 0.0), still, [0.0; 4]);
    let hidden = person(2, DVec2::new(8.0, 0.1), still, [0.0; 4]);
    let clear = person(3, DVec2::new(8.0, 3.0), still, [0.0; 4]);
    let found = cast(&setting(16), vec![near, hidden, clear]);
    assert_eq!(found.iter().map(|b| b.p_now).collect::<Vec<_>>(), [0.0, 1.0, 0.0]);
    assert_eq!(found.iter().map(|b| b.p[8]).collect::<Vec<_>>(), [0.0, 1.0, 0.0]);
}

#[test]
fn a_person_who_walks_in_blocks_from_the_step_he_arrives_at() {
    // 1 m/s towards the ray from 0.65 m beside it, half width 0.28 m: in the way from step 4 (0.25 m) on.
    let walker = person(1, DVec2::new(4.0, 0.65), DVec2::new(0.0, -1.0), [0.0; 4]);
    let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
    let found = cast(&setting(4), vec![walker, user]);
    assert!(!found[1].blocked_now);
    assert_eq!(found[1].blocked, std::array::from_fn(|w| w + 1 >= 4));
}

#[test]
fn the_share_of_samples_is_the_integral_of_the_gaussian() {
    // Lateral offset 0.28 m with sigma 0.1 m: half of the mass is inside the edge, nearly none passes the other.
    let near = person(1, DVec2::new(4.0, 0.28), DVec2::ZERO, [0.0, 0.01, 0.0, 0.0]);
    let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
    let found = cast(&setting(20_000), vec![near, user]);
    assert!((found[1].p_now - 0.5).abs() < 0.015, "{}", found[1].p_now);
    // One sigma further out: 1 - Phi(1) = 0.1587.
    let near = person(1, DVec2::new(4.0, 0.38), DVec2::ZERO, [0.0, 0.01, 0.0, 0.0]);
    let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
    let found = cast(&setting(20_000), vec![near, user]);
    assert!((found[1].p_now - 0.1587).abs() < 0.015, "{}", found[1].p_now);
}

#[test]
fn the_probability_never_falls_with_the_window() {
    let walker = person(1, DVec2::new(4.0, 0.6), DVec2::new(0.3, -0.8), [0.01, 0.01, 0.04, 0.04]);
    let user = person(2, DVec2::new(8.0, -0.2), DVec2::new(-0.5, 0.4), [0.01, 0.01, 0.04, 0.04]);
    for b in cast(&setting(128), vec![walker, user]) {
        assert!(b.p.is_sorted(), "{:?}", b.p);
    }
}

#[test]
fn standing_still_a_window_is_no_likelier_than_now() {
    // Steps are not independent: a position that is wrong now is as wrong in all steps.
    let near = person(1, DVec2::new(4.0, 0.3), DVec2::ZERO, [0.01, 0.01, 0.0, 0.0]);
    let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.01, 0.01, 0.0, 0.0]);
    let b = cast(&setting(512), vec![near, user])[1];
    assert_eq!(b.p[8], b.p_now);
}

#[test]
fn onset_and_duration_bracket_when_a_walker_enters_and_leaves_the_ray() {
    // As above, in the way from step 4 on, and out of it 0.28 m beyond the ray: at step 10, too late to be told.
    let walker = |y_m: f64| person(1, DVec2::new(4.0, y_m), DVec2::new(0.0, -1.0), [0.0; 4]);
    let user = || person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
    let coming = cast(&setting(4), vec![walker(0.65), user()])[1];
    assert_eq!((coming.onset_s, coming.duration_s), ([Some(4.0 * STEP_S); 3], [None; 3]));
    // 0.05 m before the ray it takes four steps to come out of it.
    let there = cast(&setting(4), vec![walker(0.05), user()])[1];
    assert_eq!((there.onset_s, there.duration_s), ([None; 3], [Some(4.0 * STEP_S); 3]));
}

#[test]
fn who_comes_no_sooner_than_the_last_step_has_no_onset() {
    let walker = person(1, DVec2::new(4.0, 2.0), DVec2::new(0.0, -1.0), [0.0; 4]);
    let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
    let found = cast(&setting(4), vec![walker, user])[1];
    assert_eq!((found.onset_s, found.p[STEPS - 1]), ([None; 3], 0.0));
}

#[test]
fn arms_that_swing_make_a_walker_seen_from_the_side_block_sooner() {
    // He walks across the ray towards it and is 0.33 m away, with a trunk 0.13 m deep: a hand may be in the way.
    let mut setting = setting(256);
    setting.numbers.body.arms = BodyModel::shipped().arms;
    setting.config.site.access_points[0].position_m[2] = 0.7;
    let p_now = |hand_swing: [f64; 2], speed_mps: f64| {
        let setting = Setting { config: setting.config.clone(), numbers: setting.numbers.clone() };
        let (mut track, forecast) = person(1, DVec2::new(4.0, 0.33), DVec2::new(0.0, -speed_mps), [0.0; 4]);
        track.heading_rad = -std::f64::consts::FRAC_PI_2;
        track.gait = Gait { hand_swing, hand_swing_sigma: [0.0; 2], ..Gait::UNKNOWN };
        let user = person(2, DVec2::new(8.0, 0.0), DVec2::ZERO, [0.0; 4]);
        cast(&setting, vec![(track, forecast), user])[1].p_now
    };
    let (swinging, some, standing) = (p_now([0.1; 2], 1.2), p_now([0.1, 0.0], 1.2), p_now([0.1; 2], 0.0));
    assert!(swinging > 0.2 && swinging < 0.9, "{swinging}");
    assert!(some > 0.3 * swinging && some < 0.7 * swinging, "{some} of {swinging}");
    assert_eq!([standing, p_now([0.0; 2], 1.2)], [0.0; 2], "with a hand in each pocket");
}

#[test]
fn a_crowd_sheds_samples_says_so_and_hardly_changes_what_it_tells() {
    let config = Config::default();
    let place = |id: u64| DVec2::from_angle(2.4 * id as f64) * (0.9 * (id as f64).sqrt());
    let velocity = |id: u64| DVec2::from_angle(1.7 * id as f64) * 1.2;
    let everybody = || (0..100).map(|id| person(id, place(id), velocity(id), [0.01, 0.01, 0.04, 0.04]));
    let (tracks, forecasts): (Vec<Track>, Vec<Forecast>) = everybody().unzip();
    let mut caster = Caster::new(&config.blockage, &config.site);
    let (mut all, mut fewer) = (Vec::new(), Vec::new());
    caster.cast(&tracks, &forecasts, &mut all);
    assert!(!caster.took_fewer_samples(), "nobody was there before");
    caster.cast(&tracks, &forecasts, &mut fewer);
    assert!(caster.took_fewer_samples());
    let off: Vec<f64> = all.iter().zip(&fewer).map(|(a, b)| (a.p[2] - b.p[2]).abs()).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    // One sigma of a single one is 0.09 at most.
    assert!(mean > 0.0 && mean < 0.03, "{mean}");
    let mut of_all = Caster::new(&BlockageConfig { samples_min: 128, ..config.blockage }, &config.site);
    let mut again = Vec::new();
    for _ in 0..2 {
        again.clear();
        of_all.cast(&tracks, &forecasts, &mut again);
        assert!(!of_all.took_fewer_samples(), "nobody allowed it to");
    }
    assert_eq!(again, all);
}
