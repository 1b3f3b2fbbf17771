use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Config;
use crate::blockage::body::blocks;
use crate::blockage::counts::quantiles_s;
use crate::blockage::{Caster, Chance};
use crate::forecast::constant_velocity;
use crate::gait::Gait;
use crate::geometry::{Aabb, DVec2, DVec3, Obb};
use crate::site::{AccessPoint, Pillar, Radio};
use crate::track::Canopy;

#[test]
fn quantiles_count_those_who_come_later_than_the_last_step() {
    // Of ten, one at step 2, five at step 4, the rest never.
    let mut counts = [0; MOMENTS];
    (counts[2], counts[4]) = (1, 5);
    assert_eq!(quantiles_s(&counts.map(f64::from), 10.0), [Some(0.2), Some(0.4), None]);
    assert_eq!(quantiles_s(&[0.0; MOMENTS], 0.0), [None; 3]);
}

/// Somebody anywhere within 8 m of the middle, who walks, stands or hurries.
fn somebody(id: u64, random: &mut Pcg64) -> Track {
    let mut within = |most: f64| random.random_range(-most..most);
    let (position_m, velocity_mps) =
        (DVec2::new(within(8.0), within(8.0)), DVec2::new(within(1.5), within(1.5)));
    let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE };
    let mut covariance = [[0.0; 4]; 4];
    let spread = [0.002, 0.003, 0.02, 0.03].map(|variance| variance * (1.0 + within(0.9)));
    (0..4).for_each(|i| covariance[i][i] = spread[i]);
    Track {
        id,
        position_m,
        velocity_mps: if id.is_multiple_of(4) { DVec2::ZERO } else { velocity_mps },
        covariance,
        heading_rad: within(3.0),
        heading_sigma_rad: 0.3,
        heading_behind: 0.0,
        height_m: 1.7 + within(0.3),
        height_sigma_m: 0.03,
        width_scale: 1.0 + within(0.1),
        width_scale_sigma: 0.05,
        outline_m: Default::default(),
        canopy: None,
        gait: Gait {
            phase_rad: within(3.0),
            concentration: 1.0 + within(1.0),
            hand_swing: [0.1 + within(0.1), 0.1 + within(0.1)],
            ..Gait::UNKNOWN
        },
        points: 30,
        confirmed: true,
        part_of: None,
        aabb,
        obb: Obb::from_aabb(&aabb),
        observed: Default::default(),
    }
}

/// Bits of the steps at which a link is blocked in a sample: everybody asked, one ray at a time.
fn one_by_one(sampler: &Sampler, numbers: &Numbers, ue: &Ue, ap_m: DVec3, q: usize, k: usize) -> u16 {
    let people = &sampler.people[..sampler.present];
    let posture = |p: &Trajectories, step: usize| p.posture(&sampler.draws[&p.track], step, k);
    let q_at = |step: usize| {
        let (ue, q) = (people[q].device_of(ue, k), posture(&people[q], step));
        ue.on_body(q.position_m, q.ahead.to_angle(), q.height_m)
    };
    let others = || people.iter().enumerate().filter(|(other, _)| *other != q).map(|(_, p)| p);
    let blocked = |step: usize| others().any(|p| blocks(&numbers.body, &posture(p, step), ap_m, q_at(step)));
    (0..MOMENTS).fold(0, |bits, step| bits | u16::from(blocked(step)) << step)
}

