//! Captures find their sensors by what is in them and by their names, in whatever order they are given.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use umbracast::Site;
use umbracast::lidar::packet::{columns_per_packet, encode};
use umbracast::lidar::{Column, Model};
use umbracast_io::input::{Capture, Given, Input, Told};
use umbracast_io::pcap::{Datagram, PcapWriter};

/// A site with sensors of these names, models and addresses.
fn site(sensors: &[(&str, &str, Option<&str>)]) -> Site {
    let mut site = umbracast::Config::default().site;
    let first = site.sensors[0].clone();
    site.sensors.clear();
    for (name, model, address) in sensors {
        let mut sensor = first.clone();
        (sensor.name, sensor.model) = ((*name).to_owned(), (*model).to_owned());
        sensor.address = address.map(str::to_owned);
        site.sensors.push(sensor);
    }
    site
}

/// Ten packets of each of these models, from these addresses to these ports.
fn capture(file: &Path, senders: &[(&str, [u8; 4], u16)]) {
    let mut writer = PcapWriter::new(File::create(file).unwrap()).unwrap();
    for n in 0..10 {
        for (model, from, port) in senders {
            let model = Model::by_name(model).unwrap();
            let columns: Vec<Column> = (0..columns_per_packet(&model))
                .map(|c| Column {
                    time_ns: 1_700_000_000_000_000_000
                        + n * 1_000_000
                        + (c as f64 * model.column_period_ns) as i64,
                    azimuth_cdeg: 35.2 * c as f32,
                    azimuth_rate_cdeg_per_ns: 3.6e-4,
                })
                .collect();
            let ranges = vec![5.0; columns.len() * model.beams.len()];
            let packet = encode(&model, &columns, &ranges, &vec![9; ranges.len()], columns[0].time_ns);
            let datagram =
                Datagram { time_ns: packet.time_ns, from: *from, port: *port, payload: packet.payload };
            writer.write(&datagram).unwrap();
        }
    }
    writer.finish().unwrap();
}

const FIRST: [u8; 4] = [192, 168, 1, 201];
const SECOND: [u8; 4] = [192, 168, 1, 202];

/// The files of a folder that belong to sensors in the site's order, and by what, or why not.
fn matched(site: &Site, files: &[PathBuf], told: &[Told]) -> Result<Vec<(usize, String, String)>, String> {
    let inputs = Given::of(files).and_then(|given| given.of_site(site, told)).map_err(|e| e.to_string())?;
    let [Input::Captures(captures)] = &inputs.scenes[..] else { panic!("{inputs:?}") };
    let name = |capture: &Capture| capture.file.file_name().unwrap().to_string_lossy().into_owned();
    let mut found: Vec<_> = captures.iter().map(|of| (of.sensors[0], name(of), of.by.clone())).collect();
    found.sort();
    Ok(found)
}

/// The same for both orders of two files, which must not matter.
fn both_orders(site: &Site, files: [&Path; 2]) -> Result<Vec<(usize, String, String)>, String> {
    let one = matched(site, &files.map(Path::to_owned), &[]);
    let [a, b] = files;
    let other = matched(site, &[b, a].map(Path::to_owned), &[]);
    match (&one, &other) {
        (Ok(_), _) | (_, Ok(_)) => assert_eq!(one, other),
        _ => {}
    }
    one
}

#[test]
fn address_model_and_name_tell_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let two = |site: &Site, a: &str, b: &str| both_orders(site, [&file(a), &file(b)]).unwrap();
    let told = |found: &[(usize, String, String)]| -> Vec<String> {
        found.iter().map(|(s, name, by)| format!("{s} {name} {by}")).collect()
    };
    capture(&file("a.pcap"), &[("vlp-16", SECOND, 2368)]);
    capture(&file("b.pcap"), &[("vlp-16", FIRST, 2368)]);
    capture(&file("c.pcap"), &[("hdl-32e", FIRST, 2368)]);
    capture(&file("d.pcap"), &[("os0-32", FIRST, 7502)]);
    capture(&file("the east.pcap"), &[("vlp-16", FIRST, 2368)]);

    let addresses =
        site(&[("east", "vlp-16", Some("192.168.1.201")), ("west", "vlp-16", Some("192.168.1.202"))]);
    let found = two(&addresses, "a.pcap", "b.pcap");
    assert_eq!(told(&found), ["0 b.pcap address 192.168.1.201", "1 a.pcap address 192.168.1.202"]);

    let models = site(&[("east", "vlp-16", None), ("west", "hdl-32e", None)]);
    assert_eq!(told(&two(&models, "a.pcap", "c.pcap")), ["0 a.pcap model vlp-16", "1 c.pcap model hdl-32e"]);

    let ports = site(&[("east", "os0-32", None), ("west", "hdl-32e", None)]);
    assert_eq!(told(&two(&ports, "c.pcap", "d.pcap")), ["0 d.pcap port 7502", "1 c.pcap port 2368"]);

    let names = site(&[("lidar west", "vlp-16", None), ("lidar east", "vlp-16", None)]);
    let found = two(&names, "a.pcap", "the east.pcap");
    assert_eq!(told(&found), ["0 a.pcap what the others leave", "1 the east.pcap its name"]);
}

