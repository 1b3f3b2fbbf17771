//! Hosts that vanish without a reset, as when a cable is pulled: nobody else may lose a frame for it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;

use super::{Bench, FAILS_AFTER, PLACES, Seen, account, clock, look, shell};

/// Longer than Zenoh waits for a connection (2 s) and for its close (10 s).
const AWAY: Duration = Duration::from_secs(14);
/// The second front end has a wire of its own, the second tracker and another hall a place.
const WEST: &str = "10.77.0.12";
const MORE: [(&str, &str); 2] = [("second", "10.77.0.5"), ("other", "10.77.0.6")];

/// What vanishes, by the end of its wire on the bridge; what must happen; how many frames may be lost.
const CASES: [(&str, &str, &str, i64); 4] = [
    ("one of two front ends vanishes for 14 s", "west0", "no frame lost", 0),
    ("the tracker that stands by vanishes for 14 s", "second0", "no frame lost", 0),
    ("the tracker that leads vanishes for 14 s", "server0", "3 frames lost at most", 3),
    ("two nodes of another hall vanish for 14 s", "other0", "no frame lost", 0),
];

impl Bench {
    /// Seconds of the recording: 24 at least.
    pub fn vanishing(&self, recording: &str) -> Result<(), Error> {
        for (place, address) in MORE {
            shell(&format!(
                "ip netns add {place} && ip link add {place}0 type veth peer name wire0 netns {place} && \
                 ip link set {place}0 master umbra0 up && ip -n {place} address add {address}/24 dev wire0 && \
                 ip -n {place} link set wire0 up && ip -n {place} link set lo up"
            ))?;
        }
        // What has the second wire's address goes over the second wire alone.
        shell(&format!(
            "ip link add west0 type veth peer name wire1 netns edge && ip link set west0 master umbra0 up && \
             ip -n edge address add {WEST}/32 dev wire1 && ip -n edge link set wire1 up && \
             ip -n edge route add 10.77.0.0/24 dev wire1 table 12 && ip -n edge rule add from {WEST} table 12 && \
             ip netns exec edge sysctl -qw net.ipv4.conf.all.arp_ignore=1 net.ipv4.conf.all.arp_announce=2"
        ))?;
        let outcome = CASES.iter().try_for_each(|case| self.vanishes(case, recording));
        for (place, _) in MORE {
            shell(&format!("ip netns delete {place}"))?;
        }
        shell("ip link delete west0")?;
        outcome
    }

    fn vanishes(
        &self,
        (what, wire, must, may_lose): &(&str, &str, &str, i64),
        recording: &str,
    ) -> Result<(), Error> {
        let empty = format!("{}/empty.mcap", self.path("sim"));
        let [(_, edge), (_, server), (_, radio)] = PLACES;
        let [(_, second), (_, other)] = MORE;
        let nodes = [
            ("radio", format!("forecast,cast --listen tcp/{radio}:7447")),
            (
                "server",
                format!("track --listen tcp/{server}:7447 --connect tcp/{radio}:7447,tcp/{WEST}:7448"),
            ),
            (
                "second",
                format!(
                    "track --listen tcp/{second}:7447 --connect tcp/{server}:7447,tcp/{radio}:7447,tcp/{WEST}:7448"
                ),
            ),
            (
                "edge",
                format!(
                    "sensor --sensors lidar_east --port 2368 --empty {empty} --listen tcp/{edge}:7447 \
                     --connect tcp/{server}:7447,tcp/{second}:7447"
                ),
            ),
        ];
        let mut running = BTreeMap::new();
        for (place, words) in &nodes {
            running.insert((*place, 0), self.node(place, words)?);
        }
        // It calls nobody: the trackers call it, and its answers leave where the calls came from.
        let west =
            format!("sensor --sensors lidar_west --port 2369 --empty {empty} --listen tcp/{WEST}:7448");
        running.insert(("edge", 1), self.node("edge", &west)?);
        for k in 0..2 {
            let words = format!(
                "track --hall other --listen tcp/{other}:{} --connect tcp/{radio}:7447,tcp/{server}:7447",
                7447 + k
            );
            running.insert(("other", k), self.node("other", &words)?);
        }
        let watch = Arc::<Mutex<Vec<Seen>>>::default();
        let _looking = look(&watch, &[format!("tcp/{radio}:7447")])?;
        sleep(Duration::from_secs(2));
        let mut replay = self.replay(recording)?;
        sleep(FAILS_AFTER);
        let failed = clock();
        shell(&format!("ip link set {wire} down"))?;
        sleep(AWAY);
        shell(&format!("ip link set {wire} up"))?;
        let restored = clock();
        replay.0.wait().map_err(|e| Error::new(e.to_string()))?;
        sleep(Duration::from_secs(1));
        let seen = std::mem::take(&mut *watch.lock().unwrap_or_else(PoisonError::into_inner));
        let row = account(seen, failed, restored);
        println!("{what:44} {must:40} {row}");
        self.expect(row.is_well(2.0) && row.lost <= *may_lose, what, must);
        Ok(())
    }
}