/// The same of the owner's body and of the hall's pillars.
fn causes(
    sampler: &Sampler,
    numbers: &Numbers,
    ue: &Ue,
    site: &Site,
    ap_m: DVec3,
    q: usize,
    k: usize,
) -> [u16; 2] {
    let (person, mut bits) = (&sampler.people[q], [0; 2]);
    for step in 0..MOMENTS {
        let posture = person.posture(&sampler.draws[&person.track], step, k);
        let held = person.device_of(ue, k);
        let ue_m = held.on_body(posture.position_m, posture.ahead.to_angle(), posture.height_m);
        if !ue.is_on_axis() {
            bits[0] |= u16::from(blocks(&numbers.body, &posture, ap_m, ue_m)) << step;
        }
        for pillar in &site.pillars {
            let (from, along) = (ap_m.truncate(), (ue_m - ap_m).truncate());
            let axis_m = DVec2::from_array(pillar.position_m);
            let share = ((axis_m - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let near = axis_m.distance(from + along * share) <= pillar.radius_m;
            bits[1] |= u16::from(near) << step;
        }
    }
    bits
}

fn chance_of(bits: &[u16]) -> Chance {
    let share = |steps: u16| bits.iter().filter(|&&at| at & steps != 0).count() as f64 / bits.len() as f64;
    Chance { p_now: share(1), p: std::array::from_fn(|w| share((1 << (w + 2)) - 2)) }
}

/// The chances as they are defined, from the bits of all samples.
fn chances_of(bits: &[u16], threshold: f64) -> Chances {
    let share = |steps: u16| bits.iter().filter(|&&at| at & steps != 0).count() as f64 / bits.len() as f64;
    let all = (1_u16 << MOMENTS) - 1;
    let of = |chosen: &dyn Fn(u16) -> bool, first: &dyn Fn(u16) -> u32| {
        let (mut counts, mut total) = ([0.0; MOMENTS], 0.0);
        for &at in bits.iter().filter(|&&at| chosen(at)) {
            total += 1.0;
            counts.get_mut(first(at) as usize).into_iter().for_each(|count| *count += 1.0);
        }
        quantiles_s(&counts, total)
    };
    let p_now = share(1);
    let onset_s = of(&|at| at & 1 == 0, &|at| at.trailing_zeros());
    let again = |at: u16| (!at & all & (u16::MAX << at.trailing_zeros())).trailing_zeros();
    let blocked_now = p_now >= threshold;
    Chances {
        p_now,
        blocked_now,
        p: std::array::from_fn(|w| share((1 << (w + 2)) - 2)),
        onset_s: if blocked_now { [None; 3] } else { onset_s },
        duration_s: match (blocked_now, onset_s[0]) {
            (true, _) => of(&|at| at & 1 == 1, &|at| (!at & all).trailing_zeros()),
            (false, Some(_)) => of(&|at| at & 1 == 0 && at != 0, &again),
            (false, None) => [None; 3],
        },
        own: None,
        hall: None,
        any: None,
    }
}

#[test]
fn chances_are_those_of_every_body_and_ray_asked_one_by_one() {
    const THRESHOLD: f64 = 0.47;
    let config = Config::default();
    let mut random = Pcg64::seed_from_u64(3);
    let ear = Ue { forward_m: 0.05, left_m: 0.1, height_share: 0.9, spread_m: 0.0 };
    let hand = Ue { forward_m: 0.3, left_m: -0.2, height_share: 0.6, spread_m: 0.1 };
    let aps_m = [DVec3::new(9.0, 1.0, 2.0), DVec3::new(0.0, 0.0, 3.0), DVec3::new(-3.0, -6.0, 0.6)];
    let (mut in_doubt, mut seen_late) = (0, 0);
    let mut site = config.site.clone();
    site.pillars = vec![Pillar { position_m: [3.0, 0.5], radius_m: 0.4 }];
    site.furniture.clear();
    site.access_points.push(AccessPoint { name: "low".into(), position_m: [-3.0, -6.0, 0.6], radio: None });
    for (ap, ap_m) in site.access_points.iter_mut().zip(aps_m) {
        ap.position_m = ap_m.to_array();
    }
    let mut by_hall = 0;
    for (samples, ue) in [(128, config.site.ue), (70, ear), (96, hand)] {
        let numbers = Numbers::new(&config.blockage);
        let numbers = Numbers { samples, ..numbers };
        let tracks: Vec<Track> = (0..14).map(|id| somebody(id, &mut random)).collect();
        let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
        let mut sampler = Sampler::new(&numbers, &site);
        sampler.draw(&numbers, &ue, tracks.iter().zip(&forecasts));
        let told = sampler.ask(&ue, &aps_m, THRESHOLD).to_vec();
        for (ap, &ap_m) in aps_m.iter().enumerate() {
            for q in 0..tracks.len() {
                let mut bits: Vec<u16> =
                    (0..samples).map(|k| one_by_one(&sampler, &numbers, &ue, ap_m, q, k)).collect();
                // The rest is not asked where nothing stands in the way of any sample now, nor of half of them later.
                let half = samples.div_ceil(WORD).div_ceil(2) * WORD;
                if bits.iter().all(|at| at & 1 == 0) && bits[..half].iter().all(|at| *at == 0) {
                    seen_late += usize::from(bits[half..].iter().any(|at| *at != 0));
                    bits[half..].fill(0);
                }
                let found = told[ap * tracks.len() + q];
                let causes = || (0..samples).map(|k| causes(&sampler, &numbers, &ue, &site, ap_m, q, k));
                let own: Vec<u16> = causes().map(|[own, _]| own).collect();
                let hall: Vec<u16> = causes().map(|[_, hall]| hall).collect();
                let any: Vec<u16> = (0..samples).map(|k| bits[k] | own[k] | hall[k]).collect();
                let expected = Chances {
                    own: (!ue.is_on_axis()).then(|| chance_of(&own)),
                    hall: Some(chance_of(&hall)),
                    any: Some(chance_of(&any)),
                    ..chances_of(&bits, THRESHOLD)
                };
                assert_eq!(found, expected, "access point {ap}, person {q}");
                by_hall += usize::from(hall.iter().any(|at| *at != 0));
                in_doubt += usize::from(found.p[8] > 0.1 && found.p[8] < 0.9);
            }
        }
    }
    assert!(by_hall > 5, "{by_hall} links that the pillar hides in some sample");
    assert!(in_doubt > 10 && seen_late < 5, "{in_doubt} in doubt, {seen_late} in the second half alone");
}

#[test]
fn a_ray_meets_what_somebody_carries_beside_him() {
    let config = Config::default();
    let numbers = Numbers::new(&config.blockage);
    let stands = |id: u64, place_m: DVec2| Track {
        position_m: place_m,
        velocity_mps: DVec2::ZERO,
        covariance: std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1e-6 } else { 0.0 })),
        heading_rad: 0.0,
        heading_sigma_rad: 0.01,
        width_scale: 1.0,
        ..somebody(id, &mut Pcg64::seed_from_u64(1))
    };
    let p = |left_m: f64| {
        // The ray passes 0.4 m to the left of somebody who looks along x.
        let mut carries = stands(0, DVec2::new(0.0, -0.4));
        carries.outline_m[1] = [0.0, left_m, left_m, -left_m];
        carries.outline_m[2] = carries.outline_m[1];
        let tracks = [carries, stands(1, DVec2::new(-3.0, 0.0))];
        let forecasts = tracks.each_ref().map(constant_velocity::forecast);
        let mut sampler = Sampler::new(&numbers, &config.site);
        let aps_m = [DVec3::new(8.0, 0.0, 1.2)];
        sampler.draw(&numbers, &config.site.ue, tracks.iter().zip(&forecasts));
        sampler.ask(&config.site.ue, &aps_m, 0.5)[1].p_now
    };
    assert!(p(0.0) < 0.2 && p(0.1) > 0.8, "{} {}", p(0.0), p(0.1));
}

