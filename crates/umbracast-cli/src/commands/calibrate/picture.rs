//! What the sensors saw, in plan view, with the poses before and after.

use umbracast::geometry::DVec2;
use umbracast::{Error, Site};
use umbracast_calibrate::{Calibration, Plan};
use umbracast_eval::report::plot::{self, Mark, Panel, Series};

/// One a sensor, and again.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const HALL: &str = "#444444";
/// Free space about the hall, metres.
const MARGIN_M: f64 = 3.0;
/// So many points of walls and furniture show them; of sightings every fifth shows a way.
const POINTS_MAX: usize = 700;
const SIGHTINGS: usize = 5;
/// Of a panel, pixels.
const SIZE: (f64, f64) = (520.0, 540.0);

/// Both floor plans beside each other.
///
/// # Errors
/// The picture could not be drawn.
pub fn svg(site: &Site, found: &Calibration) -> Result<String, Error> {
    let before: Vec<Plan> = found.seen.iter().map(|seen| seen.guess).collect();
    let after: Vec<Plan> = (found.sensors.iter())
        .map(|of| {
            let [x, y, _] = of.position_m;
            Plan { yaw_rad: of.rotation_deg.yaw.to_radians(), at_m: DVec2::new(x, y) }
        })
        .collect();
    let panels = [
        panel("As the site file has the sensors", site, found, &before),
        panel("As they were found", site, found, &after),
    ];
    Ok(plot::draw_grid("calibrate", &panels, 2, SIZE)?.svg)
}

fn panel(title: &str, site: &Site, found: &Calibration, plans: &[Plan]) -> Panel {
    let [least_m, most_m] = site.hall.bounds_m();
    let (least_m, most_m) = (least_m - MARGIN_M, most_m + MARGIN_M);
    let mut series = vec![walls(site)];
    for (s, plan) in plans.iter().enumerate() {
        let (seen, color) = (&found.seen[s], COLORS[s % COLORS.len()]);
        let inside = |p: &DVec2| p.cmpgt(least_m).all() && p.cmplt(most_m).all();
        let point = |p: DVec2| (p.x, p.y);
        let every = seen.upright_m.len().div_ceil(POINTS_MAX).max(1);
        let upright =
            seen.upright_m.iter().step_by(every).map(|p| plan.point(p.truncate())).filter(inside).map(point);
        series.push(of(String::new(), color, Mark::Discs(0.8), upright.collect()));
        for way in &seen.ways {
            let way = way
                .iter()
                .step_by(SIGHTINGS)
                .map(|sighting| plan.point(sighting.position_m))
                .filter(inside)
                .map(point);
            series.push(of(String::new(), color, Mark::Line(0.8), way.collect()));
        }
        let name = found.sensors[s].sensor.clone();
        series.push(of(name, color, Mark::Diamonds(7.0), vec![point(plan.at_m)]));
    }
    Panel {
        title: format!("{title}: y, m"),
        x_label: "x, m".into(),
        x: (least_m.x, most_m.x),
        y: (least_m.y, most_m.y),
        equal_axes: true,
        series,
        ..Panel::default()
    }
}

fn walls(site: &Site) -> Series {
    let corners = site.hall.corners();
    let around = corners.iter().chain(corners.first()).map(|corner| (corner.x, corner.y)).collect();
    of("walls of the site file".into(), HALL, Mark::Line(1.5), around)
}

fn of(name: String, color: &'static str, mark: Mark, points: Vec<(f64, f64)>) -> Series {
    Series { name, color, mark, points, band: Vec::new() }
}
