//! A hall whose nodes know a router only: what happens while it is away, and once it is back.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;

use super::{Bench, FAILS_AFTER, PLACES, Seen, account, clock, look};

const AWAY_FOR: Duration = Duration::from_secs(1);
/// Frames without results: of the second without a router, and until all nodes have found it again.
const MAY_LOSE: i64 = 60;
const WITHIN_S: f64 = 6.0;

impl Bench {
    /// Front end, tracker and caster at three places, all clients of the router beside the tracker, which is killed and started
    /// again.
    pub fn router(&self, recording: &str) -> Result<(), Error> {
        let (what, must) = ("the router killed, back after 1 s", "goes on by itself");
        let empty = format!("{}/empty.mcap", self.path("sim"));
        let at = format!("tcp/{}:7447", PLACES[1].1);
        let file = |name: &str, text: String| {
            std::fs::write(self.path(name), text).map_err(|e| Error::new(e.to_string()).within(name))
        };
        file(
            "router.toml",
            format!("[network]\nhall = \"lab\"\nmode = \"router\"\nanyone = true\nlisten = [\"{at}\"]\n"),
        )?;
        file("client.toml", format!("[network]\nhall = \"lab\"\nmode = \"client\"\nconnect = [\"{at}\"]\n"))?;
        let start = || self.node_of("router.toml", "server", "router");
        let router = start()?;
        let _cast = self.node_of("client.toml", "radio", "forecast,cast")?;
        let _track = self.node_of("client.toml", "server", "track")?;
        let _front = self.node_of("client.toml", "edge", &format!("sensor --port 2368 --empty {empty}"))?;
        let watch = Arc::<Mutex<Vec<Seen>>>::default();
        let _looking = look(&watch, &[at])?;
        sleep(Duration::from_secs(1));
        let mut replay = self.replay(recording)?;
        sleep(FAILS_AFTER);
        let failed = clock();
        drop(router);
        sleep(AWAY_FOR);
        let restored = clock();
        let _router = start()?;
        replay.0.wait().map_err(|e| Error::new(e.to_string()))?;
        sleep(Duration::from_secs(1));
        let seen = std::mem::take(&mut *watch.lock().unwrap_or_else(PoisonError::into_inner));
        let row = account(seen, failed, restored);
        println!("{what:44} {must:40} {row}");
        let well = row.is_well(WITHIN_S) && row.lost <= MAY_LOSE;
        self.expect(well, what, must);
        Ok(())
    }
}
