use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::Config;
use crate::forecast::{Forecast, constant_velocity};
use crate::geometry::{Aabb, DVec2, DVec3, Obb};
use crate::radio::models::kirchhoff_mean;
use crate::radio::{Passage, Surface};
use crate::site::{Handover, Material, Radio, Reflections};
use crate::track::Track;

/// Somebody who is known well, at a place, with a velocity.
pub(in crate::radio) fn somebody(id: u64, position_m: DVec2, velocity_mps: DVec2) -> Track {
    let aabb = Aabb { min_m: DVec3::ZERO, max_m: DVec3::ONE };
    let mut covariance = [[0.0; 4]; 4];
    [4e-4, 4e-4, 4e-3, 4e-3].into_iter().enumerate().for_each(|(i, variance)| covariance[i][i] = variance);
    Track {
        id,
        position_m,
        velocity_mps,
        covariance,
        heading_rad: velocity_mps.to_angle(),
        heading_sigma_rad: 0.1,
        heading_behind: 0.0,
        height_m: 1.75,
        height_sigma_m: 0.02,
        width_scale: 1.0,
        width_scale_sigma: 0.02,
        outline_m: Default::default(),
        canopy: None,
        gait: crate::gait::Gait::UNKNOWN,
        points: 30,
        confirmed: true,
        part_of: None,
        aabb,
        obb: Obb::from_aabb(&aabb),
        observed: Default::default(),
    }
}

fn config(fade_spread: bool) -> Config {
    let mut config = Config::default();
    for ap in &mut config.site.access_points {
        ap.radio = Some(Radio { fade_spread, ..Radio::default() });
    }
    config
}

fn faded(config: &Config, tracks: &[Track]) -> (Caster, Fader, Vec<Loss>) {
    let forecasts: Vec<Forecast> = tracks.iter().map(constant_velocity::forecast).collect();
    let (mut caster, mut fader) = (Caster::new(&config.blockage, &config.site), Fader::new(&config.site));
    let mut losses = Vec::new();
    caster.cast(tracks, &forecasts, &mut Vec::new());
    fader.fade(&caster, &mut losses);
    (caster, fader, losses)
}

#[test]
fn who_stands_behind_somebody_loses_power_and_who_stands_before_him_does_not() {
    // The access point `side` hangs at (14, 0, 2).
    let tracks = [(4.0, 0), (2.0, 1)].map(|(x, id)| somebody(id, DVec2::new(x, 0.0), DVec2::ZERO));
    let (_, fader, losses) = faded(&config(false), &tracks);
    assert_eq!(losses.len(), 4);
    let of_side = |track: u64| losses.iter().find(|l| l.access_point == 0 && l.track == track).unwrap();
    assert_eq!(*of_side(0), Loss::clear(0, 0));
    let [low, median, high] = of_side(1).now_db;
    assert!(low > 8.0 && median > 12.0 && high < 35.0, "{:?}", of_side(1).now_db);
    assert!(of_side(1).p_out_now > 0.8 && of_side(1).p_out[8] >= of_side(1).p_out_now - 1e-9);
    assert!(fader.outages().of(0, 1, 0).iter().any(|word| *word != 0));
    assert_eq!(fader.outages().people(), 2);
}

#[test]
fn somebody_who_crosses_a_link_takes_it_out_when_he_is_there() {
    let crosses = somebody(0, DVec2::new(6.0, -0.75), DVec2::new(0.0, 1.5));
    let stands = somebody(1, DVec2::new(2.0, 0.0), DVec2::ZERO);
    let (_, _, losses) = faded(&config(false), &[crosses, stands]);
    let loss = losses.iter().find(|l| l.access_point == 0 && l.track == 1).unwrap();
    assert!(loss.p_out_now < 0.1, "{loss:?}");
    // He is on the line after half a second.
    assert!(loss.steps_db[4][1] > 8.0 && loss.steps_db[8][1] < 2.0, "{loss:?}");
    assert!(loss.onset_s[1].is_some_and(|s| (0.29..0.51).contains(&s)), "{:?}", loss.onset_s);
}

