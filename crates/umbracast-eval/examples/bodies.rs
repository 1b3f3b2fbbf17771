//! What the program learned of ten bodies, beside their meshes, as `record/bodies.svg` has it:
//!
//! `cargo run --release -p umbracast-eval --example bodies -- FIGURE.svg`
//!
//! Each walks across the hall with somebody else of his kind, and is drawn after ten seconds: from his right, and from behind. What he
//! pushes is a track of its own. Arms, which rays meet as well, are left out. Tuning seeds.

use std::fmt::Write;

use umbracast::blockage::{BodyModel, slices_of};
use umbracast::geometry::{DVec2, DVec3};
use umbracast::lidar::Assembler;
use umbracast::track::Track;
use umbracast::{Config, Error, Health, Pipeline};
use umbracast_eval::run::chain::{drawn_scenes, empty_frames, push};
use umbracast_sim::body::Bodies;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::Preset;
use umbracast_sim::scene::{PersonTruth, Scene};

const SEED: u64 = 161_000;
/// Frames until a body is drawn.
const FRAMES: usize = 100;
const KINDS: [Kind; 10] = [
    Kind::Plain,
    Kind::Child,
    Kind::Bag,
    Kind::Bags,
    Kind::Rucksack,
    Kind::Phone,
    Kind::Umbrella,
    Kind::Pram,
    Kind::Frame,
    Kind::Wheelchair,
];
/// Meshes are drawn in cells of this width.
const CELL_M: f64 = 0.02;
/// Each view shows so much to either side, and from the floor up.
const HALF_M: f64 = 1.2;
const HIGH_M: f64 = 2.2;
const PIXELS_PER_M: f64 = 60.0;

fn main() -> Result<(), Error> {
    let figure = std::env::args().nth(1).ok_or_else(|| Error::new("expected: FIGURE.svg"))?;
    let config = Config::default();
    let mut learned = Pipeline::new(&config, None)?;
    empty_frames(&config.site, SEED)?.iter().for_each(|frame| learned.learn_empty(frame));
    let (wide, high) = (2.0 * HALF_M * PIXELS_PER_M, (HIGH_M + 0.5) * PIXELS_PER_M);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        4.0 * wide,
        5.0 * high
    );
    println!("kind        height, m  learned  from the axis, m  umbrella's radius, m");
    for (i, kind) in KINDS.into_iter().enumerate() {
        let Watched { person, track, things, triangles_m } = watch(&config, learned.clone(), kind)?;
        let off_m = (track.position_m - person.state.position_m).length();
        let radius = track.canopy.map_or("-".to_owned(), |canopy| format!("{:.2}", canopy.radius_m));
        let (height_m, learned_m) = (person.state.height_m, track.height_m);
        println!("{:<12}{height_m:>9.2}{learned_m:>9.2}{off_m:>18.3}{radius:>22}", kind.name());
        let (x, y) = (2.0 * wide * (i % 2) as f64, high * (i / 2) as f64);
        for view in [View::Right, View::Behind] {
            let at = (x + wide * (f64::from(view as u8) + 0.5), y + high - 0.2 * PIXELS_PER_M);
            let _ = writeln!(svg, "<g transform=\"translate({:.0} {:.0})\">", at.0, at.1);
            draw_mesh(&mut svg, view, &person, &triangles_m);
            std::iter::once(&track).chain(&things).for_each(|of| draw_learned(&mut svg, view, &person, of));
            svg.push_str("</g>\n");
        }
        let at = (x + wide, y + high - 0.02 * PIXELS_PER_M);
        let _ = writeln!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>",
            at.0,
            at.1,
            kind.name()
        );
    }
    svg.push_str("</svg>\n");
    std::fs::write(&figure, svg).map_err(|e| Error::new(format!("{figure}: {e}")))
}

/// From where somebody is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
enum View {
    Right,
    Behind,
}

/// Somebody, the track that is nearest, what it pushes, and the mesh.
struct Watched {
    person: PersonTruth,
    track: Track,
    things: Vec<Track>,
    triangles_m: Vec<[DVec3; 3]>,
}

