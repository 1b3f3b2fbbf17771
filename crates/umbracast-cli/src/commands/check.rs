//! `check`: reports the faults of a site's sensors before the first person comes.

use std::time::Duration;

use umbracast::lidar::{sensor_models, udp_port};
use umbracast::{Error, Mode};
use umbracast_live::HostClock;
use umbracast_live::check::{self, Ears};

use super::live;
use crate::args::{Check, Common};
use crate::ending::Ending;
use crate::run_json::{RunJson, Stopwatch};
use crate::setup;

/// Listens, then says a line for everything that is wrong.
pub fn run(args: &Check, common: &Common) -> Result<Ending, Error> {
    let site = match &args.site.site {
        Some(file) => setup::config_of_file(file)?.site,
        None => setup::config(Mode::Default, None)?.site,
    };
    let doors = live::doors(&site, args.port, false)?;
    let ports: Vec<u16> = doors.iter().map(|door| door.port).collect();
    let watch = Stopwatch::start();
    let heard = Ears::open(&ports, &usual_ports(&site))?
        .hear(Duration::from_secs_f64(args.seconds), HostClock::start());
    let (measured, findings) = check::look(&site, &doors, &heard)?;
    let mut lines: Vec<String> =
        findings.iter().map(|found| format!("{}: {}: {}", found.sensor, found.kind, found.text)).collect();
    if lines.is_empty() {
        let sensors = measured.len();
        lines.push(format!(
            "nothing wrong: {sensors} sensors, {} packets in {:.1} s",
            heard.len(),
            args.seconds
        ));
    }
    RunJson::new("check", &watch)
        .with("sensors", &measured)
        .with("findings", &findings)
        .print(common, &lines.join("\n"));
    Ok(if findings.is_empty() { Ending::Done } else { Ending::Wrong })
}

/// Where sensors send unless told otherwise: who sends there and not where the site file says is heard.
fn usual_ports(site: &umbracast::Site) -> Vec<u16> {
    let Some(sensor) = site.sensors.first() else { return Vec::new() };
    let as_delivered = |model: &str| {
        udp_port(&umbracast::site::Sensor { model: model.to_owned(), udp_port: None, ..sensor.clone() })
    };
    let mut ports: Vec<u16> = sensor_models().filter_map(as_delivered).collect();
    ports.dedup();
    ports
}
