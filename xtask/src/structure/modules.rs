//! The module tree of a package, with what each file declares, brings into scope and names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::tokens::tokens;
use crate::tools::Result;

/// A path as written: `["crate", "track", "Tracker"]`.
pub type Name = Vec<String>;

/// One file.
#[derive(Debug, Default)]
pub struct Module {
    /// The package's first: `["umbracast", "track", "kalman"]`.
    pub name: Name,
    /// Where it lies.
    pub file: PathBuf,
    /// Its lines.
    pub lines: usize,
    /// The modules it declares, in order.
    pub children: Vec<String>,
    /// What it brings into scope: by the name used here. The path is as written.
    pub imports: BTreeMap<String, Name>,
    /// Paths that it uses: those of its `use` lines that are not passed on, and those in its code.
    pub uses: Vec<Name>,
}

/// A package's modules, a file's before those of the modules it declares.
pub fn of_package(package: &str, main: &Path) -> Result<Vec<Module>> {
    let mut modules = Vec::new();
    let folder = main.parent().unwrap_or(main);
    add(&mut modules, vec![package.to_owned()], main, folder)?;
    Ok(modules)
}

fn add(modules: &mut Vec<Module>, name: Name, file: &Path, folder: &Path) -> Result<()> {
    let text = fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut module = Module { name, file: file.to_owned(), lines: text.lines().count(), ..Module::default() };
    read(&tokens(&text), &mut module);
    let (name, children) = (module.name.clone(), module.children.clone());
    modules.push(module);
    for child in children {
        let beside = folder.join(format!("{child}.rs"));
        let within = folder.join(&child);
        let file = if beside.is_file() { beside } else { within.join("mod.rs") };
        add(modules, [&name[..], &[child]].concat(), &file, &within)?;
    }
    Ok(())
}

fn read(tokens: &[String], module: &mut Module) {
    let mut i = 0;
    while i < tokens.len() {
        let at = |k: usize| tokens.get(i + k).map_or("", String::as_str);
        if at(0) == "mod" && at(2) == ";" {
            module.children.push(at(1).to_owned());
            i += 3;
        } else if at(0) == "use" && at(1) != "<" {
            // `pub use` and `pub(crate) use` pass a name on and use nothing themselves.
            let passed_on = i > 0 && matches!(tokens[i - 1].as_str(), "pub" | ")");
            let mut found = Vec::new();
            i = tree(tokens, i + 1, &Vec::new(), &mut found);
            for (local, name) in found {
                if !passed_on {
                    module.uses.push(name.clone());
                }
                module.imports.insert(local, name);
            }
        } else if is_word(at(0)) && at(1) == "::" && is_word(at(2)) {
            let mut name = vec![at(0).to_owned()];
            i += 1;
            while tokens.get(i).is_some_and(|t| t == "::") && tokens.get(i + 1).is_some_and(|t| is_word(t)) {
                name.push(tokens[i + 1].clone());
                i += 2;
            }
            module.uses.push(name);
        } else {
            i += 1;
        }
    }
}

/// Reads a `use` tree that begins at `i`, below `above`; gives local names with their paths, and where it ends.
fn tree(tokens: &[String], mut i: usize, above: &Name, found: &mut Vec<(String, Name)>) -> usize {
    let mut name = above.clone();
    while i < tokens.len() {
        match tokens[i].as_str() {
            "{" => {
                i += 1;
                while i < tokens.len() && tokens[i] != "}" {
                    i = tree(tokens, i, &name, found);
                    i += usize::from(tokens.get(i).is_some_and(|t| t == ","));
                }
                return i + 1;
            }
            "," | ";" | "}" => break,
            "as" => {
                found.push((tokens[i + 1].clone(), name));
                return i + 2;
            }
            "::" => {}
            "self" if !above.is_empty() => {}
            word => name.push(word.to_owned()),
        }
        i += 1;
    }
    let local = name.last().cloned().unwrap_or_default();
    found.push((local, name));
    i
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_use_tree_gives_every_name_with_its_path() {
        let mut module = Module::default();
        let text = "pub use kalman::Filter; use crate::{Error, site::{self, Site as Hall}}; fn f() { super::g::h::<u8>() }";
        read(&tokens(text), &mut module);
        let imports: Vec<String> =
            module.imports.iter().map(|(local, name)| format!("{local} = {}", name.join("::"))).collect();
        assert_eq!(
            imports,
            [
                "Error = crate::Error",
                "Filter = kalman::Filter",
                "Hall = crate::site::Site",
                "site = crate::site"
            ]
        );
        let uses: Vec<String> = module.uses.iter().map(|name| name.join("::")).collect();
        assert_eq!(uses, ["crate::Error", "crate::site", "crate::site::Site", "super::g::h"]);
    }
}
