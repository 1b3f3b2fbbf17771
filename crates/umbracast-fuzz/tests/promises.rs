//! Every promise over some inputs, and what the mutator says of a broken one.

use std::fs;
use std::path::Path;

use umbracast_fuzz::bounded::Bounded;
use umbracast_fuzz::run::{Until, checked, input, run};
use umbracast_fuzz::{TARGETS, Target, target};

#[global_allocator]
static MEMORY: Bounded = Bounded;

fn of_repository(file: &str) -> String {
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file);
    fs::read_to_string(&place).expect("a file of the repository")
}

fn hangs(seed: u64) {
    panic!("seed {seed} takes half a minute");
}

/// Damage to what is not understood anyway would find nothing. A recording that was cut off is understood up to its end.
#[test]
fn every_whole_input_is_understood() {
    let mut refused = Vec::new();
    for target in &TARGETS {
        for (number, whole) in (target.corpus)().iter().enumerate() {
            // A server that reads the end of what is said before it answers may hang up: a busy machine is given five tries.
            let tries = if target.name == "http" { 5 } else { 1 };
            let mut found = (0..tries).map(|_| checked(target, 0, whole));
            let checked = found.find(|checked| *checked != Ok(false)).unwrap_or(Ok(false));
            // No frame of these has anybody in it, and no request may be posted.
            let may_be_refused = target.name == "step" && number > 3 || whole.starts_with(b"POST");
            if checked != Ok(true) && (checked != Ok(false) || !may_be_refused) {
                refused.push((target.name, number, checked));
            }
        }
    }
    assert!(refused.is_empty(), "{refused:#?}");
}

#[test]
fn damaged_inputs_break_no_promise() {
    for target in &TARGETS {
        let tally = run(target, 0, Until::Inputs(100), 1, hangs);
        assert_eq!((tally.inputs, tally.broken), (100, [].into()), "{}", target.name);
    }
}

#[test]
fn a_seed_is_an_input_and_the_first_that_breaks_a_promise_is_told_with_its_place() {
    static SHORT: Target = Target {
        name: "short",
        corpus: || vec![vec![7; 40], b"t_s,id\n0.5,1\n".to_vec()],
        check: |bytes| {
            assert!(bytes.len() < 60, "{} bytes", bytes.len());
            true
        },
    };
    let corpus = (SHORT.corpus)();
    let mut bytes = Vec::new();
    let is_long = |seed: &u64, bytes: &mut Vec<u8>| {
        input(&corpus, *seed, bytes);
        bytes.len() >= 60
    };
    let first = (0..1000).find(|seed| is_long(seed, &mut bytes)).expect("some damage makes an input longer");
    let whole = (2..1000).filter(|seed| {
        input(&corpus, *seed, &mut bytes);
        corpus.contains(&bytes)
    });
    assert!(whole.count() < 50, "what is damaged is seldom whole");
    let told = run(&SHORT, 0, Until::Inputs(1000), 2, hangs);
    assert_eq!((told.inputs, told.broken.len()), (1000, 1));
    let (place, (seed, story)) = told.broken.first_key_value().expect("one place");
    assert!(
        place.contains("promises.rs") && story.ends_with("bytes") && *seed == first,
        "{place}: {seed} {story}"
    );
    assert!(told.understood < 1000);
}

/// libFuzzer's programs and the workflow are lists of names, which nothing else compares.
#[test]
fn libfuzzer_runs_every_target() {
    let (manifest, workflow) = (of_repository("fuzz/Cargo.toml"), of_repository(".github/workflows/ci.yml"));
    for Target { name, .. } in &TARGETS {
        assert!(target(name).is_some());
        assert!(manifest.contains(&format!("name = \"{name}\"\n")), "fuzz/Cargo.toml lacks {name}");
        assert!(workflow.contains(&format!("          - {name}\n")), "ci.yml lacks {name}");
    }
    assert_eq!(manifest.matches("[[bin]]").count(), TARGETS.len());
}
