//! What the page asks for beyond the frames: the whole scan while somebody looks at it, and a recording's frames.
//!
//! Whole scans are encoded on the server's thread, once a frame however many ask, and their bytes are bounded
//! ([`crate::whole`]). The pipeline does no more than leave the frame.

use std::sync::{Arc, Mutex, PoisonError};

use axum::Json;
use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use umbracast::lidar::Model;
use umbracast::site::Sensor;
use umbracast::{Error, Site};

use super::Shared;
use crate::recording::Recording;
use crate::whole;

/// A status and a sentence.
type Refusal = (StatusCode, String);

/// The last scan that was encoded, by its frame's time.
#[derive(Debug, Default)]
pub(super) struct Encoded(Mutex<Option<(i64, Bytes)>>);

/// `/api/scan`: 204 until the first frame after somebody began to ask.
pub(super) async fn scan(State(shared): State<Arc<Shared>>) -> Response {
    let Some(frame) = shared.watched.whole.ask(shared.watched.clock.now_ns()) else {
        return StatusCode::NO_CONTENT.into_response();
    };
    let mut last = shared.encoded.0.lock().unwrap_or_else(PoisonError::into_inner);
    let bytes = match &*last {
        Some((time_ns, bytes)) if *time_ns == frame.time_ns => bytes.clone(),
        _ => {
            let bytes: Bytes = whole::encoded(&frame, whole::middle_m(&shared.watched.site)).into();
            *last = Some((frame.time_ns, bytes.clone()));
            bytes
        }
    };
    octets(bytes)
}

/// The lowest and the highest beam of each sensor, degrees above its horizon; null of one without beams.
pub(super) fn fields_deg(site: &Site) -> Vec<Option<[f64; 2]>> {
    let of = |sensor: &Sensor| {
        let beams = Model::of_sensor(sensor).ok()?.beams;
        let elevations = beams.iter().map(|beam| beam.elevation_rad.to_degrees());
        let bounds =
            elevations.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], e| [low.min(e), high.max(e)]);
        (bounds[0] <= bounds[1]).then_some(bounds)
    };
    site.sensors.iter().map(of).collect()
}

#[derive(serde::Deserialize)]
pub(super) struct Span {
    from: u64,
    count: u64,
}

#[derive(serde::Deserialize)]
pub(super) struct At {
    frame: u64,
}

/// `/api/recording`
pub(super) async fn about(State(shared): State<Arc<Shared>>) -> Result<Json<Value>, Refusal> {
    Ok(Json(recording(&shared)?.about()))
}

/// `/api/recording/frames?from=&count=`
pub(super) async fn frames(
    State(shared): State<Arc<Shared>>,
    Query(span): Query<Span>,
) -> Result<Response, Refusal> {
    let recording = recording(&shared)?;
    let text = read(move || recording.frames(span.from, span.count)).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}

/// `/api/recording/scan?frame=`: 204 where it is not there yet.
pub(super) async fn recorded_scan(
    State(shared): State<Arc<Shared>>,
    Query(at): Query<At>,
) -> Result<Response, Refusal> {
    let recording = recording(&shared)?;
    let scan = read(move || recording.scan(at.frame)).await?;
    Ok(scan.map_or_else(|| StatusCode::NO_CONTENT.into_response(), |bytes| octets(bytes.into())))
}

fn recording(shared: &Shared) -> Result<Arc<Recording>, Refusal> {
    let none = || (StatusCode::NOT_FOUND, "no recording is looked at here\n".to_owned());
    shared.watched.recording.clone().ok_or_else(none)
}

/// Reads from disk beside the server's thread.
async fn read<T: Send + 'static>(
    reads: impl FnOnce() -> Result<T, Error> + Send + 'static,
) -> Result<T, Refusal> {
    let failed = |told: String| (StatusCode::INTERNAL_SERVER_ERROR, told);
    match tokio::task::spawn_blocking(reads).await {
        Ok(read) => read.map_err(|error| failed(format!("{error}\n"))),
        Err(_) => Err(failed("the reading ended; this is a bug\n".to_owned())),
    }
}

fn octets(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream"), (header::CACHE_CONTROL, "no-store")], bytes)
        .into_response()
}
