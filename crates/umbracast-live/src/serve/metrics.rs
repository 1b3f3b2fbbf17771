//! `/metrics`, in the text format of Prometheus.

use std::fmt::Write;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::Value;

use super::connections::Connections;
use super::watched::Watched;
use crate::latency::Latencies;
use crate::published::Published;

/// Upper bounds of the buckets, milliseconds.
const BUCKETS_MS: [f64; 9] = [0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// Everything that is counted.
pub fn text(watched: &Watched, newest: &Published, connections: &Connections) -> String {
    let mut out = String::new();
    let counters = &watched.counters;
    counter(
        &mut out,
        "packets_total",
        "Packets of sensors.",
        counters.packets.load(Ordering::Relaxed) as f64,
    );
    let dropped = counters.dropped_by_system.load(Ordering::Relaxed) as f64;
    let what = "Packets that the system gave up because nobody received them in time.";
    counter(&mut out, "packets_dropped_by_system_total", what, dropped);
    head(&mut out, "sensor_packets_total", "Packets of each sensor.", "counter");
    let of_sensors = counters.of_sensors.lock().unwrap_or_else(PoisonError::into_inner).clone();
    for (sensor, packets) in watched.site.sensors.iter().zip(of_sensors) {
        // As Prometheus writes a label's value.
        let name = sensor.name.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        let _ = writeln!(out, "umbracast_sensor_packets_total{{sensor=\"{name}\"}} {packets}");
    }
    counter(&mut out, "frames_total", "Frames published.", counters.frames.load(Ordering::Relaxed) as f64);
    counter(
        &mut out,
        "frames_skipped_total",
        "Frames given up because the pipeline was busy.",
        newest.frames_skipped as f64,
    );
    gauge(&mut out, "tracks", "People followed now.", newest.tracks.len() as f64);
    let state =
        |blocked: bool| newest.links.iter().filter(|link| link.is_blocked() == blocked).count() as f64;
    gauge(&mut out, "links_blocked", "Links blocked now.", state(true));
    let what = "Reports of access points that were taken.";
    counter(&mut out, "reports_total", what, counters.heard.taken() as f64);
    let what = "Reports that came while too many waited, or of which nothing could be made.";
    let skipped = counters.heard.lost() + counters.reports_skipped.load(Ordering::Relaxed);
    counter(&mut out, "reports_skipped_total", what, skipped as f64);
    gauge(&mut out, "streams", "Open WebSockets and event streams.", connections.streams() as f64);
    let streamed = connections.streamed() as f64;
    counter(&mut out, "streamed_bytes_total", "Bytes of frames sent over WebSockets.", streamed);
    let what = "Connections closed unheard because there were too many.";
    counter(&mut out, "connections_refused_total", what, connections.refused() as f64);
    if let Ok(Value::Object(health)) = serde_json::to_value(newest.health) {
        for (name, value) in health {
            let what = "What was skipped, by the name that `health` has for it.";
            counter(&mut out, &format!("skipped_{name}_total"), what, value.as_f64().unwrap_or(0.0));
        }
    }
    let recorder = counters.recorder();
    counter(&mut out, "recorded_bytes_total", "Bytes recorded.", recorder.bytes as f64);
    counter(&mut out, "recorder_lost_total", "Packets and results not recorded.", recorder.lost as f64);
    gauge(
        &mut out,
        "recorder_failing",
        "1 while the disk fails.",
        f64::from(u8::from(recorder.failing.is_some())),
    );
    let of = |latencies: &std::sync::Mutex<Latencies>| {
        latencies.lock().unwrap_or_else(PoisonError::into_inner).clone()
    };
    let what = "From the last packet of the frame to its results.";
    histogram(&mut out, "latency_seconds", what, &of(&counters.latencies));
    histogram(&mut out, "step_seconds", "The stages alone.", &of(&counters.steps));
    out
}

fn head(out: &mut String, name: &str, what: &str, kind: &str) {
    let _ = writeln!(out, "# HELP umbracast_{name} {what}\n# TYPE umbracast_{name} {kind}"); // To a string.
}

fn counter(out: &mut String, name: &str, what: &str, value: f64) {
    head(out, name, what, "counter");
    let _ = writeln!(out, "umbracast_{name} {value}");
}

fn gauge(out: &mut String, name: &str, what: &str, value: f64) {
    head(out, name, what, "gauge");
    let _ = writeln!(out, "umbracast_{name} {value}");
}

fn histogram(out: &mut String, name: &str, what: &str, latencies: &Latencies) {
    head(out, name, what, "histogram");
    for limit_ms in BUCKETS_MS {
        let within = latencies.within(Duration::from_secs_f64(limit_ms * 1e-3));
        let _ = writeln!(out, "umbracast_{name}_bucket{{le=\"{}\"}} {within}", limit_ms * 1e-3);
    }
    let (count, sum_s) = (latencies.count(), latencies.sum().as_secs_f64());
    let _ = writeln!(out, "umbracast_{name}_bucket{{le=\"+Inf\"}} {count}");
    let _ = writeln!(out, "umbracast_{name}_sum {sum_s}\numbracast_{name}_count {count}");
}
