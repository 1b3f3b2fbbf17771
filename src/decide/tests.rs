use super::*;
use crate::Config;
use crate::geometry::DVec2;
use crate::radio::{Served, Surface};
use crate::site::{AccessPoint, Handover, Radio, Reflections};

/// Three access points with radios, of which changes cost what these procedures do.
fn decider(handover: Handover) -> Decider {
    let mut site = Config::default().site;
    let place = |x: f64| AccessPoint {
        name: format!("at {x}"),
        position_m: [x, 0.0, 2.0],
        radio: Some(Radio::default()),
    };
    site.access_points = [-5.0, 0.0, 5.0].map(place).to_vec();
    (site.handover, site.reflections) = (Some(handover), Some(Reflections::default()));
    Decider::new(&site)
}

/// Commands alone: nobody changes by himself.
fn commands() -> Handover {
    Handover { conditional: Some(false), ..Handover::default() }
}

const SAMPLES: usize = 64;

/// Access point `ap` is out at these steps in the first so many samples.
fn out(outages: &mut Outages, ap: usize, steps: std::ops::RangeInclusive<usize>, samples: usize) {
    for sample in 0..samples {
        steps.clone().for_each(|step| outages.set(ap, 0, step, sample));
    }
}

/// What the first access point's link is thought to lose, as far as decisions read it.
fn loss(p_out_now: f64, p_out: f64) -> Loss {
    let onset_s = [(p_out > 0.0).then_some(0.4); 3];
    Loss { p_out_now, p_out: [p_out; STEPS], onset_s, ..Loss::clear(0, 7) }
}

#[test]
fn who_is_not_at_risk_stays() {
    let outages = Outages::new(3, 1, SAMPLES);
    let decision = decider(commands()).advise(Serving::straight(0), &loss(0.0, 0.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.target, decision.saved_s), (Action::Stay, None, 0.0));
}

#[test]
fn a_link_that_will_surely_be_out_is_left_for_one_that_will_not() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    // At once after the next command could still pass, and for half a second.
    out(&mut outages, 0, 1..=5, SAMPLES);
    out(&mut outages, 1, 3..=6, SAMPLES);
    let decision = decider(commands()).advise(Serving::straight(0), &loss(0.0, 1.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.target), (Action::HandOver, Some(2)));
    assert!(decision.saved_s > 0.02, "{decision:?}");
}

#[test]
fn of_two_that_are_in_sight_the_one_that_stays_so_longer_is_taken() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    out(&mut outages, 0, 1..=5, SAMPLES);
    let target = |outages: &Outages| {
        decider(commands()).advise(Serving::straight(0), &loss(0.0, 1.0), 0, outages).unwrap().target
    };
    assert_eq!(target(&outages), Some(1));
    // Somebody is about to walk between the first of them and the device, after the last step.
    (0..SAMPLES / 4).for_each(|sample| outages.set_beyond(1, 0, sample));
    assert_eq!(target(&outages), Some(2));
}

#[test]
fn who_can_wait_waits_for_a_better_forecast() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    // In half of the samples, and not soon.
    out(&mut outages, 0, 6..=8, SAMPLES / 2);
    let decision = decider(commands()).advise(Serving::straight(0), &loss(0.0, 0.5), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.target), (Action::Prepare, Some(1)));
    // Onset at 0.4 s at the earliest: a step earlier, less interruption, command and age.
    assert!(decision.deadline_s.is_some_and(|s| (s - 0.225).abs() < 1e-9), "{decision:?}");
}

#[test]
fn access_points_behind_one_person_fail_together_and_are_no_refuge() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    // The second is out in just the samples in which the first is, the third as often but in the others.
    out(&mut outages, 0, 1..=4, SAMPLES / 2);
    out(&mut outages, 1, 1..=4, SAMPLES / 2);
    for sample in SAMPLES / 2..SAMPLES {
        (1..=4).for_each(|step| outages.set(2, 0, step, sample));
    }
    let prepares =
        decider(Handover::default()).advise(Serving::straight(0), &loss(0.0, 0.5), 0, &outages).unwrap();
    assert_eq!((prepares.action, prepares.target), (Action::Prepare, Some(2)));
}

#[test]
fn a_short_outage_of_all_is_sat_out() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    (0..3).for_each(|ap| out(&mut outages, ap, 0..=0, SAMPLES));
    let decision =
        decider(Handover::default()).advise(Serving::straight(0), &loss(1.0, 1.0), 0, &outages).unwrap();
    assert_eq!(decision.action, Action::Wait);
    assert!(decision.saved_s > 0.1, "giving up costs 160 ms, the outage 100: {decision:?}");
}

