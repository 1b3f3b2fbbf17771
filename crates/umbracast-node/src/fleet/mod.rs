//! What runs where: every hall on a network with its nodes, as they report themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};
use umbracast::Error;
use umbracast_io::fields;
use umbracast_io::nodes::NodeHealth;
use zenoh::{Session, Wait};

/// One hall.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hall {
    /// Its nodes, by name.
    pub nodes: BTreeMap<String, Node>,
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
    /// What it had said before.
    before: Option<NodeHealth>,
}

impl Node {
    /// Cores that it uses: between its last two words, else since it began.
    pub fn cores(&self) -> Option<f64> {
        let now = self.health.as_ref()?;
        let (cpu_s, up_s) = self.before.as_ref().map_or((0.0, 0.0), |before| (before.cpu_s, before.up_s));
        Some((now.cpu_s - cpu_s) / (now.up_s - up_s).max(f64::MIN_POSITIVE))
    }

    /// Bytes a second that it publishes, in the same time.
    pub fn bytes_per_s(&self) -> Option<f64> {
        let now = self.health.as_ref()?;
        let (bytes, up_s) = self.before.as_ref().map_or((0, 0.0), |before| (before.bytes_out, before.up_s));
        Some(now.bytes_out.saturating_sub(bytes) as f64 / (now.up_s - up_s).max(f64::MIN_POSITIVE))
    }

    /// What is not as it should be, in words. `site` is what most nodes of its hall say.
    pub fn troubles(&self, site: Option<u64>) -> Vec<String> {
        let Some(health) = &self.health else { return vec!["says nothing".to_owned()] };
        let counted = [
            (health.frames_skipped, "frames skipped"),
            (health.frames_incomplete, "frames without a front end"),
            (health.messages_late, "messages late"),
            (health.messages_broken, "messages not understood"),
        ];
        let counted = counted.iter().filter(|(count, _)| *count > 0);
        let mut troubles: Vec<String> = counted.map(|(count, what)| format!("{count} {what}")).collect();
        if !health.health.is_clean() {
            troubles.push("input skipped".to_owned());
        }
        if site.is_some_and(|site| site != health.site) {
            troubles.push("another site than most".to_owned());
        }
        troubles
    }
}

impl Hall {
    /// The site of most of its nodes; of as many, the one with the least number.
    pub fn site(&self) -> Option<u64> {
        let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
        for health in self.nodes.values().filter_map(|node| node.health.as_ref()) {
            *counts.entry(health.site).or_default() += 1;
        }
        counts.into_iter().rev().max_by_key(|&(_, count)| count).map(|(site, _)| site)
    }
}