#[test]
fn a_pram_costs_others_power_but_not_its_owner() {
    let mut config = config(false);
    config.site.access_points.truncate(1);
    config.site.access_points[0].position_m = [8.0, 0.0, 0.8];
    let stands = |id: u64, x: f64, y: f64| somebody(id, DVec2::new(x, y), DVec2::ZERO);
    let median_db = |owner: u64| {
        let pram = Track { confirmed: false, part_of: Some(owner), height_m: 1.2, ..stands(2, 1.0, 0.0) };
        let (_, _, losses) = faded(&config, &[stands(0, 1.0, 3.0), stands(1, 0.0, 0.0), pram]);
        losses.iter().map(|loss| loss.now_db[1]).collect::<Vec<_>>()
    };
    assert_eq!(median_db(1), [0.0, 0.0], "one loss each for two people, and none by the owner's own");
    assert!(median_db(0)[0] == 0.0 && median_db(0)[1] > 6.0, "{:?}", median_db(0));
}

#[test]
fn the_spread_of_real_fades_widens_what_is_told() {
    let tracks = [(4.0, 0), (2.0, 1)].map(|(x, id)| somebody(id, DVec2::new(x, 0.0), DVec2::ZERO));
    let width_of = |losses: &[Loss]| {
        let [low, _, high] = losses.iter().find(|l| l.access_point == 0 && l.track == 1).unwrap().now_db;
        high - low
    };
    let width_db = |fade_spread| width_of(&faded(&config(fade_spread), &tracks).2);
    let (caster, mut fader, mut losses) = faded(&config(false), &tracks);
    fader.spreads.values_mut().for_each(|spread| spread.fill(0.0));
    fader.fade(&caster, &mut losses);
    let (none_db, shape_db, both_db) = (width_of(&losses), width_db(false), width_db(true));
    assert!(both_db > none_db + 5.0, "{both_db} {none_db}");
    assert!(both_db > shape_db + 2.0 && shape_db > none_db, "{both_db} {shape_db} {none_db}");
    assert_eq!([false, true].map(|fades| spread_db(0.0, fades)), [0.0; 2]);
    assert_eq!((spread_db(4.0, false), spread_db(40.0, false)), (3.6, 7.0));
    assert!((spread_db(4.0, true) - 3.6_f32.hypot(4.0)).abs() < 1e-5);
    assert!((spread_db(40.0, true) - 7.0_f32.hypot(7.2)).abs() < 1e-5);
}

#[test]
fn a_crowd_in_each_others_links_loses_by_fewer_samples_and_says_so() {
    let crowd = |side: u64| -> Vec<Track> {
        let place = |id: u64| DVec2::new((id % side) as f64, (id / side) as f64) * 0.8;
        (0..side * side).map(|id| somebody(id, place(id), DVec2::new(1.0, 0.3))).collect()
    };
    let takes_fewer = |people: &[Track]| {
        let (caster, fader, _) = faded(&config(true), people);
        let drawn = caster.drawn().unwrap().samples;
        (fader.took_fewer_samples(), fader.outages().samples() < drawn)
    };
    assert_eq!(takes_fewer(&crowd(2)), (false, false));
    assert_eq!(takes_fewer(&crowd(7)), (true, true));
}

