//! A broker that is none: what a sender says to it and takes from it.

use super::*;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

use serde_json::Value;
use umbracast_io::rows::LinkRow;
use umbracast_live::warnings;

fn event() -> Event {
    let mut link = LinkRow { track: 7, onset_s: [Some(0.2), Some(0.4), None], ..LinkRow::default() };
    link.p[umbracast::STEPS - 1] = 0.75;
    Event { access_point: "door/a".to_owned(), link, state: warnings::State::Warned }
}

/// The next packet of MQTT 3.1.1: its first byte, and what follows its length.
fn packet(stream: &mut TcpStream) -> (u8, Vec<u8>) {
    let mut byte = [0; 1];
    stream.read_exact(&mut byte).unwrap();
    let kind = byte[0];
    let (mut length, mut shift) = (0_usize, 0);
    loop {
        stream.read_exact(&mut byte).unwrap();
        length |= usize::from(byte[0] & 127) << shift;
        shift += 7;
        if byte[0] & 128 == 0 {
            break;
        }
    }
    let mut rest = vec![0; length];
    stream.read_exact(&mut rest).unwrap();
    (kind, rest)
}

/// The next publication's topic and payload, acknowledged.
fn publication(stream: &mut TcpStream) -> (String, String) {
    let (topic, text, number) = unacknowledged(stream);
    acknowledge(stream, number);
    (topic, text)
}

fn acknowledge(stream: &mut TcpStream, [high, low]: [u8; 2]) {
    stream.write_all(&[0x40, 2, high, low]).unwrap();
}

/// The next publication's topic, payload and number.
fn unacknowledged(stream: &mut TcpStream) -> (String, String, [u8; 2]) {
    loop {
        let (kind, rest) = packet(stream);
        if kind >> 4 != 3 {
            continue; // A question whether we are there.
        }
        let length = usize::from(u16::from_be_bytes([rest[0], rest[1]]));
        let topic = String::from_utf8(rest[2..2 + length].to_vec()).unwrap();
        let text = String::from_utf8(rest[4 + length..].to_vec()).unwrap();
        return (topic, text, [rest[2 + length], rest[3 + length]]);
    }
}

#[test]
fn a_broker_gets_every_warning_as_json_and_is_told_who_is_there() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let sender = Sender::start(&at(&broker), "lab", Hears::default(), drop).unwrap();
    sender.send(&event(), 6); // Waits until the broker is there.
    let (mut stream, _) = broker.accept().unwrap();
    let (kind, hello) = packet(&mut stream);
    assert_eq!((kind >> 4, &hello[2..6]), (1, &b"MQTT"[..]));
    assert!(hello.windows(7).any(|word| word == b"offline"), "the last will");
    stream.write_all(&[0x20, 2, 0, 0]).unwrap();
    let mut said = [publication(&mut stream), publication(&mut stream)];
    said.sort();
    assert_eq!(said[0], ("umbracast/lab/status".to_owned(), "online".to_owned()));
    assert_eq!(said[1].0, "umbracast/lab/warnings/door_a");
    let told: Value = serde_json::from_str(&said[1].1).unwrap();
    assert_eq!((&told["event"], &told["track"], &told["p_w9"]), (&"warning".into(), &7.into(), &0.75.into()));
    assert_eq!((&told["onset_p50_s"], &told["onset_p90_s"]), (&0.4.into(), &Value::Null));
    assert_eq!(told["term"], 6);
    let ended = std::thread::spawn(move || drop(sender));
    // Good-bye is not said before the last word is acknowledged: a connection that is closed with acknowledgments unread is
    // reset, and what the broker had not read yet is lost.
    let (_, last, number) = unacknowledged(&mut stream);
    assert_eq!(last, "offline");
    stream.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    assert!(stream.read(&mut [0]).is_err(), "nothing comes before the acknowledgment");
    stream.set_read_timeout(None).unwrap();
    acknowledge(&mut stream, number);
    assert_eq!(packet(&mut stream).0 >> 4, 14, "good-bye");
    drop(stream);
    ended.join().unwrap();
}

/// A broker that takes the next client: its connection, and the name that it gives.
fn taken(broker: &TcpListener) -> (TcpStream, String) {
    let (mut stream, _) = broker.accept().unwrap();
    let (_, hello) = packet(&mut stream);
    // Behind the protocol's name, level and flags and the time to live.
    let length = usize::from(u16::from_be_bytes([hello[10], hello[11]]));
    stream.write_all(&[0x20, 2, 0, 0]).unwrap();
    (stream, String::from_utf8(hello[12..12 + length].to_vec()).unwrap())
}

#[test]
fn two_senders_of_a_hall_have_names_of_their_own_and_the_one_that_stays_says_so() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let settings = at(&broker);
    let _senders = [(); 2].map(|()| Sender::start(&settings, "lab", Hears::default(), drop).unwrap());
    let [(mut stays, one), (_ends, other)] = [(); 2].map(|()| taken(&broker));
    assert_ne!(one, other);
    assert!(one.starts_with("umbracast-lab-") && other.starts_with("umbracast-lab-"));
    assert_eq!(publication(&mut stays), ("umbracast/lab/status".to_owned(), "online".to_owned()));
    // The broker passes on the last will of the other: a publication without a number.
    let topic = b"umbracast/lab/status";
    let head = [0x30, (2 + topic.len() + 7) as u8, 0, topic.len() as u8];
    stays.write_all(&[&head[..], topic, b"offline"].concat()).unwrap();
    assert_eq!(publication(&mut stays).1, "online");
}

