//! Whose each device is, told by the power that access points hear of it.

use umbracast::Site;
use umbracast::radio::{Binder, Binding};

use crate::foreseen::{Followed, Foreseen};
use crate::reports;
use crate::truth::Traces;

/// A device is taken to be carried by who does so at least so likely. Chosen on the scenes of seeds 140060 to 140062, where such a
/// guess was seldom wrong.
const LIKELY: f64 = 0.3;

/// By frame and person of the truth: the place among those confirmed of who is likeliest to carry the person's device; `None` where
/// nobody is likely to.
pub type Carriers = Vec<Vec<Option<usize>>>;

/// Of a scene, from a blind start. `foreseen` is what was foreseen of `frames`; `seed` is that of the reports.
pub fn carriers(
    site: &Site,
    frames: &[Followed],
    foreseen: &[Foreseen],
    traces: &Traces,
    seed: u64,
) -> Carriers {
    let device_of = |person: usize| person as u64;
    let reports = reports::of_scene(site, traces, seed, device_of);
    let (mut binder, mut bindings, mut waiting) = (Binder::new(site), Vec::new(), &reports[..]);
    let of_frame = |(frame, said): (&Followed, &Foreseen)| {
        binder.hear(reports::take_arrived(&mut waiting, frame.time_ns));
        binder.bind(frame.time_ns, &frame.tracks, &said.losses, &mut bindings);
        let carrier = |person: usize| {
            // Bindings of a device stand likeliest first.
            let is_its = |binding: &&Binding| binding.device == device_of(person);
            let likeliest = bindings.iter().find(is_its).filter(|binding| binding.p >= LIKELY)?;
            said.tracks.iter().position(|track| *track == likeliest.track)
        };
        (0..traces.people).map(carrier).collect()
    };
    frames.iter().zip(foreseen).map(of_frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::decide::Decider;
    use umbracast::geometry::DVec2;
    use umbracast::radio::{Loss, Outages};
    use umbracast::site::{AccessPoint, Handover, Radio};
    use umbracast::track::Track;
    use umbracast::{Config, STEP_NS};

    use crate::device::{Network, drive};
    use crate::policy::{Advised, Policy, Reactive, Tuning};

    const FRAMES: usize = 60;

    fn site() -> Site {
        let mut site = Config::default().site;
        let radio = Some(Radio::default());
        let place = |(i, position_m)| AccessPoint { name: format!("ap{i}"), position_m, radio };
        site.access_points =
            [[14.0, 0.0, 3.0], [-14.0, 0.0, 3.0]].into_iter().enumerate().map(place).collect();
        site.handover = Some(Handover::default());
        site
    }

    /// Two people; the first access point's link to the second one fades for half a second in each second, and so does the device's.
    fn scene() -> (Vec<Followed>, Vec<Foreseen>, Traces) {
        let fades = |tick: usize| tick % 100 >= 50;
        let traces = Traces::by_hand(FRAMES * 10, 2, |tick, ap| {
            [
                if ap == 1 {
                    2.0
                } else if fades(tick) {
                    25.0
                } else {
                    0.0
                },
                f32::INFINITY,
            ]
        });
        let of_frame = |frame: usize| {
            let time_ns = frame as i64 * STEP_NS;
            let track =
                |id, x_m| Track { confirmed: true, ..Track::new(id, DVec2::new(x_m, 0.0), DVec2::ZERO) };
            let lost = |access_point, track, out: bool| Loss {
                now_db: if out { [22.0, 25.0, 28.0] } else { [0.0; 3] },
                ..Loss::clear(access_point, track)
            };
            let fades = fades(frame * 10);
            let losses = vec![lost(0, 4, false), lost(0, 9, fades), lost(1, 4, false), lost(1, 9, false)];
            let (outages, tracks) = (Outages::new(2, 2, 1), vec![4, 9]);
            let said = Foreseen { time_ns, outages, losses, index_of: vec![Some(0)], tracks };
            (Followed { time_ns, tracks: vec![track(4, 3.0), track(9, -3.0)] }, said)
        };
        let (frames, foreseen) = (0..FRAMES).map(of_frame).unzip();
        (frames, foreseen, traces)
    }

    #[test]
    fn a_device_is_carried_by_whose_links_fade_when_its_own_does() {
        let (frames, foreseen, traces) = scene();
        let carriers = carriers(&site(), &frames, &foreseen, &traces, 1);
        assert_eq!((carriers.len(), carriers[0][0]), (FRAMES, None), "nothing was heard yet");
        assert_eq!(carriers[FRAMES - 1][0], Some(1), "not the one who stands where the truth says");
    }

    #[test]
    fn who_is_bound_to_nobody_changes_as_without_forecasts() {
        let (_, foreseen, traces) = scene();
        let site = site();
        let radios = site.access_points.iter().map(|ap| ap.radio).collect();
        let network = Network { radios, costs: Handover::default().costs(), seed: 1 };
        let nobody = vec![vec![None]; FRAMES];
        let advised = || Advised::new(&foreseen, Policy::Bound, Decider::new(&site), &network, &traces);
        let (mut unbound, mut known) = (advised().bound(&nobody), advised());
        let mut conditional = Reactive::new(Tuning::Fast, true, false, 2);
        let reacts = drive(&network, &traces, 0, 0, |view| conditional.order(view));
        assert!(reacts.handovers > 0);
        assert_eq!(drive(&network, &traces, 0, 0, |view| unbound.order(view)), reacts);
        // What is foreseen of the first person's links says that nothing ever happens.
        assert_eq!(drive(&network, &traces, 0, 0, |view| known.order(view)).handovers, 0);
    }
}
