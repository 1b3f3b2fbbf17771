//! Files of recorded people: small samples of each format, and the real ones where `UMBRACAST_DATA` tells where
//! they are.

#[path = "../../../tests/real_data/mod.rs"]
mod real_data;

use umbracast_io::trajectories::{
    Options, RecordedPerson, Unit, keep_middle, middle_m, parse, read, shift, without_effect,
};
use umbracast_sim::crowd::{Recorded, replay};

use real_data::real_data;

fn parse_plain(text: &str) -> Result<Vec<RecordedPerson>, String> {
    parse(text, Options::default(), "file").map_err(|e| e.to_string())
}

fn refused(text: &str) -> String {
    parse_plain(text).unwrap_err()
}

#[test]
fn trajnet_rows_take_their_time_from_the_rate_of_rows() {
    // Frame numbers step by 10, rows come at 2.5 Hz; the second person misses a row.
    let text = r#"{"scene": {"id": 0, "p": 1, "s": 10, "e": 30, "fps": 2.5, "tag": [3, [2]]}}
{"track": {"f": 10, "p": 1, "x": 1.5, "y": 0.0}}
{"track": {"f": 10, "p": 2, "x": 0.0, "y": 0.0}}
{"track": {"f": 20, "p": 1, "x": 1.0, "y": 0.25}}
{"track": {"f": 30, "p": 1, "x": 0.5, "y": 0.5}}
{"track": {"f": 30, "p": 2, "x": 0.0, "y": 1.0}}
{"track": {"f": 30, "p": 2, "x": 0.0, "y": 1.0}}
{"track": {"f": 30, "p": 3, "x": 9.0, "y": 9.0}}
"#;
    let people = parse_plain(text).unwrap();
    assert_eq!(people.iter().map(|p| p.id).collect::<Vec<_>>(), [1, 2, 3]);
    assert_eq!(people[0].samples, [[0.4, 1.5, 0.0], [0.8, 1.0, 0.25], [1.2, 0.5, 0.5]]);
    assert_eq!(people[1].samples, [[0.4, 0.0, 0.0], [1.2, 0.0, 1.0]]);
    assert_eq!(people[2].samples, [[1.2, 9.0, 9.0]]);
}

#[test]
fn csv_columns_are_found_by_name() {
    let text =
        "\u{feff}id,t_s,x_m,y_m,height_m\r\n7,0.0,1,2,1.82\r\n7,0.1,1.1,2,\r\n3,0.0,5,5,\r\n3,0.1,5,5,\r\n";
    let people = parse_plain(text).unwrap();
    let samples = vec![[0.0, 5.0, 5.0], [0.1, 5.0, 5.0]];
    assert_eq!(people[0], RecordedPerson { id: 3, samples, height_m: None });
    assert_eq!(people[1].height_m, Some(1.82));
    assert!(parse_plain("t_s,id,x_m,y_m\n0,1,0,0\n1,1,1,0\n").is_ok(), "height is optional");

    let madras = "frame,t/s,id,x/m,y/m,z/m\n2,0.1,5,-2.172,5.102,1.8\n3,0.1,5,-2.201,5.107,1.8\n";
    assert!(refused(madras).contains("frames per second"));
    let people = parse(madras, Options { fps: Some(10.0), unit: None }, "file").unwrap();
    assert_eq!(people[0].samples[1], [0.3, -2.201, 5.107]);
}

#[test]
fn csv_may_quote_its_cells_and_stand_between_comments_and_blank_lines() {
    let text = "# made by hand\n\n\"t_s\", id ,x_m,y_m,note\n0.0,1,0,0,\"a, b\"\n   \n# more\n1.0,1,1,0,\n";
    let people = parse_plain(text).unwrap();
    assert_eq!(people[0].samples, [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
}

#[test]
fn options_that_a_file_has_no_use_for_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let options = Options { fps: Some(25.0), unit: Some(Unit::Metre) };
    let told = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        without_effect(&path, options).unwrap().join("; ")
    };
    let timed = told("timed.csv", "t_s,id,x_m,y_m\n0,1,2,3\n");
    assert!(timed.contains("--fps has no effect on") && timed.contains("--unit has no effect on"), "{timed}");
    let numbered = told("numbered.csv", "frame,id,x/m,y/m\n0,1,2,3\n");
    assert!(!numbered.contains("--fps") && numbered.contains("--unit"), "{numbered}");
    assert_eq!(told("petrack.txt", "1 1 0 0\n"), "");
}

#[test]
fn the_rate_of_frame_numbers_beside_rounded_times_is_found() {
    // 30 frames a second, times rounded up to tenths, as in the Madras set.
    let rows: String = (2..92)
        .map(|f| format!("{f},{:.4},1,{},0,1.8\n", f64::from((f - 2) / 3 + 1) * 0.1, 0.02 * f64::from(f)))
        .collect();
    let people = parse_plain(&format!("frame,t/s,id,x/m,y/m,z/m\n{rows}")).unwrap();
    let samples = &people[0].samples;
    assert!((samples[89][0] - samples[0][0] - 89.0 / 30.0).abs() < 1e-9, "{:?}", samples[89]);
}

