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
use umbracast_live::published::Wanted;
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
            let json = serde_json::to_value(frame.json(&Wanted::WITHOUT_POINTS, None)).unwrap_or_default();
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
#[path = "mqtt_tests.rs"]
mod tests;
