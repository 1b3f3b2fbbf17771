//! Scenes as packets over UDP, in real time.

use std::net::SocketAddr;
use std::sync::atomic::Ordering;

use umbracast::{Config, Error, STEP_NS};
use umbracast_eval::run::chain::SceneSpec;
use umbracast_live::HostClock;
use umbracast_live::send::{self, Sent};
use umbracast_sim::scene::Scene;
use umbracast_sim::sensor::Sensors;

use crate::setup::TEST_SEED;
use crate::signal;

/// One scene after the other, each in the hour's time, until they are over or the end is asked for.
pub fn scenes(scenes: &[SceneSpec], config: &Config, to: &[SocketAddr]) -> Result<Sent, Error> {
    let site = &config.site;
    let to = send::addresses(site.sensors.len(), to);
    let sensors = Sensors::new(site, TEST_SEED)?;
    let (clock, asked) = (HostClock::start(), signal::asked_to_end()?);
    let mut sent = Sent::default();
    for spec in scenes {
        if asked.load(Ordering::Relaxed) {
            break;
        }
        let first = send::frame_of_hour(clock.now_ns());
        let crowd = spec.crowd().later(first as i64 * STEP_NS);
        let scene = Scene::in_hall(crowd, site, &sensors, spec.seed).with_bodies(&spec.bodies);
        let packets = send::ahead(send::simulated(scene.starting_at(first)));
        sent.add(&send::send(packets, &to, 1.0, clock, &asked)?);
    }
    Ok(sent)
}
