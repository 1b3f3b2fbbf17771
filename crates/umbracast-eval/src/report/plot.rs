//! Line charts and plan views as SVG and PNG: the only module that knows the plotting crate.

use std::sync::Arc;

use kuva::backend::png::PngBackend;
use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::{LegendEntry, LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;
use kuva::plot::{LinePlot, ScatterPlot};
use kuva::render::annotations::{ShadedRegion, TextAnnotation};
use kuva::render::figure::{Figure, FigureLegendPosition};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::{Scene, render_multiple};
use kuva::render::theme::Theme;
use umbracast::Error;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A line of this width.
    Line(f64),
    /// A dashed line of this width.
    Dashed(f64),
    /// Discs of this radius.
    Discs(f64),
    /// Diamonds of this radius.
    Diamonds(f64),
    /// Squares of this radius.
    Squares(f64),
    /// For the legend alone: what a shaded stretch means.
    Patch,
}

/// Points of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// In the legend, unless empty.
    pub name: String,
    /// As HTML writes it.
    pub color: &'static str,
    /// How.
    pub mark: Mark,
    /// In the units of the axes.
    pub points: Vec<(f64, f64)>,
    /// Shaded around a line: lower and upper end at each of the points, or nothing.
    pub band: Vec<[f64; 2]>,
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Above it: what the y axis shows, with the unit, where it can be read without turning the head.
    pub title: String,
    /// Below it, with the unit.
    pub x_label: String,
    /// From, to.
    pub x: (f64, f64),
    /// From, to.
    pub y: (f64, f64),
    /// Distance of the ticks along x, where it matters.
    pub x_step: Option<f64>,
    /// Distance of the ticks along y, where it matters.
    pub y_step: Option<f64>,
    /// Digits after the point on the y axis.
    pub y_digits: usize,
    /// Names along the y axis instead of figures: the first at 1.
    pub y_names: Vec<String>,
    /// The y axis counts in powers of ten.
    pub y_log: bool,
    /// One metre is as long on both axes.
    pub equal_axes: bool,
    /// Drawn in this order.
    pub series: Vec<Series>,
    /// Stretches of x behind everything: from, to, colour.
    pub shaded: Vec<(f64, f64, &'static str)>,
    /// Words at a place.
    pub notes: Vec<(f64, f64, String)>,
}

/// A finished figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// With a `viewBox`, so that it fits any width.
    pub svg: String,
    /// The same at twice the size.
    pub png: Vec<u8>,
}

/// Draws one panel of this size in pixels. `name` tells the figure from others on the same page.
///
/// # Errors
/// The picture could not be coded.
pub fn draw(name: &str, panel: &Panel, size: (f64, f64)) -> Result<Drawing, Error> {
    let (plots, layout) = parts(panel, true);
    finished(name, &render_multiple(plots, layout.with_width(size.0).with_height(size.1)))
}

/// Draws one panel of this size for a page that has a legend of its own.
pub fn svg(name: &str, panel: &Panel, size: (f64, f64)) -> String {
    let (plots, layout) = parts(panel, false);
    let scene = render_multiple(plots, layout.with_width(size.0).with_height(size.1));
    page_svg(name, &scene)
}

/// Draws panels in rows of `columns`, each of this size in pixels, with one legend below: the first panel's.
///
/// # Errors
/// The picture could not be coded.
pub fn draw_grid(name: &str, panels: &[Panel], columns: usize, size: (f64, f64)) -> Result<Drawing, Error> {
    let (plots, layouts): (Vec<_>, Vec<_>) = panels.iter().map(|panel| parts(panel, false)).unzip();
    let figure = Figure::new(panels.len().div_ceil(columns), columns)
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(size.0, size.1)
        .with_shared_legend_position(FigureLegendPosition::Bottom);
    finished(name, &figure.render())
}

fn parts(panel: &Panel, legend: bool) -> (Vec<Plot>, Layout) {
    let mut layout = Layout::new(panel.x, panel.y)
        .with_title(&panel.title)
        .with_x_label(&panel.x_label)
        .with_theme(theme())
        .with_title_size(15)
        .with_label_size(13)
        .with_tick_size(12)
        .with_body_size(12)
        .with_y_tick_format(fixed(panel.y_digits))
        .with_x_axis_min(panel.x.0)
        .with_x_axis_max(panel.x.1)
        .with_y_axis_min(panel.y.0)
        .with_y_axis_max(panel.y.1);
    if let Some(step) = panel.x_step {
        layout = layout.with_x_tick_step(step);
    }
    if let Some(step) = panel.y_step {
        layout = layout.with_y_tick_step(step);
    }
    if !panel.y_names.is_empty() {
        layout = layout.with_y_categories(panel.y_names.clone());
    }
    if panel.y_log {
        layout = layout.with_log_y().with_y_tick_format(TickFormat::Auto);
    }
    if panel.equal_axes {
        layout = layout.with_equal_aspect();
    }
    for &(from, to, color) in &panel.shaded {
        layout =
            layout.with_shaded_region(ShadedRegion::vertical(from, to).with_color(color).with_opacity(0.3));
    }
    for (x, y, text) in &panel.notes {
        let note = TextAnnotation::new(text, *x, *y).with_font_size(11).with_color("#444444");
        layout = layout.with_annotation(note);
    }
    if legend {
        // Given its words, the legend knows how wide its columns must be.
        let entries = panel.series.iter().filter(|series| !series.name.is_empty()).map(entry).collect();
        layout = layout
            .with_legend_entries(entries)
            .with_legend_position(LegendPosition::OutsideBottomColumns)
            .with_legend_box(false);
    }
    (panel.series.iter().map(plot).collect(), layout)
}