/// The first of two people of a kind after ten seconds.
fn watch(config: &Config, mut pipeline: Pipeline, kind: Kind) -> Result<Watched, Error> {
    let bodies = Bodies::new(if kind == Kind::Plain { vec![] } else { vec![(kind, 1.0)] }, [])?;
    let crowd = drawn_scenes(&[Preset::Orca03], 1, 2, SEED)[0].crowd();
    let mut scene = Scene::new(crowd, &config.site, SEED)?.with_bodies(&bodies);
    let (mut assembler, mut health) = (Assembler::new(&config.site)?, Health::default());
    let (mut tracks, mut shown) = (Vec::new(), None);
    for _ in 0..FRAMES {
        let frame = scene.next_frame().ok_or_else(|| Error::new("the scene is shorter than ten seconds"))?;
        push(&mut assembler, &frame.packets, &mut health);
        while let Some(seen) = assembler.pop() {
            tracks.clone_from(&pipeline.step(&seen).tracks);
            shown = Some(seen.time_ns);
        }
    }
    let shown_ns = shown.ok_or_else(|| Error::new("the sensors gave no frame"))?;
    let walker = &scene.walkers()[0];
    let state = walker.state_at(shown_ns).ok_or_else(|| Error::new("nobody walks"))?;
    let off_m = |track: &&Track| track.position_m.distance(state.position_m);
    let people = tracks.iter().filter(|track| track.confirmed);
    let track = people.min_by(|a, b| off_m(a).total_cmp(&off_m(b))).cloned();
    let track = track.ok_or_else(|| Error::new("nobody is followed"))?;
    let things = tracks.iter().filter(|of| of.part_of == Some(track.id)).cloned().collect();
    let mut corners_m = Vec::new();
    walker.mesh_at(shown_ns, &mut corners_m);
    let triangles_m = walker.surface().triangles.iter().map(|t| t.map(|i| corners_m[i as usize])).collect();
    let person = PersonTruth { person: walker.trajectory.person, state, arrived: false, returns: 0 };
    Ok(Watched { person, track, things, triangles_m })
}

/// What is drawn to the right.
fn right(view: View, person: &PersonTruth) -> DVec2 {
    let ahead = DVec2::from_angle(person.state.heading_rad);
    // From behind, what is on the left is drawn on the left.
    if view == View::Right { ahead } else { -ahead.perp() }
}

/// The mesh as a shadow.
fn draw_mesh(svg: &mut String, view: View, person: &PersonTruth, triangles_m: &[[DVec3; 3]]) {
    let right = right(view, person);
    let (columns, rows) = ((2.0 * HALF_M / CELL_M) as usize, (HIGH_M / CELL_M) as usize);
    let mut covered = vec![false; columns * rows];
    for [a, b, c] in triangles_m {
        // Triangles are smaller than a few cells.
        let steps = ((a.distance(*b).max(a.distance(*c)) / (0.5 * CELL_M)).ceil() as usize).max(1);
        for i in 0..=steps {
            for j in 0..=steps - i {
                let [u, v] = [i, j].map(|k| k as f64 / steps as f64);
                let p = *a + (*b - *a) * u + (*c - *a) * v;
                let x = (p.truncate() - person.state.position_m).dot(right) + HALF_M;
                let [column, row] = [x, p.z].map(|m| (m / CELL_M).floor());
                if column >= 0.0 && row >= 0.0 && (column as usize) < columns && (row as usize) < rows {
                    covered[row as usize * columns + column as usize] = true;
                }
            }
        }
    }
    for (row, cells) in covered.chunks(columns).enumerate() {
        let mut column = 0;
        for run in cells.chunk_by(|a, b| a == b) {
            if run[0] {
                let x = column as f64 * CELL_M - HALF_M;
                bar(svg, x, row as f64 * CELL_M, run.len() as f64 * CELL_M, CELL_M, "fill=\"#b8c4cc\"");
            }
            column += run.len();
        }
    }
}

/// The slices that rays meet, as boxes.
fn draw_learned(svg: &mut String, view: View, person: &PersonTruth, track: &Track) {
    let off_m = (track.position_m - person.state.position_m).dot(right(view, person));
    let mut bottom = 0.0;
    for slice in slices_of(&BodyModel::shipped(), track) {
        let (middle, half) = if view == View::Right {
            (slice.ahead, slice.half_depth)
        } else {
            (-slice.left, slice.half_width)
        };
        let [x, low, width, up] =
            [middle - half, bottom, 2.0 * half, slice.top - bottom].map(|share| share * track.height_m);
        bar(svg, off_m + x, low, width, up, "fill=\"none\" stroke=\"#c0392b\" stroke-width=\"1.2\"");
        bottom = slice.top;
    }
}

fn bar(svg: &mut String, x_m: f64, low_m: f64, width_m: f64, high_m: f64, style: &str) {
    let [x, y, width, height] = [x_m, -low_m - high_m, width_m, high_m].map(|m| m * PIXELS_PER_M);
    let _ = writeln!(
        svg,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {style}/>"
    );
}
