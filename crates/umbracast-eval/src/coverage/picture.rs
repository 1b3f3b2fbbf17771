//! The survey as a floor plan (SVG). Few returns are orange, many are blue from light to dark, and blind places are
//! hatched, so that colour-blind readers can read it too.

use std::fmt::Write as _;

use umbracast::Site;
use umbracast::geometry::{DVec2, DVec3};
use umbracast::site::Sensor;

use super::{Coverage, Place};
use crate::report::markup::escaped;
use crate::run::chain::CIRCLE_M;

/// The longer side of the hall, pixels.
const PLAN: f64 = 640.0;
/// Left of the plan, and above it.
const MARGIN: (f64, f64) = (44.0, 64.0);
/// Right of the plan.
const LEGEND: f64 = 236.0;
/// How far the arrow of a sensor goes, metres.
const ARROW_M: f64 = 2.4;
/// Least returns, colour and words of each class.
const CLASSES: [(f64, &str, &str); 6] = [
    (0.0, "url(#blind)", "none: blind"),
    (1.0, "#fdae61", "1 to 5"),
    (6.0, "#d3e5f5", "6 to 15"),
    (16.0, "#8fc1de", "16 to 31"),
    (32.0, "#3f8fc5", "32 to 63"),
    (64.0, "#0b4a8f", "64 or more"),
];
/// Of the dots where the hall blocks a link, by access point.
const DOTS: [&str; 4] = ["#222222", "#aa4499", "#117733", "#882255"];

/// Draws the floor with everything that stands and hangs there.
pub fn svg(site: &Site, coverage: &Coverage) -> String {
    let plan = Plan::of(site);
    let mut svg = plan.opened(site, coverage);
    for (number, (_, color, _)) in CLASSES.iter().enumerate() {
        let cells = plan.cells(coverage, |place| class_of(place.all_returns()) == number);
        let _ = writeln!(svg, "<path fill=\"{color}\" shape-rendering=\"crispEdges\" d=\"{cells}\"/>");
    }
    svg += &plan.standing(site);
    for (number, _) in site.access_points.iter().enumerate() {
        let dots = plan.dots(coverage, number, site.access_points.len());
        let color = DOTS[number % DOTS.len()];
        let _ = writeln!(
            svg,
            "<path stroke=\"{color}\" stroke-width=\"2.6\" stroke-linecap=\"round\" d=\"{dots}\"/>"
        );
    }
    site.sensors.iter().for_each(|sensor| svg += &plan.sensor(sensor));
    for access_point in &site.access_points {
        let (x, y) = plan.at(access_point.position().truncate());
        svg += &diamond(x, y);
        svg += &label(x, y + 20.0, "middle", &access_point.name);
    }
    svg + &plan.legend(site) + "</svg>\n"
}

/// From metres to pixels.
struct Plan {
    least_m: DVec2,
    most_m: DVec2,
    scale: f64,
}

fn class_of(returns: f64) -> usize {
    CLASSES.iter().rposition(|&(least, ..)| returns >= least).unwrap_or(0)
}

// Writing to a String cannot fail, so what `write!` returns is let go below.
impl Plan {
    fn of(site: &Site) -> Self {
        let [least_m, most_m] = site.hall.bounds_m();
        Self { least_m, most_m, scale: PLAN / (most_m - least_m).max_element() }
    }

    /// Pixels to the right and down.
    fn at(&self, position_m: DVec2) -> (f64, f64) {
        let from_corner =
            DVec2::new(position_m.x - self.least_m.x, self.most_m.y - position_m.y) * self.scale;
        (MARGIN.0 + from_corner.x, MARGIN.1 + from_corner.y)
    }

    fn size(&self) -> (f64, f64) {
        ((self.most_m - self.least_m) * self.scale).into()
    }

