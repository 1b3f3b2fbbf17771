//! `quote`: every block of figures in a document is cut anew from the record that the comment above it names.
//!
//! ```text
//! <!-- from record/speed.txt
//! $ umbracast run * --mode default | * frames
//! -->
//! ```
//!
//! Each line of the comment is one rule: first what a line of the record begins with, then, between bars, what further
//! lines up to the next empty one begin with. A star stands for anything. A record's head (commit, answers, what it took) is
//! never quoted. Only a comment that has rules is followed.
//!
//! A block whose record has another digest of the program's answers than `record/answers.txt` ([`crate::answers`]), or none, is
//! marked as of an earlier program.

use std::fs;
use std::path::PathBuf;

use crate::answers;
use crate::record::{ANSWERS, COMMIT, MACHINE, RADIO, TOOK};
use crate::tools::{Result, files_below, root};

/// What a comment of a quoted block begins with.
const MARK: &str = "<!-- from ";
const FENCE: &str = "```";
/// Stands above a block whose figures the present program may not give.
const EARLIER: &str = "*These figures are of an earlier program.*";

/// Those that quote records.
fn pages() -> Vec<PathBuf> {
    let alone = ["README.md", "notebooks/leaderboard.md"].map(|page| root().join(page));
    [alone.to_vec(), files_below(&root().join("docs"), ".md")].concat()
}

/// Rewrites README.md, the leaderboard and the pages of docs/. Fails, once all that can be is written, where a rule finds nothing.
pub fn run() -> Result<()> {
    let mut missing = Vec::new();
    let present = Digests::present()?;
    for page in pages() {
        let name = page.strip_prefix(root()).unwrap_or(&page).display().to_string();
        let text = fs::read_to_string(&page).map_err(|e| format!("{name}: {e}"))?;
        let told = |what: String| missing.push(format!("{name}: {what}"));
        let renewed = renewed(&text, &present, |record| fs::read_to_string(root().join(record)).ok(), told);
        if renewed != text {
            fs::write(&page, renewed).map_err(|e| format!("{name}: {e}"))?;
            println!("{name}");
        }
    }
    if missing.is_empty() { Ok(()) } else { Err(format!("quote:\n{}", missing.join("\n"))) }
}

/// Those of the answers that are kept.
#[derive(Debug, Clone)]
pub struct Digests {
    plain: String,
    /// With those about radios.
    radio: String,
}

impl Digests {
    /// # Errors
    /// Answers that are not kept.
    pub fn present() -> Result<Self> {
        let kept = |file: &str| fs::read_to_string(root().join(file)).map_err(|e| format!("{file}: {e}"));
        let [plain, radio] = &answers::ASKED;
        let plain = kept(plain.file)?;
        let both = plain.clone() + &kept(radio.file)?;
        Ok(Self { plain: answers::digest(&plain), radio: answers::digest(&both) })
    }

    /// The same for all.
    #[cfg(test)]
    pub fn both(digest: &str) -> Self {
        Self { plain: digest.into(), radio: digest.into() }
    }

    /// What a record of the present program names: `record/NAME.txt`, or its name.
    pub fn of(&self, record: &str) -> &str {
        let name = record.trim_start_matches("record/").trim_end_matches(".txt");
        if RADIO.contains(&name) { &self.radio } else { &self.plain }
    }
}

/// Whether a record was made by a program that gave these answers.
pub fn is_of(record: &str, digest: &str) -> bool {
    record.lines().any(|line| line.strip_prefix(ANSWERS) == Some(digest))
}

/// The page with every block cut anew. A block whose record is not there, or of which nothing is found, stays.
fn renewed(
    page: &str,
    present: &Digests,
    record: impl Fn(&str) -> Option<String>,
    mut missing: impl FnMut(String),
) -> String {
    let mut parts = page.split(MARK);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += MARK;
        let comment = part.split("-->").next().unwrap_or_default();
        let mut lines = comment.lines().map(str::trim).filter(|line| !line.is_empty());
        let name = lines.next().unwrap_or_default();
        let rules: Vec<&str> = lines.collect();
        let part = &match record(name) {
            Some(record) => marked(part, !is_of(&record, present.of(name))),
            None => part.to_owned(),
        };
        let place = opened(part);
        let (Some((from, to)), false) = (place, rules.is_empty()) else {
            text += part;
            continue;
        };
        let Some(record) = record(name) else {
            missing(format!("{name}: not there"));
            text += part;
            continue;
        };
        let (block, found_nothing) = cut(&record, &rules);
        found_nothing.iter().for_each(|rule| missing(format!("{name}: no line {rule:?}")));
        if block.is_empty() {
            text += part;
        } else {
            text += &part[..from];
            text += &block;
            text += &part[to..];
        }
    }
    text
}

