// What the examples in the documentation of `src/` see: included by them, out of the reader's sight.

/// One ray of a sensor that looks 35 degrees down: the floor is 15.5 m away, somebody before it nearer.
pub fn ray(k: u64, range_m: f32) -> umbracast::Frame {
    use umbracast::lidar::{Cloud, Scan, SensorPoint};

    let point = SensorPoint { position_m: [range_m, 0.0, 0.0], time_ns: 0, reflectivity: 10.0 };
    let site_from_sensor = umbracast::Config::default().site.sensors[0].site_from_sensor();
    let scan = Scan { sensor: 0, site_from_sensor, cloud: Cloud::Unorganised(vec![point]) };
    umbracast::Frame { index: k, time_ns: (k as i64 + 1) * umbracast::STEP_NS, scans: vec![scan] }
}

/// Points of somebody at the origin, 1.7 m tall.
pub fn somebody() -> Vec<umbracast::detect::Point> {
    use umbracast::geometry::DVec2;

    let point = |i: u32| {
        let around = DVec2::from_angle(2.4 * f64::from(i)) * DVec2::new(0.13, 0.25);
        let position_m = around.extend(0.1 + 0.04 * f64::from(i));
        umbracast::detect::Point { position_m, time_ns: 0, sensor: 0 }
    };
    (0..40).map(point).collect()
}

/// A detection of somebody on the x axis.
pub fn detection(x_m: f64, time_ns: i64) -> umbracast::detect::Detection {
    use umbracast::geometry::{Aabb, DVec2, DVec3, Obb};

    let (half_m, middle_m) = (DVec3::new(0.2, 0.2, 0.85), DVec3::new(x_m, 0.0, 0.85));
    let aabb = Aabb { min_m: middle_m - half_m, max_m: middle_m + half_m };
    umbracast::detect::Detection {
        position_m: DVec2::new(x_m, 0.0),
        covariance_m2: Some([[4e-4, 0.0], [0.0, 4e-4]]),
        z_m: 0.9,
        time_ns,
        points: 40,
        full_body: true,
        top_m: 1.7,
        top_diagonal_m: 0.2,
        gait: None,
            reaches: Vec::new(),
            bands: Default::default(),
            overhead: None,
            facing: None,
        aabb,
        obb: Obb::from_aabb(&aabb),
    }
}

/// A frame without scans, as a tracker sees it.
pub fn views(k: i64) -> umbracast::lidar::Views {
    umbracast::lidar::Views { time_ns: (k + 1) * umbracast::STEP_NS, of_scans: Vec::new() }
}

/// Tracks of people after two seconds, each by its place along x in frame k.
pub fn tracks_of(places_m: &[fn(f64) -> f64]) -> Vec<umbracast::track::Track> {
    let config = umbracast::Config::default();
    let (mut tracker, mut tracks) =
        (umbracast::track::Tracker::new(&config.track, &config.site), Vec::new());
    for k in 0..20 {
        let seen: Vec<_> = places_m.iter().map(|x_m| detection(x_m(k as f64), views(k).time_ns)).collect();
        tracker.update(&views(k), &seen, &mut tracks);
    }
    tracks
}

/// Somebody who walks along x, 1.2 m/s.
pub fn walker() -> Vec<umbracast::track::Track> {
    tracks_of(&[|k| 0.12 * k])
}

/// Two people who stand in line with the access point `side`, 14 and 10 m from it.
pub fn two_people() -> Vec<umbracast::track::Track> {
    tracks_of(&[|_| 0.0, |_| 4.0])
}

/// Where tracks will be.
pub fn forecasts_of(tracks: &[umbracast::track::Track]) -> Vec<umbracast::forecast::Forecast> {
    let config = umbracast::Config::default();
    let mut forecasts = Vec::new();
    let mut forecaster =
        umbracast::forecast::Forecaster::new(&config.forecast, None).expect("the residual needs no weights");
    forecaster.forecast(tracks, &mut forecasts);
    forecasts
}

/// Packets of an HDL-32E whose every return lies 8 m away, from 0.0 s on.
pub fn packets(n: i64) -> Vec<umbracast::lidar::Packet> {
    let model = umbracast::lidar::Model::hdl_32e();
    let column = |i: i64| umbracast::lidar::Column {
        time_ns: i * 46_080,
        azimuth_cdeg: (i * 1659 % 3_600_000) as f32 / 100.0,
        azimuth_rate_cdeg_per_ns: 3.6e-4,
    };
    let packet = |k: i64| {
        let columns: Vec<_> = (12 * k..12 * k + 12).map(column).collect();
        let (ranges_m, reflectivities) = ([8.0; 12 * 32], [10; 12 * 32]);
        umbracast::lidar::packet::encode(&model, &columns, &ranges_m, &reflectivities, columns[11].time_ns)
    };
    (0..n).map(packet).collect()
}

/// One column of an HDL-32E, every return 8 m away to the right.
pub fn image() -> umbracast::lidar::RangeImage {
    let column =
        umbracast::lidar::Column { time_ns: 5, azimuth_cdeg: 9000.0, azimuth_rate_cdeg_per_ns: 3.6e-4 };
    umbracast::lidar::RangeImage {
        beams: umbracast::lidar::Model::hdl_32e().beams,
        columns: vec![column],
        range_m: vec![8.0; 32],
        reflectivity: vec![10; 32],
    }
}