    /// Title, axes and an empty floor.
    fn opened(&self, site: &Site, coverage: &Coverage) -> String {
        let (width, height) = self.size();
        let (all_width, all_height) = (MARGIN.0 + width + LEGEND, MARGIN.1 + height.max(430.0) + 48.0);
        let (left, top) = MARGIN;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {all_width:.0} {all_height:.0}\" \
             style=\"width: 100%; max-width: {all_width:.0}px; height: auto\" \
             font-family=\"system-ui, sans-serif\" font-size=\"13\" fill=\"#222222\" role=\"img\">\n\
             <title>Returns from a standing person at every place of site {0}</title>\n\
             <defs><pattern id=\"blind\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" \
             patternTransform=\"rotate(45)\"><rect width=\"7\" height=\"7\" fill=\"#ffffff\"/>\
             <rect width=\"2.6\" height=\"7\" fill=\"#b2182b\"/></pattern></defs>\n\
             <rect width=\"{all_width:.0}\" height=\"{all_height:.0}\" fill=\"#ffffff\"/>\n\
             <text x=\"{left}\" y=\"26\" font-size=\"18\" font-weight=\"600\">Site {0}: what the sensors see of a \
             standing person</text>\n\
             <text x=\"{left}\" y=\"46\" fill=\"#555555\">A body of {1} m every {2} m, returns in one revolution of \
             all sensors</text>\n\
             <rect x=\"{left}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#eeeeee\"/>\n",
            escaped(&site.name),
            coverage.options.height_m,
            coverage.options.step_m,
        );
        let bottom = top + height;
        for metre in ticks(self.least_m.x, self.most_m.x) {
            let (x, _) = self.at(DVec2::new(metre, self.least_m.y));
            let _ = writeln!(
                svg,
                "<path stroke=\"#888888\" d=\"M{x:.1} {bottom:.1}v5\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{metre}</text>",
                bottom + 19.0
            );
        }
        for metre in ticks(self.least_m.y, self.most_m.y) {
            let (_, y) = self.at(DVec2::new(self.least_m.x, metre));
            let _ = writeln!(
                svg,
                "<path stroke=\"#888888\" d=\"M{left} {y:.1}h-5\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{metre}</text>",
                left - 8.0,
                y + 4.5
            );
        }
        let (x, y) = (left + width * 0.5, bottom + 37.0);
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">x and y, m</text>");
        svg
    }

    /// Squares round the places that are wanted, neighbours in a row as one.
    fn cells(&self, coverage: &Coverage, wanted: impl Fn(&Place) -> bool) -> String {
        let side = coverage.options.step_m * self.scale;
        let mut runs: Vec<(DVec2, usize)> = Vec::new();
        for place in coverage.places.iter().filter(|place| wanted(place)) {
            match runs.last_mut() {
                Some((start_m, count)) if follows(*start_m, *count, place, coverage.options.step_m) => {
                    *count += 1
                }
                _ => runs.push((place.position_m, 1)),
            }
        }
        let mut path = String::new();
        for (start_m, count) in runs {
            let (x, y) = self.at(start_m);
            let (left, top) = (x - side * 0.5, y - side * 0.5);
            let right = left + side * count as f64;
            let _ = write!(path, "M{left:.1} {top:.1}H{right:.1}V{:.1}H{left:.1}z", top + side);
        }
        path
    }

    /// Where the hall blocks the link to one access point; those of several stand side by side.
    fn dots(&self, coverage: &Coverage, access_point: usize, of: usize) -> String {
        let shift = (access_point as f64 - (of as f64 - 1.0) * 0.5) * coverage.options.step_m / of as f64;
        let mut path = String::new();
        for place in coverage.places.iter().filter(|place| place.static_blocked[access_point]) {
            let (x, y) = self.at(place.position_m + DVec2::X * shift);
            let _ = write!(path, "M{x:.1} {y:.1}h0");
        }
        path
    }

    /// Walls, pillars, furniture, and the circle of the paper's scene where it fits in.
    fn standing(&self, site: &Site) -> String {
        let mut svg = String::from("<g fill=\"#8a8a8a\" stroke=\"#333333\" stroke-width=\"1.2\">\n");
        for pillar in &site.pillars {
            let (x, y) = self.at(DVec2::from_array(pillar.position_m));
            let radius = pillar.radius_m * self.scale;
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\"/>");
        }
        for item in &site.furniture {
            let (x, y) = self.at(DVec2::from_array(item.position_m));
            let [length, depth, _] = item.size_m.map(|m| m * self.scale);
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{length:.1}\" height=\"{depth:.1}\" \
                 transform=\"rotate({} {x:.1} {y:.1})\"/>",
                x - length * 0.5,
                y - depth * 0.5,
                -item.yaw_deg
            );
        }
        svg += &self.walls(site);
        if has_circle(site) {
            let (x, y) = self.at(site.hall.middle_m());
            let radius = CIRCLE_M * self.scale;
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" stroke=\"#333333\" \
                 stroke-dasharray=\"5 4\"/>"
            );
        }
        svg
    }

    fn walls(&self, site: &Site) -> String {
        let ((left, top), (width, height)) = (MARGIN, self.size());
        if site.hall.outline_m.is_empty() {
            return format!(
                "<rect x=\"{left}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"none\" \
                 stroke-width=\"2\"/>\n</g>\n"
            );
        }
        let corners = site.hall.corners().into_iter().map(|corner| {
            let (x, y) = self.at(corner);
            format!("{x:.1},{y:.1}")
        });
        let corners = corners.collect::<Vec<_>>().join(" ");
        format!("<polygon points=\"{corners}\" fill=\"none\" stroke-width=\"2\"/>\n</g>\n")
    }

    /// A square, and an arrow where it looks.
    fn sensor(&self, sensor: &Sensor) -> String {
        let position_m = DVec2::new(sensor.position_m[0], sensor.position_m[1]);
        let (x, y) = self.at(position_m);
        let mut svg = String::new();
        // One that looks straight down has no arrow.
        if let Some(ahead) = sensor.site_from_sensor().direction(DVec3::X).truncate().try_normalize() {
            let (tip_x, tip_y) = self.at(position_m + ahead * ARROW_M);
            let side = |turn: f64| self.at(position_m + ahead * (ARROW_M - 0.7) + ahead.perp() * turn);
            let ((a_x, a_y), (b_x, b_y)) = (side(0.4), side(-0.4));
            let _ = writeln!(
                svg,
                "<path fill=\"none\" stroke=\"#ffffff\" stroke-width=\"5\" d=\"M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}\"/>\
                 <path fill=\"none\" stroke=\"#111111\" stroke-width=\"2.2\" d=\"M{x:.1} {y:.1}L{tip_x:.1} {tip_y:.1}\
                 M{a_x:.1} {a_y:.1}L{tip_x:.1} {tip_y:.1}L{b_x:.1} {b_y:.1}\"/>"
            );
        }
        svg += &square(x, y);
        // Towards the middle, so that the words stay on the floor.
        let (anchor, aside) = if position_m.x > 0.0 { ("end", 8.0) } else { ("start", -8.0) };
        let name = format!("{}, {} m up", sensor.name, sensor.position_m[2]);
        svg + &label(x + aside, y - 14.0, anchor, &name)
    }

    fn legend(&self, site: &Site) -> String {
        let left = MARGIN.0 + self.size().0 + 24.0;
        let mut y = MARGIN.1 + 14.0;
        let mut svg = format!("<text x=\"{left:.1}\" y=\"{y:.1}\" font-weight=\"600\">Returns</text>\n");
        for (_, color, words) in CLASSES.iter().rev() {
            y += 24.0;
            let _ = writeln!(
                svg,
                "<rect x=\"{left:.1}\" y=\"{:.1}\" width=\"26\" height=\"18\" fill=\"{color}\" \
                 stroke=\"#666666\" stroke-width=\"0.8\"/>",
                y - 13.0
            );
            svg += &entry(left, y, words);
        }
        let middle = left + 13.0;
        y += 36.0;
        svg += &square(middle, y - 4.0);
        svg += &entry(left, y, "sensor, the arrow: ahead");
        if !site.access_points.is_empty() {
            y += 24.0;
            svg += &diamond(middle, y - 4.0);
            svg += &entry(left, y, "access point");
        }
        if !(site.pillars.is_empty() && site.furniture.is_empty()) {
            y += 24.0;
            let _ = writeln!(
                svg,
                "<rect x=\"{left:.1}\" y=\"{:.1}\" width=\"26\" height=\"14\" fill=\"#8a8a8a\" stroke=\"#333333\"/>",
                y - 11.0
            );
            svg += &entry(left, y, "pillar, furniture");
        }
        if has_circle(site) {
            y += 24.0;
            let _ = writeln!(
                svg,
                "<path stroke=\"#333333\" stroke-dasharray=\"5 4\" d=\"M{left:.1} {:.1}h26\"/>",
                y - 4.0
            );
            svg += &entry(left, y, &format!("circle of {CIRCLE_M} m"));
        }
        for (number, access_point) in site.access_points.iter().enumerate() {
            y += 24.0;
            let _ = writeln!(
                svg,
                "<path stroke=\"{}\" stroke-width=\"2.6\" stroke-linecap=\"round\" stroke-dasharray=\"0 6\" \
                 d=\"M{:.1} {:.1}h22\"/>",
                DOTS[number % DOTS.len()],
                left + 3.0,
                y - 4.0
            );
            svg += &entry(left, y, &format!("hall cuts the link to {}", access_point.name));
        }
        svg
    }
}