/// With or without the mark, which stands between a comment and the block right below it.
fn marked(part: &str, earlier: bool) -> String {
    let Some((comment, rest)) = part.split_once("-->") else { return part.to_owned() };
    let Some((between, _)) = rest.split_once(FENCE) else { return part.to_owned() };
    if !between.replace(EARLIER, "").trim().is_empty() {
        return part.to_owned();
    }
    let mark = if earlier { format!("\n\n{EARLIER}\n\n") } else { "\n".to_owned() };
    format!("{comment}-->{mark}{}", &rest[between.len()..])
}

/// From where to where the inside of the first block lies, its line ends included.
fn opened(part: &str) -> Option<(usize, usize)> {
    let fence = part.find(FENCE)?;
    let from = fence + part[fence..].find('\n')? + 1;
    Some((from, from + part[from..].find(FENCE)?))
}

/// The record's lines that the rules choose, tables with an empty line between, and what found none.
fn cut(record: &str, rules: &[&str]) -> (String, Vec<String>) {
    let (mut block, mut found_nothing) = (String::new(), Vec::new());
    for rule in rules {
        let mut parts = rule.split('|').map(str::trim);
        let title = parts.next().unwrap_or_default();
        let further: Vec<&str> = parts.collect();
        let mut lines = record.lines().skip_while(|line| !begins(line, title));
        let Some(first) = lines.next() else {
            found_nothing.push(title.to_owned());
            continue;
        };
        if !block.is_empty() && !further.is_empty() {
            block.push('\n');
        }
        block += first.trim_end();
        block.push('\n');
        let head = |line: &&str| [COMMIT, ANSWERS, MACHINE, TOOK].iter().any(|head| line.starts_with(head));
        let paragraph = lines.filter(|line| !head(line)).take_while(|line| !line.trim().is_empty());
        let paragraph: Vec<&str> = paragraph.collect();
        for line in paragraph.iter().filter(|line| further.iter().any(|glob| begins(line, glob))) {
            block += line.trim_end();
            block.push('\n');
        }
        let in_vain = further.iter().filter(|glob| !paragraph.iter().any(|line| begins(line, glob)));
        found_nothing.extend(in_vain.map(|glob| format!("{title} | {glob}")));
    }
    (block, found_nothing)
}

