//! Why the paper's figures are what they are, as `record/explain.txt` and `record/explain.svg` have it:
//!
//! `cargo run --release -p umbracast-eval --example explain -- SCENES FIGURE.svg`
//!
//! Tuning seeds; five CPU minutes for two scenes. Expect the published base rate only from bodies wider than
//! people, and Table I only from tracks 0.2 m off.

use std::env::args;

use rayon::prelude::*;
use umbracast::config::{BoxKind, ForecastMethod, Rollout};
use umbracast::forecast::Weights;
use umbracast::site::AccessPoint;
use umbracast::{Config, Error, Mode, STEPS};
use umbracast_eval::explain::figure::{Source, Story, draw};
use umbracast_eval::explain::replay::{Noise, Replay, Surroundings};
use umbracast_eval::explain::search::{
    DIMENSIONS, Fed, PUBLISHED, Setting, Space, Tried, missing, neighbours, search,
};
use umbracast_eval::explain::table_one::{
    displacement_m, fitted, means_m, off_table_one_m, standing_still_m,
};
use umbracast_eval::oracle::ladder;
use umbracast_eval::report::published::{DISPLACEMENT_M, F1_AT_300_MS};
use umbracast_eval::report::tables::Table;
use umbracast_eval::run::chain::{self, SceneResult, SceneSpec, Spec, drawn_scenes};
use umbracast_eval::run::scene_score::Predictor;
use umbracast_eval::score::link_counts::LinkCounts;
use umbracast_sim::crowd::Preset;

/// Tuning seeds only (docs/CONVENTIONS.md).
const FIRST_SEED: u64 = 100_000;
const PEOPLE: usize = 10;
const LSTM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/paper_lstm.safetensors");

/// From the middle of the circle and above the floor, metres.
const PLACES_M: [(f64, f64); 12] = [
    (0.0, 1.0),
    (0.0, 3.0),
    (6.0, 1.0),
    (6.0, 2.0),
    (12.0, 1.0),
    (12.0, 1.5),
    (12.0, 2.0),
    (12.0, 3.0),
    (14.0, 1.0),
    (14.0, 1.5),
    (14.0, 2.0),
    (17.0, 1.5),
];
const WIDTHS: [f64; 4] = [1.0, 1.3, 1.6, 2.0];
const SCALES: [f64; 6] = [0.6, 0.8, 1.0, 1.2, 1.5, 1.8];
const MISSED: [f64; 4] = [0.0, 0.05, 0.1, 0.2];
/// Kinds of error that the tracks may have, of size 1.
const KINDS: [(&str, Noise); 4] = [
    ("alternating", Noise { sigma_m: 1.0, kept: -0.5, late_s: 0.0 }),
    ("white", Noise { sigma_m: 1.0, kept: 0.0, late_s: 0.0 }),
    ("lasting", Noise { sigma_m: 1.0, kept: 0.9, late_s: 0.0 }),
    ("late", Noise { sigma_m: 0.0, kept: 0.0, late_s: 1.0 }),
];
const EXACT: Noise = Noise { sigma_m: 0.0, kept: 0.0, late_s: 0.0 };
/// Of the noise that Table I asks for.
const SHARES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// The kinds that are searched over.
const SEARCHED: [usize; 3] = [0, 1, 2];

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = args().skip(1).collect();
    let [scenes, figure] = &arguments[..] else { return Err(Error::new("expected: SCENES FIGURE.svg")) };
    let scenes: usize = scenes.parse().map_err(|_| Error::new("SCENES: expected a number"))?;
    let bytes = std::fs::read(LSTM).map_err(|e| Error::new(format!("{LSTM}: {e}")))?;
    let weights = Weights::from_safetensors(&bytes)?;

    let chain = whole_chain(scenes, &weights)?;
    let around = surroundings();
    let crowds: Vec<Vec<Replay>> =
        Preset::ALL.iter().map(|&preset| replays(preset, scenes, &around)).collect();
    let (fed, nearest) = table_one(&crowds[0], &weights)?;
    let space = Space { around, fed, scales: SCALES.to_vec(), missed: MISSED.to_vec() };
    let mut tried = Vec::new();
    for (crowd, replays) in crowds.iter().enumerate() {
        tried.extend(search(&space, crowd, replays, &weights)?);
    }
    let base_rates = base_rates(&tried);
    let best = nearest_rows(&space, &tried)?;

    let [rerun, umbracast] = chain.displacement_m;
    let story = Story {
        rungs: chain.rungs,
        displacement_m: vec![
            nearest,
            ("standing still".to_owned(), standing_still_m(&crowds[0])),
            ("paper's method, rerun".to_owned(), rerun),
            ("Umbracast".to_owned(), umbracast),
        ],
        curves: best.curves,
        nearest: [1, 3, 4]
            .map(|d| format!("{}: {}", DIMENSIONS[d], value(&space, &best.setting, d)))
            .join(", "),
        base_rates,
    };
    std::fs::write(figure, draw(&story)?.svg).map_err(|e| Error::new(format!("{figure}: {e}")))
}

