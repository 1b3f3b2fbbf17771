//! How the animation is drawn: one card with a background of its own, so that it reads on a light page and on a dark
//! one; no script, no file beside it.

use std::fmt::Write as _;

use umbracast::Site;

use super::floor::{self, Window};
use super::markup::escaped;

/// Of the card, pixels.
const WIDTH: f64 = 600.0;
/// Around the hall, and above it.
const MARGIN: (f64, f64) = (16.0, 62.0);
/// Below the hall.
const LEGEND: f64 = 84.0;
/// The hall is no higher.
const HEIGHT_MAX: f64 = 640.0;
/// From above, of an adult, metres, and never smaller than so many pixels.
const PERSON: (f64, f64) = (0.28, 4.5);

/// Every class is named within the picture's own name: on a page its style must not touch anything else.
const STYLE: &str = "
#umbracast-animation .card { fill: #ffffff; stroke: #d5d9de; }
#umbracast-animation .floor { fill: #f3f5f7; stroke: #68727d; stroke-width: 2; }
#umbracast-animation .thing { fill: #cdd3da; stroke: #68727d; }
#umbracast-animation .ink { fill: #1f242b; }
#umbracast-animation .soft { fill: #59626d; }
#umbracast-animation .halo { stroke: #f3f5f7; stroke-width: 4; stroke-linejoin: round; paint-order: stroke; }
#umbracast-animation .rule { stroke: #1f242b; stroke-width: 2; fill: none; }
#umbracast-animation .person { fill: #1f242b; stroke: #ffffff; stroke-width: 1.2; }
#umbracast-animation .way { stroke: #0072b2; stroke-width: 2.4; stroke-linecap: round; }
#umbracast-animation .ap { fill: #f0e442; stroke: #1f242b; stroke-width: 1.5; }
#umbracast-animation .lidar { fill: #1f242b; stroke: #ffffff; stroke-width: 1.5; }
@media (prefers-color-scheme: dark) {
#umbracast-animation .card { fill: #15181c; stroke: #3a4149; }
#umbracast-animation .floor { fill: #20252b; stroke: #8d97a3; }
#umbracast-animation .thing { fill: #3a4149; stroke: #8d97a3; }
#umbracast-animation .ink { fill: #eceff2; }
#umbracast-animation .soft { fill: #a9b3be; }
#umbracast-animation .halo { stroke: #20252b; }
#umbracast-animation .rule { stroke: #eceff2; }
#umbracast-animation .person { fill: #eceff2; stroke: #15181c; }
#umbracast-animation .way { stroke: #56b4e9; }
#umbracast-animation .ap { stroke: #15181c; }
#umbracast-animation .lidar { fill: #eceff2; stroke: #15181c; }
}
";

/// What is shown of a link at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    /// The person is not in the scene or has arrived, or hall and furniture block the link.
    Hidden,
    /// In sight, and predicted to stay so.
    InSight,
    /// In sight, and predicted to be blocked within the longest window.
    Predicted,
    /// Blocked by another person, truly.
    Blocked,
}

/// The person's way and the links, at the instants shown.
pub struct Walker {
    /// Where the person is at each step, metres; `None` while not in the scene.
    pub places_m: Vec<Option<(f64, f64)>>,
    /// From there to where the forecast ends, metres; zero without a track.
    pub ways_m: Vec<(f64, f64)>,
    /// By access point: what is shown from which time on, seconds from the start.
    pub links: Vec<Vec<(f64, LinkState)>>,
}

/// Colour, width and dashes of a link. The colours read on both backgrounds; the dashes tell them apart without.
fn look(state: LinkState) -> (&'static str, &'static str, &'static str) {
    match state {
        LinkState::Hidden => ("#8aa0b4", "0", "1 0"),
        LinkState::InSight => ("#8aa0b4", "1", "1 0"),
        LinkState::Predicted => ("#e69f00", "2.8", "8 4"),
        LinkState::Blocked => ("#dd3322", "3.6", "1 0"),
    }
}

