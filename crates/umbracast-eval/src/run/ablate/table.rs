//! The ablation as a table, as rows for a program, and as a picture.

use std::fmt::Write as _;

use super::{Ablated, Compared, Figure, Row};

/// Figures that have a table of their own, and what a change of 1 stands for in it.
const TABLES: [(Figure, f64, &str); 4] = [
    (Figure::F1, 1e3, "F1 within 300 ms, first access point, thousandths more than with everything"),
    (Figure::Idf1, 1e3, "IDF1, thousandths more"),
    (Figure::PositionM, 1e3, "Position RMSE, millimetres more"),
    (Figure::DisplacementM, 1e3, "Displacement at 900 ms, millimetres more"),
];
/// A change of F1 of so much has the full colour.
const FULL: f64 = 0.03;

/// A table a figure: mechanisms down, data across. A star marks a change whose 95 % interval excludes none.
pub fn to_text(sets: &[Ablated]) -> String {
    let mut text = String::new();
    for (figure, unit, title) in TABLES {
        let _ = writeln!(text, "{title}");
        let _ = write!(text, "{:22}", "without");
        sets.iter().for_each(|set| {
            let _ = write!(text, " {:>10}", set.name);
        });
        text.push('\n');
        for r in 0..sets.first().map_or(0, |set| set.rows.len()) {
            let _ = write!(text, "{:22}", name(&sets[0].rows[r]));
            for set in sets {
                let compared = compared(&set.rows[r], figure);
                let cell = match (r, compared.value, compared.more) {
                    (0, Some(value), _) => format!("{value:.3} "),
                    (_, _, Some(more)) => format!("{:+.0}{}", more * unit, mark(&compared)),
                    _ => "- ".to_owned(),
                };
                let _ = write!(text, " {cell:>10}");
            }
            text.push('\n');
        }
        text.push('\n');
    }
    let _ = writeln!(text, "Time of a frame, median, microseconds more");
    for r in 0..sets.first().map_or(0, |set| set.rows.len()) {
        let _ = write!(text, "{:22}", name(&sets[0].rows[r]));
        for set in sets {
            let own = set.rows[r].frame.as_secs_f64() * 1e6;
            let whole = set.rows[0].frame.as_secs_f64() * 1e6;
            let cell = if r == 0 { format!("{own:.0} ") } else { format!("{:+.0} ", own - whole) };
            let _ = write!(text, " {cell:>10}");
        }
        text.push('\n');
    }
    text
}

/// A line a data set, variant and figure.
pub fn to_csv(sets: &[Ablated]) -> String {
    let mut text = "data,scenes,without,figure,value,more,more_low,more_high\n".to_owned();
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
    for set in sets {
        for row in &set.rows {
            for (figure, compared) in Figure::ALL.iter().zip(&row.figures) {
                let [low, high] = compared.interval.map_or([None; 2], |[low, high]| [Some(low), Some(high)]);
                let _ = writeln!(
                    text,
                    "{},{},{},\"{}\",{},{},{},{}",
                    set.name,
                    set.scenes,
                    name(row),
                    figure.name(),
                    cell(compared.value),
                    cell(compared.more),
                    cell(low),
                    cell(high)
                );
            }
        }
    }
    text
}

/// What F1 loses (orange) or gains (blue) without each mechanism on each set of data (SVG).
pub fn figure(sets: &[Ablated]) -> String {
    let rows = sets.first().map_or(0, |set| set.rows.len()).saturating_sub(1);
    let (left, top, wide, high) = (190.0, 110.0, 62.0, 22.0);
    let width = left + wide * sets.len() as f64 + 20.0;
    let height = top + high * rows as f64 + 40.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    for (s, set) in sets.iter().enumerate() {
        let (x, y) = (left + wide * (s as f64 + 0.5), top - 8.0);
        let _ =
            writeln!(svg, "<text x=\"{x}\" y=\"{y}\" transform=\"rotate(-40 {x} {y})\">{}</text>", set.name);
        for r in 0..rows {
            let y = top + high * r as f64;
            if s == 0 {
                let label = name(&set.rows[r + 1]);
                let _ = writeln!(
                    svg,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{label}</text>",
                    left - 8.0,
                    y + 15.0
                );
            }
            let compared = compared(&set.rows[r + 1], Figure::F1);
            let Some(more) = compared.more else { continue };
            let share = (more.abs() / FULL).min(1.0);
            let color = if more < 0.0 { "#e66101" } else { "#2166ac" };
            let x = left + wide * s as f64;
            let _ = writeln!(
                svg,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{wide}\" height=\"{high}\" fill=\"{color}\" \
                 fill-opacity=\"{share:.2}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{:+.0}{}</text>",
                x + wide * 0.5,
                y + 15.0,
                more * 1e3,
                mark(&compared)
            );
        }
    }
    let _ = writeln!(
        svg,
        "<text x=\"8\" y=\"{}\">F1 within 300 ms without the mechanism, thousandths more (blue) or less (orange); * \
         interval excludes none</text>\n</svg>",
        height - 14.0
    );
    svg
}

fn name(row: &Row) -> &'static str {
    row.without.map_or("nothing", |mechanism| mechanism.name())
}

fn compared(row: &Row, figure: Figure) -> Compared {
    let place = Figure::ALL.iter().position(|f| *f == figure).unwrap_or(0);
    row.figures[place]
}

fn mark(compared: &Compared) -> &'static str {
    match compared.interval {
        Some([low, high]) if low > 0.0 || high < 0.0 => "*",
        _ => " ",
    }
}