/// A name, and metres by step.
type Curve = (String, [f64; STEPS]);

/// What the chain with its sensors brings to the story.
struct Chain {
    /// F1 at 300 ms, `side`.
    rungs: Vec<(&'static str, Source, f64)>,
    /// By step: of the paper's method and of ours.
    displacement_m: [[f64; STEPS]; 2],
}

/// The modes on simulated returns, with mean and draw and both boxes, and the ladder on the same scenes.
fn whole_chain(scenes: usize, weights: &Weights) -> Result<Chain, Error> {
    let with = |mode, rollout, person_box| {
        let mut config = Config::for_mode(mode);
        (config.forecast.rollout, config.blockage.person_box) = (rollout, person_box);
        config
    };
    let runs = [
        ("hdl, mean, AABB", with(Mode::Hdl, Rollout::Mean, BoxKind::Aabb)),
        ("hdl, draw, AABB", with(Mode::Hdl, Rollout::Draw, BoxKind::Aabb)),
        ("hdl, mean, OBB", with(Mode::Hdl, Rollout::Mean, BoxKind::Obb)),
        ("paper, mean, AABB", with(Mode::Paper, Rollout::Mean, BoxKind::Aabb)),
        ("paper, mean, OBB", with(Mode::Paper, Rollout::Mean, BoxKind::Obb)),
        ("default", Config::for_mode(Mode::Default)),
    ];
    let spec = Spec {
        configs: runs.iter().map(|(_, config)| config.clone()).collect(),
        weights: Some(weights.clone()),
        scenes: drawn_scenes(&[Preset::Orca03], scenes, PEOPLE, FIRST_SEED),
        keep: None,
        ladder: true,
    };
    let results = chain::run(&spec, |_| {})?;
    let mut blockage = blockage_table(scenes);
    let mut displacement = displacement_table("Table I and our own tracks");
    let mut found = Vec::new();
    for (i, (name, config)) in runs.iter().enumerate() {
        let links = side_links(&results, i);
        blockage.rows.extend([3, 8].map(|w| {
            let c = &links.windows[w - 1].all;
            let scores = [c.base_rate(), c.accuracy(), c.precision(), c.recall(), c.f1()];
            let start = [(*name).to_owned(), format!("{} ms", w * 100)];
            start.into_iter().chain(scores.map(|s| format!("{:.3}", s.unwrap_or(f64::NAN)))).collect()
        }));
        let scenes: Vec<_> = results.iter().map(|scene| scene.score.modes[i].displacement).collect();
        let steps = means_m(&scenes);
        let forecast = match config.forecast.method {
            ForecastMethod::Lstm => "LSTM on the tracks",
            _ => "own forecast",
        };
        displacement.rows.push(displacement_row(&format!("{forecast} of {name}"), &steps));
        found.push((links.windows[2].all.f1().unwrap_or(f64::NAN), steps));
    }
    let climbed: Vec<_> = results.iter().filter_map(|scene| scene.ladder.as_ref()).collect();
    let ladder = ladder::rows(&climbed, &spec.configs[0].site);
    for row in ladder.iter().filter(|row| row.access_point == "side" && [3, 8].contains(&row.window)) {
        let scores = [row.base_rate, None, row.precision, row.recall, row.f1];
        let cell = |s: Option<f64>| s.map_or_else(String::new, |s| format!("{s:.3}"));
        let start = [format!("known: {}", row.oracle), format!("{} ms", row.window * 100)];
        blockage.rows.push(start.into_iter().chain(scores.map(cell)).collect());
    }
    println!("{}\n{}", blockage.to_text(), displacement.to_text());
    let known = |name, oracle| {
        let row = ladder.iter().find(|r| r.oracle == oracle && r.access_point == "side" && r.window == 3);
        (name, Source::Known, row.and_then(|row| row.f1).unwrap_or(f64::NAN))
    };
    let (rerun, ours) = (found[0], found[runs.len() - 1]);
    Ok(Chain {
        rungs: vec![
            ("the paper, as published", Source::Published, F1_AT_300_MS),
            ("its method, rerun on our scenes", Source::Measured, rerun.0),
            known("future known, its box (AABB)", "true future, AABB of the walking body"),
            ("Umbracast", Source::Measured, ours.0),
            known("future known, trunk and head", "true future, trunk and head"),
            known("future known, upright body: the ceiling", "true future, upright body"),
        ],
        displacement_m: [rerun.1, ours.1],
    })
}

/// What a run said of the links of `side`, the first access point.
fn side_links(results: &[SceneResult], run: usize) -> LinkCounts {
    let of = |scene: &'_ SceneResult| {
        let mut runs = scene.score.said.iter().filter(|said| said.predictor == Predictor::Run);
        runs.nth(run).map(|said| said.access_points[0].clone())
    };
    let scenes: Vec<LinkCounts> = results.iter().filter_map(of).collect();
    LinkCounts::pooled(&scenes.iter().collect::<Vec<_>>())
}