/// From metres to pixels, and how long it runs.
pub struct Canvas<'a> {
    site: &'a Site,
    window: Window,
    scale: f64,
    left: f64,
    duration_s: f64,
}

// Writing to a String cannot fail, so what `write!` returns is let go below.
impl<'a> Canvas<'a> {
    /// Of what lies in the window.
    pub fn new(site: &'a Site, window: Window, duration_s: f64) -> Self {
        let (width_m, height_m) = (window.0.1 - window.0.0, window.1.1 - window.1.0);
        let scale = ((WIDTH - 2.0 * MARGIN.0) / width_m).min(HEIGHT_MAX / height_m);
        Self { site, window, scale, left: (WIDTH - width_m * scale) / 2.0, duration_s }
    }

    /// Pixels to the right and down.
    fn at(&self, (x_m, y_m): (f64, f64)) -> (f64, f64) {
        let ((from_m, _), (_, to_m)) = self.window;
        (self.left + (x_m - from_m) * self.scale, MARGIN.1 + (to_m - y_m) * self.scale)
    }

    /// The lower end of the hall.
    fn bottom(&self) -> f64 {
        MARGIN.1 + (self.window.1.1 - self.window.1.0) * self.scale
    }

    /// The card with its headline; `about` tells what is shown.
    pub fn opened(&self, about: &str) -> String {
        let height = self.bottom() + LEGEND;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" id=\"umbracast-animation\" viewBox=\"0 0 {WIDTH} {}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"14\" role=\"img\">\n\
             <title>People walk through a hall; radio links turn amber before a body blocks them, then red</title>\n\
             <style>{STYLE}</style>\n\
             <rect class=\"card\" x=\"0.5\" y=\"0.5\" width=\"{}\" height=\"{}\" rx=\"10\"/>\n\
             <text class=\"ink\" x=\"{m}\" y=\"29\" font-size=\"18\" font-weight=\"600\">Links turn amber before a body \
             blocks them, then red</text>\n\
             <text class=\"soft\" x=\"{m}\" y=\"49\">{}</text>\n",
            px(height),
            WIDTH - 1.0,
            px(height - 1.0),
            escaped(about),
            m = MARGIN.0
        )
    }

    /// Walls, pillars, furniture, and a bar for the scale.
    pub fn hall(&self) -> String {
        let mut svg = format!("<path class=\"floor\" d=\"{}\"/>\n", self.path(&floor::walls(self.site)));
        for outline in floor::standing(self.site) {
            let _ = writeln!(svg, "<path class=\"thing\" d=\"{}\"/>", self.path(&outline));
        }
        let bar_m = floor::scale_bar_m(self.window);
        let (left, y) = (self.left + 22.0, self.bottom() - 24.0);
        let width = bar_m * self.scale;
        let _ = writeln!(
            svg,
            "<path class=\"rule\" d=\"M{} {}v6h{}v-6\"/>\
             <text class=\"ink halo\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{bar_m} m</text>",
            px(left),
            px(y - 6.0),
            px(width),
            px(left + width / 2.0),
            px(y - 10.0)
        );
        svg
    }

    /// Links below, people above; all fade out and in where the loop starts again.
    pub fn moving(&self, walkers: &[Walker]) -> String {
        let mut svg = format!(
            "<g><animate attributeName=\"opacity\" values=\"0;1;1;0\" keyTimes=\"0;0.03;0.97;1\" {}/>\n",
            self.clock()
        );
        for walker in walkers {
            let feet = held(&walker.places_m).into_iter().map(|place| self.at(place)).collect::<Vec<_>>();
            let access_points = floor::access_points(self.site);
            for (states, &from) in walker.links.iter().zip(&access_points) {
                svg += &self.link(self.at(from), &feet, states);
            }
        }
        walkers.iter().for_each(|walker| svg += &self.person(walker));
        svg + "</g>\n"
    }

    fn link(&self, from: (f64, f64), feet: &[(f64, f64)], states: &[(f64, LinkState)]) -> String {
        if states.iter().all(|&(_, state)| state == LinkState::Hidden) {
            return String::new();
        }
        let (x, y): (Vec<f64>, Vec<f64>) = feet.iter().copied().unzip();
        let mut svg = format!("<line x1=\"{}\" y1=\"{}\"", px(from.0), px(from.1));
        let looks: Vec<_> = states.iter().map(|&(_, state)| look(state)).collect();
        // What a viewer without animation shows.
        let still = looks[looks.len() / 2];
        let middle = feet[feet.len() / 2];
        let _ = write!(
            svg,
            " x2=\"{}\" y2=\"{}\" stroke=\"{}\" stroke-width=\"{}\" stroke-dasharray=\"{}\">",
            px(middle.0),
            px(middle.1),
            still.0,
            still.1,
            still.2
        );
        svg += &self.animate("x2", &joined(x.into_iter().map(px)));
        svg += &self.animate("y2", &joined(y.into_iter().map(px)));
        if looks.len() > 1 {
            // The first holds from the very start.
            let share = |i: usize| if i == 0 { 0.0 } else { states[i].0 / self.duration_s };
            let key_times = joined((0..states.len()).map(|i| format!("{:.4}", share(i))));
            let mut switch = |name: &str, values: String| {
                let _ = write!(
                    svg,
                    "<animate attributeName=\"{name}\" calcMode=\"discrete\" keyTimes=\"{key_times}\" \
                     values=\"{values}\" {}/>",
                    self.clock()
                );
            };
            switch("stroke", joined(looks.iter().map(|look| look.0)));
            switch("stroke-width", joined(looks.iter().map(|look| look.1)));
            switch("stroke-dasharray", joined(looks.iter().map(|look| look.2)));
        }
        svg + "</line>\n"
    }

    fn person(&self, walker: &Walker) -> String {
        let feet: Vec<_> = held(&walker.places_m).into_iter().map(|place| self.at(place)).collect();
        let ways = || walker.ways_m.iter().map(|(x_m, y_m)| (x_m * self.scale, -y_m * self.scale));
        let (middle, way) = (feet[feet.len() / 2], ways().nth(feet.len() / 2).unwrap_or_default());
        let mut svg = format!("<g transform=\"translate({} {})\">", px(middle.0), px(middle.1));
        let _ = write!(
            svg,
            "<animateTransform attributeName=\"transform\" type=\"translate\" values=\"{}\" {}/>",
            joined(feet.iter().map(|&(x, y)| format!("{} {}", px(x), px(y)))),
            self.clock()
        );
        if walker.places_m.iter().any(Option::is_none) {
            let shown =
                walker.places_m.iter().map(|place| if place.is_some() { "visible" } else { "hidden" });
            let _ = write!(
                svg,
                "<animate attributeName=\"visibility\" calcMode=\"discrete\" values=\"{}\" {}/>",
                joined(shown),
                self.clock()
            );
        }
        let _ = write!(svg, "<line class=\"way\" x2=\"{}\" y2=\"{}\">", px(way.0), px(way.1));
        svg += &self.animate("x2", &joined(ways().map(|way| px(way.0))));
        svg += &self.animate("y2", &joined(ways().map(|way| px(way.1))));
        let radius = (PERSON.0 * self.scale).max(PERSON.1);
        let _ = writeln!(svg, "</line><circle class=\"person\" r=\"{}\"/></g>", px(radius));
        svg
    }

    /// Sensors and every access point with its name, above everything that moves.
    pub fn fixtures(&self) -> String {
        let mut svg = String::new();
        for place in floor::sensors(self.site) {
            let (x, y) = self.at(place);
            svg += &square(x, y);
        }
        for (access_point, place) in self.site.access_points.iter().zip(floor::access_points(self.site)) {
            let (x, y) = self.at(place);
            svg += &diamond(x, y);
            let _ = writeln!(
                svg,
                "<text class=\"ink halo\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                px(x),
                px(y + 25.0),
                escaped(&access_point.name)
            );
        }
        svg
    }

    /// What is what, and how far the loop has come.
    pub fn legend(&self) -> String {
        let top = self.bottom() + 8.0;
        let width = WIDTH - 2.0 * MARGIN.0;
        let mut svg = format!(
            "<rect class=\"soft\" x=\"{}\" y=\"{}\" width=\"{width}\" height=\"3\" opacity=\"0.75\">{}</rect>\n",
            MARGIN.0,
            px(top),
            self.animate("width", &format!("0;{width}"))
        );
        let (first, second) = (top + 30.0, top + 56.0);
        let columns = [MARGIN.0, 190.0, 440.0];
        let links = [
            (LinkState::InSight, "link in sight"),
            (LinkState::Predicted, "predicted blocked in 0.9 s"),
            (LinkState::Blocked, "blocked now"),
        ];
        for ((state, words), x) in links.into_iter().zip(columns) {
            let (color, stroke, dashes) = look(state);
            let _ = writeln!(
                svg,
                "<path stroke=\"{color}\" stroke-width=\"{stroke}\" stroke-dasharray=\"{dashes}\" d=\"M{} {}h30\"/>",
                px(x),
                px(first - 5.0)
            );
            svg += &words_at(x + 38.0, first, words);
        }
        svg += &diamond(columns[0] + 15.0, second - 5.0);
        svg += &words_at(columns[0] + 38.0, second, "access point");
        let _ = writeln!(
            svg,
            "<path class=\"way\" d=\"M{} {y}h20\"/><circle class=\"person\" cx=\"{}\" cy=\"{y}\" r=\"5\"/>",
            px(columns[1] + 6.0),
            px(columns[1] + 6.0),
            y = px(second - 5.0)
        );
        svg += &words_at(columns[1] + 38.0, second, "person, forecast of 0.9 s");
        svg += &square(columns[2] + 15.0, second - 5.0);
        svg + &words_at(columns[2] + 38.0, second, "LiDAR")
    }

    fn path(&self, outline: &[(f64, f64)]) -> String {
        let corners = outline.iter().map(|&corner| self.at(corner));
        let corners: Vec<String> = corners.map(|(x, y)| format!("{} {}", px(x), px(y))).collect();
        format!("M{}z", corners.join("L"))
    }

    fn animate(&self, attribute: &str, values: &str) -> String {
        format!("<animate attributeName=\"{attribute}\" values=\"{values}\" {}/>", self.clock())
    }

    fn clock(&self) -> String {
        format!("dur=\"{}s\" repeatCount=\"indefinite\"", px(self.duration_s))
    }
}

