//! What a new node asks for and other nodes answer: the site, the empty hall, the weights of the LSTM.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use sha2::{Digest, Sha256};
use umbracast::lidar::{Assembler, Packet};
use umbracast::{Config, Error, Frame, Health, Site};
use umbracast_io::nodes::TrackerState;
use umbracast_io::{fields, messages};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;

use crate::hall::Hall;

/// How long an answer may take: the packets of an empty hall are some megabytes.
const WAIT: Duration = Duration::from_secs(3);

/// How often the end of asking may be asked for, and after how many such looks others are asked again.
const LOOK: Duration = Duration::from_millis(20);
const LOOKS: usize = 50;

/// What a node has to give, by the key it is asked for with.
#[derive(Debug, Clone, Default)]
pub struct Shared(BTreeMap<String, Vec<u8>>);

/// Answers as long as it lives.
#[derive(Debug)]
pub struct Sharing {
    _queryable: Queryable<()>,
    _heard: Option<Subscriber<()>>,
}

impl Shared {
    /// The configuration as TOML. It holds nothing of the network: no name, no password.
    #[must_use]
    pub fn with_config(mut self, hall: &Hall, config: &Config) -> Self {
        self.0.insert(hall.keys().of("config/site"), config.to_toml().into_bytes());
        self
    }

    /// The packets of the empty hall, a list for each sensor of the site.
    #[must_use]
    pub fn with_empty(mut self, hall: &Hall, site: &Site, packets: &[Vec<Packet>]) -> Self {
        for (sensor, packets) in site.sensors.iter().zip(packets).filter(|(_, packets)| !packets.is_empty()) {
            let time_ns = packets[0].time_ns;
            let message = messages::sensor_packets(time_ns, &sensor.name, packets);
            self.0.insert(hall.keys().background(&sensor.name), message);
        }
        self
    }

    /// Weights of the network, as their file holds them.
    #[must_use]
    pub fn with_weights(mut self, hall: &Hall, file: Vec<u8>) -> Self {
        self.0.insert(hall.keys().of("config/weights"), file);
        self
    }

    /// Answers from now on.
    ///
    /// # Errors
    /// A key that is none.
    pub fn answer(self, hall: &Hall) -> Result<Sharing, Error> {
        let queryable = hall.answer(&hall.keys().of("config/**"), move |query| {
            for (key, bytes) in &self.0 {
                let Ok(key) = KeyExpr::try_from(key.as_str()) else { continue };
                if query.key_expr().intersects(&key) {
                    // Who asked and is gone needs no answer.
                    let _ = query.reply(key, bytes.as_slice()).wait();
                }
            }
        })?;
        Ok(Sharing { _queryable: queryable, _heard: None })
    }
}

/// Keeps the tracker's state as it was published last, for a tracker that comes when no other is there.
///
/// # Errors
/// A key that is none.
pub fn keep_state(hall: &Hall) -> Result<Sharing, Error> {
    let kept = Arc::<Mutex<Option<(u64, ZBytes)>>>::default();
    let (key, given) = (hall.keys().of("state"), kept.clone());
    let queryable = hall.answer(&key, move |query| {
        let newest = given.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((_, state)) = newest {
            let _ = query.reply(query.key_expr().clone(), state).wait(); // Who asked may be gone.
        }
    })?;
    let heard = hall.hear(&key, move |_, bytes| {
        let Some(TrackerState { term, .. }) = fields::decode(&bytes.to_bytes()) else { return };
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        // Not that of one who was away and does not know yet that another one leads.
        if kept.as_ref().is_none_or(|(known, _)| *known <= term) {
            *kept = Some((term, bytes.clone()));
        }
    })?;
    Ok(Sharing { _queryable: queryable, _heard: Some(heard) })
}

/// The configuration that somebody of the hall has; `None` where nobody answers.
///
/// # Errors
/// One that is not understood.
pub fn ask_config(hall: &Hall) -> Result<Option<Config>, Error> {
    let key = hall.keys().of("config/site");
    let Some((_, bytes)) = hall.ask(&key, WAIT).into_iter().next() else { return Ok(None) };
    let text = String::from_utf8(bytes).map_err(|e| Error::new(e.to_string()).within(&key))?;
    Config::of_run(&text, &key).map(Some)
}

/// The weights that somebody of the hall was given.
pub fn ask_weights(hall: &Hall) -> Option<Vec<u8>> {
    hall.ask(&hall.keys().of("config/weights"), WAIT).into_iter().next().map(|(_, bytes)| bytes)
}

/// The packets of the empty hall for these sensors of the site, by place in the site; `None` where they are not all known.
pub fn ask_empty(hall: &Hall, site: &Site, own: &[usize]) -> Option<Vec<Vec<Packet>>> {
    let mut packets = vec![Vec::new(); site.sensors.len()];
    for &sensor in own {
        let key = hall.keys().background(&site.sensors.get(sensor)?.name);
        let (_, bytes) = hall.ask(&key, WAIT).into_iter().next()?;
        packets[sensor] = messages::read_sensor_packets(&bytes).filter(|packets| !packets.is_empty())?;
    }
    Some(packets)
}

/// Asks for the empty hall until somebody has it, and gives its frames to `take`. Ends when `stop` is true.
pub fn ask_empty_until(
    hall: Hall,
    site: Site,
    own: Vec<usize>,
    stop: Arc<AtomicBool>,
    take: impl FnOnce(Vec<Frame>) + Send + 'static,
) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut looks = 0_usize;
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
            looks += 1;
            if !looks.is_multiple_of(LOOKS) {
                continue;
            }
            let packets = ask_empty(&hall, &site, &own);
            // Packets of a model that this site has not are none of the empty hall: somebody else's answer may be right.
            if let Some(frames) = packets.and_then(|packets| empty_frames(&site, &packets).ok()) {
                return take(frames);
            }
        }
    })
}

/// The frames of such packets, with each sensor's place in the site.
///
/// # Errors
/// A sensor model that is not known.
pub fn empty_frames(site: &Site, packets: &[Vec<Packet>]) -> Result<Vec<Frame>, Error> {
    let own: Vec<usize> = (0..packets.len()).filter(|&s| !packets[s].is_empty()).collect();
    let sensors = own.iter().filter_map(|&s| site.sensors.get(s).cloned()).collect();
    let mut assembler = Assembler::new(&Site { sensors, ..site.clone() })?;
    let mut all: Vec<(usize, &Packet)> =
        own.iter().enumerate().flat_map(|(k, &s)| packets[s].iter().map(move |p| (k, p))).collect();
    all.sort_by_key(|(_, packet)| packet.time_ns);
    let (mut frames, mut health) = (Vec::new(), Health::default());
    for (sensor, packet) in all {
        assembler.push(sensor, packet, &mut health);
        frames.extend(std::iter::from_fn(|| assembler.pop()));
    }
    assembler.finish();
    frames.extend(std::iter::from_fn(|| assembler.pop()));
    frames.iter_mut().flat_map(|frame| &mut frame.scans).for_each(|scan| scan.sensor = own[scan.sensor]);
    Ok(frames)
}

/// A number by which nodes see that they were given the same site: the first bytes of a digest of all that it says.
pub fn site_number(site: &Site) -> u64 {
    let text = serde_json::to_vec(site).unwrap_or_default(); // Plain data: cannot fail.
    let digest = Sha256::digest(&text);
    digest.iter().take(8).fold(0, |number, &byte| number << 8 | u64::from(byte))
}
