//! The uses between files: names followed to the files that define them, circles, and uses against the data's order.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::modules::{Module, Name, of_package};
use crate::tools::Result;

/// The packages in the order of the data; `lib.rs` or `main.rs` is the first file of each.
const PACKAGES: [(&str, &str); 12] = [
    ("umbracast", "src"),
    ("umbracast-sim", "crates/umbracast-sim/src"),
    ("umbracast-io", "crates/umbracast-io/src"),
    ("umbracast-eval", "crates/umbracast-eval/src"),
    ("umbracast-train", "crates/umbracast-train/src"),
    ("umbracast-network", "crates/umbracast-network/src"),
    ("umbracast-calibrate", "crates/umbracast-calibrate/src"),
    ("umbracast-plan", "crates/umbracast-plan/src"),
    ("umbracast-live", "crates/umbracast-live/src"),
    ("umbracast-node", "crates/umbracast-node/src"),
    ("umbracast-fuzz", "crates/umbracast-fuzz/src"),
    ("umbracast-cli", "crates/umbracast-cli/src"),
];

/// One file.
#[derive(Debug)]
pub struct File {
    /// From the repository on.
    pub place: String,
    /// Index of its package.
    pub krate: usize,
    /// Its top module; empty for the package's first file.
    pub room: String,
    /// Its lines.
    pub lines: usize,
}

/// All files and what they use.
#[derive(Debug)]
pub struct Graph {
    /// The packages' names, in the order of the data.
    pub packages: Vec<&'static str>,
    /// In the order in which `mod` lines name them.
    pub files: Vec<File>,
    /// User and used, by file, each pair once.
    pub uses: Vec<(usize, usize)>,
    /// Files each of which uses all others of the group, by whatever way.
    pub circles: Vec<Vec<usize>>,
    /// Those uses whose used stands below the user in the order of `mod` lines.
    pub backward: Vec<(usize, usize)>,
}

impl Graph {
    /// Reads all packages that are there.
    pub fn of_workspace(root: &Path) -> Result<Self> {
        let (mut modules, mut krates, mut packages) = (Vec::new(), Vec::new(), Vec::new());
        for (package, folder) in PACKAGES {
            let main = ["lib.rs", "main.rs"].map(|file| root.join(folder).join(file));
            let Some(main) = main.iter().find(|file| file.is_file()) else { continue };
            let of_package = of_package(&package.replace('-', "_"), main)?;
            krates.extend(std::iter::repeat_n(packages.len(), of_package.len()));
            packages.push(package);
            modules.extend(of_package);
        }
        let index: BTreeMap<&[String], usize> =
            modules.iter().enumerate().map(|(i, module)| (&module.name[..], i)).collect();
        let house = House { modules: &modules, index };
        let mut uses = BTreeSet::new();
        for (user, module) in modules.iter().enumerate() {
            for name in &module.uses {
                if let Some(used) = house.defined_in(user, name).filter(|used| *used != user) {
                    uses.insert((user, used));
                }
            }
        }
        let uses: Vec<(usize, usize)> = uses.into_iter().collect();
        let file = |(module, krate): (&Module, &usize)| File {
            place: module
                .file
                .strip_prefix(root)
                .unwrap_or(&module.file)
                .to_string_lossy()
                .replace('\\', "/"),
            krate: *krate,
            room: module.name.get(1).cloned().unwrap_or_default(),
            lines: module.lines,
        };
        let backward = uses.iter().copied().filter(|(user, used)| house.is_backward(*user, *used)).collect();
        Ok(Self {
            packages,
            files: modules.iter().zip(&krates).map(file).collect(),
            circles: circles(modules.len(), &uses),
            uses,
            backward,
        })
    }
}

struct House<'a> {
    modules: &'a [Module],
    index: BTreeMap<&'a [String], usize>,
}

