//! Warnings, decisions and frames as JSON over MQTT for clients without Zenoh, sent to an existing broker; and reports of access
//! points and lists of objects from it.
//!
//! It does not use Zenoh's bridge, because the bridge passes on bytes. Warnings on Zenoh are CDR, and MQTT listeners
//! expect JSON. `rumqttc` is maintained and small, and needs no runtime that Zenoh does not need already.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use rumqttc::{Client, Connection, LastWill, MqttOptions, QoS, TlsConfiguration, Transport};
use serde::Deserialize;
use umbracast::Error;
use umbracast_live::Published;
use umbracast_live::advice::Advice;
use umbracast_live::log::{self, Level};
use umbracast_live::warnings::Event;

use crate::secrets;

/// Warnings that wait for the broker; more are lost, and counted.
const WAITING: usize = 4096;
/// While so many messages wait for the broker's acknowledgment, a frame is left out: the next one is worth more.
const FRAMES_WAITING: i64 = 16;
/// The longest message: a list or a frame of a thousand people.
const LONGEST_BYTES: usize = 4 << 20;
/// A broker that does not answer is called again after so long.
const RETRY: Duration = Duration::from_secs(1);
/// A broker is asked whether it is there when it was silent for so long.
const KEEP_ALIVE: Duration = Duration::from_secs(5);
/// Whoever ends waits for the broker's last acknowledgments: so often, so long.
const NAPS: usize = 500;
const NAP: Duration = Duration::from_millis(2);

/// `[network.mqtt]` of the site file.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mqtt {
    /// The broker, `HOST:PORT`.
    pub broker: String,
    /// The name that it knows us by.
    pub user: Option<String>,
    /// A file that holds the password, alone on a line.
    pub password_file: Option<PathBuf>,
    /// The certificate that the broker's is signed by, PEM: with it the connection is encrypted.
    pub ca: Option<PathBuf>,
    /// Warnings and password go to a broker on another host as they are. Without `ca` that has to be said.
    #[serde(default)]
    pub plain: bool,
    /// Takes lists of objects from `umbracast/HALL/objects/SOURCE`.
    #[serde(default)]
    pub objects: bool,
    /// Sends each frame with its tracks and links to `umbracast/HALL/frames`.
    #[serde(default)]
    pub frames: bool,
}

/// Sends the warnings of a hall.
pub struct Sender {
    client: Client,
    hall: String,
    frames: bool,
    lost: AtomicU64,
    state: Arc<State>,
    thread: Option<JoinHandle<()>>,
}

type TakesReports = dyn Fn(&[u8]) -> Result<(), Error> + Send;
type TakesObjects = dyn Fn(&str, &[u8]) + Send;

/// Who takes what a broker has for the hall. They are called on the connection's thread, and wait for nobody.
pub struct Hears {
    /// What access points heard, of `umbracast/HALL/reports`; an error is told.
    pub reports: Box<TakesReports>,
    /// Lists of objects with their source, of `umbracast/HALL/objects/SOURCE`, if the settings take any.
    pub objects: Box<TakesObjects>,
}

impl Default for Hears {
    /// Nobody.
    fn default() -> Self {
        Self { reports: Box::new(|_| Ok(())), objects: Box::new(|_, _| {}) }
    }
}

/// What the sender and the thread that talks to the broker share.
#[derive(Default)]
struct State {
    stop: AtomicBool,
    /// What the broker has not acknowledged yet.
    open: AtomicI64,
}

