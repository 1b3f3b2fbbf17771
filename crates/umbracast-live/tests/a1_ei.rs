//! The example that makes a live run a producer of A1 enrichment information, beside stubs of the coordinator and the run.

use std::path::Path;
use std::process::Command;

#[test]
fn the_producer_registers_serves_jobs_and_ends_them() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/oran/test_a1_ei.py");
    let python = std::env::var("UMBRACAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let Ok(run) = Command::new(&python).arg("-B").arg(&script).output() else {
        eprintln!("skipped: {python} cannot be run");
        return;
    };
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