impl House<'_> {
    /// The file that defines what `name` says in the file `user`; none for a module itself and for other packages'.
    fn defined_in(&self, user: usize, name: &Name) -> Option<usize> {
        self.follow(user, name, 0)
    }

    fn follow(&self, user: usize, name: &[String], depth: usize) -> Option<usize> {
        // A name is passed on a few times at most; a longer way is one that leads back to itself.
        if depth > 8 {
            return None;
        }
        let mut place = self.modules[user].name.clone();
        let mut rest = name;
        match name.first()?.as_str() {
            "crate" => place.truncate(1),
            "self" => {}
            "super" => {
                while let Some(("super", after)) =
                    rest.split_first().map(|(first, after)| (first.as_str(), after))
                {
                    place.pop();
                    rest = after;
                }
                return self.descend(&place, rest, depth);
            }
            first if self.index.contains_key(&name[..1]) => place = vec![first.to_owned()],
            first if self.modules[user].children.iter().any(|child| child == first) => {
                return self.descend(&place, name, depth);
            }
            first => {
                let import = self.modules[user].imports.get(first)?;
                if import[..] == name[..1] {
                    return None;
                }
                return self.follow(user, &[import, &name[1..]].concat(), depth + 1);
            }
        }
        rest = &rest[1..];
        self.descend(&place, rest, depth)
    }

    /// From a module down the rest of a path.
    fn descend(&self, place: &[String], rest: &[String], depth: usize) -> Option<usize> {
        let module = *self.index.get(place)?;
        let (first, after) = rest.split_first()?;
        if self.modules[module].children.contains(first) {
            return self.descend(&[place, std::slice::from_ref(first)].concat(), after, depth);
        }
        match self.modules[module].imports.get(first) {
            Some(import) => self.follow(module, &[import, after].concat(), depth + 1),
            None => Some(module),
        }
    }

    /// Whether `used` stands below `user`. A module and one within it stand side by side.
    fn is_backward(&self, user: usize, used: usize) -> bool {
        let (from, to) = (&self.modules[user].name, &self.modules[used].name);
        let shared = from.iter().zip(to).take_while(|(a, b)| a == b).count();
        let (Some(a), Some(b)) = (from.get(shared), to.get(shared)) else { return false };
        let Some(parent) = self.index.get(&from[..shared]) else { return false };
        let order = &self.modules[*parent].children;
        order.iter().position(|child| child == a) < order.iter().position(|child| child == b)
    }
}

/// Groups of two and more that can reach one another.
fn circles(count: usize, uses: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let users: Vec<(usize, usize)> = uses.iter().map(|&(user, used)| (used, user)).collect();
    let mut left: BTreeSet<usize> = (0..count).collect();
    let mut found = Vec::new();
    while let Some(start) = left.first().copied() {
        let group: Vec<usize> = reached(start, uses).intersection(&reached(start, &users)).copied().collect();
        left.retain(|file| !group.contains(file));
        if group.len() > 1 {
            found.push(group);
        }
    }
    found
}

/// Where the arrows lead from `start`, itself included.
fn reached(start: usize, arrows: &[(usize, usize)]) -> BTreeSet<usize> {
    let (mut seen, mut open) = (BTreeSet::from([start]), vec![start]);
    while let Some(at) = open.pop() {
        for &(from, to) in arrows {
            if from == at && seen.insert(to) {
                open.push(to);
            }
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_found_and_a_diamond_is_none() {
        assert_eq!(circles(5, &[(0, 1), (0, 2), (1, 3), (2, 3)]), Vec::<Vec<usize>>::new());
        assert_eq!(circles(5, &[(0, 1), (1, 2), (2, 1), (2, 4), (4, 3)]), [vec![1, 2]]);
    }

    #[test]
    fn a_name_that_is_passed_on_leads_to_the_file_that_defines_it() {
        let module = |name: &[&str], children: &[&str], imports: &[(&str, &str)]| Module {
            name: name.iter().map(|part| (*part).to_owned()).collect(),
            children: children.iter().map(|child| (*child).to_owned()).collect(),
            imports: imports
                .iter()
                .map(|(local, path)| ((*local).to_owned(), path.split("::").map(String::from).collect()))
                .collect(),
            ..Module::default()
        };
        let modules = [
            module(&["house"], &["track", "cast"], &[("Tracker", "track::Tracker")]),
            module(&["house", "track"], &["tracker"], &[("Tracker", "tracker::Tracker")]),
            module(&["house", "track", "tracker"], &[], &[]),
            module(&["house", "cast"], &[], &[("track", "crate::track")]),
        ];
        let index = modules.iter().enumerate().map(|(i, module)| (&module.name[..], i)).collect();
        let house = House { modules: &modules, index };
        let name = |path: &str| path.split("::").map(String::from).collect::<Name>();
        assert_eq!(house.defined_in(3, &name("crate::Tracker")), Some(2));
        assert_eq!(house.defined_in(3, &name("track::Tracker")), Some(2));
        assert_eq!(house.defined_in(3, &name("track::Track")), Some(1));
        assert_eq!(house.defined_in(2, &name("super::super::STEPS")), Some(0));
        assert_eq!(house.defined_in(3, &name("glam::DVec2")), None);
        assert!(house.is_backward(1, 3) && !house.is_backward(3, 2) && !house.is_backward(2, 1));
    }
}