fn blockage_table(scenes: usize) -> Table {
    let title = format!("The method rerun on simulated returns, orca-03, {scenes} scenes, access point side");
    Table::new(title, 1, &["", "window", "base rate", "accuracy", "precision", "recall", "F1"])
}

fn displacement_table(title: &str) -> Table {
    let steps = (1..=STEPS).map(|h| format!("{} ms", h * 100));
    let header = ["".to_owned()].into_iter().chain(steps).chain(["off Table I".to_owned()]).collect();
    let mut table = Table { header, ..Table::new(title, 1, &[]) };
    table.rows.push(displacement_row("published", &DISPLACEMENT_M));
    table
}

fn displacement_row(name: &str, steps_m: &[f64; STEPS]) -> Vec<String> {
    let values =
        steps_m.iter().chain([&off_table_one_m(steps_m)]).map(|m| format!("{m:.3}")).collect::<Vec<_>>();
    [vec![name.to_owned()], values].concat()
}

/// An empty hall with an access point at every place.
fn surroundings() -> Surroundings {
    let mut site = Config::for_mode(Mode::Paper).site;
    let place = |(radius, height): (f64, f64)| AccessPoint {
        name: match radius > 0.0 {
            true => format!("{radius:.0} m out, {height:.1} m high"),
            false => format!("in the middle, {height:.1} m high"),
        },
        position_m: [radius, 0.0, height],
        radio: None,
    };
    site.access_points = PLACES_M.map(place).to_vec();
    Surroundings { site, widths: WIDTHS.to_vec() }
}

fn replays(preset: Preset, scenes: usize, around: &Surroundings) -> Vec<Replay> {
    let specs = drawn_scenes(&[preset], scenes, PEOPLE, FIRST_SEED);
    specs.par_iter().map(|spec: &SceneSpec| Replay::new(spec.crowd(), around, spec.seed)).collect()
}

/// Prints which noise makes the LSTM err as Table I says. Returns what the search feeds it with, and the row that
/// comes nearest to Table I.
fn table_one(replays: &[Replay], weights: &Weights) -> Result<(Vec<Fed>, Curve), Error> {
    let mut table = displacement_table("Table I and the LSTM on true ways (orca-03) with an error added, m");
    table.rows.push(displacement_row("standing still", &standing_still_m(replays)));
    let mut fed = vec![Fed { name: "exact".to_owned(), noise: EXACT, rollout: Rollout::Mean }];
    for (name, rollout) in [("exact", Rollout::Mean), ("exact, drawn", Rollout::Draw)] {
        table.rows.push(displacement_row(name, &displacement_m(replays, &EXACT, rollout, weights)?));
    }
    let mut nearest = (String::new(), [f64::INFINITY; STEPS]);
    for (kind, (name, unit)) in KINDS.iter().enumerate() {
        let noise = fitted(replays, unit, 0.8, Rollout::Mean, weights)?;
        let size = |noise: &Noise| match noise.late_s > 0.0 {
            true => format!("{name} {:.2} s", noise.late_s),
            false => format!("{name} {:.3} m", noise.sigma_m),
        };
        for (rollout, how) in [(Rollout::Mean, ""), (Rollout::Draw, ", drawn")] {
            let steps = displacement_m(replays, &noise, rollout, weights)?;
            table.rows.push(displacement_row(&format!("{}{how}", size(&noise)), &steps));
            if off_table_one_m(&steps) < off_table_one_m(&nearest.1) {
                nearest = (format!("LSTM, {:.2} m off", noise.sigma_m), steps);
            }
            let drawn = rollout == Rollout::Draw;
            if SEARCHED.contains(&kind) && (!drawn || *name == "white") {
                fed.extend(SHARES.map(|share| {
                    let noise = noise.times(share);
                    Fed { name: format!("{}{how}", size(&noise)), noise, rollout }
                }));
            }
        }
    }
    println!("{}", table.to_text());
    Ok((fed, nearest))
}

/// Index of the base rate among the figures.
fn base_rate_index() -> usize {
    PUBLISHED.iter().position(|published| published.name.starts_with("base rate")).unwrap_or(0)
}

