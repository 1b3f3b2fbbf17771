//! `export`: files of every form hold what the tables and the recording hold.

use std::fs;
use std::path::Path;

use umbracast_io::pcd::{PcdCloud, read_pcd};

#[path = "common/command.rs"]
mod command;
mod common;

use command::{done, umbracast};
use common::folder;

fn text(path: &Path) -> &str {
    path.to_str().expect("the test's folder has a plain name")
}

fn cloud(file: &Path) -> PcdCloud {
    read_pcd(&fs::read(file).expect("a cloud"), "cloud").expect("a PCD file")
}

/// The names of a folder's files.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn scans_foreground_ways_and_links_are_written_and_read_back() {
    let folder = folder("export");
    let (sim, walk) = (folder.join("sim"), folder.join("walk.csv"));
    let rows = (0..=16).map(|k| {
        format!(
            "{},1,6.0,{}\n{},2,{},0.3\n",
            0.1 * f64::from(k),
            -1.0 + 0.12 * f64::from(k),
            0.1 * f64::from(k),
            1.0 - 0.1 * f64::from(k)
        )
    });
    fs::write(&walk, format!("t_s,id,x_m,y_m\n{}", rows.collect::<String>())).expect("writes");
    done(&["simulate", "--trajectories", text(&walk), "--out", text(&sim)]);
    let scene = sim.join("scene-0000.mcap");

    // One whole scan in three forms: the same points, most of them on the floor.
    let scans = folder.join("scans");
    done(&["export", text(&scene), "--frame", "9", "--as", "pcd,ply,las", "--out", text(&scans)]);
    assert_eq!(names(&scans), ["scan-0000-000009.las", "scan-0000-000009.pcd", "scan-0000-000009.ply"]);
    let whole = cloud(&scans.join("scan-0000-000009.pcd"));
    let z = &whole.field("z").expect("heights").values;
    let on_floor = z.iter().filter(|z| z.abs() < 0.2).count();
    assert!(whole.width > 50_000 && on_floor > whole.width / 4, "{on_floor} of {}", whole.width);
    let las = fs::read(scans.join("scan-0000-000009.las")).expect("a cloud");
    assert_eq!(las[107..111], (whole.width as u32).to_le_bytes());
    let ply = fs::read(scans.join("scan-0000-000009.ply")).expect("a cloud");
    let header = String::from_utf8_lossy(&ply[..300]).into_owned();
    assert!(header.contains(&format!("element vertex {}\n", whole.width)), "{header}");

    // What people left in it, their ways, and links.
    let found = folder.join("found");
    done(&["export", text(&scene), "--foreground", "--tracks", "--links", "--out", text(&found)]);
    let foreground = cloud(&found.join("foreground-0000-000009.pcd"));
    assert!(foreground.width > 20 && foreground.width < whole.width / 20, "{}", foreground.width);
    let ways = cloud(&found.join("tracks-0000.pcd"));
    let tracks = &ways.field("track").expect("numbers").values;
    assert!(tracks.iter().any(|t| *t != tracks[0]), "two people walk: {tracks:?}");
    let links = cloud(&found.join("links-0000-000009.pcd"));
    assert!(
        links.width > 100
            && links.field("p_w9").is_some_and(|p| p.values.iter().all(|p| (0.0..=1.0).contains(p)))
    );
    assert_eq!(names(&found).len(), 1 + 2 * 16, "{:?}", names(&found));

    // The same for a map.
    let map = folder.join("map");
    done(&["export", text(&scene), "--as", "geojson", "--origin", "-33.9,18.4", "--out", text(&map)]);
    assert_eq!(names(&map), ["links-0000.geojson", "site.geojson", "tracks-0000.geojson"]);
    let geojson = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(map.join(name)).expect("a file")).expect("JSON")
    };
    let lines = geojson("tracks-0000.geojson");
    let lines = lines["features"].as_array().expect("features");
    let first = &lines[0]["geometry"]["coordinates"][0];
    assert_eq!((lines.len(), &lines[0]["geometry"]["type"]), (2, &serde_json::json!("LineString")));
    assert!((first[0].as_f64().expect("a longitude") - 18.4).abs() < 1e-3, "{first}");
    let of_map: usize =
        lines.iter().map(|line| line["geometry"]["coordinates"].as_array().map_or(0, Vec::len)).sum();
    assert_eq!(of_map, ways.width, "the same places in both");

    let out = folder.join("none");
    let output =
        umbracast(&["export", text(&scene), "--frame", "99", "--out", text(&out)]).output().expect("starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(1) && told.contains("--frame 99: expected a frame of the input"),
        "{told}"
    );
}