#[test]
fn a_long_recording_keeps_its_middle_and_a_shifted_one_its_shape() {
    let person = |id: i64, from: i32, to: i32| RecordedPerson {
        id,
        samples: (from..=to).map(|k| [f64::from(k) * 0.1, f64::from(k), 2.0]).collect(),
        height_m: None,
    };
    let mut people = vec![person(1, 0, 100), person(2, 0, 20), person(3, 60, 100)];
    keep_middle(&mut people, 4.0);
    assert_eq!(people.iter().map(|p| p.id).collect::<Vec<_>>(), [1, 3]);
    assert_eq!((people[0].samples[0], people[0].samples.len()), ([3.0, 30.0, 2.0], 41));
    assert_eq!(people[1].samples.len(), 11, "who is there then, as long as he is");
    let whole = people.clone();
    keep_middle(&mut people, 100.0);
    assert_eq!(people, whole);

    assert_eq!(middle_m(&people), Some([50.0, 2.0]));
    shift(&mut people, [-50.0, -2.0]);
    assert_eq!(middle_m(&people), Some([0.0, 0.0]));
    assert_eq!(people[0].samples[0], [3.0, -20.0, 0.0]);
    assert_eq!(middle_m(&[]), None);
}

#[test]
fn petrack_headers_tell_rate_and_unit_and_options_go_before_them() {
    let text =
        "# framerate: 25 fps\n# id frame x/cm y/cm z/cm\n1 50 -206.5 100 180\n1\t51\t-205.0\t100\t180\n";
    let people = parse_plain(text).unwrap();
    assert_eq!(people[0].samples, [[2.0, -2.065, 1.0], [2.04, -2.05, 1.0]]);
    assert_eq!(people[0].height_m, Some(1.8));

    let bare = "1 50 -2.5 1\n1 51 -2.25 1\n";
    assert!(refused(bare).contains("--fps"));
    let people = parse(bare, Options { fps: Some(10.0), unit: None }, "file").unwrap();
    assert_eq!((people[0].samples[0], people[0].height_m), ([5.0, -2.5, 1.0], None));

    let options = Options { fps: Some(50.0), unit: Some(Unit::Metre) };
    let people = parse("# framerate: 25\n# x/cm\n1 50 1 1 1.7\n1 51 1.1 1 1.7\n", options, "file").unwrap();
    assert_eq!(people[0].samples[0], [1.0, 1.0, 1.0]);
}

#[test]
fn headers_in_latin_1_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("people.txt");
    std::fs::write(&path, b"# framerate: 25\n# J\xfclich\n1 0 0 0\n1 1 0.05 0\n").unwrap();
    assert_eq!(read(&path, Options::default()).unwrap().len(), 1);
}

#[test]
fn what_is_wrong_is_told_with_file_line_expected_and_found() {
    for (text, story) in [
        ("", "file: expected rows of recorded people, found none"),
        (
            "t_s,id,x_m\n0,1,2\n",
            "file: line 1: expected the columns t_s,id,x_m,y_m[,height_m], found \"t_s,id,x_m\"",
        ),
        ("t_s,id,x_m,y_m\n0,1,2\n", "file: line 2: expected 4 values, found 3: \"0,1,2\""),
        ("t_s,id,x_m,y_m\r\n# none\r\n\r\n0,1,2\r\n", "file: line 4: expected 4 values, found 3"),
        ("t_s,id,x_m,y_m\n", "file: expected rows of recorded people below the header, found none"),
        (
            "{\"scene\": {\"fps\": 2.5}}",
            "file: expected rows of recorded people below the header, found none",
        ),
        (
            "t_s,id,x_m,y_m,height_m\n0,1,2,3,\n1,1,2,3,1.75\n2,1,2,3,175\n",
            "file: line 4: height: expected metres, 3 at most, found 175: centimetres? (PeTrack text: --unit cm)",
        ),
        ("t_s,id,x_m,y_m\n0,1,2,3\n1,1,zwei,3\n", "file: line 3: x: expected a number, found \"zwei\""),
        ("t_s,id,x_m,y_m\n0,1,2,inf\n", "file: line 2: y: expected a number, found \"inf\""),
        ("t_s,id,x_m,y_m\n0,1.5,2,3\n", "file: line 2: id: expected a whole number, found \"1.5\""),
        (
            "t_s,id,x_m,y_m\n0,1,2,3\n0,1,2,4\n",
            "file: line 3: expected one place of person 1 at 0 s, found another in line 2",
        ),
        (
            "# framerate: 0\n1 1 0 0\n1 2 0 0\n",
            "file: framerate: expected frames per second above 0, found 0",
        ),
        ("# framerate: 25\n1 1 0\n", "file: line 2: expected `id frame x y [z]`, found \"1 1 0\""),
        ("{\"track\": {\"f\": 1}}\n", "file: line 1: expected a TrajNet++ scene or track"),
        (
            "{\"track\": {\"f\":1,\"p\":1,\"x\":0,\"y\":0}}\n",
            "file: expected frames per second, found no scene with fps",
        ),
        (
            "# framerate: 25\n1 1 0 0\n1 2 5 0\n",
            "file: line 3: expected people on foot, up to 12 m/s, found 125 m/s of person 1: 5.0 m in 0.040 s since line 2",
        ),
    ] {
        let found = refused(text);
        assert!(found.starts_with(story), "{found}");
    }
    let missing = read("no/such/file".as_ref(), Options::default()).unwrap_err().to_string();
    assert!(missing.starts_with("no/such/file: "), "{missing}");
}

