use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;

use umbracast::Config;
use umbracast_io::rows::{DecisionRow, LinkRow, LossRow, TrackRow};
use umbracast_io::wire;

use super::*;
use crate::clock::HostClock;
use crate::run::Counters;
use crate::warnings::Warnings;

fn server(token: Option<&str>) -> (Server, HostClock) {
    let clock = HostClock::start();
    let watched = Watched::new(Config::default().site, Arc::new(Counters::default()), clock, "a test");
    let door = Door::at(SocketAddr::from(([127, 0, 0, 1], 0)));
    let door = Door { hosts: vec!["hall.example".to_owned()], token: token.map(str::to_owned), ..door };
    (start(door, watched).unwrap(), clock)
}

fn published(clock: HostClock) -> Arc<Published> {
    let link = LinkRow { track: 4, blocked_now: true, p_now: 0.9, p: [0.9; 9], ..LinkRow::default() };
    Arc::new(Published {
        frame: 12,
        published_ns: clock.now_ns(),
        tracks: vec![TrackRow { track: 4, x_m: 1.5, confirmed: true, ..TrackRow::default() }],
        links: vec![link],
        events: Warnings::default().changes(&[link], &["side".to_owned()]),
        access_points: Arc::from(["side".to_owned()]),
        points_cm: vec![[1, 2, 3]],
        sensors: vec![true, false],
        ..Published::default()
    })
}

/// A connection on which this request was sent.
fn ask(server: &Server, path: &str, heads: &str) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let host = server.address();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n{heads}\r\n").unwrap();
    BufReader::new(stream)
}

/// Status and body of an answer.
fn get(server: &Server, path: &str, heads: &str) -> (u16, String) {
    let mut answer = String::new();
    ask(server, path, &format!("Connection: close\r\n{heads}")).read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
}

