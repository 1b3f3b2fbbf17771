//! What runs where: every hall on a network with its nodes, as they report themselves, and what is not as it should be.

mod show;
mod troubles;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use umbracast::{Config, Error};
use umbracast_io::fields;
use umbracast_io::nodes::NodeHealth;
use umbracast_live::HostClock;
use zenoh::query::QueryTarget;
use zenoh::{Session, Wait};

pub use show::{json, text};

/// More words than a thousand nodes say in a minute are not listened to.
const WORDS_MAX: usize = 1 << 16;

/// How long nodes may take to say what their site is.
const ANSWER: Duration = Duration::from_secs(2);

/// One hall.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hall {
    /// Its nodes, by name.
    pub nodes: BTreeMap<String, Node>,
    /// The sensors of its site, where a node says what the site is.
    pub sensors: Vec<String>,
}

/// One node.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Node {
    /// What it does, as its tokens say. None: it is gone.
    pub roles: BTreeSet<String>,
    /// The sensors that it stands beside.
    pub sensors: BTreeSet<String>,
    /// What it said last.
    pub health: Option<NodeHealth>,
    /// What it said first, if it spoke more than once.
    first: Option<NodeHealth>,
    /// How far its clock is ahead of the clock of the host that listens, seconds. A word that was long on its way makes it less.
    ahead_s: Option<f64>,
}

/// A word of a node: its key, what it says, and when it was heard, time of the host that listens.
pub type Word = (String, NodeHealth, i64);

impl Node {
    /// Cores that it uses: between its first and its last word, else since it began.
    pub fn cores(&self) -> Option<f64> {
        let now = self.health.as_ref()?;
        let (cpu_s, up_s) = self.first.as_ref().map_or((0.0, 0.0), |first| (first.cpu_s, first.up_s));
        Some((now.cpu_s - cpu_s) / (now.up_s - up_s).max(f64::MIN_POSITIVE))
    }

    /// Bytes a second that it publishes, in the same time.
    pub fn bytes_per_s(&self) -> Option<f64> {
        let now = self.health.as_ref()?;
        let (bytes, up_s) = self.first.as_ref().map_or((0, 0.0), |first| (first.bytes_out, first.up_s));
        Some(now.bytes_out.saturating_sub(bytes) as f64 / (now.up_s - up_s).max(f64::MIN_POSITIVE))
    }
}

/// What tokens and words of health say together.
pub fn halls(tokens: &[String], words: Vec<Word>) -> BTreeMap<String, Hall> {
    let mut halls: BTreeMap<String, Hall> = BTreeMap::new();
    for token in tokens {
        if let ["umbracast", hall, "node", role, id] = token.split('/').collect::<Vec<_>>()[..] {
            // A front end shows itself once for each sensor, by the sensor's name before its own.
            let (sensor, id) = id.rsplit_once('.').map_or((None, id), |(sensor, id)| (Some(sensor), id));
            let node = halls.entry(hall.to_owned()).or_default().nodes.entry(id.to_owned()).or_default();
            node.roles.insert(role.to_owned());
            node.sensors.extend(sensor.map(str::to_owned));
        }
    }
    for (key, health, heard_ns) in words {
        if let ["umbracast", hall, "health", _, id] = key.split('/').collect::<Vec<_>>()[..] {
            let node = halls.entry(hall.to_owned()).or_default().nodes.entry(id.to_owned()).or_default();
            let ahead_s = health.time_ns.saturating_sub(heard_ns) as f64 * 1e-9;
            node.ahead_s = Some(node.ahead_s.map_or(ahead_s, |before| before.max(ahead_s)));
            // A node of several roles says the same under each.
            if node.health.as_ref().is_none_or(|last| last.time_ns < health.time_ns) {
                let before = node.health.replace(health);
                node.first = node.first.take().or(before);
            }
        }
    }
    halls
}

/// Listens for so long, every node speaks once a second, and says who is there.
///
/// # Errors
/// A session that is closed.
pub fn look(
    session: &Session,
    hall: Option<&str>,
    listen: Duration,
) -> Result<BTreeMap<String, Hall>, Error> {
    let failed = |e: zenoh::Error| Error::new(format!("fleet: {e}"));
    let (hall, clock) = (hall.unwrap_or("*"), HostClock::start());
    let words = Arc::new(Mutex::new(Vec::new()));
    let lock =
        |words: &Mutex<Vec<_>>| std::mem::take(&mut *words.lock().unwrap_or_else(PoisonError::into_inner));
    let heard = words.clone();
    let subscriber = session.declare_subscriber(format!("umbracast/{hall}/health/*/*"));
    let subscriber = subscriber.callback(move |sample| {
        if let Some(health) = fields::decode::<NodeHealth>(&sample.payload().to_bytes()) {
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            if heard.len() < WORDS_MAX {
                heard.push((sample.key_expr().to_string(), health, clock.now_ns()));
            }
        }
    });
    let subscriber = subscriber.wait().map_err(failed)?;
    std::thread::sleep(listen);
    // A channel without a bound: a router answers itself before the question returns, and would wait for ever on a full one.
    let (sender, replies) = channel();
    let tokens = session.liveliness().get(format!("umbracast/{hall}/node/*/*"));
    let tokens = tokens.callback(move |reply| drop(sender.send(reply)));
    tokens.wait().map_err(failed)?;
    let key = |reply: zenoh::query::Reply| Some(reply.result().ok()?.key_expr().to_string());
    let present: Vec<String> = replies.into_iter().filter_map(key).collect();
    subscriber.undeclare().wait().map_err(failed)?;
    let mut halls = halls(&present, lock(&words));
    for (hall, sensors) in sites(session, hall).map_err(failed)? {
        if let Some(hall) = halls.get_mut(&hall) {
            hall.sensors = sensors;
        }
    }
    Ok(halls)
}

/// The names of the sensors of every hall's site, from whoever answers.
fn sites(session: &Session, hall: &str) -> Result<BTreeMap<String, Vec<String>>, zenoh::Error> {
    let (sender, replies) = channel();
    let asked = session.get(format!("umbracast/{hall}/config/site")).target(QueryTarget::All);
    asked.timeout(ANSWER).callback(move |reply| drop(sender.send(reply))).wait()?;
    let of_reply = |reply: zenoh::query::Reply| {
        let sample = reply.into_result().ok()?;
        let key = sample.key_expr().as_str();
        let text = String::from_utf8(sample.payload().to_bytes().into_owned()).ok()?;
        let config = Config::of_run(&text, key).ok()?;
        let names = config.site.sensors.into_iter().map(|sensor| sensor.name).collect();
        Some((key.split('/').nth(1)?.to_owned(), names))
    };
    Ok(replies.into_iter().filter_map(of_reply).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_are_none_of_ours_are_left_out() {
        let tokens = ["other/a/node/track/t1".to_owned(), "umbracast/a".to_owned()];
        let word = ("umbracast/a/state".to_owned(), NodeHealth::default(), 1);
        assert!(halls(&tokens, vec![word]).is_empty());
    }
}
