//! docs/COMMANDS.md is what the built command says of itself, so that page and command cannot differ.
//! `UPDATE=1 cargo test -p umbracast-cli --test commands_page` writes it.

use std::fs;
use std::path::Path;
use std::process::Command;

const HEAD: &str = "\
# Commands

The command is `umbracast`. `cargo install --path crates/umbracast-cli` installs it. From a checkout, `cargo run --release --`
in front of the arguments does the same without installing.

Exit codes: 0 done, 1 failed, 2 wrong arguments, 3 done but data was lost or skipped (the last line says what).
[GLOSSARY.md](GLOSSARY.md) explains the terms. [USING.md](USING.md) goes through the commands in the order of their use.

A build with `--features node` has `node` and `fleet` too. [STAGES.md](STAGES.md) and [NODES.md](NODES.md) explain them.

The test `crates/umbracast-cli/tests/commands_page.rs` makes this page from the command's help.
";

/// What `umbracast WORDS --help` prints.
fn help(words: &[String]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_umbracast"));
    // The help shows what variables hold on this machine.
    let done = command
        .args(words)
        .arg("--help")
        .env_remove("UMBRACAST_DATA")
        .env_remove("UMBRACAST_LOG")
        .output()
        .expect("it runs");
    assert!(done.status.success(), "{words:?}: {}", done.status);
    String::from_utf8(done.stdout).expect("help is text")
}

/// The commands that a help lists, but for `help` itself.
fn listed(help: &str) -> Vec<String> {
    let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    below
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(String::from)
        .collect()
}

/// One section a command, and those of the commands below it.
fn sections(words: &[String], page: &mut String) {
    let help = help(words);
    let name = [&["umbracast".to_owned()], words].concat().join(" ");
    let level = "#".repeat(2 + words.len().saturating_sub(1));
    page.push_str(&format!("\n{level} {name}\n\n```text\n{}\n```\n", help.trim_end()));
    for command in listed(&help) {
        sections(&[words, &[command]].concat(), page);
    }
}

#[test]
fn the_page_of_commands_is_what_they_say_of_themselves() {
    let mut page = HEAD.to_owned();
    sections(&[], &mut page);
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/COMMANDS.md");
    if std::env::var_os("UPDATE").is_some() {
        fs::write(&place, &page).expect("docs/COMMANDS.md can be written");
    }
    let there = fs::read_to_string(&place).expect("docs/COMMANDS.md");
    let differs = page.lines().zip(there.lines()).find(|(says, stands)| says != stands);
    assert!(page == there, "docs/COMMANDS.md is stale, UPDATE=1 renews it; says and stands: {differs:?}");
}

#[test]
fn the_site_file_of_the_guide_is_understood() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/USING.md");
    let guide = fs::read_to_string(guide).expect("docs/USING.md");
    let site =
        guide.split("```toml\n").nth(1).and_then(|after| after.split("```").next()).expect("a site file");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hall.toml");
    fs::write(&file, site).expect("writes");
    let done = Command::new(env!("CARGO_BIN_EXE_umbracast")).args(["config", "--check"]).arg(&file).output();
    let done = done.expect("it runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

#[test]
fn listed_commands_are_read_from_a_help() {
    let help = "Usage: x\n\nCommands:\n  demo  One\n  run   Two\n  help  Three\n\nOptions:\n  -h\n";
    assert_eq!(listed(help), ["demo", "run"]);
}

#[cfg(not(feature = "node"))]
#[test]
fn a_build_without_nodes_says_how_to_get_them() {
    for words in [&["node", "track", "--site", "hall.toml"][..], &["node", "--help"], &["fleet"]] {
        let done = Command::new(env!("CARGO_BIN_EXE_umbracast")).args(words).output().expect("it runs");
        let told = String::from_utf8_lossy(&done.stderr);
        assert!(
            told.contains("without the feature `node`") && told.contains("--features node"),
            "{words:?}: {told}"
        );
        assert_eq!(done.status.code(), Some(1), "{words:?}");
    }
}
