//! The interface as OpenAPI 3.1, with the rows' schemas made from their columns.

use serde_json::{Value, json};
use umbracast_io::rows::{BindingRow, DecisionRow, LinkRow, LossRow, TrackRow};
use umbracast_io::wire;

/// The document.
pub fn document() -> Value {
    let json_of = |what: &str, schema: Value| {
        json!({ "get": { "summary": what, "responses": { "200": {
            "description": what, "content": { "application/json": { "schema": schema } } } } } })
    };
    let text_of = |what: &str, kind: &str| {
        json!({ "get": { "summary": what, "responses": { "200": {
            "description": what, "content": { kind: { "schema": { "type": "string" } } } } } } })
    };
    let frame = json!({ "$ref": "#/components/schemas/Frame" });
    json!({
        "openapi": "3.1.0",
        "info": { "title": "Umbracast", "version": env!("CARGO_PKG_VERSION") },
        "paths": {
            "/api/site": json_of("Hall, sensors, access points", json!({ "type": "object" })),
            "/api/frame": json_of("The newest frame; ?points=0 leaves the points out, ?columns=track,x_m,p_w3 all other columns of rows, and ?decimals=4 rounds measures", frame),
            "/api/live": text_of("WebSocket: a Frame as JSON text, each time there is a newer one; takes what /api/frame takes", "application/json"),
            "/api/objects/{source}": text_of("Of node --objects: WebSocket. Takes lists of objects of another perception as JSON, and answers as /api/live", "application/json"),
            "/api/scan": text_of("The whole scan of the newest frame while it is asked for: frame (u64), origin (3 f64, metres), then x, y, z (i16, centimetres), sensor and reflectivity (u8) of each point, little-endian; 204 without one", "application/octet-stream"),
            "/api/recording": json_of("Of view: how many frames are computed, and of what; 404 of other commands", json!({ "type": "object" })),
            "/api/recording/frames": json_of("?from=&count=: for each frame what every mode says, and the truth", json!({ "type": "array", "items": { "type": "object" } })),
            "/api/recording/scan": text_of("?frame=: its whole scan, as /api/scan", "application/octet-stream"),
            "/api/reports": reports_path(),
            "/api/events": text_of("Server-sent events: warning, blocked, clear, gone, an Event as JSON each; decision, a DecisionEvent", "text/event-stream"),
            "/health": json_of("200 while frames come, 503 while they do not", json!({ "type": "object" })),
            "/metrics": text_of("Counters and histograms for Prometheus", "text/plain"),
        },
        "components": { "schemas": {
            "Track": wire::json_schema::<TrackRow>(),
            "Blockage": wire::json_schema::<LinkRow>(),
            "Loss": wire::json_schema::<LossRow>(),
            "Binding": wire::json_schema::<BindingRow>(),
            "Report": report_schema(),
            "Decision": wire::json_schema::<DecisionRow>(),
            "Frame": frame_schema(),
            "Event": event_schema(),
            "DecisionEvent": decision_event_schema(),
        } }
    })
}

fn reports_path() -> Value {
    let one = json!({ "$ref": "#/components/schemas/Report" });
    let schema = json!({ "oneOf": [one, { "type": "array", "items": one }] });
    json!({ "post": {
        "summary": "What access points heard of devices: one report or a list",
        "requestBody": { "required": true, "content": { "application/json": { "schema": schema } } },
        "responses": {
            "202": { "description": "All are taken with the next frame" },
            "400": { "description": "One cannot be, and none was taken; says which, expected and found" },
        },
    } })
}

fn report_schema() -> Value {
    json!({
        "title": "Report",
        "type": "object",
        "required": ["access_point", "device", "power_dbm"],
        "properties": {
            "time_ns": { "type": "integer", "description": "When it was heard, in the sensors' time; just now, where it is missing." },
            "access_point": { "type": "string", "description": "Its name in the site file; it has a radio there." },
            "device": { "type": "integer", "description": "The network's name of the device." },
            "power_dbm": { "type": "number", "description": "Received power of the reference signal." },
            "serves": { "type": "boolean", "description": "Whether this access point serves the device; false where it is not said." },
        }
    })
}

fn frame_schema() -> Value {
    let list =
        |of: &str| json!({ "type": "array", "items": { "$ref": format!("#/components/schemas/{of}") } });
    json!({
        "title": "Frame",
        "type": "object",
        "properties": {
            "frame": { "type": "integer", "description": "Counts from the first packet." },
            "time_ns": { "type": "integer", "description": "End of the frame, time of the sensors." },
            "published_ns": { "type": "integer", "description": "Host time." },
            "age_ms": { "type": ["integer", "null"], "description": "Since it was published; null before the first." },
            "latency_ms": { "type": "number", "description": "From the last packet of the frame to its results." },
            "step_ms": { "type": "number", "description": "The stages alone." },
            "frames_skipped": { "type": "integer" },
            "reloads": { "type": "integer", "description": "How often the site file was read again; then /api/site is another." },
            "sensors": { "type": "array", "items": { "type": "boolean" }, "description": "Which gave to this frame." },
            "health": { "type": "object", "description": "What was skipped since the start." },
            "tracks": list("Track"),
            "blockages": list("Blockage"),
            "losses": list("Loss"),
            "bindings": list("Binding"),
            "decisions": list("Decision"),
            "events": { "type": "array", "items": { "oneOf": [
                { "$ref": "#/components/schemas/Event" }, { "$ref": "#/components/schemas/DecisionEvent" } ] } },
            "points_cm": { "type": "array", "items": { "type": "integer" }, "description": "x y z, x y z, ... of new points." },
        }
    })
}

fn event_schema() -> Value {
    json!({
        "title": "Event",
        "type": "object",
        "properties": {
            "event": { "enum": ["warning", "blocked", "clear", "gone"] },
            "access_point": { "type": "string" },
            "track": { "type": "integer" },
            "frame": { "type": "integer" },
            "time_ns": { "type": "integer" },
            "p_now": { "type": "number", "description": "Blocked by others now," },
            "p_w9": { "type": "number", "description": "and within 900 ms." },
            "p_any_now": { "type": "number", "description": "The same by others, the owner or the hall." },
            "p_any_w9": { "type": "number" },
            "cause": { "enum": ["others", "owner", "hall", null], "description": "The likeliest of a warning or blockage." },
            "onset_p10_s": { "type": ["number", "null"] },
            "onset_p50_s": { "type": ["number", "null"] },
            "onset_p90_s": { "type": ["number", "null"] },
        }
    })
}

fn decision_event_schema() -> Value {
    let mut schema = wire::json_schema::<DecisionRow>();
    schema["title"] = "DecisionEvent".into();
    schema["properties"]["event"] = json!({ "enum": ["decision"] });
    schema["properties"]["frame"] = json!({ "type": "integer" });
    schema["properties"]["time_ns"] = json!({ "type": "integer" });
    schema
}
