//! Rules for the repository's own text: the order of the runtime's modules, what they may not use, and the size of
//! files.

use std::fs;
use std::path::{Path, PathBuf};

/// No file is longer; a second room hides in one that wants to be.
const LINES_MAX: usize = 500;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every Rust file below a folder, in order of name.
fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

fn files_below(folders: &[&str]) -> Vec<(String, String)> {
    let mut paths = Vec::new();
    folders.iter().for_each(|folder| rust_files(&root().join(folder), &mut paths));
    assert!(!paths.is_empty(), "no Rust file below {folders:?}");
    paths
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(root()).unwrap_or(&path).display().to_string();
            (name, fs::read_to_string(&path).expect("a source file is text"))
        })
        .collect()
}

/// The modules of the runtime in the order that `lib.rs` gives them.
fn module_order() -> Vec<String> {
    let lib = fs::read_to_string(root().join("src/lib.rs")).expect("src/lib.rs");
    lib.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')).map(String::from).collect()
}

/// The modules named by `crate::NAME` and `use crate::{NAME, ..}` in a text.
fn modules_used(text: &str) -> Vec<String> {
    let code: String =
        text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join(" ");
    let word = |s: &str| s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut used = Vec::new();
    for after in code.split("crate::").skip(1) {
        let Some(group) = after.strip_prefix('{') else {
            used.push(word(after));
            continue;
        };
        let mut depth = 1;
        let mut item = String::new();
        for c in group.chars() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 || (c == ',' && depth == 1) {
                used.push(word(item.trim()));
                item.clear();
            } else {
                item.push(c);
            }
            if depth == 0 {
                break;
            }
        }
    }
    used
}

