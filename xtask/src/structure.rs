//! `structure`: the files of the workspace and what they use of one another, as a picture and in words. Both are made
//! from the code; `--check` says if the picture is out of date.

mod tokens;
mod modules;
mod graph;
mod draw;

use std::fs;

use crate::tools::{Result, root};
use graph::Graph;

const PICTURE: &str = "docs/structure.svg";

/// Writes the picture and prints the words; with `check` compares the picture, and fails for a circle in `src/`.
pub fn run(check: bool) -> Result<()> {
    let graph = Graph::of_workspace(&root())?;
    println!("{}", words(&graph));
    let (place, picture) = (root().join(PICTURE), draw::svg(&graph));
    if !check {
        return fs::write(&place, picture).map_err(|e| format!("{PICTURE}: {e}"));
    }
    let committed = fs::read_to_string(&place).map_err(|e| format!("{PICTURE}: {e}"))?;
    if committed != picture {
        return Err(format!("{PICTURE} is not what the code gives; `cargo xtask structure` makes it anew"));
    }
    match graph.circles.iter().filter(|circle| graph.files[circle[0]].krate == 0).count() {
        0 => Ok(()),
        circles => Err(format!("src/: expected no circle of files, found {circles}")),
    }
}

/// The words alone.
pub fn in_words() -> Result<String> {
    Ok(words(&Graph::of_workspace(&root())?))
}

fn words(graph: &Graph) -> String {
    let mut text = String::from("package            files   lines   uses  in circles  against the order\n");
    for (krate, package) in graph.packages.iter().enumerate() {
        let files = || graph.files.iter().filter(|file| file.krate == krate);
        let lines: usize = files().map(|file| file.lines).sum();
        let own = |uses: &[(usize, usize)]| {
            uses.iter().filter(|(from, _)| graph.files[*from].krate == krate).count()
        };
        let circles: usize =
            graph.circles.iter().filter(|circle| graph.files[circle[0]].krate == krate).map(Vec::len).sum();
        let (uses, backward) = (own(&graph.uses), own(&graph.backward));
        let count = files().count();
        text += &format!("{package:<18} {count:>5} {lines:>7} {uses:>6} {circles:>11} {backward:>18}\n");
    }
    let name = |file: &usize| graph.files[*file].place.as_str();
    for circle in &graph.circles {
        text += &format!("circle: {}\n", circle.iter().map(name).collect::<Vec<_>>().join(", "));
    }
    for (from, to) in &graph.backward {
        text += &format!("against the order: {} uses {}\n", name(from), name(to));
    }
    text.trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_runtime_use_one_another_in_no_circle_and_never_against_the_order() {
        let graph = Graph::of_workspace(&root()).expect("the workspace is read");
        let of_runtime = |file: usize| graph.files[file].krate == 0;
        let circles = graph.circles.iter().filter(|circle| of_runtime(circle[0])).count();
        let backward = graph.backward.iter().filter(|(from, _)| of_runtime(*from)).count();
        assert_eq!((circles, backward), (0, 0), "{}", words(&graph));
    }
}