/// What tokens and words of health say together. A word comes with its key; of one node the later replaces the earlier.
pub fn halls(tokens: &[String], words: Vec<(String, NodeHealth)>) -> BTreeMap<String, Hall> {
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
    for (key, health) in words {
        if let ["umbracast", hall, "health", _, id] = key.split('/').collect::<Vec<_>>()[..] {
            let node = halls.entry(hall.to_owned()).or_default().nodes.entry(id.to_owned()).or_default();
            // A node of several roles may say the same under each.
            if node.health.as_ref().is_none_or(|last| last.time_ns < health.time_ns) {
                node.before = node.health.replace(health);
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
    let hall = hall.unwrap_or("*");
    let words = Arc::new(Mutex::new(Vec::new()));
    let lock =
        |words: &Mutex<Vec<_>>| std::mem::take(&mut *words.lock().unwrap_or_else(PoisonError::into_inner));
    let heard = words.clone();
    let subscriber = session.declare_subscriber(format!("umbracast/{hall}/health/*/*"));
    let subscriber = subscriber.callback(move |sample| {
        if let Some(health) = fields::decode::<NodeHealth>(&sample.payload().to_bytes()) {
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            heard.push((sample.key_expr().to_string(), health));
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
    Ok(halls(&present, lock(&words)))
}

/// A table: a line a node.
pub fn text(halls: &BTreeMap<String, Hall>) -> String {
    let mut text = format!(
        "{:12} {:34} {:22} {:>8} {:>6} {:>8} {:>9} {:>8} {:>8}  troubles\n",
        "hall", "node", "does", "up, s", "cores", "MiB", "frames", "kB/s", "p99, ms"
    );
    for (name, hall) in halls {
        for (id, node) in &hall.nodes {
            let health = node.health.clone().unwrap_or_default();
            let leads = if health.leads { " (leads)" } else { "" };
            let roles: Vec<&str> = node.roles.iter().map(String::as_str).collect();
            let does = if roles.is_empty() { "gone".to_owned() } else { roles.join(",") + leads };
            let _ = writeln!(
                text,
                "{name:12} {id:34} {does:22} {:8.0} {:6.2} {:8.1} {:9} {:8.1} {:8.1}  {}",
                health.up_s,
                node.cores().unwrap_or(0.0),
                health.resident_bytes as f64 / f64::from(1 << 20),
                health.frames,
                node.bytes_per_s().unwrap_or(0.0) / 1000.0,
                health.latency_ms[1],
                node.troubles(hall.site()).join(", "),
            ); // To a string: cannot fail.
        }
    }
    text
}

/// The same for programs.
pub fn json(halls: &BTreeMap<String, Hall>) -> Value {
    let of_node = |site: Option<u64>, id: &String, node: &Node| {
        let health = node.health.clone().unwrap_or_default();
        let value = json!({
            "roles": node.roles,
            "sensors": node.sensors,
            "host": health.host,
            "stages": health.stages,
            "leads": health.leads,
            "up_s": health.up_s,
            "cores": node.cores(),
            "resident_bytes": health.resident_bytes,
            "frames": health.frames,
            "frames_skipped": health.frames_skipped,
            "frames_incomplete": health.frames_incomplete,
            "messages_late": health.messages_late,
            "messages_broken": health.messages_broken,
            "bytes_per_s": node.bytes_per_s(),
            "latency_p50_ms": health.latency_ms[0],
            "latency_p99_ms": health.latency_ms[1],
            "health": health.health,
            "troubles": node.troubles(site),
        });
        (id.clone(), value)
    };
    let of_hall = |(name, hall): (&String, &Hall)| {
        let site = hall.site();
        let nodes = hall.nodes.iter().map(|(id, node)| of_node(site, id, node));
        (name.clone(), Value::Object(nodes.collect()))
    };
    Value::Object(halls.iter().map(of_hall).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::share::site_number;
    use umbracast::Config;

    fn word(key: &str, time_ns: i64, cpu_s: f64, frames_skipped: u64) -> (String, NodeHealth) {
        let up_s = time_ns as f64 * 1e-9;
        (key.to_owned(), NodeHealth { time_ns, cpu_s, up_s, frames_skipped, ..NodeHealth::default() })
    }

    #[test]
    fn nodes_are_listed_by_hall_with_their_load() {
        let tokens =
            ["umbracast/a/node/track/t1", "umbracast/a/node/cast/t1", "umbracast/b/node/sensor/east.s1"];
        let tokens = tokens.map(str::to_owned);
        let words = vec![
            word("umbracast/a/health/track/t1", 10_000_000_000, 1.0, 0),
            word("umbracast/a/health/track/t1", 12_000_000_000, 2.0, 3),
            word("umbracast/a/health/cast/t1", 12_000_000_000, 2.0, 3),
            word("umbracast/c/health/cast/dead", 1_000_000_000, 0.5, 0),
        ];
        let halls = halls(&tokens, words);
        let t1 = &halls["a"].nodes["t1"];
        assert_eq!((t1.roles.len(), t1.cores()), (2, Some(0.5)), "between its last two words");
        assert_eq!(t1.troubles(None), ["3 frames skipped"]);
        let s1 = &halls["b"].nodes["s1"];
        assert_eq!(
            (s1.troubles(None), s1.sensors.first().map(String::as_str)),
            (vec!["says nothing".to_owned()], Some("east"))
        );
        assert!(halls["c"].nodes["dead"].roles.is_empty());
        let text = text(&halls);
        assert_eq!(text.lines().count(), 4);
        assert!(text.contains("cast,track") && text.contains("gone") && text.contains("3 frames skipped"));
        assert_eq!(json(&halls)["a"]["t1"]["cores"], 0.5);
    }

    #[test]
    fn a_node_with_another_site_file_than_the_rest_is_told() {
        let numbers = [site_number(&Config::default().site), {
            let mut other = Config::default().site;
            other.access_points[0].position_m[2] += 0.01;
            site_number(&other)
        }];
        let node = |site: usize| {
            let health = NodeHealth { site: numbers[site], ..NodeHealth::default() };
            Node { health: Some(health), ..Node::default() }
        };
        let nodes = [("a", 0), ("b", 1), ("c", 0)].map(|(id, site)| (id.to_owned(), node(site)));
        let hall = Hall { nodes: nodes.into() };
        let troubles: Vec<usize> = hall.nodes.values().map(|n| n.troubles(hall.site()).len()).collect();
        assert_eq!(troubles, [0, 1, 0]);
    }

    #[test]
    fn keys_that_are_none_of_ours_are_left_out() {
        let tokens = ["other/a/node/track/t1".to_owned(), "umbracast/a".to_owned()];
        assert!(halls(&tokens, vec![word("umbracast/a/state", 1, 0.0, 0)]).is_empty());
    }
}
