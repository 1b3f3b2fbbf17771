//! The program answers what is kept of it in `record/`: every record names the digest of those files.

#[path = "../../../xtask/src/answers.rs"]
mod answers;

use std::path::{Path, PathBuf};

use answers::{ASKED, Asked};

fn answers_as_kept(asked: &Asked) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let data = std::env::var_os("UMBRACAST_DATA").map(PathBuf::from).filter(|data| data.is_dir());
    if data.is_none() {
        eprintln!("skipped: the questions that need UMBRACAST_DATA");
    }
    let kept = std::fs::read_to_string(root.join(asked.file)).unwrap();
    let umbracast = Path::new(env!("CARGO_BIN_EXE_umbracast"));
    let found = answers::ask(asked, umbracast, &root, data.as_deref()).unwrap();
    let differences = answers::differences(&kept, &found);
    assert!(
        differences.is_empty(),
        "answers moved: `cargo xtask answers --write`, then make the records anew; {}",
        differences.join("\n")
    );
    // The digest that records name.
    assert_eq!(answers::digest(&kept).len(), 10);
}

#[test]
fn the_program_answers_as_its_records_say() {
    answers_as_kept(&ASKED[0]);
}

#[test]
fn the_program_answers_about_radios_as_their_records_say() {
    answers_as_kept(&ASKED[1]);
}