/// Numbers that are finite add up to some that are not: the middle of such people, the times of such rows.
#[test]
fn places_and_times_that_nothing_has_are_refused() {
    let told = refused("t_s,id,x_m,y_m\n0.0,1,1e308,0\n0.1,1,1e308,0\n");
    assert!(
        told.contains("file: line 2: expected places up to 10000000 m") && told.contains("found 1"),
        "{told}"
    );
    let told = refused("t_s,id,x_m,y_m\n1e300,1,0,0\n");
    assert!(told.contains("line 2") && told.contains("times up to 100000000000 s"), "{told}");
    let told =
        refused("{\"scene\": {\"fps\": 1e-300}}\n{\"track\": {\"f\": 9, \"p\": 1, \"x\": 0, \"y\": 0}}\n");
    assert!(told.contains("line 2") && told.contains("times up to"), "{told}");
}

#[test]
fn real_files_hold_the_people_their_readmes_count() {
    let Some(root) = real_data("trajnetpp").map(|folder| folder.join("..")) else { return };
    let fps = |fps| Options { fps: Some(fps), unit: None };
    let without = Options::default();
    let centimetres = Options { fps: Some(25.0), unit: Some(Unit::Centimetre) };
    // File, options, people, seconds from the first to the last sample.
    for (file, options, people, span_s) in [
        ("circle_antipode/circle-10m-16-1.txt", without, 16, Some(12.8)),
        ("circle_antipode/circle-10m-64-1xx.txt", centimetres, 64, Some(16.96)),
        ("pedpy/traj_UNI_CORR_500_01.txt", without, 148, Some(75.52)),
        ("pedpy/030_c_56_h0.txt", without, 75, Some(64.76)),
        // 30 frames a second: its own times say so, and people sway once in 42 frames, not in 4.2 s.
        ("madras/Topview_1A.csv", without, 85, Some(296.0 / 30.0)),
        ("trajnetpp/biwi_hotel.ndjson", without, 263, None),
        ("trajnetpp/lcas.ndjson", without, 304, None),
    ] {
        let found = read(&root.join(file), options).unwrap();
        assert_eq!(found.len(), people, "{file}");
        let times = || found.iter().flat_map(|person| person.samples.iter().map(|s| s[0]));
        let span = times().fold(f64::MIN, f64::max) - times().fold(f64::MAX, f64::min);
        assert!(span_s.is_none_or(|expected| (span - expected).abs() < 0.001), "{file}: {span} s");
    }
    let wrong_unit = read(&root.join("circle_antipode/circle-10m-64-1xx.txt"), fps(25.0)).unwrap_err();
    assert!(wrong_unit.to_string().contains("--unit cm"), "{wrong_unit}");
}

#[test]
fn real_people_walk_again() {
    let Some(file) = real_data("circle_antipode/circle-10m-16-1.txt") else { return };
    let people = read(&file, Options::default()).unwrap();
    let recorded: Vec<Recorded> =
        people.iter().map(|p| Recorded { samples: &p.samples, height_m: p.height_m }).collect();
    let crowd = replay(&recorded, 0.12).unwrap();
    assert_eq!(crowd.trajectories.len(), 16);
    assert_eq!(crowd.duration_ns, 12_800_000_000);

    let (mut squares, mut samples, mut fastest) = (0.0, 0, 0.0_f64);
    for (way, person) in crowd.trajectories.iter().zip(&people) {
        assert!((9.0..11.0).contains(&way.positions_m[0].length()), "starts on the circle of 10 m");
        assert!(way.height_m.is_some_and(|height| (1.6..=1.8).contains(&height)));
        for [time_s, x, y] in &person.samples {
            let time_ns = ((time_s - people[0].samples[0][0]) * 1e9).round() as i64;
            let (position, velocity) = way.at(time_ns).unwrap();
            squares += (position.x - x).powi(2) + (position.y - y).powi(2);
            samples += 1;
            fastest = fastest.max(velocity.length());
        }
    }
    // The tracker's own noise is 3.4 cm; its jumps of 0.4 m in a frame would be 10 m/s. Some people run.
    let rms_m = (squares / f64::from(samples)).sqrt();
    assert!(rms_m < 0.035, "{rms_m} m");
    assert!(fastest < 5.0, "{fastest} m/s");
}
