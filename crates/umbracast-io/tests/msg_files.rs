//! `ros2/umbracast_msgs`: the definitions of our messages as a package of ROS 2, written from the same place as the
//! messages themselves. `UPDATE=1 cargo test -p umbracast-io --test msg_files` writes them anew.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use umbracast_io::messages::{self, Schema};
use umbracast_io::nodes;
use umbracast_io::rows::{BindingRow, DecisionRow, DetectionRow, LinkRow, LossRow, ReportRow, TrackRow};
use umbracast_io::wire;

const OURS: &str = "umbracast_msgs/";

/// The definition of each of our types, by name.
fn definitions() -> BTreeMap<String, String> {
    let rows = [
        wire::schema::<DetectionRow>(),
        wire::schema::<TrackRow>(),
        wire::schema::<LinkRow>(),
        wire::schema::<LossRow>(),
        wire::schema::<DecisionRow>(),
        wire::schema::<BindingRow>(),
        wire::schema::<ReportRow>(),
    ];
    let rest = [messages::PEOPLE, messages::LINKS, messages::SENSOR_PACKETS];
    rows.into_iter().chain(rest).chain(nodes::schemas()).flat_map(|schema| parts(&schema)).collect()
}

/// A concatenated definition taken apart: the first part is the message's own, the others say whose they are.
fn parts(schema: &Schema) -> Vec<(String, String)> {
    let rule = format!("{}\n", "=".repeat(80));
    let whole = format!("MSG: {}\n{}", schema.name.replace("/msg/", "/"), schema.definition);
    let own = |part: &str| {
        let (name, fields) = part.strip_prefix("MSG: ")?.split_once('\n')?;
        Some((name.strip_prefix(OURS)?.to_owned(), fields.replace(OURS, "")))
    };
    whole.split(&rule).filter_map(own).collect()
}

#[test]
fn the_package_holds_what_is_sent() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ros2/umbracast_msgs/msg");
    let expected = definitions();
    assert!(expected.len() >= 9 && expected["Tracks"].contains("Track[] tracks"), "{:?}", expected.keys());
    if std::env::var_os("UPDATE").is_some() {
        expected
            .iter()
            .for_each(|(name, text)| fs::write(folder.join(format!("{name}.msg")), text).expect("writes"));
    }
    let found: BTreeMap<String, String> = fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .map(|path| {
            (
                path.file_stem().expect("a name").to_string_lossy().into_owned(),
                fs::read_to_string(&path).expect("text"),
            )
        })
        .collect();
    assert!(found == expected, "UPDATE=1 writes the definitions anew");
}