impl Sender {
    /// Begins to call the broker, and goes on until it answers. `umbracast/HALL/status` says `online` from then on, and
    /// `offline` when the last sender of the hall ends or is cut off. `told` gets what happens to the connection, `hears` what the
    /// broker has for the hall.
    ///
    /// # Errors
    /// A broker's name that is none, a file that cannot be read or that others can read.
    pub fn start(
        settings: &Mqtt,
        hall: &str,
        hears: Hears,
        told: impl Fn(log::Event) + Send + 'static,
    ) -> Result<Self, Error> {
        let (host, port) = address(&settings.broker)?;
        // A name of its own: a broker throws out whoever had the same name before.
        let client_id = format!("umbracast-{hall}-{:08x}", RandomState::new().build_hasher().finish() as u32);
        let mut options = MqttOptions::new(&client_id, host, port);
        let status = format!("umbracast/{hall}/status");
        options.set_keep_alive(KEEP_ALIVE);
        options.set_max_packet_size(LONGEST_BYTES, LONGEST_BYTES);
        options.set_last_will(LastWill::new(&status, "offline", QoS::AtLeastOnce, true));
        if let Some(user) = &settings.user {
            let password = settings.password_file.as_deref().map(secrets::first_line).transpose()?;
            options.set_credentials(user, password.unwrap_or_default());
        }
        if let Some(ca) = &settings.ca {
            let tls = TlsConfiguration::Simple { ca: read(ca)?, alpn: None, client_auth: None };
            options.set_transport(Transport::Tls(tls));
        }
        let (client, connection) = Client::new(options, WAITING);
        let state = Arc::new(State::default());
        let mut talk = Talk {
            client: client.clone(),
            state: state.clone(),
            status,
            reports: format!("umbracast/{hall}/reports"),
            objects: settings.objects.then(|| format!("umbracast/{hall}/objects/")),
            broker: settings.broker.clone(),
            client_id,
            connected: false,
        };
        let thread = std::thread::spawn(move || talk.run(connection, &hears, told));
        let (hall, frames, lost) = (hall.to_owned(), settings.frames, AtomicU64::new(0));
        Ok(Self { client, hall, frames, lost, state, thread: Some(thread) })
    }

    /// Sends what a link has come to, as the page's events say it, to `umbracast/HALL/warnings/AP`, at least once. Waits for
    /// nobody. A listener that has heard of a newer term gives the event up.
    pub fn send(&self, event: &Event, term: u64) {
        // What separates levels and patterns of MQTT is in no name that can be subscribed to.
        let access_point = event.access_point.replace(['/', '+', '#'], "_");
        let topic = format!("umbracast/{}/warnings/{access_point}", self.hall);
        self.publish(&topic, event.json(), term);
    }

    /// Sends what is to be done about a device, as the page's events say it, to `umbracast/HALL/decisions/TRACK`, at least once, with the
    /// term of the tracker that led. Waits for nobody.
    pub fn advise(&self, advice: &Advice, term: u64) {
        let topic = format!("umbracast/{}/decisions/{}", self.hall, advice.decision.track);
        self.publish(&topic, advice.json(), term);
    }

    /// Sends a frame as `/api/frame` of the page says it, where the settings ask for frames and the broker keeps up.
    pub fn frame(&self, frame: &Published) {
        if self.frames && self.state.open.load(Ordering::Acquire) < FRAMES_WAITING {
            let json = serde_json::to_value(frame.json(false, None)).unwrap_or_default();
            self.publish(&format!("umbracast/{}/frames", self.hall), json, frame.term);
        }
    }

    fn publish(&self, topic: &str, mut json: serde_json::Value, term: u64) {
        json["term"] = term.into();
        if !self.state.publish(&self.client, topic, false, json.to_string()) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Warnings and decisions that found the queue full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        // Behind what waits; a broker that is not there gets the last will's word from nobody, as it has none of ours.
        let status = format!("umbracast/{}/status", self.hall);
        self.state.publish(&self.client, &status, true, "offline".to_owned());
        self.state.stop.store(true, Ordering::Release);
        let Some(thread) = self.thread.take() else { return };
        // A connection that is closed with acknowledgments unread is reset, and what the broker had not read is lost with it.
        let is_heard = || self.state.open.load(Ordering::Acquire) <= 0 || thread.is_finished();
        for _ in (0..NAPS).take_while(|_| !is_heard()) {
            std::thread::sleep(NAP);
        }
        let _ = self.client.try_disconnect();
        let _ = thread.join(); // It does not panic; if it did, there is nothing left to end.
    }
}

impl State {
    /// At least once. False where too much waits already.
    fn publish(&self, client: &Client, topic: &str, retain: bool, text: String) -> bool {
        self.open.fetch_add(1, Ordering::AcqRel);
        let taken = client.try_publish(topic, QoS::AtLeastOnce, retain, text).is_ok();
        if !taken {
            self.open.fetch_sub(1, Ordering::AcqRel);
        }
        taken
    }
}

