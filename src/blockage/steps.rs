//! The position and heading of a track at each step of its forecast.

use crate::STEP_S;
use crate::forecast::Forecast;
use crate::gait::WALKS_FROM_MPS;
use crate::geometry::DVec2;
use crate::track::Track;

/// Below this step length a forecast says nothing about where a person faces.
const TURNS_FROM_M: f64 = WALKS_FROM_MPS * STEP_S;

/// Mean position at a step; step 0 is now.
pub(super) fn position_at(track: &Track, forecast: &Forecast, step: usize) -> DVec2 {
    if step == 0 { track.position_m } else { forecast.steps[step - 1].mean_m }
}

/// Heading at a step: the track's, turned as the forecast's way turns. The paper turns the boxes and does not
/// say by what.
pub(super) fn heading_at(track: &Track, forecast: &Forecast, step: usize) -> f64 {
    if step < 2 {
        return track.heading_rad;
    }
    let stride = |s: usize| position_at(track, forecast, s) - position_at(track, forecast, s - 1);
    let (first, last) = (stride(1), stride(step));
    if first.length() < TURNS_FROM_M || last.length() < TURNS_FROM_M {
        return track.heading_rad;
    }
    track.heading_rad + first.angle_to(last)
}
