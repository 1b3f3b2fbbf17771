//! What is posted: a body that is neither too long nor too late.

use std::time::Duration;

use axum::body::{Bytes, to_bytes};
use axum::extract::Request;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

/// A body may be so long: a hall with thousands of corners, or some thirty thousand reports.
const BODY_BYTES: usize = 4 << 20;
/// And comes within so long, as a request's head does.
const COMES_WITHIN: Duration = Duration::from_secs(10);

/// The body of a request. One that is too long is not read, and one that does not come is not waited for: then `long` or `late` is the
/// answer.
pub(super) async fn of(
    request: Request,
    long: &'static str,
    late: &'static str,
) -> Result<Bytes, Box<Response>> {
    let too_long = || Box::new((StatusCode::PAYLOAD_TOO_LARGE, long).into_response());
    let length = request.headers().get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok());
    if length.and_then(|length| length.parse::<usize>().ok()).is_some_and(|length| length > BODY_BYTES) {
        return Err(too_long());
    }
    match tokio::time::timeout(COMES_WITHIN, to_bytes(request.into_body(), BODY_BYTES)).await {
        Ok(Ok(body)) => Ok(body),
        Ok(Err(_)) => Err(too_long()),
        Err(_) => Err(Box::new((StatusCode::REQUEST_TIMEOUT, late).into_response())),
    }
}