/// Status and body of the answer to a body that is posted.
fn post(server: &Server, path: &str, heads: &str, body: &str) -> (u16, String) {
    let (mut stream, host) = (TcpStream::connect(server.address()).unwrap(), server.address());
    let length = body.len();
    write!(
        stream,
        "POST {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Length: {length}\r\n{heads}\r\n{body}"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
}

#[test]
fn reports_are_posted_by_who_may_and_what_is_none_is_told() {
    let mut site = Config::default().site;
    site.access_points[0].radio = Some(umbracast::site::Radio::default());
    let name = site.access_points[0].name.clone();
    let (counters, clock) = (Arc::new(Counters::default()), HostClock::start());
    let mut watched = Watched::new(site, counters.clone(), clock, "a test");
    let heard = counters.clone();
    watched.ear = Some(Arc::new(move |reports| heard.heard.push(reports)));
    let token = "sixteen-characters";
    let door = Door { token: Some(token.to_owned()), ..Door::at(SocketAddr::from(([127, 0, 0, 1], 0))) };
    let server = start(door, watched).unwrap();
    let one = format!("{{\"access_point\":\"{name}\",\"device\":7,\"power_dbm\":-61.5}}");
    assert_eq!(post(&server, "/api/reports", "", &one).0, 401);
    let bearer = format!("Authorization: Bearer {token}\r\n");
    let two = format!("[{one},{one}]");
    assert_eq!(post(&server, "/api/reports", &bearer, &two), (202, String::new()));
    let now_ns = clock.now_ns();
    let reports = counters.heard.take(now_ns, now_ns);
    assert_eq!((reports.len(), reports[1].device, reports[1].power_dbm), (2, 7, -61.5));
    assert!((now_ns - reports[0].time_ns).abs() < 60_000_000_000, "heard just now");
    let (status, told) = post(&server, "/api/reports", &bearer, &two.replace(&name, "attic"));
    assert_eq!(status, 400);
    assert!(
        told.starts_with("report 0: access_point: expected one of the site's that has a radio"),
        "{told}"
    );
    assert!(counters.heard.take(0, 0).is_empty(), "none of them is taken");
    let metrics = get(&server, "/metrics", &bearer).1;
    assert!(metrics.contains("\numbracast_reports_total 2\n"), "{metrics}");
    server.stop();
}

#[test]
fn curl_gets_what_the_page_gets() {
    let (server, clock) = server(None);
    assert_eq!(get(&server, "/health", "").0, 503, "no frame yet");
    server.publisher().publish(&published(clock));
    let (status, body) = get(&server, "/api/frame", "");
    let frame: Value = serde_json::from_str(&body).unwrap();
    assert_eq!((status, &frame["frame"], &frame["tracks"][0]["x_m"]), (200, &json!(12), &json!(1.5)));
    assert_eq!(
        (&frame["blockages"][0]["access_point"], &frame["points_cm"]),
        (&json!("side"), &json!([1, 2, 3]))
    );
    let slim: Value = serde_json::from_str(&get(&server, "/api/frame?points=0", "").1).unwrap();
    assert_eq!(slim.get("points_cm"), None);
    let (status, body) = get(&server, "/health", "");
    assert!(
        status == 200 && body.contains("\"name\":\"lidar_west\"") && body.contains("\"gave\":false"),
        "{body}"
    );
    let site: Value = serde_json::from_str(&get(&server, "/api/site", "").1).unwrap();
    assert_eq!(
        (&site["title"], &site["site"]["access_points"][0]["name"]),
        (&json!("a test"), &json!("side"))
    );
    let metrics = get(&server, "/metrics", "").1;
    assert!(
        metrics.contains("\numbracast_links_blocked 1\n") && metrics.contains("le=\"+Inf\""),
        "{metrics}"
    );
    let (status, page) = get(&server, "/", "");
    assert!(
        status == 200 && page.contains("<canvas") && !page.contains("https://"),
        "nothing is loaded from elsewhere"
    );
    let heads = page.len();
    assert!((40_000..1 << 20).contains(&heads), "the whole page has {heads} bytes");
    server.stop();
}

#[test]
fn the_whole_scan_comes_only_while_somebody_asks_and_a_recording_only_where_there_is_one() {
    let (server, _) = server(None);
    assert_eq!(get(&server, "/api/scan", "").0, 204, "no frame was left yet");
    for path in ["/api/recording", "/api/recording/frames?from=0&count=5", "/api/recording/scan?frame=3"] {
        assert_eq!(get(&server, path, "").0, 404, "{path}");
    }
    assert_eq!(get(&server, "/api/recording/frames?from=-1&count=5", "").0, 400);
    server.stop();
    let mut watched = Watched::new(Config::default().site, Arc::default(), HostClock::start(), "a recording");
    let recording =
        Arc::new(crate::recording::Recording::new(vec!["default".to_owned()], 2.0, false, false).unwrap());
    recording.add(&[Published { frame: 9, ..Published::default() }], None, || vec![1, 2, 3]);
    watched.recording = Some(recording);
    let server = start(Door::at(SocketAddr::from(([127, 0, 0, 1], 0))), watched).unwrap();
    let frames: Value =
        serde_json::from_str(&get(&server, "/api/recording/frames?from=0&count=5", "").1).unwrap();
    assert_eq!((&frames[0]["frames"][0]["frame"], frames.as_array().unwrap().len()), (&json!(9), 1));
    assert_eq!(get(&server, "/health", "").0, 200, "a recording is never late");
    server.stop();
}

#[test]
fn a_planner_answers_and_says_what_is_wrong() {
    let mut watched = Watched::new(Config::default().site, Arc::default(), HostClock::start(), "a plan");
    watched.planner = Some(Planner::new(|name, body| match name {
        "length" => Ok(json!({ "length": body.len() }).to_string()),
        _ => Err(Error::new(format!("expected length, found {name}"))),
    }));
    let server = start(Door::at(SocketAddr::from(([127, 0, 0, 1], 0))), watched).unwrap();
    let post = |name: &str, length: usize, heads: &str| {
        let mut stream = TcpStream::connect(server.address()).unwrap();
        let host = server.address();
        write!(stream, "POST /api/plan/{name} HTTP/1.1\r\nHost: {host}\r\nContent-Length: {length}\r\nConnection: close\r\n{heads}\r\n").unwrap();
        let _ = stream.write_all(&vec![b'x'; if length < 1000 { length } else { 0 }]);
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer
    };
    assert!(post("length", 7, "").ends_with("{\"length\":7}"));
    let wrong = post("width", 7, "");
    assert!(wrong.contains(" 400 ") && wrong.ends_with("expected length, found width\n"), "{wrong}");
    assert!(post("length", 5 << 20, "").contains(" 413 "), "a question has a longest length");
    assert!(post("length", 7, "Origin: http://elsewhere.example\r\n").contains(" 403 "));
    assert!(get(&server, "/", "").1.contains("id=\"plan\""));
    server.stop();
}

#[test]
fn every_field_of_a_frame_is_in_the_interface() {
    let document = openapi::document();
    let frame =
        serde_json::to_value(published(HostClock::start()).json(&crate::published::Wanted::WHOLE, None))
            .unwrap();
    let known = &document["components"]["schemas"]["Frame"]["properties"];
    frame.as_object().unwrap().keys().for_each(|name| assert!(known.get(name).is_some(), "{name}"));
    let known = &document["components"]["schemas"]["Event"]["properties"];
    frame["events"][0]
        .as_object()
        .unwrap()
        .keys()
        .for_each(|name| assert!(known.get(name).is_some(), "{name}"));
}

#[test]
fn a_client_gets_the_columns_that_it_names_rounded() {
    let (server, clock) = server(None);
    server.publisher().publish(&published(clock));
    let frame = |query: &str| {
        let (status, text) = get(&server, &format!("/api/frame?{query}"), "");
        assert_eq!(status, 200, "{text}");
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let whole = frame("");
    let part = frame("columns=track,x_m,p_w3&decimals=1");
    let names = |row: &Value| row.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert!(names(&whole["tracks"][0]).len() > 100);
    assert_eq!(names(&part["tracks"][0]), ["track", "x_m"]);
    assert_eq!(names(&part["blockages"][0]), ["p_w3", "track"]);
    let rounded = (whole["tracks"][0]["x_m"].as_f64().unwrap() * 10.0).round() / 10.0;
    assert_eq!(part["tracks"][0]["x_m"].as_f64().unwrap(), rounded);
    for (query, found) in [("columns=x_mm", "\"x_mm\""), ("decimals=16", "16")] {
        let (status, text) = get(&server, &format!("/api/frame?{query}"), "");
        assert!(status == 400 && text.contains("expected") && text.contains(found), "{text}");
    }
    server.stop();
}

#[test]
fn the_page_asks_for_every_column_that_it_reads() {
    let page = pages::WATCH;
    let asked = &page[page.find("const DRAWN").unwrap()..];
    let asked = &asked[..asked.find("function connect").unwrap()];
    let columns = [
        wire::columns::<TrackRow>(),
        wire::columns::<LinkRow>(),
        wire::columns::<LossRow>(),
        wire::columns::<DecisionRow>(),
    ];
    let reads = |name: &str| {
        page.match_indices(&format!(".{name}")).any(|(at, found)| {
            !page[at + found.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_')
        })
    };
    let read: Vec<String> = columns.into_iter().flatten().filter(|name| reads(name)).collect();
    assert!(read.len() > 20, "{read:?}");
    read.iter().for_each(|name| assert!(asked.contains(&format!("\"{name}\"")), "{name}"));
}

#[test]
fn without_its_token_nobody_sees_anything() {
    let (server, _) = server(Some("a-secret-of-sixteen"));
    for path in [
        "/",
        "/api/frame",
        "/api/live",
        "/api/events",
        "/metrics",
        "/api/frame?token=a-secret-of-sixtee",
        "/?token=",
    ] {
        assert_eq!(get(&server, path, "").0, 401, "{path}");
    }
    assert_eq!(get(&server, "/api/frame?token=a-secret-of-sixteen", "").0, 200);
    assert_eq!(get(&server, "/api/frame", "Authorization: Bearer a-secret-of-sixteen\r\n").0, 200);
    // A page from elsewhere is refused though the browser sends the cookie along.
    let cookie = "Cookie: a=b; umbracast_token=a-secret-of-sixteen\r\n";
    assert_eq!(get(&server, "/api/frame", cookie).0, 200);
    let foreign = format!("{cookie}Origin: http://elsewhere.example\r\n");
    assert_eq!(get(&server, "/api/frame", &foreign).0, 403);
    // Two wrong tokens were given above; a request without any is no guess.
    for _ in 0..8 {
        assert_eq!(get(&server, "/api/frame?token=guessed", "").0, 401);
    }
    assert_eq!(get(&server, "/api/frame", cookie).0, 429, "closed for a minute");
    server.stop();
}

#[test]
fn a_page_of_another_origin_is_refused() {
    let (server, _) = server(None);
    assert_eq!(get(&server, "/api/frame", "Origin: http://elsewhere.example\r\n").0, 403);
    let own = format!("Origin: http://{}\r\n", server.address());
    assert_eq!(get(&server, "/api/frame", &own).0, 200);
    server.stop();
}

/// What the server says to a request of this host, with the right token.
fn get_of(server: &Server, host: &str, heads: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    let token = "Authorization: Bearer a-secret-of-sixteen\r\nConnection: close\r\n";
    write!(stream, "GET /api/site HTTP/1.1\r\n{host}{token}{heads}\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    (answer.split(' ').nth(1).unwrap().parse().unwrap(), answer)
}

/// With a token the host was not looked at: a page of elsewhere whose name led here could ask with a token that it had guessed
/// or been given.
#[test]
fn a_name_that_was_made_to_lead_here_is_refused_with_a_token_too() {
    for token in [Some("a-secret-of-sixteen"), None] {
        let (server, _) = server(token);
        for own in [
            "127.0.0.1:8600",
            "localhost",
            "localhost:8600",
            "[::1]:8600",
            "hall.example",
            "HALL.example:443",
        ] {
            assert_eq!(get_of(&server, &format!("Host: {own}\r\n"), "").0, 200, "{own}");
        }
        let origin = "Origin: https://hall.example\r\n";
        assert_eq!(get_of(&server, "Host: hall.example\r\n", origin).0, 200);
        assert_eq!(get_of(&server, "Host: localhost\r\n", origin).0, 403, "another name's page");
        let foreign = ["elsewhere.example:8600", "127.0.0.1.elsewhere.example", "192.168.0.7:8600", "@:", ""];
        for foreign in foreign {
            let (status, answer) = get_of(&server, &format!("Host: {foreign}\r\n"), "");
            assert!(status == 403 && answer.contains("--host"), "{foreign}: {answer}");
        }
        assert_ne!(get_of(&server, "", "").0, 200, "without a host");
        server.stop();
    }
}

#[test]
fn a_host_that_is_no_name_is_refused_at_the_start() {
    let watched = Watched::new(
        Config::default().site,
        Arc::new(Counters::default()),
        HostClock::start(),
        String::new(),
    );
    let door = Door::at(SocketAddr::from(([127, 0, 0, 1], 0)));
    let door = Door { hosts: vec!["https://hall.example".to_owned()], ..door };
    let message = start(door, watched).err().unwrap().to_string();
    assert!(message.contains("--host") && message.contains("found \"https://hall.example\""), "{message}");
}

#[test]
fn an_address_that_others_reach_needs_a_token() {
    let watched = Watched::new(
        Config::default().site,
        Arc::new(Counters::default()),
        HostClock::start(),
        String::new(),
    );
    let message = start(Door::at(SocketAddr::from(([0, 0, 0, 0], 0))), watched).err().unwrap().to_string();
    assert!(message.contains("UMBRACAST_TOKEN"), "{message}");
}

#[test]
fn a_websocket_gets_the_newest_frame_and_the_next() {
    let (server, clock) = server(None);
    server.publisher().publish(&published(clock));
    // The key and its answer are those of RFC 6455, section 1.3.
    let heads = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                 Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let mut stream = ask(&server, "/api/live?points=0", heads);
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        stream.read_line(&mut line).unwrap();
        assert!(!line.is_empty(), "closed");
    }
    let mut text = || {
        let mut head = [0; 2];
        stream.read_exact(&mut head).unwrap();
        assert_eq!(head[0], 0x81, "one whole text");
        let length = match head[1] {
            126 => {
                let mut long = [0; 2];
                stream.read_exact(&mut long).unwrap();
                usize::from(u16::from_be_bytes(long))
            }
            short => usize::from(short),
        };
        let mut text = vec![0; length];
        stream.read_exact(&mut text).unwrap();
        serde_json::from_slice::<Value>(&text).unwrap()
    };
    assert_eq!(text()["frame"], 12);
    server.publisher().publish(&Arc::new(Published { frame: 13, ..(*published(clock)).clone() }));
    assert_eq!(text()["frame"], 13);
    server.stop();
}

#[test]
fn lists_of_objects_are_taken_by_websocket_where_somebody_takes_them() {
    let heads = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                 Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let (deaf, _) = server(None);
    assert_eq!(get(&deaf, "/api/objects/cameras", "").0, 404);
    let (hear, heard) = std::sync::mpsc::channel();
    let hear = std::sync::Mutex::new(hear);
    let clock = HostClock::start();
    let mut watched =
        Watched::new(Config::default().site, Arc::new(Counters::default()), clock, String::new());
    watched.objects = Some(Box::new(move |source, list| {
        let _ = hear.lock().unwrap().send((source.to_owned(), list.to_vec()));
    }));
    let server = start(Door::at(SocketAddr::from(([127, 0, 0, 1], 0))), watched).unwrap();
    let mut stream = ask(&server, "/api/objects/cameras", heads);
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        stream.read_line(&mut line).unwrap();
        assert!(!line.is_empty(), "closed");
    }
    // A client's text is masked: here with zeros, which leave it as it is. It is longer than what viewers may say.
    let list = vec![b'x'; 8000];
    let head = [&[0x81, 0x80 | 126][..], &(list.len() as u16).to_be_bytes(), &[0; 4]].concat();
    stream.get_mut().write_all(&[head, list.clone()].concat()).unwrap();
    let (source, taken) = heard.recv_timeout(Duration::from_secs(5)).unwrap();
    assert_eq!((source.as_str(), taken), ("cameras", list));
    // It is answered with frames.
    server.publisher().publish(&published(clock));
    let mut head = [0; 1];
    stream.read_exact(&mut head).unwrap();
    assert_eq!(head[0], 0x81);
    server.stop();
}

#[test]
fn events_are_sent_as_they_happen() {
    let (server, clock) = server(None);
    let mut stream = ask(&server, "/api/events", "Accept: text/event-stream\r\n");
    let mut line = String::new();
    while line != "\r\n" {
        line.clear();
        stream.read_line(&mut line).unwrap();
    }
    server.publisher().publish(&published(clock));
    let mut said = String::new();
    while !said.contains("data: ") {
        stream.read_line(&mut said).unwrap();
    }
    assert!(said.contains("event: blocked\n") && said.contains("\"track\":4"), "{said}");
    server.stop();
}
