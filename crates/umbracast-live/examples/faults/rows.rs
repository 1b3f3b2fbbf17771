//! What fails, what must happen then, and the promises that say so.

use umbracast::Site;
use umbracast::site::Furniture;

use super::Fault;
use super::clients::Clients;
use super::disk::Disk;
use super::hall::PEOPLE;
use super::harm;
use super::promise::Promise::{
    AllRecorded, Counted, EveryFrame, Followed, Frames, NobodyInvented, NobodyLeft, NothingCounted,
    PageBears, RecordedOrCounted, SameNumbers, Told, Well,
};

const NOTHING: Fault = Fault {
    name: "nothing",
    must: "nothing",
    promises: &[
        EveryFrame,
        Followed(PEOPLE),
        NobodyInvented(PEOPLE),
        SameNumbers,
        NothingCounted,
        AllRecorded,
    ],
    seconds: 12,
    harm: harm::none,
    hall: None,
    told: |_| (),
    meanwhile: |_| (),
    people: PEOPLE,
    sensors_ahead_s: 0,
    disk: Disk::Fine,
    clients: Clients::Nobody,
};

/// Packets suffer, and nobody notices.
const HARMLESS: Fault = Fault {
    must: "nobody lost",
    promises: &[EveryFrame, Followed(PEOPLE), NobodyInvented(PEOPLE), SameNumbers, Well(1.0)],
    ..NOTHING
};

/// A run with a disk lasts longer: after a write that failed, it is tried again five seconds later.
const OF_DISK: Fault = Fault {
    must: "told, counted, recorded again after it",
    promises: &[
        EveryFrame,
        Followed(PEOPLE),
        SameNumbers,
        Told,
        Counted("not_recorded"),
        RecordedOrCounted,
        Well(5.5),
    ],
    seconds: 15,
    ..NOTHING
};

const OF_CLIENTS: Fault = Fault {
    must: "no frame lost, the page goes on",
    promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, NothingCounted, AllRecorded, PageBears(40)],
    ..NOTHING
};