/// Random crowds: every sample's loss is that of the exact model over everybody, so nobody who matters is left out.
#[test]
fn losses_are_those_of_everybody_asked_one_by_one() {
    let mut random = Pcg64::seed_from_u64(7);
    let mut fades = 0;
    for ue in [
        Ue { forward_m: 0.0, left_m: 0.0, height_share: 0.5, spread_m: 0.0 },
        Ue { forward_m: 0.3, left_m: 0.1, height_share: 0.6, spread_m: 0.0 },
        Ue { forward_m: 0.3, left_m: 0.1, height_share: 0.6, spread_m: 0.1 },
    ] {
        let mut config = config(false);
        config.site.ue = ue;
        let mut within = |most: f64| random.random_range(-most..most);
        let tracks: Vec<Track> = (0..12)
            .map(|id| {
                somebody(id, DVec2::new(within(7.0), within(7.0)), DVec2::new(within(1.5), within(1.5)))
            })
            .collect();
        let (caster, mut fader, mut losses) = faded(&config, &tracks);
        fader.spreads.values_mut().for_each(|spread| spread.fill(0.0));
        fader.fade(&caster, &mut losses);
        // Where bodies are many, not all samples are asked.
        let (people, samples) = (caster.drawn().unwrap().bodies, fader.outages().samples());
        for person in 0..people.len() {
            fader.turn(people, person);
        }
        for (ap, place) in config.site.access_points.iter().enumerate() {
            for owner in 0..people.len() {
                let loss = losses.iter().find(|l| l.access_point == ap && l.track == owner as u64).unwrap();
                for step in [0, 4, 9] {
                    let mut all_db: Vec<f64> = (0..samples)
                        .map(|k| one_by_one(&fader, people, place.position(), &ue, owner, step, k))
                        .collect();
                    all_db.sort_by(f64::total_cmp);
                    let median_db = all_db[samples / 2];
                    let found = if step == 0 { loss.now_db[1] } else { loss.steps_db[step - 1][1] };
                    assert!(
                        (found - median_db).abs() < 0.5 + 0.1 * median_db.abs(),
                        "{ap} {owner} {step}: found {found}, exactly {median_db}"
                    );
                    fades += usize::from(median_db > 5.0);
                }
            }
        }
    }
    assert!(fades > 10, "{fades}: nothing was compared");
}

fn one_by_one(
    fader: &Fader,
    people: &[Trajectories],
    ap_m: DVec3,
    ue: &Ue,
    owner: usize,
    step: usize,
    k: usize,
) -> f64 {
    let wavelength_m = Radio::default().wavelength_m();
    let place = |p: &Trajectories| {
        p.mean_m[step] + DVec2::from([0, 1].map(|i| f64::from(p.off_m[i][step * p.samples + k])))
    };
    let ahead = |of: usize| {
        let [cos, sin] = [0, 1].map(|i| f64::from(fader.turns[of][i][k]));
        people[of].ahead[step].rotate(DVec2::new(cos, sin))
    };
    let q = &people[owner];
    let held = q.device_of(ue, k);
    let ue_m = held.on_body(place(q), ahead(owner).to_angle(), f64::from(q.height_m[k]));
    let mut sum_db = 0.0;
    for (body, p) in people.iter().enumerate() {
        if body == owner && ue.is_on_axis() {
            continue;
        }
        let Some(passage) = Passage::new(ap_m, ue_m, place(p), 0.0) else { continue };
        if passage.from_tx_m < 0.05 || passage.to_rx_m < 0.05 {
            continue;
        }
        let along = (ap_m - ue_m).truncate().normalize();
        let height_m = f64::from(p.height_m[k]);
        let scale = height_m / 1.72 * f64::from(p.width_scale[k]);
        let facing = ahead(body);
        let half_m = scale * (0.13 * along.perp_dot(facing)).hypot(0.28 * along.dot(facing));
        let parts = [
            passage.rectangle(half_m, 0.0, 0.82 * height_m),
            passage.rectangle(0.1 * scale, 0.82 * height_m, height_m),
        ];
        sum_db += kirchhoff_mean(wavelength_m, &passage, &parts, 0.04).min(50.0);
    }
    sum_db
}