fn follows(start_m: DVec2, count: usize, place: &Place, step_m: f64) -> bool {
    let next_m = start_m + DVec2::X * step_m * count as f64;
    place.position_m.distance(next_m) < 0.1 * step_m
}

/// Does the circle of the paper's scene lie within the hall?
fn has_circle(site: &Site) -> bool {
    site.hall.clearance_m(site.hall.middle_m()) >= CIRCLE_M
}

/// Every five metres, or every metre in a small hall.
fn ticks(least_m: f64, most_m: f64) -> impl Iterator<Item = f64> {
    let step_m = if most_m - least_m > 12.0 { 5.0 } else { 1.0 };
    let (least, most) = ((least_m / step_m).ceil() as i64, (most_m / step_m).floor() as i64);
    (least..=most).map(move |i| i as f64 * step_m)
}

fn square(x: f64, y: f64) -> String {
    format!(
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" fill=\"#111111\" stroke=\"#ffffff\" \
         stroke-width=\"1.5\"/>\n",
        x - 6.0,
        y - 6.0
    )
}

fn diamond(x: f64, y: f64) -> String {
    format!(
        "<path fill=\"#f0e442\" stroke=\"#111111\" stroke-width=\"1.5\" d=\"M{x:.1} {:.1}l7 8l-7 8l-7 -8z\"/>\n",
        y - 8.0
    )
}

/// Words on the plan, readable on every colour.
fn label(x: f64, y: f64, anchor: &str, words: &str) -> String {
    format!(
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" stroke=\"#ffffff\" stroke-width=\"4\" \
         stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>\n",
        escaped(words)
    )
}

/// Words beside a sign of the legend.
fn entry(left: f64, y: f64, words: &str) -> String {
    format!("<text x=\"{:.1}\" y=\"{y:.1}\">{}</text>\n", left + 36.0, escaped(words))
}