#[test]
fn a_module_uses_only_modules_above_it() {
    let order = module_order();
    assert!(order.len() > 8, "{order:?}");
    let mut wrong = Vec::new();
    for (name, text) in files_below(&["src"]) {
        let module = name.split('/').nth(1).unwrap_or_default().trim_end_matches(".rs").to_owned();
        let Some(own) = order.iter().position(|m| *m == module) else { continue };
        for used in modules_used(&text) {
            if order.iter().position(|m| *m == used).is_some_and(|place| place > own) {
                wrong.push(format!("{name} uses {used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "these run against the data: {wrong:#?}");
}

#[test]
fn the_order_test_sees_a_group_and_a_path() {
    let text = "use crate::{Error, site::Site};\nlet x = crate::track::Track;\n// crate::health in a comment";
    assert_eq!(modules_used(text), ["Error", "site", "track"]);
}

#[test]
fn the_runtime_has_no_file_socket_clock_or_environment_and_one_place_for_threads() {
    let mut wrong = Vec::new();
    for (name, text) in files_below(&["src"]) {
        for word in ["std::fs", "std::net", "std::time", "std::thread", "std::env", "println!", "static mut"]
        {
            let shares = name == "src/shared.rs" && word == "std::thread";
            if !shares && text.lines().any(|l| !l.trim_start().starts_with("//") && l.contains(word)) {
                wrong.push(format!("{name}: {word}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_runtime_knows_none_of_its_satellites() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let own = manifest.split("\n[dependencies]").nth(1).expect("the package has dependencies");
    let own = own.split("\n[").next().unwrap_or_default();
    assert!(!own.contains("umbracast-"), "package umbracast must see no crate below crates/");
}

#[test]
fn the_simulator_uses_no_algorithm_of_the_runtime() {
    let algorithms = ["detect", "track", "forecast", "blockage", "pipeline", "geometry::slab"];
    for (name, text) in files_below(&["crates/umbracast-sim"]) {
        for module in algorithms {
            assert!(!text.contains(&format!("umbracast::{module}")), "{name} uses umbracast::{module}");
        }
    }
}

#[test]
fn no_file_is_longer_than_a_reader_bears() {
    let long: Vec<String> = files_below(&["src", "crates", "tests", "examples", "xtask", "bench"])
        .into_iter()
        .filter(|(_, text)| text.lines().count() > LINES_MAX)
        .map(|(name, text)| format!("{name}: {} lines", text.lines().count()))
        .collect();
    assert!(long.is_empty(), "{long:#?}");
}

#[test]
fn nothing_is_left_undone() {
    for (name, text) in files_below(&["src", "crates", "examples", "xtask", "bench"]) {
        for word in ["todo!(", "unimplemented!(", "#[ignore"] {
            assert!(!text.contains(word), "{name}: {word}");
        }
    }
}

/// README.md and the pages of docs/: name and text.
fn pages() -> Vec<(String, String)> {
    let docs = fs::read_dir(root().join("docs")).expect("docs/").flatten().map(|entry| entry.path());
    let mut paths: Vec<PathBuf> = docs.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    paths.extend(["README.md", "notebooks/leaderboard.md"].map(|page| root().join(page)));
    paths.sort();
    let name = |path: &Path| path.strip_prefix(root()).unwrap_or(path).display().to_string();
    paths.iter().map(|path| (name(path), fs::read_to_string(path).expect("a page is text"))).collect()
}

/// `cargo xtask quote` cuts the blocks anew.
#[test]
fn every_figure_of_a_page_stands_in_a_recorded_run() {
    let mut quoting = Vec::new();
    for (page, text) in pages() {
        for part in text.split("<!-- from ").skip(1) {
            let (comment, rest) = part.split_once("-->").expect("a comment that names a record");
            let name = comment.split_whitespace().next().expect("the name of a record");
            let block = rest.split("```").nth(1).expect("a block below the comment");
            let lines: Vec<&str> = block.lines().skip(1).filter(|line| !line.trim().is_empty()).collect();
            // A record that nobody has made yet has an empty block.
            let Ok(record) = fs::read_to_string(root().join(name)) else {
                assert!(lines.is_empty(), "{page} quotes {name}, which is not there");
                continue;
            };
            assert!(!lines.is_empty(), "{page} quotes nothing of {name}");
            for line in lines {
                let found = record.lines().any(|recorded| recorded.trim_end() == line.trim_end());
                assert!(found, "{page} quotes a line that {name} does not hold: {line}");
            }
            quoting.push(page.clone());
        }
    }
    for page in ["README.md", "docs/RESULTS.md", "docs/PAPER_FIGURES.md"] {
        assert!(quoting.iter().any(|name| name == page), "{page} quotes no recorded run");
    }
}

/// Figures in the prose of README.md and docs/RESULTS.md that say how something was set up or what is asked. What was measured
/// stands in a quoted block.
const DEFINITIONS: [&str; 26] = [
    "within the next 300 ms",
    "the next 300 ms have",
    "access point 2 m high",
    "one 3 m high in the middle",
    "95 % interval",
    "a standard deviation of 0.12 s unless",
    "people keep 0.3 m and 0.6 m around themselves",
    "a circle of 12.5 m radius",
    "people keep 0.3 m around themselves",
    "a circle of 10 m",
    "stated 90 % regions hold fewer than 90 % of them",
    "F1 at within 300 ms is lost",
    "moves these people apart to 0.35 m",
    "sensors 3, 5, 6 and 8 m high",
    "pairs who walk 0.5 m apart",
    "At 6 m with the paper's pitch",
    "off by half a degree and 3 cm",
    "slips by a degree after 10 s",
    "off by 5 degrees and 0.3 m",
    "ranges that are 3 cm off",
    "3 to 8 m from one sensor",
    "windows of 100 to 900 ms",
    "the median and the 99 % quantile",
    "within 0.5 m, one to one",
    "10 clouds a second",
    "within 0.2 m of each other",
];

/// A page without its blocks, comments and code words, on one line.
fn prose(page: &str) -> String {
    let outside = |text: &str, from: &str, to: &str| {
        let mut parts = text.split(from);
        let first = parts.next().unwrap_or_default().to_owned();
        parts.fold(first, |text, part| text + " " + part.split_once(to).map_or("", |(_, after)| after))
    };
    let text = outside(page, "<!--", "-->");
    // Every other part between marks is inside.
    let kept = |text: &str, mark: &str| text.split(mark).step_by(2).collect::<Vec<_>>().join(" ");
    kept(&kept(&text, "```"), "`").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Numbers with a unit, and decimals as scores have them.
fn figures(prose: &str) -> Vec<String> {
    const UNITS: [&str; 22] = [
        "%", "m", "cm", "mm", "km", "s", "ms", "m/s", "dB", "Hz", "GHz", "deg", "degree", "degrees", "MB",
        "GB", "kB", "MiB", "minute", "minutes", "hours", "clouds",
    ];
    let bare = |word: &str| word.trim_matches(|c: char| "()[],;:.!?*\"".contains(c)).to_owned();
    let words: Vec<&str> = prose.split(' ').collect();
    let mut found = Vec::new();
    for (k, word) in words.iter().enumerate() {
        let number = word.trim_matches(|c: char| "()[],;:!?*\"".contains(c)).trim_end_matches('.');
        let digits = number.trim_end_matches(|c: char| c.is_alphabetic() || c == '%' || c == '/');
        if !digits.ends_with(|c: char| c.is_ascii_digit())
            || !digits.chars().all(|c| c.is_ascii_digit() || ".,+-".contains(c))
        {
            continue;
        }
        let unit = match &number[digits.len()..] {
            "" => words.get(k + 1).map(|next| bare(next)).unwrap_or_default(),
            unit => bare(unit),
        };
        let decimals = digits.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        if UNITS.contains(&unit.as_str()) || decimals >= 2 {
            found.push(words[k..words.len().min(k + 3)].join(" "));
        }
    }
    found
}

#[test]
fn no_sentence_of_the_first_pages_holds_a_figure_that_nobody_can_make_again() {
    let pages: Vec<(String, String)> =
        pages().into_iter().filter(|(name, _)| name == "README.md" || name == "docs/RESULTS.md").collect();
    for (page, text) in &pages {
        let mut prose = prose(text);
        DEFINITIONS.iter().for_each(|phrase| prose = prose.replace(phrase, ""));
        let figures = figures(&prose);
        assert!(figures.is_empty(), "{page}: quote these from a record, or leave them out: {figures:#?}");
    }
    for phrase in DEFINITIONS {
        let stands = pages.iter().any(|(_, text)| prose(text).contains(phrase));
        assert!(stands, "no page defines {phrase:?} any more");
    }
}

#[test]
fn a_figure_in_a_sentence_is_seen_and_a_quoted_one_is_not() {
    let page = "F1 rises to 0.94 (.93 before), by 2 % within 300ms.\n<!-- from record/a.txt 5 m -->\n```text\n0.95 at 7 m\n```\n\
                `--rate 0.25` is half; seeds from 300,000; 20 scenes; GLB 2.0.";
    assert_eq!(
        figures(&prose(page)),
        ["0.94 (.93 before),", "(.93 before), by", "2 % within", "300ms. is half;"]
    );
}

/// A row's figures by the names of their columns, of the first table of record/people.txt.
fn people_row(record: &str, report: &str) -> std::collections::BTreeMap<String, String> {
    let cells = |line: &str| -> Vec<String> {
        line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).map(str::to_owned).collect()
    };
    let mut table = record.lines().skip_while(|line| !line.starts_with("report "));
    let names = cells(table.next().expect("a head"));
    // The last row of a report holds all its recordings.
    let rows = table.take_while(|line| !line.is_empty()).filter(|line| line.starts_with(report));
    let row = cells(rows.last().unwrap_or_else(|| panic!("record/people.txt has no {report}")));
    assert_eq!(row.len(), names.len(), "{row:?}");
    names.into_iter().zip(row).collect()
}

#[test]
fn pages_say_below_persistence_of_truth_where_the_record_does() {
    let record = fs::read_to_string(root().join("record/people.txt")).expect("record/people.txt");
    for report in ["bottleneck", "madras"] {
        let row = people_row(&record, report);
        let figure = |name: &str| row[name].parse::<f64>().expect("a figure");
        for place in ["side", "centre"] {
            let (f1, persistence) = (figure(&format!("F1 {place}")), figure(&format!("persistence {place}")));
            assert!(f1 < persistence, "pages say below persistence: {report}, {place}: {f1}, {persistence}");
        }
    }
    for page in ["README.md", "docs/RESULTS.md", "docs/LOCKED.md"] {
        let (_, text) = pages().into_iter().find(|(name, _)| name == page).expect("a page");
        let says = prose(&text).replace('*', "").to_lowercase();
        let says =
            says.split(". ").any(|s| s.contains("bottleneck") && s.contains("below persistence of truth"));
        assert!(says, "{page} does not say of bottlenecks that F1 is below persistence of truth");
    }
}

#[test]
fn what_fits_never_reads_the_bodies_of_another_maker_that_tests_read() {
    let fits = files_below(&["crates/umbracast-train/src", "train/src"]);
    assert!(fits.len() > 5, "{}", fits.len());
    let mut families = 0;
    for (name, text) in fits {
        families += text.matches("Meshes::family(\"a\")").count();
        let of_a = text.replace("Meshes::family(\"a\")", "").replace("::meshes::Meshes", "");
        assert!(!of_a.to_lowercase().contains("meshes"), "{name}: may read family b");
    }
    assert_eq!(families, 1, "family a is what fits read");
}

/// The release's workflow takes its notes from there.
#[test]
fn the_changelog_tells_of_the_version_that_is_built_in_the_order_of_its_form() {
    let text = fs::read_to_string(root().join("CHANGELOG.md")).expect("CHANGELOG.md");
    let versions: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("## ")).collect();
    let built =
        versions.iter().position(|version| version.split(' ').next() == Some(env!("CARGO_PKG_VERSION")));
    let built = built.unwrap_or_else(|| panic!("CHANGELOG.md tells of {versions:?}"));
    assert!(built == 0 || versions[..built] == ["Unreleased"], "{versions:?}: the newest comes first");
    for version in text.split("\n## ").skip(1) {
        let parts: Vec<&str> = version.lines().filter_map(|line| line.strip_prefix("### ")).collect();
        let order = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"];
        let places: Vec<Option<usize>> =
            parts.iter().map(|part| order.iter().position(|name| name == part)).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{parts:?}, expected of {order:?}");
    }
}

#[test]
fn every_link_of_a_page_leads_somewhere() {
    for (page, text) in pages() {
        let folder = root().join(&page).parent().map(Path::to_path_buf).unwrap_or_default();
        for target in text.split("](").skip(1).filter_map(|after| after.split(')').next()) {
            let file = target.split('#').next().unwrap_or_default();
            let elsewhere = file.is_empty() || file.contains("://") || file.contains(char::is_whitespace);
            assert!(elsewhere || folder.join(file).exists(), "{page} leads to {file}, which is not there");
        }
    }
}

#[test]
fn the_front_door_is_short() {
    let (_, text) = pages().into_iter().find(|(name, _)| name == "README.md").expect("README.md");
    let lines = text.lines().count();
    assert!(lines <= 120, "README.md: {lines} lines");
}
