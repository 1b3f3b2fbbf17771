//! Tests of what a report contains.

use super::*;
use crate::run::pooled::pool;
use crate::run::scene_score::{ModeRun, score_scene};
use crate::score::hand_made::{link_row, track_row, truth_of};
use crate::score::scene::{SceneRun, SceneTruth};
use umbracast::Health;

/// Three people who stand still; the link of the first is blocked from frame 30 on and we say so in time.
fn scene() -> (SceneTruth, SceneRun) {
    let truth = truth_of(3, 60, |person, frame| person == 0 && frame >= 30);
    let mut run = SceneRun::default();
    for frame in 0..60 {
        for person in 0..3_u32 {
            run.tracks.push(track_row(frame, u64::from(person), f64::from(person) * 10.0, 0.0));
            run.links.push(link_row(frame, u64::from(person), person == 0 && frame >= 21));
        }
    }
    (truth, run)
}

fn scores(config: &Config, groups: &[&str]) -> Scores {
    let (truth, run) = scene();
    let of = |group: &&str| {
        let run = ModeRun { config, rows: &run, health: Health::default() };
        score_scene(0, group, &truth, &[run], None, None).unwrap()
    };
    let mut scenes: Vec<_> = groups.iter().map(of).collect();
    // The same truth each time, taken for that of different recordings.
    (0..).zip(&mut scenes).for_each(|(recording, scene)| scene.recording = recording);
    pool(&scenes.iter().collect::<Vec<_>>(), &["side".to_owned()])
}

/// Everything that is written of the hand-made scene, which is kept, in this hall.
fn written(config: &Config, groups: &[&str]) -> (tempfile::TempDir, String) {
    let (truth, run) = scene();
    let kept = Kept { label: "hand made", mode: Mode::Default, site: &config.site, truth: &truth, run: &run };
    let command = "umbracast evaluate --out <here>";
    let configs = [config.clone()];
    let context = Context { configs: &configs, command, kept: Some(kept), notes: &[] };
    let directory = tempfile::tempdir().unwrap();
    write(directory.path(), &scores(config, groups), &context).unwrap();
    let page = std::fs::read_to_string(directory.path().join("report.html")).unwrap();
    (directory, page)
}

#[test]
fn the_same_scores_give_the_same_files() {
    let config = Config::for_mode(Mode::Default);
    let written = [0, 1].map(|_| {
        let (directory, page) = written(&config, &["orca-03"]);
        let names = ["scores.json", "metrics.svg", "metrics.png", "plan.svg", "link.png", "animation.svg"];
        (names.map(|name| std::fs::read(directory.path().join(name)).unwrap()), page)
    });
    assert!(written[0] == written[1], "same scores, other bytes");
    assert_eq!(&written[0].0[2][1..4], b"PNG");
    let page = &written[0].1;
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count());
    assert!(page.contains("umbracast evaluate --out &lt;here&gt;") && page.contains("clutter_per_m2"));
}

/// Nothing that a browser would load or run; a name space is a name.
fn stands_alone(text: &str) {
    for loads in ["<script", "src=", "<link", "@import", "<image", "<use", "<iframe", "onload"] {
        assert!(!text.contains(loads), "{loads}");
    }
    let named = text.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(text.matches("http").count(), named);
    assert_eq!(text.matches("url(").count(), text.matches("url(#").count());
    assert!(text.matches("href=\"").count() == text.matches("href=\"#").count());
}

#[test]
fn page_and_animation_load_nothing() {
    let (directory, page) = written(&Config::for_mode(Mode::Default), &["orca-03"]);
    stands_alone(&page);
    stands_alone(&std::fs::read_to_string(directory.path().join("animation.svg")).unwrap());
}

#[test]
fn one_scene_of_one_mode_speaks_of_itself_alone() {
    let config = Config::for_mode(Mode::Default);
    let (directory, page) = written(&config, &["orca-03"]);
    // What follows are the settings, and those of the paper's method have its name.
    let page = page.split("<h2>Run it again</h2>").next().unwrap();
    let text = std::fs::read_to_string(directory.path().join("report.txt")).unwrap();
    let shown = to_text(&scores(&config, &["orca-03"]), &config.site);
    for said in [page, &text, &shown] {
        for foreign in ["nterval", "brackets", "95 %", "modes", "every mode", "paper", "ublished", "scenes"] {
            assert!(!said.contains(foreign), "{foreign}");
        }
    }
}

#[test]
fn what_several_scenes_have_is_explained_and_only_the_same_hall_stands_beside_the_paper() {
    let mut config = Config::for_mode(Mode::Default);
    let (_, page) = written(&config, &["orca-03"; 5]);
    for there in ["Shaded: 95 % intervals", "In brackets: 95 % interval", "published", "in the paper"] {
        assert!(page.contains(there), "{there}");
    }
    config.site.hall.length_m += 1.0;
    let (_, page) = written(&config, &["orca-03"; 5]);
    let page = page.split("<h2>Run it again</h2>").next().unwrap();
    assert!(page.contains("In brackets: 95 % interval"));
    assert!(!page.contains("published") && !page.contains("paper"));
}

