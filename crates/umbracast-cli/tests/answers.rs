//! The program answers what `record/answers.txt` keeps of it: every record names that file's digest.

#[path = "../../../xtask/src/answers.rs"]
mod answers;

use std::path::{Path, PathBuf};

#[test]
fn the_program_answers_as_its_records_say() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let data = std::env::var_os("UMBRACAST_DATA").map(PathBuf::from).filter(|data| data.is_dir());
    if data.is_none() {
        eprintln!("skipped: the questions that need UMBRACAST_DATA");
    }
    let kept = std::fs::read_to_string(root.join(answers::FILE)).unwrap();
    let found = answers::ask(Path::new(env!("CARGO_BIN_EXE_umbracast")), &root, data.as_deref()).unwrap();
    let differences = answers::differences(&kept, &found);
    assert!(
        differences.is_empty(),
        "answers moved: `cargo xtask answers --write`, then make the records anew; {}",
        differences.join("\n")
    );
    // The digest that records name.
    assert_eq!(answers::digest(&kept).len(), 10);
}
