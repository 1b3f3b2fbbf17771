//! What the page of `plan` asks: questions with a JSON body each, answered beside the server's own thread, one after the
//! other.

use std::sync::Arc;

use axum::extract::{Path, Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use tokio::sync::Mutex;
use umbracast::Error;

use super::{Shared, body};

/// What answers a question: its name and its JSON to the answer's JSON.
type Answers = dyn Fn(&str, &[u8]) -> Result<String, Error> + Send + Sync;

/// Who answers the page of `plan`.
#[derive(Clone)]
pub struct Planner {
    answers: Arc<Answers>,
    /// Held while it computes: its threads are enough for one.
    one: Arc<Mutex<()>>,
}

impl Planner {
    /// By this function, which may take its time. It is told the question's name and its body, which anybody may have
    /// written.
    pub fn new(answers: impl Fn(&str, &[u8]) -> Result<String, Error> + Send + Sync + 'static) -> Self {
        Self { answers: Arc::new(answers), one: Arc::default() }
    }
}

/// `/api/plan/NAME`: 200 with JSON, or 400 with a sentence that says what was expected. A question that is too long is not
/// read, and one that does not come is not waited for.
pub(super) async fn answer(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    request: Request,
) -> Response {
    let Some(planner) = shared.watched.planner.clone() else {
        return (StatusCode::NOT_FOUND, "nothing is planned here\n").into_response();
    };
    let (long, late) =
        ("expected a question of 4 MiB at most\n", "expected the whole question within 10 s\n");
    let body = match body::of(request, long, late).await {
        Ok(body) => body,
        Err(refusal) => return *refusal,
    };
    let _one = planner.one.lock().await;
    let told = tokio::task::spawn_blocking(move || (planner.answers)(&name, &body)).await;
    match told {
        Ok(Ok(json)) => ([(header::CONTENT_TYPE, "application/json")], json).into_response(),
        Ok(Err(error)) => (StatusCode::BAD_REQUEST, format!("{error}\n")).into_response(),
        Err(_) => {
            (StatusCode::INTERNAL_SERVER_ERROR, "the computation ended; this is a bug\n").into_response()
        }
    }
}