#[test]
fn long_tables_are_folded_and_the_scene_stands_first() {
    let (_, page) = written(&Config::for_mode(Mode::Default), &["orca-03"]);
    let at = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
    let order = ["id=\"animation\"", "id=\"plan\"", "id=\"link\"", "id=\"metrics\"", "<h2>Tables</h2>"];
    assert!(order.map(at).is_sorted());
    let tables = page.split("<h2>Tables</h2>").nth(1).unwrap().split("<h2>Run it again</h2>").next().unwrap();
    let folded = tables.split("<details").skip(2).filter(|table| table.matches("<tr").count() > 13);
    assert!(folded.map(|table| assert!(table.starts_with('>'), "{table:.80}")).count() > 0);
}

#[test]
fn the_animation_shows_every_access_point_and_turns_amber_then_red() {
    let mut config = Config::for_mode(Mode::Default);
    let roof = umbracast::site::AccessPoint { name: "roof".into(), position_m: [2.0, 3.0, 5.0], radio: None };
    config.site.access_points.push(roof);
    let (directory, page) = written(&config, &["orca-03"]);
    let svg = std::fs::read_to_string(directory.path().join("animation.svg")).unwrap();
    assert!(page.contains(&svg), "the page embeds it");
    for access_point in &config.site.access_points {
        assert_eq!(svg.matches(&format!(">{}</text>", access_point.name)).count(), 1, "{access_point:?}");
    }
    assert_eq!(svg.matches("class=\"ap\"").count(), config.site.access_points.len() + 1, "and the legend");
    assert_eq!(svg.matches("class=\"lidar\"").count(), config.site.sensors.len() + 1, "and the legend");
    assert_eq!(svg.matches("<circle class=\"person\" r=").count(), 3);
    assert!(svg.len() < 300_000);
    // In sight until frame 21, foreseen, and blocked from frame 30 on: once, of one link.
    assert_eq!(svg.matches("values=\"#8aa0b4;#e69f00;#dd3322\"").count(), 1);
    let amber = svg.split("values=\"#8aa0b4;#e69f00;#dd3322\"").next().unwrap();
    let key_times = amber.rsplit("keyTimes=\"").next().unwrap().split('"').next().unwrap();
    let shares: Vec<f64> = key_times.split(';').map(|share| share.parse().unwrap()).collect();
    // Thinned frames: frames 21 and 30 of 59, each to within two.
    assert!((shares[1] - 21.0 / 59.0).abs() < 0.04 && (shares[2] - 30.0 / 59.0).abs() < 0.04, "{shares:?}");
    let plan = std::fs::read_to_string(directory.path().join("plan.svg")).unwrap();
    for access_point in &config.site.access_points {
        assert!(plan.contains(&format!(">{}</text>", access_point.name)), "{access_point:?}");
    }
}

#[test]
fn a_scene_without_time_has_no_animation() {
    let site = Config::default().site;
    let truth = truth_of(1, 1, |_, _| false);
    let run = SceneRun::default();
    let kept = Kept { label: "", mode: Mode::Default, site: &site, truth: &truth, run: &run };
    assert_eq!(animation::svg(&kept), None);
    let truth = SceneTruth::default();
    assert_eq!(animation::svg(&Kept { truth: &truth, ..kept }), None);
}

#[test]
fn the_text_shows_what_was_scored_beside_what_was_published() {
    let text = to_text(&scores(&Config::for_mode(Mode::Default), &["orca-03"; 5]), &Config::default().site);
    // Warned from frame 21 for a blockage at 30: right at w = 9, early before; nothing is missed.
    let row = text.lines().find(|line| line.contains("900 ms") && line.contains("default")).unwrap();
    assert!(row.contains("1.000 [1.000, 1.000]"), "{row}");
    assert!(text.contains("published") && text.contains("0.785"));
}

#[test]
fn a_verdict_says_in_three_sentences_what_the_scores_come_to() {
    let config = Config::for_mode(Mode::Default);
    let told = verdict(&scores(&config, &["orca-03"])).unwrap();
    assert!(
        told.starts_with(
            "Verdict: of the links to side that a body blocked within 300 ms, mode default warned of 100.0 %"
        ),
        "{told}"
    );
    assert!(
        told.contains("\"as now\" of the true present") && told.contains("One scene shows how it works"),
        "{told}"
    );
    assert_eq!(told.matches(". ").count(), 2, "{told}");
    assert!(verdict(&scores(&config, &["orca-03", "mixed"])).unwrap().contains("2 simulated scenes"));
}

#[test]
fn several_presets_get_a_row_each_and_a_pooled_one() {
    let scores = scores(&Config::for_mode(Mode::Default), &["orca-03", "orca-06", "orca-03"]);
    let named: Vec<_> = scores.groups.iter().map(|group| (group.name.as_str(), group.scenes)).collect();
    assert_eq!(named, [("orca-03", 2), ("orca-06", 1), ("all", 3)]);
    let text = to_text(&scores, &Config::default().site);
    let row = |name: &str| text.lines().any(|l| l.starts_with(name) && l.contains("position RMSE"));
    assert!(["orca-03 ", "orca-06 ", "all "].into_iter().all(row), "{text}");
    assert!(["orca-03 ", "orca-06 ", "all "].iter().all(|name| text.lines().any(|l| l.starts_with(name))));
}
