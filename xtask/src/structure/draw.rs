//! The picture: a panel for the packages and one for the modules of each, boxes from above in the order of the data,
//! and an arrow from the user to the used. Arrows up, as they should be, run on the right; arrows down run on the
//! left in red. A red box holds files that use one another in a circle.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::graph::Graph;

const BOX_PX: [f64; 2] = [132.0, 22.0];
const STEP_PX: f64 = 31.0;
const MARGIN_PX: f64 = 20.0;
const PANEL_PX: f64 = 360.0;
/// Room for the arrows down.
const LEFT_PX: f64 = 62.0;
const TITLE_PX: f64 = 44.0;
const COLUMNS: usize = 3;
/// Of arrows, by the box they start from, so that one can be followed.
const INKS: [&str; 6] = ["#33658a", "#2f7f5f", "#7a5195", "#8a6d1f", "#4f6d7a", "#5a5f2f"];
const RED: &str = "#c1121f";

/// Boxes with names and a word on each, and how many files of one use how many of another.
struct Panel {
    title: String,
    boxes: Vec<(String, String)>,
    /// Whether files in it go in a circle.
    red: Vec<bool>,
    arrows: BTreeMap<(usize, usize), usize>,
}

/// The whole picture.
pub fn svg(graph: &Graph) -> String {
    let mut panels = vec![of_packages(graph)];
    panels.extend((0..graph.packages.len()).map(|krate| of_rooms(graph, krate)));
    let height = |panel: &Panel| TITLE_PX + STEP_PX * panel.boxes.len() as f64 + MARGIN_PX;
    // Each panel goes below the shortest column.
    let mut bottoms = [0.0_f64; COLUMNS];
    let mut body = String::new();
    for panel in &panels {
        let column = (0..COLUMNS).fold(0, |best, c| if bottoms[c] < bottoms[best] { c } else { best });
        let (x, y) = (MARGIN_PX + PANEL_PX * column as f64, MARGIN_PX + bottoms[column]);
        let _ = write!(body, "<g transform=\"translate({x},{y})\">\n{}</g>\n", drawn(panel));
        bottoms[column] += height(panel);
    }
    let (width, height) = (
        MARGIN_PX * 2.0 + PANEL_PX * COLUMNS as f64,
        MARGIN_PX * 2.0 + bottoms.iter().fold(0.0, |a: f64, b| a.max(*b)),
    );
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<!-- cargo xtask structure -->\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <style>path{{fill:none}} path:hover{{stroke-width:4}} .word{{fill:#666;font-size:10px}}</style>\n{body}</svg>\n"
    )
}

fn of_packages(graph: &Graph) -> Panel {
    let files = |krate: usize| graph.files.iter().filter(|file| file.krate == krate).count();
    let mut panel = Panel {
        title: "Packages".to_owned(),
        boxes: graph
            .packages
            .iter()
            .enumerate()
            .map(|(k, name)| ((*name).to_owned(), many(files(k))))
            .collect(),
        red: vec![false; graph.packages.len()],
        arrows: BTreeMap::new(),
    };
    for &(user, used) in &graph.uses {
        let (from, to) = (graph.files[user].krate, graph.files[used].krate);
        if from != to {
            *panel.arrows.entry((from, to)).or_default() += 1;
        }
    }
    panel
}

/// The rooms of a package: its top modules. The package's first file is no room.
fn of_rooms(graph: &Graph, krate: usize) -> Panel {
    let mut rooms: Vec<&str> = Vec::new();
    for file in graph.files.iter().filter(|file| file.krate == krate && !file.room.is_empty()) {
        if !rooms.contains(&file.room.as_str()) {
            rooms.push(&file.room);
        }
    }
    let room = |file: usize| {
        let file = &graph.files[file];
        rooms.iter().position(|room| file.krate == krate && *room == file.room)
    };
    let files =
        |name: &&str| graph.files.iter().filter(|file| file.krate == krate && file.room == **name).count();
    let mut panel = Panel {
        title: format!("Rooms of {}", graph.packages[krate]),
        boxes: rooms.iter().map(|name| ((*name).to_owned(), many(files(name)))).collect(),
        red: vec![false; rooms.len()],
        arrows: BTreeMap::new(),
    };
    for &(user, used) in &graph.uses {
        if let (Some(from), Some(to)) = (room(user), room(used))
            && from != to
        {
            *panel.arrows.entry((from, to)).or_default() += 1;
        }
    }
    for room in graph.circles.iter().flatten().filter_map(|file| room(*file)) {
        panel.red[room] = true;
    }
    panel
}

fn many(files: usize) -> String {
    if files == 1 { "1 file".to_owned() } else { format!("{files} files") }
}

fn drawn(panel: &Panel) -> String {
    let top = |place: usize| TITLE_PX - 18.0 + STEP_PX * place as f64;
    let mut text = format!("<text x=\"{LEFT_PX}\" y=\"10\" font-weight=\"bold\">{}</text>\n", panel.title);
    for (&(from, to), &count) in &panel.arrows {
        let up = to < from;
        let far = from.abs_diff(to) as f64;
        let reach = 14.0 + 135.0 * far / (far + 9.0);
        let (edge, bend, ink) = if up {
            (LEFT_PX + BOX_PX[0], reach, INKS[from % INKS.len()])
        } else {
            (LEFT_PX, -reach.min(LEFT_PX), RED)
        };
        // An arrow leaves a box above its middle and ends below the middle of another, so that heads stand apart.
        let (start, end) = (top(from) + 0.3 * BOX_PX[1], top(to) + 0.7 * BOX_PX[1]);
        let tip = edge + bend.signum() * 6.0;
        let curve =
            format!("M{edge} {start:.1}C{0:.1} {start:.1} {0:.1} {end:.1} {tip} {end:.1}", edge + bend * 1.3);
        let head = format!("M{tip} {:.1}L{edge} {end:.1}L{tip} {:.1}", end - 3.0, end + 3.0);
        let width = 1.0 + 0.5 * (count as f64).log2();
        let (user, used) = (&panel.boxes[from].0, &panel.boxes[to].0);
        let _ = writeln!(
            text,
            "<path d=\"{curve}{head}\" stroke=\"{ink}\" stroke-width=\"{width:.1}\" stroke-opacity=\"0.75\">\
             <title>{user} uses {used}: {count}</title></path>"
        );
    }
    for (place, ((name, word), red)) in panel.boxes.iter().zip(&panel.red).enumerate() {
        let (y, [width, height]) = (top(place), BOX_PX);
        let line = if *red { RED } else { "#444444" };
        let _ = writeln!(
            text,
            "<rect x=\"{LEFT_PX}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"3\" fill=\"#f6f4ee\" \
             stroke=\"{line}\"/>\n<text x=\"{}\" y=\"{}\">{name}</text>\n\
             <text class=\"word\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{word}</text>",
            LEFT_PX + 7.0,
            y + 15.0,
            LEFT_PX + width - 6.0,
            y + 15.0,
        );
    }
    text
}