/// Prints how often links are blocked, and returns the places of the figure, in the crowd of the figure.
fn base_rates(tried: &[Tried]) -> Vec<(String, Vec<(f64, f64)>)> {
    let of = |crowd: usize, width: usize, place: usize| {
        let found = tried.iter().find(|t| t.setting == [crowd, width, place, 0, 0, 0]);
        found.map_or(f64::NAN, |t| t.figures[base_rate_index()])
    };
    let header: Vec<String> = WIDTHS.iter().map(|width| format!("{width:.1} wide")).collect();
    let words = ["crowd", "access point"].map(str::to_owned).to_vec();
    let title =
        "Share of windows blocked within 300 ms, by the width of the bodies (published: 0.28 to 0.32)";
    let mut table = Table { header: [words, header].concat(), ..Table::new(title, 2, &[]) };
    let names: Vec<String> = surroundings().site.access_points.into_iter().map(|ap| ap.name).collect();
    for (crowd, preset) in Preset::ALL.iter().enumerate() {
        for (place, name) in names.iter().enumerate() {
            let rates = (0..WIDTHS.len()).map(|width| format!("{:.3}", of(crowd, width, place)));
            table.rows.push([preset.name().to_owned(), name.clone()].into_iter().chain(rates).collect());
        }
    }
    println!("{}", table.to_text());
    let drawn = [1, 3, 10, 4].map(|place| {
        let points = WIDTHS.iter().enumerate().map(|(width, &w)| (w, of(0, width, place)));
        (names[place].clone(), points.collect())
    });
    drawn.to_vec()
}

/// Prints the rows that come nearest, and what becomes of the first when one thing changes. Returns the first.
fn nearest_rows(space: &Space, tried: &[Tried]) -> Result<Tried, Error> {
    let nearest = |among: &dyn Fn(&Setting) -> bool| {
        let rows = tried.iter().filter(|t| among(&t.setting));
        rows.min_by(|a, b| a.deviation.total_cmp(&b.deviation)).ok_or_else(|| Error::new("search: no row"))
    };
    let whole_noise = |s: &Setting| s[3] > 0 && (s[3] - 1) % SHARES.len() == SHARES.len() - 1;
    let best = nearest(&|_| true)?;
    let columns = [
        ("nearest", best),
        ("people as wide as they are", nearest(&|s| s[1] == 0)?),
        ("noise of Table I", nearest(&whole_noise)?),
    ];
    let header: Vec<&str> = ["", "published"].into_iter().chain(columns.map(|(name, _)| name)).collect();
    let mut table = Table::new(format!("Blockage figures: the nearest of {} rows", tried.len()), 1, &header);
    for (dimension, name) in DIMENSIONS.iter().enumerate() {
        let values = columns.map(|(_, t)| value(space, &t.setting, dimension));
        table.rows.push([(*name).to_owned(), String::new()].into_iter().chain(values).collect());
    }
    for (i, published) in PUBLISHED.iter().enumerate() {
        let wanted = match published.at_least {
            true => "> 0".to_owned(),
            false => format!("{} +- {}", published.value, published.rounding),
        };
        let values = columns.map(|(_, t)| {
            let unlike = missing(&t.figures).contains(&published.name);
            format!("{}{:.3}", if unlike { "* " } else { "" }, t.figures[i])
        });
        table.rows.push([published.name.to_owned(), wanted].into_iter().chain(values).collect());
    }
    let deviations = columns.map(|(_, t)| format!("{:.2}", t.deviation));
    table
        .rows
        .push(["off, roundings (RMS)".to_owned(), String::new()].into_iter().chain(deviations).collect());
    table.note = "* not within its rounding".to_owned();
    println!("{}", table.to_text());

    let shown = [0, 1, 2, 3, 4, 7];
    let header =
        ["changed", "to", "off"].into_iter().chain(shown.map(|i| PUBLISHED[i].name)).collect::<Vec<_>>();
    let mut table = Table::new("The nearest row with one thing changed", 2, &header);
    let row = |words: [String; 2], t: &Tried| {
        let figures = shown.map(|i| format!("{:.3}", t.figures[i]));
        words.into_iter().chain([format!("{:.2}", t.deviation)]).chain(figures).collect::<Vec<_>>()
    };
    table.rows.push(row(["nothing".to_owned(), String::new()], best));
    for (dimension, t) in neighbours(tried, &best.setting) {
        let words = [DIMENSIONS[dimension].to_owned(), value(space, &t.setting, dimension)];
        table.rows.push(row(words, t));
    }
    println!("{}", table.to_text());
    Ok(best.clone())
}

/// A dimension of a setting in words.
fn value(space: &Space, setting: &Setting, dimension: usize) -> String {
    let i = setting[dimension];
    match dimension {
        0 => Preset::ALL[i].name().to_owned(),
        1 => format!("{} times", space.around.widths[i]),
        2 => space.around.site.access_points[i].name.clone(),
        3 => space.fed[i].name.clone(),
        4 => format!("{} times", space.scales[i]),
        _ => format!("{:.0} %", space.missed[i] * 100.0),
    }
}
