//! Reports the faults of a site's sensors before the first person comes: a silent sensor, other packets, a clock that
//! differs, another pose.

mod listen;

use std::collections::BTreeMap;
use std::net::IpAddr;

use serde::Serialize;
use umbracast::geometry::DVec3;
use umbracast::lidar::packet::decode;
use umbracast::lidar::{Assembler, Cloud, Frame, Model, Packet, sensor_models};
use umbracast::site::{Hall, Sensor, TimeSource};
use umbracast::{Error, Health, Site};
use umbracast_calibrate::floor;

pub use self::listen::{Ears, Heard};
use crate::receive::Door;

/// More of its packets than this are lost or of another kind.
const SHARE_MAX: f64 = 0.02;
/// A sensor turns as fast as it says within this share.
const RATE_SHARE_MAX: f64 = 0.02;
/// A clock that is further from this host's is not believed by `live`: it is shifted.
const HOST_APART_NS: i64 = umbracast::STEP_NS;
/// In so long somebody who walks goes a centimetre: two sensors see him at two places when their clocks are further apart.
const APART_NS: i64 = 10_000_000;
/// A floor that is tilted by this lies 0.3 m off at 15 m.
const TILT_MAX_DEG: f64 = 1.0;
/// As much as a tape measure and an uneven floor explain.
const HEIGHT_MAX_M: f64 = 0.1;
/// Nobody is taller; what hangs higher is not watched.
const WATCHED_MAX_M: f64 = 2.4;
/// A sensor that is of use has this share of its returns where people may be.
const INSIDE_MIN: f64 = 0.2;
/// Two packets that follow one another, at most.
const NEXT_NS: i64 = 20_000_000;

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Whose.
    pub sensor: String,
    /// What kind: `silent`, `model`, `loss`, `rate`, `clock`, `view`, `pose`.
    pub kind: &'static str,
    /// What was expected and what was found.
    pub text: String,
}

/// What was measured of a sensor; none of what could not be.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Measured {
    /// Its name.
    pub sensor: String,
    /// Packets that came from it.
    pub packets: usize,
    /// Revolutions a second.
    pub rate_hz: Option<f64>,
    /// Its clock before this host's, by the packet that was under way for the shortest time.
    pub clock_ahead_s: Option<f64>,
    /// Share of the returns that lie where people may be.
    pub inside: Option<f64>,
    /// The floor against level.
    pub floor_tilt_deg: Option<f64>,
    /// The sensor over the floor.
    pub height_m: Option<f64>,
}

/// Looks through what was heard at the doors of a site's sensors.
///
/// # Errors
/// A sensor model that is not known.
pub fn look(site: &Site, doors: &[Door], heard: &[Heard]) -> Result<(Vec<Measured>, Vec<Finding>), Error> {
    let (mut measured, mut findings) = (Vec::new(), Vec::new());
    for door in doors {
        let Some(sensor) = site.sensors.get(door.sensor) else { continue };
        let model = Model::of_sensor(sensor)?;
        let packets: Vec<Packet> = (heard.iter().filter(|heard| is_of(door, heard)))
            .map(|heard| Packet { time_ns: heard.time_ns, payload: heard.payload.clone() })
            .collect();
        let mut of = Measured { sensor: sensor.name.clone(), packets: packets.len(), ..Measured::default() };
        let mut tell = |kind, text| findings.push(Finding { sensor: sensor.name.clone(), kind, text });
        match packets.is_empty() {
            true => tell("silent", silent(door, doors, heard)),
            false => match other_model(&model, &packets) {
                Some(text) => tell("model", text),
                None => {
                    turns(&model, sensor, &packets, &mut of, &mut tell);
                    looks(site, sensor, &packets, &mut of, &mut tell)?;
                }
            },
        }
        measured.push(of);
    }
    clocks(site, &measured, &mut findings);
    Ok((measured, findings))
}

fn is_of(door: &Door, heard: &Heard) -> bool {
    heard.port == door.port && door.from.is_none_or(|from| from == heard.from)
}