fn plot(series: &Series) -> Plot {
    let line = |width| {
        let line = LinePlot::new()
            .with_data(series.points.clone())
            .with_color(series.color)
            .with_stroke_width(width);
        let line = match series.band.len() == series.points.len() {
            true => line.with_band(series.band.iter().map(|b| b[0]), series.band.iter().map(|b| b[1])),
            false => line,
        };
        if series.name.is_empty() { line } else { line.with_legend(&series.name) }
    };
    let marks = |shape, radius| {
        let marks = ScatterPlot::new()
            .with_data(series.points.clone())
            .with_color(series.color)
            .with_size(radius)
            .with_marker(shape);
        Plot::Scatter(if series.name.is_empty() { marks } else { marks.with_legend(&series.name) })
    };
    match series.mark {
        Mark::Line(width) => Plot::Line(line(width)),
        Mark::Dashed(width) => Plot::Line(line(width).with_dashed()),
        Mark::Discs(radius) => marks(MarkerShape::Circle, radius),
        Mark::Diamonds(radius) => marks(MarkerShape::Diamond, radius),
        Mark::Squares(radius) => marks(MarkerShape::Square, radius),
        Mark::Patch => Plot::Line(line(0.0)),
    }
}

fn entry(series: &Series) -> LegendEntry {
    let (shape, dasharray) = match series.mark {
        Mark::Line(_) => (LegendShape::Line, None),
        Mark::Dashed(_) => (LegendShape::Line, Some("6 4".into())),
        Mark::Discs(_) => (LegendShape::Circle, None),
        Mark::Diamonds(_) => (LegendShape::Marker(MarkerShape::Diamond), None),
        Mark::Squares(_) => (LegendShape::Marker(MarkerShape::Square), None),
        Mark::Patch => (LegendShape::Rect, None),
    };
    LegendEntry { label: series.name.clone(), color: series.color.into(), shape, dasharray }
}

fn theme() -> Theme {
    Theme {
        axis_color: "#666666".into(),
        grid_color: "#e6e6e6".into(),
        tick_color: "#666666".into(),
        text_color: "#222222".into(),
        legend_border: "none".into(),
        font_family: Some("system-ui, sans-serif".into()),
        ..Theme::light()
    }
}

fn fixed(digits: usize) -> TickFormat {
    TickFormat::Custom(Arc::new(move |value| format!("{value:.digits$}")))
}

fn finished(name: &str, scene: &Scene) -> Result<Drawing, Error> {
    let png = PngBackend::new()
        .with_scale(2.0)
        .render_scene(scene)
        .map_err(|e| Error::new(format!("figure: cannot be drawn as PNG: {e}")))?;
    Ok(Drawing { svg: page_svg(name, scene), png })
}

fn page_svg(name: &str, scene: &Scene) -> String {
    let svg = SvgBackend::new().render_scene(scene);
    renamed(&scalable(&svg, scene.width, scene.height), name)
}

/// The crate writes a fixed size; a page needs one that shrinks with it.
fn scalable(svg: &str, width: f64, height: f64) -> String {
    let body = svg.split_once('>').map_or("", |(_, body)| body);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         style=\"width: 100%; max-width: {width}px; height: auto\" \
         font-family=\"system-ui, sans-serif\" role=\"img\">{body}"
    )
}

/// The crate numbers its clip paths through the whole program; here they count within the figure, so that the
/// same scores give the same bytes and two figures on a page do not share one.
fn renamed(svg: &str, name: &str) -> String {
    const CLIP: &str = "kuva-clip-";
    let mut pieces = svg.split(CLIP);
    let mut text = pieces.next().unwrap_or_default().to_owned();
    let mut seen: Vec<&str> = Vec::new();
    for piece in pieces {
        let (number, rest) = piece.split_at(piece.find(|c: char| !c.is_ascii_digit()).unwrap_or(piece.len()));
        let at = seen.iter().position(|&known| known == number).unwrap_or_else(|| {
            seen.push(number);
            seen.len() - 1
        });
        text += &format!("{name}-clip-{at}{rest}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clip_paths_count_within_their_figure() {
        let svg = "<clipPath id=\"kuva-clip-7\"/><g clip-path=\"url(#kuva-clip-7)\"/><clipPath id=\"kuva-clip-12\"/>";
        let expected = "<clipPath id=\"plan-clip-0\"/><g clip-path=\"url(#plan-clip-0)\"/><clipPath id=\"plan-clip-1\"/>";
        assert_eq!(renamed(svg, "plan"), expected);
    }
}
