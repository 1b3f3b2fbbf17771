//! Fits the network of the pose, `umbracast::detect::pose`.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use umbracast::Error;
use umbracast::detect::SHIFT_M;
use umbracast::detect::point_network::{BODY_UNITS, OUTPUTS, POINT_UNITS, PointNetwork};
use umbracast::detect::pose::{Pose, poses};
use umbracast::detect::pose_view::{OF_BODY, OF_POINT, POINTS, PoseView};
use umbracast::geometry::DVec2;

use crate::point_network::{EPOCHS, SEED, Sample, fit};
use crate::sightings::{Seen, held_out_name, scenes_listed, watch_all};
use crate::truth::Truth;

/// Fits the network; returns the weights file and its card. `commit`, which state of the source this is, goes into the card.
/// `scene_done` is called with scenes done and scenes in all, from any thread.
///
/// # Errors
/// A layout that nothing can be simulated of.
pub fn train_pose(
    commit: &str,
    scene_done: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<u8>, String), Error> {
    let [training, held_out] = watch_all(scene_done)?;
    let samples: Vec<Sample> =
        training.iter().map(|seen| Sample { view: seen.view, truth: Truth::of(seen) }).collect();
    let weights = fit(&samples)?;
    let network = PointNetwork::from_safetensors(&weights)?;
    Ok((weights, card(&network, &training, &held_out, commit)))
}

/// What a network says of one body.
pub(crate) fn pose(network: &PointNetwork, view: &PoseView) -> Pose {
    poses(network, std::slice::from_ref(view)).next().expect("one pose a view")
}

fn card(network: &PointNetwork, training: &[Seen], held_out: &[Seen], commit: &str) -> String {
    let error = |s: &Seen| pose(network, &s.view).position_m - s.view.base_m - s.off_m;
    let squared = |s: &Seen| {
        let ([[xx, xy], [_, yy]], e) = (pose(network, &s.view).covariance_m2, error(s));
        (yy * e.x * e.x - 2.0 * xy * e.x * e.y + xx * e.y * e.y) / (xx * yy - xy * xy)
    };
    let rmse =
        |of: &dyn Fn(&Seen) -> DVec2, seen: &[Seen]| mean(seen.iter().map(|s| of(s).length_squared())).sqrt();
    let off_rad = |(pose, s): &(Pose, &Seen)| Some(turned(pose.facing?.heading_rad - s.heading_rad?));
    let off_phase_rad = |(pose, s): &(Pose, &Seen)| Some(turned(pose.gait?.phase_rad - s.phase_rad?));
    let poses = || held_out.iter().map(|s| (pose(network, &s.view), s));
    let headings: Vec<f64> = poses().filter_map(|seen| off_rad(&seen)).collect();
    let off_swing = |(pose, s): &(Pose, &Seen)| {
        let (gait, swing) = (pose.gait?, s.hand_swing?);
        Some([0, 1].map(|i| (gait.hand_swing[i] - swing[i], gait.hand_swing_sigma[i])))
    };
    let swings: Vec<(f64, f64)> = poses().filter_map(|seen| off_swing(&seen)).flatten().collect();
    let all_swings: Vec<f64> = training.iter().filter_map(|s| s.hand_swing).flatten().collect();
    let mean_swing = mean(all_swings.iter().copied());
    let swing_sigma = mean(all_swings.iter().map(|swing| (swing - mean_swing).powi(2))).sqrt();
    let phases: Vec<f64> = poses().filter_map(|seen| off_phase_rad(&seen)).collect();
    let within = |rad: f64, off_rad: &[f64]| mean(off_rad.iter().map(|off| f64::from(off.abs() < rad)));
    let mut off_line_deg: Vec<f64> = headings
        .iter()
        .map(|off| ((off + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2).abs().to_degrees())
        .collect();
    off_line_deg.sort_by(f64::total_cmp);
    let quantile =
        |share: f64| off_line_deg[((share * off_line_deg.len() as f64) as usize).min(off_line_deg.len() - 1)];
    let commit = if commit.is_empty() { "unknown" } else { commit };
    format!(
        "# Network of the pose of a body\n\n\
         From what the sensors saw of one body in one frame to where its axis stands, with the error's covariance, which way it \
         faces if it stands, where in the stride it is and how far each hand swings if it walks: up to {POINTS} points of {OF_POINT} numbers, each through \
         {POINT_UNITS:?} units, then with {OF_BODY} numbers of the whole body through {BODY_UNITS:?} units, {OUTPUTS} outputs \
         (`src/detect/pose.rs`).\n\n\
         Written by `umbracast train pose`, commit {commit}.\n\n\
         ## Data\n\n{}\n{} bodies; {EPOCHS} epochs, Adam, negative log-likelihood, every fifth body made smaller or larger, seed \
         {SEED}.\n\n\
         ## What one frame tells\n\n\
         | | training | {} |\n|---|---|---|\n\
         | axis, each point moved {SHIFT_M} m away from its sensor, m | {:.4} | {:.4} |\n| axis, this network, m | {:.4} | {:.4} |\n\
         | squared error over its variance (2 if honest) | | {:.2} |\n\
         | facing: front and back are not mistaken, of {} who stand | | {:.3} |\n\
         | off the line, either way, median | | {:.1} degrees |\n| 90 % | | {:.1} degrees |\n\
         | phase of the stride: off by an eighth at most, of {} who walk | | {:.3} |\n\
         | how far hands swing: mean of all, one standard deviation | {:.3}, {:.3} | |\n\
         | this network's error, one standard deviation | | {:.3} |\n\
         | squared error over its variance (1 if honest) | | {:.2} |\n",
        scenes_listed(),
        training.len(),
        held_out_name(),
        rmse(&|s| s.off_m, training),
        rmse(&|s| s.off_m, held_out),
        rmse(&error, training),
        rmse(&error, held_out),
        mean(held_out.iter().map(squared)),
        headings.len(),
        within(FRAC_PI_2, &headings),
        quantile(0.5),
        quantile(0.9),
        phases.len(),
        within(FRAC_PI_4, &phases),
        mean_swing,
        swing_sigma,
        mean(swings.iter().map(|(off, _)| off * off)).sqrt(),
        mean(swings.iter().map(|(off, sigma)| (off / sigma).powi(2))),
    )
}

fn mean(of: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = of.len() as f64;
    of.sum::<f64>() / n
}

/// From -pi to pi.
fn turned(rad: f64) -> f64 {
    (rad + PI).rem_euclid(TAU) - PI
}