/// Where it was listened, and what came instead that is of no sensor.
fn silent(door: &Door, doors: &[Door], heard: &[Heard]) -> String {
    let mut strangers: BTreeMap<(u16, IpAddr, usize), usize> = BTreeMap::new();
    for heard in heard.iter().filter(|heard| !doors.iter().any(|door| is_of(door, heard))) {
        *strangers.entry((heard.port, heard.from, heard.payload.len())).or_default() += 1;
    }
    let from = door.from.map_or(String::new(), |from| format!(" from {from}"));
    let instead: Vec<String> = strangers
        .iter()
        .map(|((port, from, bytes), count)| format!("{count} of {bytes} bytes from {from} on port {port}"))
        .collect();
    let instead = match instead.is_empty() {
        true => "nothing from elsewhere either".to_owned(),
        false => format!("instead {}", instead.join(", ")),
    };
    format!("expected packets on UDP port {}{from}, found none; {instead}", door.port)
}

/// What is wrong where the packets are not those of the model: which models they may be of.
fn other_model(model: &Model, packets: &[Packet]) -> Option<String> {
    let share = refused(model, packets);
    if share <= SHARE_MAX {
        return None;
    }
    let sample = &packets[..packets.len().min(100)];
    let would = |name: &&str| Model::by_name(name).is_ok_and(|model| refused(&model, sample) == 0.0);
    let others: Vec<&str> = sensor_models().filter(would).collect();
    let fit = match others.is_empty() {
        true => "of no model that is known".to_owned(),
        false => format!("such as {} sends", others.join(", ")),
    };
    let (percent, bytes) = (share * 100.0, packets[0].payload.len());
    Some(format!("expected packets of {}, found {percent:.0} % others: {bytes} bytes, {fit}", model.name))
}

/// Share of the packets that are not the model's; 1 where none holds any return.
fn refused(model: &Model, packets: &[Packet]) -> f64 {
    let (mut health, mut columns) = (Health::default(), 0);
    packets.iter().for_each(|packet| decode(model, packet, &mut health, |_, _, _| columns += 1));
    let refused = health.packets_wrong_size + health.packets_not_understood;
    if columns == 0 { 1.0 } else { refused as f64 / packets.len() as f64 }
}