pub const FAULTS: &[Fault] = &[
    NOTHING,
    Fault {
        name: "one sensor silent for 5 s",
        must: "people are followed with the other one",
        promises: &[
            EveryFrame,
            Followed(PEOPLE - 1),
            NobodyInvented(PEOPLE),
            Counted("sensors_missing"),
            Well(1.0),
        ],
        harm: harm::silent,
        ..NOTHING
    },
    Fault { name: "one packet of a thousand lost for 5 s", harm: harm::lost::<1000>, ..HARMLESS },
    Fault { name: "one packet of ten lost for 5 s", harm: harm::lost::<10>, ..HARMLESS },
    Fault {
        name: "every second packet lost for 5 s",
        must: "people are followed",
        promises: &[EveryFrame, Followed(PEOPLE - 1), NobodyInvented(PEOPLE), SameNumbers, Well(1.0)],
        harm: harm::lost::<2>,
        ..NOTHING
    },
    Fault {
        name: "one packet of a hundred corrupted for 5 s",
        must: "counted, nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, Counted("packets_not_understood"), Well(1.0)],
        harm: harm::corrupted::<100>,
        ..NOTHING
    },
    Fault {
        name: "every second packet corrupted for 5 s",
        must: "counted, frames go on",
        promises: &[EveryFrame, Followed(PEOPLE - 1), Counted("packets_not_understood"), Well(1.0)],
        harm: harm::corrupted::<2>,
        ..NOTHING
    },
    Fault {
        name: "every packet cut in half for 5 s",
        must: "counted, all well after it",
        promises: &[Frames(65), NobodyInvented(PEOPLE), Counted("packets_wrong_size"), Well(1.0)],
        harm: harm::cut_in_half,
        ..NOTHING
    },
    Fault { name: "eight packets each in reverse order for 5 s", harm: harm::eight_in_reverse, ..HARMLESS },
    Fault {
        name: "every packet ten times for 5 s",
        must: "repeated ones counted, no frame lost",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, Counted("packets_duplicate"), Well(1.0)],
        harm: harm::ten_times,
        ..NOTHING
    },
    Fault {
        name: "packets of zeros beside, as many, for 5 s",
        must: "counted, nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, Counted("packets_not_understood"), Well(1.0)],
        harm: harm::zeros_beside,
        ..NOTHING
    },
    Fault {
        name: "one sensor hangs 5 deg askew",
        must: "told, people are followed",
        promises: &[EveryFrame, Followed(PEOPLE), Counted("sensors_moved"), Well(1.0)],
        told: |site| site.sensors[0].rotation_deg.yaw -= 5.0,
        ..NOTHING
    },
    Fault {
        name: "sensors turn at 5 Hz",
        must: "nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), NobodyInvented(PEOPLE), SameNumbers, NothingCounted],
        hall: Some(|site| turning_at(site, 5.0)),
        ..NOTHING
    },
    Fault {
        name: "sensors turn at 20 Hz",
        must: "nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), NobodyInvented(PEOPLE), SameNumbers, NothingCounted],
        hall: Some(|site| turning_at(site, 20.0)),
        ..NOTHING
    },
    Fault {
        name: "one sensor turns at 5 Hz, one at 20 Hz, untold",
        must: "nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), NobodyInvented(PEOPLE), SameNumbers],
        hall: Some(|site| (site.sensors[0].rate_hz, site.sensors[1].rate_hz) = (5.0, 20.0)),
        told: |site| turning_at(site, 10.0),
        ..NOTHING
    },
    Fault {
        name: "one HDL-32E's clock half an hour off for 5 s",
        must: "shifted, counted, nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, Counted("clock_jumps"), Well(1.0)],
        harm: harm::velodyne_half_an_hour_off,
        ..NOTHING
    },
    Fault {
        name: "one Ouster's clock an hour off for 5 s",
        must: "shifted, counted, nobody lost",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, Counted("clock_jumps"), Well(1.0)],
        hall: Some(with_ousters),
        harm: harm::ouster_an_hour_off,
        ..NOTHING
    },
    Fault {
        name: "the host's clock half an hour behind HDL-32Es'",
        sensors_ahead_s: 1800,
        must: "nobody lost",
        ..NOTHING
    },
    Fault {
        name: "the host's clock an hour behind Ousters'",
        must: "nobody lost",
        hall: Some(with_ousters),
        sensors_ahead_s: 3600,
        ..NOTHING
    },
    Fault {
        name: "ten times the people for 5 s",
        must: "the six are followed, no frame lost",
        promises: &[EveryFrame, Followed(PEOPLE), Well(1.0)],
        people: 10 * PEOPLE,
        ..NOTHING
    },
    Fault {
        // Its sides are taken for people while it is there: a limit of the detector that this row only shows.
        name: "a lorry stands in the hall for 5 s",
        must: "nobody lost, who is invented goes with it",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, NobodyLeft(PEOPLE), Well(1.0)],
        meanwhile: |site| {
            site.furniture.push(Furniture {
                position_m: [0.0, -13.0],
                size_m: [7.0, 2.5, 3.0],
                yaw_deg: 0.0,
            });
        },
        ..NOTHING
    },
    Fault { name: "the disk gone for 5 s", disk: Disk::Gone, ..OF_DISK },
    Fault { name: "a disk of 64 MiB full for 5 s", disk: Disk::Full, ..OF_DISK },
    Fault { name: "a disk without inodes for 5 s", disk: Disk::NoInodes, ..OF_DISK },
    Fault {
        name: "the disk stands still for 0.9 s of each of 5 s",
        must: "all is recorded",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, AllRecorded, RecordedOrCounted, Well(1.0)],
        disk: Disk::Slow,
        ..OF_DISK
    },
    Fault {
        name: "the disk stands still for 5 s",
        promises: &[
            EveryFrame,
            Followed(PEOPLE),
            SameNumbers,
            Told,
            Counted("not_recorded"),
            RecordedOrCounted,
            Well(1.0),
        ],
        disk: Disk::StandsStill,
        ..OF_DISK
    },
    Fault { name: "48 clients read a byte a second for 5 s", clients: Clients::Slow, ..OF_CLIENTS },
    Fault {
        name: "a thousand connections without a word in 5 s",
        promises: &[EveryFrame, Followed(PEOPLE), SameNumbers, NothingCounted, AllRecorded, PageBears(1000)],
        clients: Clients::Many,
        ..OF_CLIENTS
    },
    Fault { name: "clients that send garbage for 5 s", clients: Clients::Hostile, ..OF_CLIENTS },
];

fn turning_at(site: &mut Site, rate_hz: f64) {
    site.sensors.iter_mut().for_each(|sensor| sensor.rate_hz = rate_hz);
}

fn with_ousters(site: &mut Site) {
    site.sensors.iter_mut().for_each(|sensor| sensor.model = "os0-32".to_owned());
}