#[test]
fn doubt_is_refused_with_file_candidates_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    capture(&file("a.pcap"), &[("vlp-16", FIRST, 2368)]);
    capture(&file("b.pcap"), &[("vlp-16", FIRST, 2368)]);
    capture(&file("west.pcap"), &[("vlp-16", FIRST, 2368)]);
    capture(&file("os.pcap"), &[("os0-32", FIRST, 7502)]);
    let refused = |site: &Site, names: [&str; 2]| {
        both_orders(site, names.map(file).each_ref().map(PathBuf::as_path)).unwrap_err()
    };
    let holds = |told: &str, parts: &[&str]| {
        parts.iter().for_each(|part| assert!(told.contains(part), "{part}: {told}"))
    };

    // Either may be of either.
    let names = site(&[("west", "vlp-16", None), ("east", "vlp-16", None)]);
    let told = refused(&names, ["a.pcap", "b.pcap"]);
    let found = "10 packets of 1206 bytes from 192.168.1.201 to port 2368";
    holds(&told, &["a.pcap: ", "west and east may have sent", found, "`address`", "`--sensor west="]);
    // The user's word settles it.
    let word = Told { sensor: "east".to_owned(), file: file("a.pcap") };
    let settled = matched(&names, &[file("a.pcap"), file("b.pcap")], &[word]).unwrap();
    assert_eq!((settled[0].1.as_str(), settled[1].2.as_str()), ("b.pcap", "--sensor"));
    let wrong = Told { sensor: "north".to_owned(), file: file("a.pcap") };
    holds(
        &matched(&names, &[file("a.pcap"), file("b.pcap")], &[wrong]).unwrap_err(),
        &["west, east", "\"north\""],
    );

    // The name says one thing, the packets another.
    let addresses =
        site(&[("east", "vlp-16", Some("192.168.1.201")), ("west", "vlp-16", Some("192.168.1.202"))]);
    let told = refused(&addresses, ["west.pcap", "west.pcap"]);
    holds(&told, &["expected packets of west", "found packets of east", "`--sensor east="]);
    // Two of one sensor.
    let told = refused(&addresses, ["a.pcap", "b.pcap"]);
    holds(&told, &["expected 2 captures", "is of east", "address 192.168.1.201"]);
    // Of no sensor: what is sent and what was found, with the remedy.
    let told = refused(&names, ["a.pcap", "os.pcap"]);
    holds(&told, &["os.pcap: expected packets of west (vlp-16): 1206 bytes to port 2368", "to port 7502"]);
    // None of a sensor.
    let three = site(&[("west", "vlp-16", None), ("east", "vlp-16", None), ("top", "os0-32", None)]);
    fs::copy(file("a.pcap"), file("east.pcap")).unwrap();
    let told = refused(&three, ["west.pcap", "east.pcap"]);
    holds(&told, &["sensor \"top\": expected a capture of it", "west.pcap -> west (port 2368, its name)"]);
}

#[test]
fn sizes_ports_and_models_that_do_not_fit_are_named_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lidar.pcap");
    let told = |model: &str, sent: (&str, [u8; 4], u16), address: Option<&str>| {
        capture(&file, &[sent]);
        matched(&site(&[("door", model, address)]), std::slice::from_ref(&file), &[]).unwrap_err()
    };
    let found = told("os0-128", ("os1-64", FIRST, 7502), None);
    assert!(
        found.contains("door (os0-128): 8448 bytes to port 7502, found 10 packets of 4352 bytes"),
        "{found}"
    );
    assert!(found.contains("no metadata of door") && found.contains("calibration_file"), "{found}");
    let found = told("vlp-16", ("vlp-16", FIRST, 2369), None);
    assert!(found.contains("set `udp_port = 2369` of door"), "{found}");
    let found = told("vlp-16", ("vlp-16", SECOND, 2368), Some("192.168.1.201"));
    assert!(found.contains("set `address = \"192.168.1.202\"` of door"), "{found}");
    let found = told("vlp-16", ("hdl-32e", FIRST, 2368), None);
    assert!(found.contains("a hdl-32e sends such packets: correct `model` of door"), "{found}");
}

#[test]
fn what_is_named_empty_is_the_empty_hall() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["east.pcap", "west.pcap", "empty-east.pcap", "empty-west.pcap"] {
        capture(&folder.path().join(name), &[("vlp-16", FIRST, 2368)]);
    }
    let site = site(&[("west", "vlp-16", None), ("east", "vlp-16", None)]);
    let files = |input: &Input| -> Vec<(usize, String)> {
        let Input::Captures(captures) = input else { panic!("{input:?}") };
        let mut files: Vec<_> = captures
            .iter()
            .map(|of| (of.sensors[0], of.file.file_name().unwrap().to_string_lossy().into_owned()))
            .collect();
        files.sort();
        files
    };
    let named = |names: [&str; 2]| names.into_iter().map(str::to_owned).enumerate().collect::<Vec<_>>();
    let inputs = Given::of(&[folder.path().to_owned()]).unwrap().of_site(&site, &[]).unwrap();
    assert_eq!(inputs.scenes.len(), 1);
    assert_eq!(files(&inputs.scenes[0]), named(["west.pcap", "east.pcap"]));
    assert_eq!(files(inputs.empty.as_ref().unwrap()), named(["empty-west.pcap", "empty-east.pcap"]));
    // Where nothing else is given, they are what is asked for.
    let empty: Vec<PathBuf> =
        ["empty-west.pcap", "empty-east.pcap"].map(|name| folder.path().join(name)).into();
    let alone = Given::of(&empty).unwrap().of_site(&site, &[]).unwrap();
    assert_eq!((alone.scenes.len(), alone.empty), (1, None));
}