/// Nothing in it blocks, and one access point hangs at this place.
fn bare_hall(ap_m: [f64; 3]) -> Config {
    let mut config = Config::default();
    (config.site.pillars, config.site.furniture) = (Vec::new(), Vec::new());
    config.site.access_points.truncate(1);
    config.site.access_points[0].position_m = ap_m;
    config
}

fn stands(id: u64, x: f64, y: f64) -> Track {
    Track::new(id, DVec2::new(x, y), DVec2::ZERO)
}

fn cast(config: &Config, tracks: &[Track]) -> Vec<crate::blockage::Blockage> {
    let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
    let mut blockages = Vec::new();
    crate::blockage::Caster::new(&config.blockage, &config.site).cast(tracks, &forecasts, &mut blockages);
    blockages
}

#[test]
fn an_umbrella_blocks_the_link_that_passes_over_its_owners_head() {
    let config = bare_hall([4.0, 0.0, 3.0]);
    let umbrella = Canopy { center_m: DVec2::ZERO, radius_m: 0.5, low_m: 1.75, top_m: 2.0 };
    let p = |canopy: Option<Canopy>| {
        // The ray is 1.8 m high there, and 0.35 m beside the head.
        let tracks = [Track { canopy, ..stands(0, 1.0, 0.35) }, stands(1, -1.0, 0.0)];
        cast(&config, &tracks)[1].p_now
    };
    assert!(p(None) < 0.05 && p(Some(umbrella)) > 0.8, "{} {}", p(None), p(Some(umbrella)));
    let high = Canopy { low_m: 2.2, top_m: 2.4, ..umbrella };
    assert!(p(Some(high)) < 0.05, "{}: what is between head and rim is free", p(Some(high)));
}

