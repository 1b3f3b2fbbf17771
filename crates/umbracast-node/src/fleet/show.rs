//! The fleet as a table and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Value, json};

use super::{Hall, Node};

/// A table: a line a node.
pub fn text(halls: &BTreeMap<String, Hall>) -> String {
    let mut text = format!(
        "{:12} {:34} {:22} {:>8} {:>6} {:>8} {:>9} {:>8} {:>8}  troubles\n",
        "hall", "node", "does", "up, s", "cores", "MiB", "frames", "kB/s", "p99, ms"
    );
    for (name, hall) in halls {
        for (id, node) in &hall.nodes {
            let health = node.health.clone().unwrap_or_default();
            let leads = if health.leads { " (leads)" } else { "" };
            let roles: Vec<&str> = node.roles.iter().map(String::as_str).collect();
            let does = if roles.is_empty() { "gone".to_owned() } else { roles.join(",") + leads };
            let _ = writeln!(
                text,
                "{name:12} {id:34} {does:22} {:8.0} {:6.2} {:8.1} {:9} {:8.1} {:8.1}  {}",
                health.up_s,
                node.cores().unwrap_or(0.0),
                health.resident_bytes as f64 / f64::from(1 << 20),
                health.frames,
                node.bytes_per_s().unwrap_or(0.0) / 1000.0,
                health.latency_ms[1],
                hall.troubles_of(node).join(", "),
            ); // To a string: cannot fail.
        }
        for trouble in hall.troubles() {
            let _ = writeln!(text, "{name:12} {trouble}");
        }
    }
    text
}

/// The same for programs.
pub fn json(halls: &BTreeMap<String, Hall>) -> Value {
    let of_node = |hall: &Hall, id: &String, node: &Node| {
        let health = node.health.clone().unwrap_or_default();
        let value = json!({
            "roles": node.roles,
            "sensors": node.sensors,
            "host": health.host,
            "stages": health.stages,
            "leads": health.leads,
            "up_s": health.up_s,
            "cores": node.cores(),
            "resident_bytes": health.resident_bytes,
            "frames": health.frames,
            "frames_skipped": health.frames_skipped,
            "frames_incomplete": health.frames_incomplete,
            "messages_late": health.messages_late,
            "messages_broken": health.messages_broken,
            "bytes_per_s": node.bytes_per_s(),
            "latency_p50_ms": health.latency_ms[0],
            "latency_p99_ms": health.latency_ms[1],
            "health": health.health,
            "empty_hall": health.empty_hall,
            "clock_ahead_s": node.ahead_s,
            "troubles": hall.troubles_of(node),
        });
        (id.clone(), value)
    };
    let of_hall = |(name, hall): (&String, &Hall)| {
        let nodes = hall.nodes.iter().map(|(id, node)| of_node(hall, id, node));
        let nodes = Value::Object(nodes.collect());
        (name.clone(), json!({ "nodes": nodes, "sensors": hall.sensors, "troubles": hall.troubles() }))
    };
    Value::Object(halls.iter().map(of_hall).collect())
}