/// Whether a line begins so, a star being anything.
fn begins(line: &str, glob: &str) -> bool {
    let mut pieces = glob.split('*');
    let Some(mut rest) = pieces.next().and_then(|first| line.strip_prefix(first)) else { return false };
    for piece in pieces {
        let Some(at) = rest.find(piece) else { return false };
        rest = &rest[at + piece.len()..];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORD: &str = "$ umbracast evaluate\nmode   F1\npaper  .80\nours   .94\n\nDetection\nours   .99\n";

    fn of_plain(plain: &str) -> Digests {
        Digests { plain: plain.into(), radio: "77cd".into() }
    }

    #[test]
    fn a_record_of_radios_names_another_digest() {
        let page = "<!-- from record/network.txt\n$ umbracast | mode\n-->\n```text\n```\n";
        let marks = |digest: &'static str| {
            let record = move |_: &str| Some(format!("# answers {digest}\n{RECORD}"));
            renewed(page, &of_plain("12ab"), record, |_| {}).matches("an earlier program").count()
        };
        assert_eq!((marks("77cd"), marks("12ab")), (0, 1));
    }

    #[test]
    fn a_block_is_cut_anew_and_the_rest_stays() {
        let page = "Before.\n<!-- from record/a.txt\n$ umbracast | mode | ours\nDetection | *\n-->\n\
                    ```text\nours   .50\n```\nAfter.\n<!-- from record/b.txt -->\n```text\nx\n```\n";
        let record = |name: &str| (name == "record/a.txt").then(|| format!("# answers 12ab\n{RECORD}"));
        let new = renewed(page, &of_plain("12ab"), record, |m| panic!("{m}"));
        let block =
            "```text\n$ umbracast evaluate\nmode   F1\nours   .94\n\nDetection\nours   .99\n```\nAfter.";
        assert!(new.contains(block), "{new}");
        assert!(new.starts_with("Before.\n<!-- from record/a.txt\n$ umbracast | mode"), "{new}");
        assert!(new.ends_with("<!-- from record/b.txt -->\n```text\nx\n```\n"), "{new}");
    }

    #[test]
    fn a_block_of_an_earlier_program_is_marked_until_its_record_is_made_anew() {
        let page =
            "<!-- from record/a.txt\n$ umbracast | mode | ours\n-->\n```text\nours   .50\n```\nAfter.\n";
        let of = |digest: &'static str| move |_: &str| Some(format!("# answers {digest}\n{RECORD}"));
        let stale = renewed(page, &of_plain("12ab"), of("99ff"), |m| panic!("{m}"));
        assert_eq!(stale.matches("an earlier program").count(), 1, "{stale}");
        assert!(stale.contains("```text\n$ umbracast evaluate\nmode   F1\nours   .94\n```"), "{stale}");
        assert_eq!(renewed(&stale, &of_plain("12ab"), of("99ff"), |m| panic!("{m}")), stale);
        let fresh = renewed(&stale, &of_plain("12ab"), of("12ab"), |m| panic!("{m}"));
        assert!(!fresh.contains("an earlier program") && fresh.contains("-->\n```text\n"), "{fresh}");
        let without = renewed(page, &of_plain("12ab"), |_| Some(RECORD.to_owned()), |m| panic!("{m}"));
        assert!(without.contains("an earlier program"), "{without}");
    }

    /// The figures that a stranger sees first are of the present program, and every other block says if it is not.
    #[test]
    fn readme_and_the_first_results_quote_the_present_program() {
        let present = Digests::present().unwrap();
        let record = |name: &str| fs::read_to_string(root().join(name)).ok();
        for page in pages() {
            let text = fs::read_to_string(&page).unwrap();
            assert_eq!(
                renewed(&text, &present, record, |_| {}),
                text,
                "{}: run `cargo xtask quote`",
                page.display()
            );
            let first_only = page.ends_with("docs/RESULTS.md");
            if !page.ends_with("README.md") && !first_only {
                continue;
            }
            let quotes = text.split(MARK).skip(1).take(if first_only { 1 } else { usize::MAX });
            for quote in quotes {
                let name = quote.lines().next().unwrap_or_default().trim_end_matches("-->").trim();
                let of_present = record(name).is_some_and(|record| is_of(&record, present.of(name)));
                assert!(of_present, "{}: {name} is of an earlier program", page.display());
            }
        }
    }

    #[test]
    fn the_head_of_a_record_is_not_quoted() {
        let record = RECORD.replacen('\n', "\n# commit 1\n# answers 2\n# machine 4\n# took 3 s\n", 1);
        let (block, _) = cut(&record, &["$ umbracast | *"]);
        assert_eq!(block, "$ umbracast evaluate\nmode   F1\npaper  .80\nours   .94\n");
    }

    #[test]
    fn what_is_not_found_is_told() {
        let (block, nothing) = cut(RECORD, &["$ umbracast | hdl", "Tracking"]);
        assert_eq!((block.as_str(), nothing.len()), ("$ umbracast evaluate\n", 2));
        assert_eq!(nothing, ["$ umbracast | hdl", "Tracking"]);
    }

    #[test]
    fn a_star_is_anything_between() {
        assert!(begins("side  300 ms  paper       0.1", "side*300 ms*paper  *0."));
        assert!(!begins("side  300 ms  paper, bound once  0.1", "side*300 ms*paper  *0."));
        assert!(!begins("other side", "side"));
    }
}