/// How fast it turns, what is lost of it, and its clock.
fn turns(
    model: &Model,
    sensor: &Sensor,
    packets: &[Packet],
    of: &mut Measured,
    tell: &mut impl FnMut(&'static str, String),
) {
    let (mut rates, mut columns, mut ahead_ns) = (Vec::new(), 0_usize, Vec::new());
    let (mut before, mut ends_ns) = (None, None);
    for packet in packets {
        let mut first = None;
        decode(model, packet, &mut Health::default(), |column, _, _| {
            first.get_or_insert(column);
            columns += 1;
        });
        let Some(column) = first else { continue };
        ahead_ns.push(column.time_ns.saturating_sub(packet.time_ns));
        let (start_ns, _) = ends_ns.unwrap_or((column.time_ns, 0));
        ends_ns = Some((start_ns, column.time_ns));
        if let Some((time_ns, azimuth_cdeg)) = before.replace((column.time_ns, column.azimuth_cdeg))
            && (1..NEXT_NS).contains(&column.time_ns.saturating_sub(time_ns))
        {
            let turned_cdeg = f64::from(column.azimuth_cdeg - azimuth_cdeg).rem_euclid(36_000.0);
            rates.push(turned_cdeg / 36_000.0 / ((column.time_ns - time_ns) as f64 * 1e-9));
        }
    }
    rates.sort_by(f64::total_cmp);
    of.rate_hz = rates.get(rates.len() / 2).copied();
    of.clock_ahead_s = ahead_ns.iter().max().map(|&ns| ns as f64 * 1e-9);
    let expected_hz = sensor.rate_hz;
    if let Some(rate_hz) = of.rate_hz.filter(|hz| (hz / expected_hz - 1.0).abs() > RATE_SHARE_MAX) {
        tell("rate", format!("expected {expected_hz} revolutions a second, found {rate_hz:.2}"));
    }
    let spans_ns = ends_ns.map_or(0, |(start_ns, end_ns)| (end_ns - start_ns).max(0));
    let whole = spans_ns as f64 / model.column_period_ns;
    let lost = 1.0 - columns as f64 / whole.max(1.0);
    if lost > SHARE_MAX {
        tell("loss", format!("expected every packet, found {:.0} % of its columns missing", lost * 100.0));
    }
}

/// Whether its returns lie where people walk, and the floor where its pose says.
fn looks(
    site: &Site,
    sensor: &Sensor,
    packets: &[Packet],
    of: &mut Measured,
    tell: &mut impl FnMut(&'static str, String),
) -> Result<(), Error> {
    let points_m = points(site, sensor, packets)?;
    let sensor_m = sensor.site_from_sensor().translation_m;
    let Some(floor) = floor::find(&points_m, sensor_m) else {
        tell("pose", format!("expected a floor below it, found none in {} returns", points_m.len()));
        return Ok(());
    };
    let (tilt_deg, height_m) = (floor.tilt_deg(), floor.height_of_m(sensor_m));
    let share =
        points_m.iter().filter(|point| is_watched(site, point)).count() as f64 / points_m.len() as f64;
    (of.floor_tilt_deg, of.height_m, of.inside) = (Some(tilt_deg), Some(height_m), Some(share));
    let expected_m = sensor_m.z;
    if tilt_deg > TILT_MAX_DEG || (height_m - expected_m).abs() > HEIGHT_MAX_M {
        let yaw_deg = sensor.rotation_deg.yaw;
        let (ahead_deg, left_deg) = (floor.rise_deg(yaw_deg), floor.rise_deg(yaw_deg + 90.0));
        let story = format!(
            "expected a level floor {expected_m:.2} m below it, found one {height_m:.2} m below that rises {ahead_deg:.1} \
             deg ahead and {left_deg:.1} deg to its left (ahead: too small a pitch in the site file)"
        );
        tell("pose", story);
    } else if share < INSIDE_MIN {
        let percent = share * 100.0;
        let story = format!(
            "expected a fifth of its {} returns at least between floor and {WATCHED_MAX_M} m in the hall, found \
             {percent:.0} %: its place or yaw may be another",
            points_m.len()
        );
        tell("view", story);
    }
    Ok(())
}

/// Whether people may be there.
fn is_watched(site: &Site, point_m: &DVec3) -> bool {
    site.hall.contains(point_m.truncate()) && (-HEIGHT_MAX_M..WATCHED_MAX_M).contains(&point_m.z)
}

/// Returns of the fullest frame, in the site's frame, but for their heights, which are above the site's floor.
fn points(site: &Site, sensor: &Sensor, packets: &[Packet]) -> Result<Vec<DVec3>, Error> {
    let alone = Site { sensors: vec![sensor.clone()], ..site.clone() };
    let (mut assembler, mut health) = (Assembler::new(&alone)?, Health::default());
    let mut fullest: Vec<DVec3> = Vec::new();
    for packet in packets {
        assembler.push(0, packet, &mut health);
        while let Some(frame) = assembler.pop() {
            let points = returns_of(&frame, &site.hall);
            if points.len() > fullest.len() {
                fullest = points;
            }
        }
    }
    Ok(fullest)
}

fn returns_of(frame: &Frame, hall: &Hall) -> Vec<DVec3> {
    let mut points = Vec::new();
    for scan in &frame.scans {
        let Cloud::Organised(image) = &scan.cloud else { continue };
        let beams = image.beams.len();
        for (at, &range_m) in image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0) {
            let point = image.point_m(at / beams, at % beams, f64::from(range_m));
            let mut at_m = scan.site_from_sensor.point(point);
            at_m.z -= hall.floor_m(at_m.truncate());
            points.push(at_m);
        }
    }
    points
}

/// Clocks against this host's, and against that of the first sensor that agrees with it. One that sensors share need
/// not be the host's; one that is not used is not asked for.
fn clocks(site: &Site, measured: &[Measured], findings: &mut Vec<Finding>) {
    let mut first: Option<(&str, i64)> = None;
    for of in measured {
        let time = site.sensors.iter().find(|sensor| sensor.name == of.sensor).map(|sensor| sensor.time);
        if time == Some(TimeSource::Arrival) {
            continue;
        }
        let Some(ahead_ns) = of.clock_ahead_s.map(|s| (s * 1e9) as i64) else { continue };
        let mut tell = |text| findings.push(Finding { sensor: of.sensor.clone(), kind: "clock", text });
        let in_words = |ns: i64| {
            let side = if ns < 0 { "behind" } else { "ahead of" };
            format!("{:.3} s {side}", ns.unsigned_abs() as f64 * 1e-9)
        };
        if ahead_ns.abs() > HOST_APART_NS && time != Some(TimeSource::Ptp) {
            tell(format!("expected the time of this host within 0.1 s, found {} it", in_words(ahead_ns)));
            continue;
        }
        match first {
            None => first = Some((&of.sensor, ahead_ns)),
            Some((name, of_first_ns)) if (ahead_ns - of_first_ns).abs() > APART_NS => tell(format!(
                "expected the time of {name} within 0.01 s, found {} it",
                in_words(ahead_ns - of_first_ns)
            )),
            Some(_) => {}
        }
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