/// Two stand still. In what share of the samples the ways are out, the straight one and that by a reflection, of an access point at
/// (14, 0) to who stands second; and what reflects. Links can lose `margin_db`.
fn out_by(of: Reflections, [ap_z, margin_db]: [f64; 2], places_m: [DVec2; 2]) -> ([f64; 2], Option<Surface>) {
    let mut config = config(false);
    config.site.hall.height_m = 4.0;
    (config.site.handover, config.site.reflections) = (Some(Handover::default()), Some(of));
    config.site.access_points.truncate(1);
    let ap = &mut config.site.access_points[0];
    ap.position_m[2] = ap_z;
    ap.radio = Some(Radio { margin_db, fade_spread: false, ..Radio::default() });
    let tracks = [0, 1].map(|i| somebody(i as u64, places_m[i], DVec2::ZERO));
    let (_, fader, _) = faded(&config, &tracks);
    let outages = fader.outages();
    let share = |way: usize| {
        let bits: u32 = outages.of(way, 1, 0).iter().map(|word| word.count_ones()).sum();
        f64::from(bits) / outages.samples() as f64
    };
    let reflected = outages.reflected(0, 1);
    ([share(0), reflected.map_or(1.0, |(way, _)| share(way))], reflected.map(|(_, surface)| surface))
}

const NOTHING: Reflections =
    Reflections { walls: Material::None, ceiling: Material::None, floor: Material::None };

#[test]
fn a_beam_at_the_ceiling_passes_over_who_stands_in_the_straight_way() {
    let of = Reflections { ceiling: Material::Metal, ..NOTHING };
    let places_m = [DVec2::new(5.0, 0.0), DVec2::new(2.0, 0.0)];
    let ([straight, reflected], surface) = out_by(of, [2.0, 15.0], places_m);
    assert_eq!(surface, Some(Surface::Ceiling));
    assert!(straight > 0.5 && reflected < 0.1, "{straight} {reflected}");
    assert_eq!(out_by(of, [2.0, 0.5], places_m).1, None, "it loses more than that without anybody");
}

#[test]
fn a_beam_at_the_floor_is_cut_by_whom_the_straight_way_is_cut_by() {
    let of = Reflections { floor: Material::Metal, ..NOTHING };
    let places_m = [DVec2::new(3.0, 0.0), DVec2::new(2.0, 0.0)];
    let ([straight, reflected], surface) = out_by(of, [2.0, 15.0], places_m);
    assert_eq!(surface, Some(Surface::Floor));
    assert!(straight > 0.7 && reflected > 0.7, "{straight} {reflected}");
}

#[test]
fn both_legs_of_a_way_by_a_wall_are_cut_by_who_stands_in_them_and_by_nobody_else() {
    // The wall at x = 17 shows the access point at (20, 0), 3 dB weaker; the others are more than 6 dB too far.
    let of = Reflections { walls: Material::Metal, ..NOTHING };
    let (ue_m, ap_m) = (DVec2::new(2.0, 6.0), DVec2::new(14.0, 0.0));
    let out = |at_m: DVec2, margin_db: f64| out_by(of, [1.2, margin_db], [at_m, ue_m]);
    let meets_m = ue_m.lerp(DVec2::new(20.0, 0.0), 15.0 / 18.0);
    for at_m in [ue_m.lerp(meets_m, 0.3), meets_m.lerp(ap_m, 0.5)] {
        let ([straight, reflected], surface) = out(at_m, 6.0);
        assert_eq!(surface, Some(Surface::Wall(1)));
        assert!(straight < 0.1 && reflected > 0.5, "{at_m}: {straight} {reflected}");
    }
    let ([straight, reflected], _) = out(ue_m.lerp(ap_m, 0.4), 6.0);
    assert!(straight > 0.7 && reflected < 0.1, "{straight} {reflected}");
    // With a wider margin the beam takes another wall where the first is cut.
    let ([_, reflected], surface) = out(ue_m.lerp(meets_m, 0.3), 12.0);
    assert!(reflected < 0.1 && surface.is_some_and(|of| of != Surface::Wall(1)), "{reflected} {surface:?}");
}
