//! What is read at the start: configurations, networks' weights, sensors' own files.

use umbracast::config::DEFAULT_TOML;
use umbracast::detect::point_network::PointNetwork;
use umbracast::forecast::{Residual, Weights};
use umbracast::geometry::DVec2;
use umbracast::lidar::{Assembler, Model};
use umbracast::pipeline::Pipeline;
use umbracast::{Config, Mode};

use super::Target;

/// A configuration that is accepted can be written and read again, and begins a run.
pub const TOML: Target = Target { name: "toml", corpus: configurations, check: configuration };
/// Weights that are accepted give finite forecasts.
pub const NETWORKS: Target = Target { name: "weights", corpus: networks, check: network };
/// A sensor's own file that is accepted gives packets that fit into a datagram, and finite beams. The first byte of the
/// input says which sensor's it is.
pub const CALIBRATION: Target = Target { name: "calibration", corpus: calibrations, check: calibration };

/// A datagram holds no more.
const DATAGRAM_BYTES: usize = 65_507;

fn configurations() -> Vec<Vec<u8>> {
    let sites = [
        include_str!("../../../../config/sites/glass.toml"),
        include_str!("../../../../config/sites/l-hall.toml"),
        include_str!("../../../../config/sites/ramp.toml"),
        include_str!("../../../../config/sites/slipping-sensor.toml"),
        include_str!("../../../../config/sites/ouster.toml"),
        DEFAULT_TOML,
    ];
    let written = Mode::ALL.map(|mode| Config::for_mode(mode).to_toml());
    sites.map(str::to_owned).into_iter().chain(written).map(String::into_bytes).collect()
}

fn configuration(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let _ = Config::site_of_run(text, "input.toml");
    let Ok(config) = Config::of_run(text, "input.toml") else { return false };
    let again = Config::of_run(&config.to_toml(), "input.toml").expect("a configuration of ours");
    assert_eq!(again, config);
    assert!(Assembler::new(&config.site).is_ok(), "the sensors were checked");
    let _ = Pipeline::new(&config, None);
    true
}

fn networks() -> Vec<Vec<u8>> {
    let residual = include_bytes!("../../../../models/residual.safetensors").to_vec();
    vec![small_lstm(), residual, include_bytes!("../../../../models/pose.safetensors").to_vec()]
}

/// The paper's network with few units.
pub(super) fn small_lstm() -> Vec<u8> {
    let (units, embedded) = (16, 2);
    safetensors(&[
        ("emb.weight", &[embedded, 2]),
        ("emb.bias", &[embedded]),
        ("enc.weight_ih", &[4 * units, embedded]),
        ("enc.weight_hh", &[4 * units, units]),
        ("enc.bias_ih", &[4 * units]),
        ("enc.bias_hh", &[4 * units]),
        ("dec.weight", &[5, units]),
        ("dec.bias", &[5]),
    ])
}

/// Tensors of these shapes, every value an eighth: a header's length, the header as JSON, the values.
fn safetensors(tensors: &[(&str, &[usize])]) -> Vec<u8> {
    let (mut header, mut end) = (Vec::new(), 0);
    for (name, shape) in tensors {
        let start = end;
        end += 4 * shape.iter().product::<usize>();
        header.push(format!(
            "\"{name}\":{{\"dtype\":\"F32\",\"shape\":{shape:?},\"data_offsets\":[{start},{end}]}}"
        ));
    }
    let header = format!("{{{}}}", header.join(","));
    let values = 0.125_f32.to_le_bytes().repeat(end / 4);
    [&(header.len() as u64).to_le_bytes(), header.as_bytes(), &values].concat()
}

fn network(bytes: &[u8]) -> bool {
    let weights = Weights::from_safetensors(bytes);
    if let Ok(weights) = &weights {
        let observed_m = [std::array::from_fn(|k| DVec2::new(0.1, 0.01 * k as f64))];
        let steps = weights.roll_out(&observed_m, |_, step| step.mean_m);
        assert_eq!(steps.len(), 1);
    }
    let residual = Residual::from_safetensors(bytes).is_ok();
    let pose = PointNetwork::from_safetensors(bytes).is_ok();
    weights.is_ok() || residual || pose
}

fn calibrations() -> Vec<Vec<u8>> {
    let list = |step: f64, beams: usize| {
        let angles: Vec<String> =
            (0..beams).map(|beam| format!("{:.2}", 20.0 - step * beam as f64)).collect();
        angles.join(", ")
    };
    let metadata = |beams: usize| {
        let (altitude, azimuth) = (list(0.7, beams), list(0.0, beams));
        let shifts = vec!["0"; beams].join(", ");
        format!(
            "{{\"prod_line\": \"OS-0-{beams}\", \"lidar_mode\": \"1024x10\", \"udp_profile_lidar\": \
             \"RNG19_RFL8_SIG16_NIR16\", \"beam_altitude_angles\": [{altitude}], \"beam_azimuth_angles\": [{azimuth}], \
             \"lidar_origin_to_beam_origin_mm\": 27.67, \"lidar_to_sensor_transform\": [-1, 0, 0, 0, 0, -1, 0, 0, \
             0, 0, 1, 36.18, 0, 0, 0, 1], \"data_format\": {{\
             \"columns_per_packet\": 16, \"columns_per_frame\": 1024, \"pixels_per_column\": {beams}, \
             \"pixel_shift_by_row\": [{shifts}]}}}}"
        )
    };
    let angles = (1..=32).fold("Channel,Elevation,Azimuth\n".to_owned(), |text, channel| {
        text + &format!("{channel},{}.25,-0.01\n", 16 - channel)
    });
    let of = |model: u8, text: String| [vec![model], text.into_bytes()].concat();
    vec![of(0, metadata(128)), of(1, metadata(32)), of(2, angles)]
}

fn calibration(input: &[u8]) -> bool {
    let Some((model, bytes)) = input.split_first() else { return false };
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let mut sensor = Config::default().site.sensors.swap_remove(0);
    sensor.model = ["os0-128", "os0-32", "xt32", "hdl-32e"][usize::from(model % 4)].to_owned();
    sensor.calibration = Some(text.to_owned());
    let Ok(model) = Model::of_sensor(&sensor) else { return false };
    assert!(model.packet_bytes() <= DATAGRAM_BYTES && model.column_period_ns > 0.0);
    assert!(model.beams.iter().all(|beam| beam.direction.is_finite() && beam.origin_m.is_finite()));
    true
}