#[test]
fn what_access_points_heard_comes_from_the_broker_and_what_is_none_is_told() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let (hear, heard) = std::sync::mpsc::channel();
    let (tell, told) = std::sync::mpsc::channel();
    let reports = move |json: &[u8]| match json {
        b"[]" => hear.send(()).map_err(|e| Error::new(e.to_string())),
        _ => Err(Error::new("expected JSON")),
    };
    let hears = Hears { reports: Box::new(reports), ..Hears::default() };
    let sender = Sender::start(&at(&broker), "lab", hears, move |event| drop(tell.send(event)));
    let (mut stream, _) = taken(&broker);
    let topic = b"umbracast/lab/reports";
    for text in ["[]", "{{"] {
        let head = [0x30, (2 + topic.len() + text.len()) as u8, 0, topic.len() as u8];
        stream.write_all(&[&head[..], topic, text.as_bytes()].concat()).unwrap();
    }
    heard.recv().unwrap();
    let refused = told.iter().find(|event| event.name == "reports_refused").unwrap();
    assert_eq!(refused.text, "umbracast/lab/reports: expected JSON; none of this message is taken");
    drop((stream, broker, sender));
}

#[test]
fn a_connection_that_somebody_takes_over_is_told() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let (tell, told) = std::sync::mpsc::channel();
    let sender = Sender::start(&at(&broker), "lab", Hears::default(), move |event| drop(tell.send(event)));
    let (stream, name) = taken(&broker);
    drop(stream);
    let events = [told.recv().unwrap(), told.recv().unwrap()];
    assert_eq!(events.each_ref().map(|event| event.name), ["mqtt_connected", "mqtt_lost"]);
    assert!(events[1].text.contains(&name) && events[1].text.contains("takes this name"));
    drop((broker, sender));
}

#[test]
fn lists_of_objects_come_in_and_frames_go_out_where_that_is_asked_for() {
    let broker = TcpListener::bind("127.0.0.1:0").unwrap();
    let settings = Mqtt { objects: true, frames: true, ..at(&broker) };
    let (hear, heard) = std::sync::mpsc::channel();
    let hear = move |source: &str, list: &[u8]| drop(hear.send((source.to_owned(), list.to_vec())));
    let hears = Hears { objects: Box::new(hear), ..Hears::default() };
    let sender = Sender::start(&settings, "lab", hears, drop).unwrap();
    let (mut stream, _) = taken(&broker);
    assert_eq!(publication(&mut stream).1, "online");
    for topic in ["umbracast/lab/objects/cameras", "umbracast/lab/other"] {
        // A list is longer than what brokers' clients take unless they are told to.
        let body = [&[0, topic.len() as u8], topic.as_bytes(), &[b'7'; 20_000]].concat();
        let length = [
            (body.len() % 128) as u8 | 128,
            (body.len() / 128 % 128) as u8 | 128,
            (body.len() / 16_384) as u8,
        ];
        stream.write_all(&[&[0x30], &length[..], &body].concat()).unwrap();
    }
    let (source, list) = heard.recv_timeout(Duration::from_secs(5)).unwrap();
    assert_eq!((source.as_str(), list.len()), ("cameras", 20_000));
    let frame = Published { time_ns: 300, term: 6, ..Published::default() };
    (0..100).for_each(|_| sender.frame(&frame));
    assert_eq!(sender.lost(), 0, "frames that a slow broker does not take are left out");
    let (topic, text, number) = unacknowledged(&mut stream);
    let told: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (topic.as_str(), &told["time_ns"], &told["term"]),
        ("umbracast/lab/frames", &300.into(), &6.into())
    );
    acknowledge(&mut stream, number);
    assert!(heard.try_recv().is_err(), "another topic is no list");
    drop(stream);
    drop(sender);
}

fn at(broker: &TcpListener) -> Mqtt {
    let broker = broker.local_addr().unwrap().to_string();
    let (objects, frames) = (false, false);
    Mqtt { broker, user: None, password_file: None, ca: None, plain: false, objects, frames }
}

#[test]
fn a_broker_that_is_never_there_stops_nobody() {
    let settings = Mqtt {
        broker: "127.0.0.1:1".to_owned(),
        user: None,
        password_file: None,
        ca: None,
        plain: false,
        objects: false,
        frames: false,
    };
    let sender = Sender::start(&settings, "lab", Hears::default(), drop).unwrap();
    (0..WAITING + 10).for_each(|_| sender.send(&event(), 6));
    assert!(sender.lost() >= 10);
    drop(sender);
    assert!(
        Sender::start(&Mqtt { broker: "nowhere".to_owned(), ..settings }, "lab", Hears::default(), drop)
            .is_err()
    );
}
