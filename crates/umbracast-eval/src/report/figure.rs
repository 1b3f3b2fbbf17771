//! A figure, and the colours, lines and axes that figures have in common.

use umbracast::Error;

use super::plot::{Drawing, Mark, Panel, Series, draw, draw_grid, svg};

/// A figure with what a reader needs to understand it.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without an ending.
    pub name: &'static str,
    /// One line above it.
    pub title: String,
    /// What is drawn and how to read it.
    pub caption: String,
    /// The picture by itself, its legend below.
    pub drawing: Drawing,
    /// For the page: its panels (SVG) without a legend, which stand side by side or below each other.
    pub panels: Vec<String>,
    /// The same for a narrow page, where they differ.
    pub narrow: Vec<String>,
    /// For the page: name, colour and how it is drawn.
    pub legend: Vec<(String, &'static str, Mark)>,
    /// It takes the whole width of the page, not half of it.
    pub whole_width: bool,
}

/// How large panels are drawn, pixels.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// In the picture by itself.
    pub alone: (f64, f64),
    /// On the page.
    pub page: (f64, f64),
    /// On a narrow page, where that is not the same.
    pub narrow: Option<(f64, f64)>,
}

impl Figure {
    /// Draws its panels, the legend of all being the first one's.
    ///
    /// # Errors
    /// A picture that could not be coded.
    pub fn of(
        name: &'static str,
        (title, caption): (String, String),
        panels: &[Panel],
        sizes: Sizes,
    ) -> Result<Self, Error> {
        let drawing = match panels {
            [panel] => draw(name, panel, sizes.alone)?,
            _ => draw_grid(name, panels, 2, sizes.alone)?,
        };
        let drawn = |kind: &str, size: (f64, f64)| -> Vec<String> {
            (0..).zip(panels).map(|(i, panel)| svg(&format!("{name}-{kind}{i}"), panel, size)).collect()
        };
        let entries = panels.first().map_or(&[][..], |panel| &panel.series);
        let named = entries.iter().filter(|series| !series.name.is_empty());
        Ok(Self {
            name,
            title,
            caption,
            drawing,
            panels: drawn("page", sizes.page),
            narrow: sizes.narrow.map(|size| drawn("narrow", size)).unwrap_or_default(),
            legend: named.map(|series| (series.name.clone(), series.color, series.mark)).collect(),
            whole_width: panels.len() > 1,
        })
    }
}

pub const BLUE: &str = "#0072b2";
pub const ORANGE: &str = "#d55e00";
pub const GREEN: &str = "#009e73";
pub const PURPLE: &str = "#aa4499";
pub const GOLD: &str = "#b8860b";
pub const YELLOW: &str = "#f0e442";
pub const SKY: &str = "#56b4e9";
pub const GREY: &str = "#888888";
pub const LIGHT: &str = "#cccccc";
pub const BLACK: &str = "#222222";
pub const RED: &str = "#cc3311";

/// Points of one kind.
pub fn series(name: impl Into<String>, color: &'static str, mark: Mark, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.into(), color, mark, points, band: Vec::new() }
}

/// Axes of a chart over milliseconds ahead, unless changed.
pub fn axes(title: &str, x_label: &str, y: (f64, f64)) -> Panel {
    Panel {
        title: title.into(),
        x_label: x_label.into(),
        x: (0.0, 1000.0),
        y,
        x_step: Some(200.0),
        y_step: Some(if y.1 - y.0 < 0.55 { 0.1 } else { 0.2 }),
        y_digits: 1,
        ..Panel::default()
    }
}