#[test]
fn a_device_is_served_as_it_was_advised_until_the_network_says_otherwise() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    out(&mut outages, 0, 1..=5, SAMPLES);
    let track = Track { confirmed: true, ..Track::new(7, DVec2::ZERO, DVec2::ZERO) };
    let losses =
        [0, 1, 2].map(|ap| Loss { p_out: [f64::from(u8::from(ap == 0)); STEPS], ..Loss::clear(ap, 7) });
    let (mut decider, mut decisions) = (decider(commands()), vec![]);
    let mut serving_at = |frame: i64, heard: Option<(usize, i64)>| {
        if let Some((access_point, heard_ms)) = heard {
            decider.serve(&Served { track: 7, access_point, heard_ns: heard_ms * 1_000_000 });
        }
        decider.decide(frame * 100_000_000, std::slice::from_ref(&track), &losses, &outages, &mut decisions);
        (decisions[0].serving, decisions[0].action)
    };
    assert_eq!(serving_at(1, None), (1, Action::Stay), "nobody said, so the likeliest to stay in sight");
    assert_eq!(serving_at(2, Some((0, 150))), (0, Action::HandOver));
    assert_eq!(serving_at(3, Some((0, 190))), (1, Action::Stay), "heard before the change was advised");
    assert_eq!(serving_at(4, Some((0, 390))), (0, Action::HandOver), "it was not made");
    assert_eq!(serving_at(5, Some((2, 480))), (2, Action::Stay), "another was");
    assert_eq!(serving_at(6, Some((0, 470))), (2, Action::Stay), "a report that came late");
    let mut without = Decider::new(&Config::default().site);
    let mut decisions = vec![];
    without.decide(0, &[], &[], &Outages::new(1, 0, SAMPLES), &mut decisions);
    assert!(
        decisions.is_empty()
            && without.advise(Serving::straight(0), &loss(0.0, 0.0), 0, &Outages::new(1, 1, 1)).is_none()
    );
}

/// The first access point can reach the device over the ceiling; `reflected` of the samples of that way are out at steps 1 to 5.
fn with_ceiling(outages: &mut Outages, reflected: usize) {
    outages.set_surface(0, 0, Surface::Ceiling);
    let (way, surface) = outages.reflected(0, 0).unwrap();
    assert_eq!((way, surface, outages.reflected(1, 0)), (3, Surface::Ceiling, None));
    out(outages, way, 1..=5, reflected);
}

#[test]
fn a_beam_that_is_pointed_elsewhere_is_cheaper_than_a_change() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    out(&mut outages, 0, 1..=5, SAMPLES);
    with_ceiling(&mut outages, 0);
    for handover in [commands(), Handover::default()] {
        let decision = decider(handover).advise(Serving::straight(0), &loss(0.0, 1.0), 0, &outages).unwrap();
        let beam = (Action::Beam, None, Some(Surface::Ceiling));
        assert_eq!((decision.action, decision.target, decision.surface), beam, "{decision:?}");
        assert!(decision.saved_s > 0.015, "{decision:?}");
    }
    with_ceiling(&mut outages, SAMPLES);
    let decision = decider(commands()).advise(Serving::straight(0), &loss(0.0, 1.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.surface), (Action::HandOver, None), "both ways are cut");
}

#[test]
fn a_beam_comes_back_to_the_device_when_nobody_is_in_the_way_any_more() {
    let reflected = Serving { access_point: 0, is_reflected: true };
    let mut outages = Outages::new(3, 1, SAMPLES);
    with_ceiling(&mut outages, 0);
    let mut decider = decider(commands());
    let decision = decider.advise(reflected, &loss(0.0, 0.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.target, decision.surface), (Action::Beam, None, None));
    let nothing_reflects = Outages::new(3, 1, SAMPLES);
    let decision = decider.advise(reflected, &loss(0.0, 0.0), 0, &nothing_reflects).unwrap();
    assert_eq!((decision.action, decision.surface), (Action::Beam, None), "it points at nothing");
    out(&mut outages, 0, 0..=4, SAMPLES);
    let decision = decider.advise(reflected, &loss(1.0, 1.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.p_out), (Action::Stay, 0.0), "the straight way is cut as yet");
}

#[test]
fn who_is_served_by_a_reflection_prepares_no_change_to_a_link_that_is_out() {
    let mut outages = Outages::new(3, 1, SAMPLES);
    // The straight way is out for a moment, then the reflection; the other access points are out all the time.
    with_ceiling(&mut outages, 0);
    let (way, _) = outages.reflected(0, 0).unwrap();
    out(&mut outages, 0, 0..=2, SAMPLES);
    out(&mut outages, way, 3..=9, SAMPLES);
    (1..3).for_each(|ap| out(&mut outages, ap, 0..=9, SAMPLES));
    let reflected = Serving { access_point: 0, is_reflected: true };
    let decision = decider(Handover::default()).advise(reflected, &loss(1.0, 1.0), 0, &outages).unwrap();
    assert_eq!((decision.action, decision.target), (Action::Stay, None), "{decision:?}");
}
