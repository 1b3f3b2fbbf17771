//! `POST /api/reports`: what access points heard of devices, from a RAN's own program.

use std::sync::{Arc, PoisonError};

use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use umbracast_io::reports;

use super::{Shared, body};

/// 202 where all were taken, 400 with a sentence where one cannot be: then none was taken.
pub(super) async fn take(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let Some(ear) = &shared.watched.ear else {
        return (StatusCode::NOT_FOUND, "nothing is heard here\n").into_response();
    };
    let (long, late) = ("expected reports of 4 MiB at most\n", "expected all reports within 10 s\n");
    let body = match body::of(request, long, late).await {
        Ok(body) => body,
        Err(refusal) => return *refusal,
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