#[test]
fn a_pram_blocks_others_but_not_its_owner_and_has_no_link() {
    let config = bare_hall([8.0, 0.0, 1.2]);
    // Whether the links of somebody aside and of somebody behind the pram are blocked.
    let blocked = |part_of: Option<u64>| {
        let pram = Track { confirmed: false, part_of, height_m: 1.1, ..stands(2, 1.0, 0.0) };
        let tracks = [stands(0, 1.0, 3.0), stands(1, 0.0, 0.0), pram];
        cast(&config, &tracks).iter().map(|link| (link.track, link.p_now > 0.5)).collect::<Vec<_>>()
    };
    assert_eq!(blocked(Some(0)), [(0, false), (1, true)]);
    assert_eq!(blocked(Some(1)), [(0, false), (1, false)], "its owner");
    assert_eq!(blocked(None), [(0, false), (1, false)], "nobody, and nothing that is known");
}

#[test]
fn processors_with_narrower_registers_give_the_same_bits() {
    let config = Config::default();
    let (numbers, ue) = (Numbers::new(&config.blockage), config.site.ue);
    let mut random = Pcg64::seed_from_u64(4);
    let tracks: Vec<Track> = (0..20).map(|id| somebody(id, &mut random)).collect();
    let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
    let people = || tracks.iter().zip(&forecasts);
    let aps_m = [DVec3::new(9.0, 1.0, 2.0), DVec3::new(0.0, 0.0, 3.0)];
    let (mut wide, mut narrow) = (Sampler::new(&numbers, &config.site), Sampler::new(&numbers, &config.site));
    wide.draw(&numbers, &ue, people());
    narrow.draw_portably(&numbers, &ue, people());
    let told = wide.ask(&ue, &aps_m, 0.5);
    let Sampler { figure, people, present, samples, samples_min, askers, .. } = &mut narrow;
    let (samples, samples_min) = (*samples, *samples_min);
    let among = Everybody { figure, bodies: &people[..*present], samples, samples_min };
    for (ap, &ap_m) in aps_m.iter().enumerate() {
        for person in 0..tracks.len() {
            let aim = Aim { ue: &ue, ap, ap_m, person, threshold: 0.5 };
            let expected = askers[0].ask_portably(among, aim);
            assert_eq!(told[ap * tracks.len() + person], expected, "{ap}, {person}");
        }
    }
}

#[test]
fn threads_that_share_the_links_of_a_frame_tell_what_one_does() {
    let mut config = Config::default();
    let place = |i: u32| (14.0 * DVec2::from_angle(f64::from(i))).extend(3.0).to_array();
    let radio = Some(Radio::default());
    let more = (0..12).map(|i| AccessPoint { name: format!("{i}"), position_m: place(i), radio });
    config.site.access_points.extend(more);
    // What the samples of each link said is kept for who weighs them.
    config.site.ue.spread_m = 0.1;
    let mut casters = [1, 2, 5].map(|threads| {
        let mut caster = Caster::new(&config.blockage, &config.site);
        caster.use_threads(threads);
        caster
    });
    let mut random = Pcg64::seed_from_u64(6);
    let mut fewer = Vec::new();
    for people in [30, 30, 8, 12, 60, 60] {
        let tracks: Vec<Track> = (0..people).map(|id| somebody(id, &mut random)).collect();
        let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
        let [alone, two, five] = casters.each_mut().map(|caster| {
            let mut blockages = Vec::new();
            caster.cast(&tracks, &forecasts, &mut blockages);
            let mut weighed = blockages.clone();
            let weights: Vec<f32> = (0..128).map(|k| 0.5 + k as f32 / 128.0).collect();
            weighed.iter_mut().enumerate().for_each(|(link, told)| caster.weigh(link, &weights, told));
            (blockages, weighed, caster.took_fewer_samples())
        });
        assert!(alone == two && alone == five, "{people} people");
        assert_ne!(alone.0, alone.1);
        fewer.push(alone.2);
    }
    assert!(fewer.contains(&true) && fewer.contains(&false), "{fewer:?}");
}
