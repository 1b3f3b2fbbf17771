//! `POST /api/reports`: what access points heard of devices, from a RAN's own program.

use std::sync::{Arc, PoisonError};
use std::time::Duration;

use axum::body::to_bytes;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use umbracast_io::reports;

use super::Shared;

/// A body may be so long: some thirty thousand reports.
const BODY_BYTES: usize = 4 << 20;
/// And comes within so long, as a request's head does.
const COMES_WITHIN: Duration = Duration::from_secs(10);

/// 202 where all were taken, 400 with a sentence where one cannot be: then none was taken.
pub(super) async fn take(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let Some(ear) = &shared.watched.ear else {
        return (StatusCode::NOT_FOUND, "nothing is heard here\n").into_response();
    };
    let body = match tokio::time::timeout(COMES_WITHIN, to_bytes(request.into_body(), BODY_BYTES)).await {
        Ok(Ok(body)) => body,
        Ok(Err(_)) => {
            return (StatusCode::PAYLOAD_TOO_LARGE, "expected reports of 4 MiB at most\n").into_response();
        }
        Err(_) => {
            return (StatusCode::REQUEST_TIMEOUT, "expected all reports within 10 s\n").into_response();
        }
    };
    let now_ns = shared.watched.clock.now_ns();
    let site = shared.site.read().unwrap_or_else(PoisonError::into_inner);
    match reports::from_json(&body, &site, now_ns) {
        Ok(reports) => {
            ear(&reports);
            StatusCode::ACCEPTED.into_response()
        }
        Err(error) => (StatusCode::BAD_REQUEST, format!("{error}\n")).into_response(),
    }
}