/// Where somebody stays while not in the scene: at the nearest known place in time, the earlier first.
fn held(places_m: &[Option<(f64, f64)>]) -> Vec<(f64, f64)> {
    let mut last = places_m.iter().copied().flatten().next().unwrap_or_default();
    let place = |place: &Option<(f64, f64)>| {
        last = place.unwrap_or(last);
        last
    };
    places_m.iter().map(place).collect()
}

fn square(x: f64, y: f64) -> String {
    let (x, y) = (px(x - 6.0), px(y - 6.0));
    format!("<rect class=\"lidar\" x=\"{x}\" y=\"{y}\" width=\"12\" height=\"12\"/>\n")
}

fn diamond(x: f64, y: f64) -> String {
    format!("<path class=\"ap\" d=\"M{} {}l8 9l-8 9l-8 -9z\"/>\n", px(x), px(y - 9.0))
}

fn words_at(x: f64, y: f64, words: &str) -> String {
    format!("<text class=\"ink\" x=\"{}\" y=\"{}\">{words}</text>\n", px(x), px(y))
}

/// A tenth of a pixel, without a zero behind the point.
fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn joined(values: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let mut text = String::new();
    for value in values {
        text += if text.is_empty() { "" } else { ";" };
        text += value.as_ref();
    }
    text
}
