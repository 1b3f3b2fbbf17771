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
fn the_runtime_has_no_file_socket_clock_thread_or_environment() {
    let mut wrong = Vec::new();
    for (name, text) in files_below(&["src"]) {
        for word in ["std::fs", "std::net", "std::time", "std::thread", "std::env", "println!", "static mut"]
        {
            if text.lines().any(|l| !l.trim_start().starts_with("//") && l.contains(word)) {
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
    paths.push(root().join("README.md"));
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
            let record =
                fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{page}: {name}: {e}"));
            let block = rest.split("```").nth(1).expect("a block below the comment");
            let lines: Vec<&str> = block.lines().skip(1).filter(|line| !line.trim().is_empty()).collect();
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
