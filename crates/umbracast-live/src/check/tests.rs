use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use umbracast::Config;
use umbracast_sim::scene::Scene;

use super::*;
use crate::clock::HostClock;
use crate::receive::Arrived;
use crate::send;

/// What two HDL-32E of the default site send in a second and a half.
fn packets() -> Vec<Arrived> {
    static PACKETS: OnceLock<Vec<Arrived>> = OnceLock::new();
    let made = || {
        let site = Config::default().site;
        let frames = Scene::empty(&site, 7, 15).unwrap();
        let mut all: Vec<Arrived> = frames
            .into_iter()
            .flat_map(|frame| frame.into_iter().enumerate())
            .flat_map(|(sensor, packets)| packets.into_iter().map(move |packet| Arrived { sensor, packet }))
            .collect();
        all.sort_by_key(|arrived| arrived.packet.time_ns);
        all
    };
    PACKETS.get_or_init(made).clone()
}

/// Packets as they would be sent now: a Velodyne tells the time within the hour.
fn now(mut arrived: Arrived, start_ns: i64) -> Arrived {
    let payload = &mut arrived.packet.payload;
    let at = payload.len() - 6;
    let us = u32::from_le_bytes(payload[at..at + 4].try_into().unwrap());
    let us = (i64::from(us) + start_ns / 1000).rem_euclid(3_600_000_000);
    payload[at..at + 4].copy_from_slice(&(us as u32).to_le_bytes());
    arrived
}

/// Listens to what is sent over loopback, harmed so, and looks at it with the site file written so.
fn check(harm: impl Fn(Arrived) -> Vec<Arrived>, write: impl Fn(&mut Site)) -> (Vec<Measured>, Vec<Finding>) {
    let mut site = Config::default().site;
    write(&mut site);
    let free = |_| UdpSocket::bind("0.0.0.0:0").unwrap().local_addr().unwrap().port();
    let ports: Vec<u16> = (0..2).map(free).collect();
    let doors: Vec<Door> = (ports.iter().zip(&site.sensors).enumerate())
        .map(|(sensor, (&port, of))| Door { sensor, port, from: of.address_bytes().map(IpAddr::from) })
        .collect();
    let packets = packets();
    let clock = HostClock::start();
    let ears = Ears::open(&ports, &[]).unwrap();
    let listening = std::thread::spawn(move || ears.hear(Duration::from_millis(1900), clock));
    let start_ns = clock.now_ns() + 50_000_000;
    clock.sleep_until(start_ns);
    let to: Vec<SocketAddr> = ports.iter().map(|&port| (Ipv4Addr::LOCALHOST, port).into()).collect();
    let sent = packets.into_iter().flat_map(|arrived| harm(now(arrived, start_ns)));
    send::send(sent, &to, 1.0, clock, &AtomicBool::new(false)).unwrap();
    look(&site, &doors, &listening.join().unwrap()).unwrap()
}

fn kinds(findings: &[Finding]) -> Vec<(&str, &str)> {
    findings.iter().map(|finding| (finding.sensor.as_str(), finding.kind)).collect()
}

#[test]
fn nothing_is_found_where_nothing_is_wrong() {
    let (measured, findings) = check(|arrived| vec![arrived], |_| ());
    assert_eq!(findings, []);
    for of in measured {
        assert!((of.rate_hz.unwrap() - 10.0).abs() < 0.01, "{of:?}");
        assert!(of.floor_tilt_deg.unwrap() < 0.1 && (of.height_m.unwrap() - 9.0).abs() < 0.02, "{of:?}");
    }
}

#[test]
fn a_silent_sensor_is_told_with_who_sends_instead() {
    let (_, findings) =
        check(|arrived| vec![arrived], |site| site.sensors[1].address = Some("10.1.2.3".to_owned()));
    assert_eq!(kinds(&findings), [("lidar_west", "silent")]);
    let text = &findings[0].text;
    assert!(text.contains("from 10.1.2.3") && text.contains("of 1206 bytes from 127.0.0.1"), "{text}");
}

#[test]
fn another_model_is_told_with_the_one_it_is() {
    let (_, findings) = check(|arrived| vec![arrived], |site| site.sensors[0].model = "vlp-16".to_owned());
    assert_eq!(kinds(&findings), [("lidar_east", "model")]);
    assert!(findings[0].text.contains("such as hdl-32e sends"), "{}", findings[0].text);
    let zeros = |mut arrived: Arrived| {
        arrived.packet.payload.fill(0);
        vec![arrived]
    };
    let (_, findings) = check(zeros, |_| ());
    assert_eq!(kinds(&findings), [("lidar_east", "model"), ("lidar_west", "model")]);
    assert!(findings[0].text.contains("of no model that is known"), "{}", findings[0].text);
}

#[test]
fn clocks_apart_are_told() {
    for (by_ns, told) in [(40_000_000, "0.040 s ahead of it"), (-5_000_000_000, "s behind it")] {
        let harm = |arrived: Arrived| vec![if arrived.sensor == 1 { now(arrived, by_ns) } else { arrived }];
        let (_, findings) = check(harm, |_| ());
        assert_eq!(kinds(&findings), [("lidar_west", "clock")], "{findings:?}");
        // Packets of both sensors leave one after the other, so a few tenths of a millisecond differ.
        let text = findings[0].text.replace("0.039", "0.040").replace("0.041", "0.040");
        assert!(text.contains(told), "{text}");
    }
}

#[test]
fn a_clock_that_is_not_used_may_be_apart() {
    let harm = |arrived: Arrived| vec![now(arrived, -5_000_000_000)];
    for time in [TimeSource::Arrival, TimeSource::Ptp] {
        let (_, findings) = check(harm, |site| site.sensors.iter_mut().for_each(|sensor| sensor.time = time));
        assert_eq!(findings, [], "{time:?}: both alike");
    }
}

#[test]
fn a_sensor_that_looks_elsewhere_is_told() {
    let (measured, findings) = check(
        |arrived| vec![arrived],
        |site| {
            site.sensors[0].rotation_deg.pitch -= 3.0;
            site.sensors[1].position_m[2] -= 0.5;
        },
    );
    assert_eq!(kinds(&findings), [("lidar_east", "pose"), ("lidar_west", "pose")]);
    assert!(findings[0].text.contains("rises 3.0 deg ahead"), "{}", findings[0].text);
    assert!((measured[1].height_m.unwrap() - 9.0).abs() < 0.02, "{}", findings[1].text);
    let (_, findings) = check(|arrived| vec![arrived], |site| site.sensors[0].rotation_deg.yaw = 0.0);
    assert!(kinds(&findings).contains(&("lidar_east", "view")), "{findings:?}");
}

#[test]
fn another_rate_and_lost_packets_are_told() {
    let lossy = |arrived: Arrived| {
        let lost = arrived.sensor == 1 && arrived.packet.time_ns / 1_000_000 % 5 == 0;
        if lost { vec![] } else { vec![arrived] }
    };
    let (_, findings) = check(lossy, |site| site.sensors[0].rate_hz = 20.0);
    assert_eq!(kinds(&findings), [("lidar_east", "rate"), ("lidar_west", "loss")]);
    assert!(findings[0].text.contains("found 10.00"), "{}", findings[0].text);
}
