//! Warnings as JSON over MQTT, for those who have no Zenoh: sent to a broker that is there already.
//!
//! A client of our own and not Zenoh's bridge, as the bridge passes on bytes: warnings on Zenoh are CDR, and who listens
//! to MQTT expects JSON. `rumqttc` is kept, small, and brings no runtime that Zenoh has not brought.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use rumqttc::{Client, Connection, LastWill, MqttOptions, QoS, TlsConfiguration, Transport};
use serde::Deserialize;
use umbracast::Error;
use umbracast_live::warnings::Event;

/// Warnings that wait for the broker; more are lost, and counted.
const WAITING: usize = 4096;
/// A broker that does not answer is called again after so long.
const RETRY: Duration = Duration::from_secs(1);
/// A broker is asked whether it is there when it was silent for so long.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

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
}

/// Sends the warnings of a hall.
pub struct Sender {
    client: Client,
    hall: String,
    lost: AtomicU64,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Sender {
    /// Begins to call the broker, and goes on until it answers. `umbracast/HALL/status` says `online` from then on, and
    /// `offline` when this ends or is cut off.
    ///
    /// # Errors
    /// A broker's name that is none, a file that cannot be read.
    pub fn start(settings: &Mqtt, hall: &str) -> Result<Self, Error> {
        let (host, port) = address(&settings.broker)?;
        let mut options = MqttOptions::new(format!("umbracast-{hall}"), host, port);
        let status = format!("umbracast/{hall}/status");
        options.set_keep_alive(KEEP_ALIVE);
        options.set_last_will(LastWill::new(&status, "offline", QoS::AtLeastOnce, true));
        if let Some(user) = &settings.user {
            let password = settings.password_file.as_deref().map(read).transpose()?.unwrap_or_default();
            let password = String::from_utf8_lossy(&password);
            options.set_credentials(user, password.lines().next().unwrap_or_default());
        }
        if let Some(ca) = &settings.ca {
            let tls = TlsConfiguration::Simple { ca: read(ca)?, alpn: None, client_auth: None };
            options.set_transport(Transport::Tls(tls));
        }
        let (client, connection) = Client::new(options, WAITING);
        let stop = Arc::new(AtomicBool::new(false));
        let thread = std::thread::spawn({
            let (client, stop) = (client.clone(), stop.clone());
            move || talk(connection, &client, &status, &stop)
        });
        Ok(Self { client, hall: hall.to_owned(), lost: AtomicU64::new(0), stop, thread: Some(thread) })
    }

    /// Sends what a link has come to, as the page's events say it, to `umbracast/HALL/warnings/AP`, at least once. Waits for
    /// nobody.
    pub fn send(&self, event: &Event) {
        // What separates levels and patterns of MQTT is in no name that can be subscribed to.
        let access_point = event.access_point.replace(['/', '+', '#'], "_");
        let topic = format!("umbracast/{}/warnings/{access_point}", self.hall);
        let text = event.json().to_string();
        if self.client.try_publish(topic, QoS::AtLeastOnce, false, text).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Warnings that found the queue full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        // Behind what waits; a broker that is not there gets the last will's word from nobody, as it has none of ours.
        let said = self.client.try_publish(
            format!("umbracast/{}/status", self.hall),
            QoS::AtLeastOnce,
            true,
            "offline",
        );
        let _ = said.and_then(|()| self.client.try_disconnect());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // It does not panic; if it did, there is nothing left to end.
        }
    }
}

/// Sends and receives until the client has said good-bye, or nobody is there to say it to.
fn talk(mut connection: Connection, client: &Client, status: &str, stop: &AtomicBool) {
    use rumqttc::{Event, Outgoing, Packet};
    for event in connection.iter() {
        match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => {
                let _ = client.try_publish(status, QoS::AtLeastOnce, true, "online");
            }
            Ok(Event::Outgoing(Outgoing::Disconnect)) => return,
            Ok(_) => {}
            Err(_) if stop.load(Ordering::Relaxed) => return,
            Err(_) => std::thread::sleep(RETRY),
        }
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
    use umbracast_live::warnings::State;

    fn event() -> Event {
        let mut link = LinkRow { track: 7, onset_s: [Some(0.2), Some(0.4), None], ..LinkRow::default() };
        link.p[umbracast::STEPS - 1] = 0.75;
        Event { access_point: "door/a".to_owned(), link, state: State::Warned }
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
        loop {
            let (kind, rest) = packet(stream);
            if kind >> 4 != 3 {
                continue; // A question whether we are there.
            }
            let length = usize::from(u16::from_be_bytes([rest[0], rest[1]]));
            let topic = String::from_utf8(rest[2..2 + length].to_vec()).unwrap();
            let number = &rest[2 + length..4 + length];
            // Who has said good-bye right behind it waits for no acknowledgment, and may be gone.
            let _ = stream.write_all(&[0x40, 2, number[0], number[1]]);
            return (topic, String::from_utf8(rest[4 + length..].to_vec()).unwrap());
        }
    }

    #[test]
    fn a_broker_gets_every_warning_as_json_and_is_told_who_is_there() {
        let broker = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = broker.local_addr().unwrap().to_string();
        let settings = Mqtt { broker: address, user: None, password_file: None, ca: None };
        let sender = Sender::start(&settings, "lab").unwrap();
        sender.send(&event()); // Waits until the broker is there.
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
        let ended = std::thread::spawn(move || drop(sender));
        assert_eq!(publication(&mut stream).1, "offline");
        assert_eq!(packet(&mut stream).0 >> 4, 14, "good-bye");
        drop(stream);
        ended.join().unwrap();
    }

    #[test]
    fn a_broker_that_is_never_there_stops_nobody() {
        let settings = Mqtt { broker: "127.0.0.1:1".to_owned(), user: None, password_file: None, ca: None };
        let sender = Sender::start(&settings, "lab").unwrap();
        (0..WAITING + 10).for_each(|_| sender.send(&event()));
        assert!(sender.lost() >= 10);
        drop(sender);
        assert!(Sender::start(&Mqtt { broker: "nowhere".to_owned(), ..settings }, "lab").is_err());
    }
}