/// What the thread that talks to the broker knows.
struct Talk {
    client: Client,
    state: Arc<State>,
    /// The topic that says whether the hall has a sender.
    status: String,
    /// The topic of what access points heard.
    reports: String,
    /// What topics of lists of objects begin with, where they are taken.
    objects: Option<String>,
    broker: String,
    client_id: String,
    connected: bool,
}

impl Talk {
    /// Sends and receives until the client has said good-bye, or nobody is there to say it to.
    fn run(&mut self, mut connection: Connection, hears: &Hears, told: impl Fn(log::Event)) {
        use rumqttc::{Event, Outgoing, Packet};
        for event in connection.iter() {
            let stops = self.state.stop.load(Ordering::Acquire);
            match event {
                Ok(Event::Incoming(Packet::ConnAck(_))) => {
                    let Self { broker, client_id, .. } = self;
                    let text = format!("warnings go to the MQTT broker {broker} from {client_id}");
                    told(log::Event::new(Level::Info, "mqtt_connected", text));
                    self.connected = true;
                    // Another sender of the hall that ends says `offline` for all.
                    let _ = self.client.try_subscribe(&self.status, QoS::AtLeastOnce);
                    let _ = self.client.try_subscribe(&self.reports, QoS::AtMostOnce);
                    if let Some(objects) = &self.objects {
                        let _ = self.client.try_subscribe(format!("{objects}+"), QoS::AtMostOnce);
                    }
                    self.say_online();
                }
                Ok(Event::Incoming(Packet::Publish(said)))
                    if said.topic == self.status && said.payload == "offline" && !stops =>
                {
                    self.say_online();
                }
                Ok(Event::Incoming(Packet::Publish(said))) if said.topic == self.reports => {
                    if let Err(error) = (hears.reports)(&said.payload) {
                        let text = format!("{}: {error}; none of this message is taken", self.reports);
                        told(log::Event::new(Level::Warn, "reports_refused", text));
                    }
                }
                Ok(Event::Incoming(Packet::Publish(said))) => {
                    let source = self.objects.as_ref().and_then(|objects| said.topic.strip_prefix(objects));
                    source.into_iter().for_each(|source| (hears.objects)(source, &said.payload));
                }
                Ok(Event::Incoming(Packet::PubAck(_))) => {
                    self.state.open.fetch_sub(1, Ordering::AcqRel);
                }
                Ok(Event::Outgoing(Outgoing::Disconnect)) => return,
                Ok(_) => {}
                Err(_) if stops => return,
                Err(error) => {
                    told(self.lost(&error));
                    self.connected = false;
                    std::thread::sleep(RETRY);
                }
            }
        }
    }

    fn say_online(&self) {
        self.state.publish(&self.client, &self.status, true, "online".to_owned());
    }

    /// In words. MQTT 3.1.1 does not say why a broker hangs up.
    fn lost(&self, error: &rumqttc::ConnectionError) -> log::Event {
        let Self { broker, client_id, .. } = self;
        let (name, text) = match self.connected {
            true => (
                "mqtt_lost",
                format!(
                    "the MQTT broker {broker} is gone or has ended the connection of {client_id}: {error}; a broker does so, \
                     too, when another client takes this name"
                ),
            ),
            false => {
                ("mqtt_no_answer", format!("the MQTT broker {broker} does not take {client_id}: {error}"))
            }
        };
        log::Event::new(Level::Warn, name, text)
    }
}

fn address(broker: &str) -> Result<(&str, u16), Error> {
    let parts = broker.rsplit_once(':').filter(|(host, _)| !host.is_empty());
    let parts = parts.and_then(|(host, port)| Some((host, port.parse().ok()?)));
    parts.ok_or_else(|| {
        Error::new(format!("network.mqtt.broker: expected HOST:PORT, as localhost:1883, found {broker:?}"))
    })
}

fn read(file: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(file).map_err(|e| Error::new(e.to_string()).within(file.display()))
}

#[cfg(test)]
mod tests {
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
        assert_eq!(
            (&told["event"], &told["track"], &told["p_w9"]),
            (&"warning".into(), &7.into(), &0.75.into())
        );
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
        let sender =
            Sender::start(&at(&broker), "lab", Hears::default(), move |event| drop(tell.send(event)));
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
}
