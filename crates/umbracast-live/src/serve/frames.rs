//! Frames as JSON: the newest, each as it comes, and those that answer lists of objects. A client says what it wants of them.

use std::collections::BTreeSet;
use std::sync::Arc;

use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Query, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use umbracast_io::rows::{BindingRow, DecisionRow, LinkRow, LossRow, TrackRow};
use umbracast_io::wire;

use super::connections::{Guest, Stream};
use super::{Shared, full};
use crate::published::Wanted;

/// What a client may say over a WebSocket at once.
const SAID_BYTES: usize = 4096;
/// A list of objects is no longer: a thousand people, each told at length.
const LIST_BYTES: usize = 1 << 20;
/// A double has no more decimals that matter.
const MOST_DECIMALS: u8 = 15;

#[derive(serde::Deserialize)]
pub(super) struct FrameQuery {
    /// 0 leaves the points out.
    points: Option<u8>,
    /// Names of columns, a comma between; without it all of them.
    columns: Option<String>,
    /// That measures are rounded to.
    decimals: Option<u8>,
}

impl FrameQuery {
    fn wanted(self) -> Result<Wanted, String> {
        if let Some(decimals) = self.decimals.filter(|decimals| *decimals > MOST_DECIMALS) {
            return Err(format!("decimals: expected 0 to {MOST_DECIMALS}, found {decimals}\n"));
        }
        let columns = self.columns.map(|columns| columns.split(',').map(str::to_owned).collect::<Vec<_>>());
        if let Some(columns) = &columns {
            let known: BTreeSet<String> = [
                wire::columns::<TrackRow>(),
                wire::columns::<LinkRow>(),
                wire::columns::<LossRow>(),
                wire::columns::<BindingRow>(),
                wire::columns::<DecisionRow>(),
            ]
            .into_iter()
            .flatten()
            .collect();
            if let Some(unknown) = columns.iter().find(|name| !known.contains(*name)) {
                let found = unknown.as_str();
                return Err(format!(
                    "columns: expected those of /api/openapi.json, found {found:?}
"
                ));
            }
        }
        let rows = wire::Asked { columns, decimals: self.decimals };
        Ok(Wanted { points: self.points != Some(0), rows })
    }
}

pub(super) async fn newest(State(shared): State<Arc<Shared>>, Query(query): Query<FrameQuery>) -> Response {
    let wanted = match query.wanted() {
        Ok(wanted) => wanted,
        Err(told) => return (StatusCode::BAD_REQUEST, told).into_response(),
    };
    let newest = shared.newest.borrow().clone();
    Json(newest.json(&wanted, shared.age(&newest))).into_response()
}

pub(super) async fn live(
    State(shared): State<Arc<Shared>>,
    Extension(guest): Extension<Guest>,
    Query(query): Query<FrameQuery>,
    upgrade: WebSocketUpgrade,
) -> Response {
    let wanted = match query.wanted() {
        Ok(wanted) => wanted,
        Err(told) => return (StatusCode::BAD_REQUEST, told).into_response(),
    };
    let Some(place) = guest.stream() else { return full() };
    // Nothing is expected from a client but that it closes. Room is made for a frame before it comes.
    let upgrade = upgrade.max_message_size(SAID_BYTES).max_frame_size(SAID_BYTES);
    upgrade.on_upgrade(move |socket| stream(socket, shared, place, wanted, None))
}

/// Takes lists of objects, where somebody does, and answers with frames.
pub(super) async fn objects(
    State(shared): State<Arc<Shared>>,
    Extension(guest): Extension<Guest>,
    Path(source): Path<String>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Response {
    if shared.watched.objects.is_none() {
        let told = "expected a node that takes lists of objects: umbracast node ... --objects\n";
        return (StatusCode::NOT_FOUND, told).into_response();
    }
    let upgrade = match upgrade {
        Ok(upgrade) => upgrade,
        Err(rejection) => return rejection.into_response(),
    };
    let Some(place) = guest.stream() else { return full() };
    let upgrade = upgrade.max_message_size(LIST_BYTES).max_frame_size(LIST_BYTES);
    upgrade.on_upgrade(move |socket| stream(socket, shared, place, Wanted::WITHOUT_POINTS, Some(source)))
}

/// Every frame that the client can take. A watch holds the newest only, so a slow one skips frames, and the others
/// notice nothing.
async fn stream(
    mut socket: WebSocket,
    shared: Arc<Shared>,
    place: Stream,
    wanted: Wanted,
    source: Option<String>,
) {
    let mut newest = shared.newest.subscribe();
    newest.mark_changed();
    loop {
        tokio::select! {
            changed = newest.changed() => {
                if changed.is_err() {
                    return;
                }
                let frame = newest.borrow_and_update().clone();
                let json = frame.json(&wanted, shared.age(&frame));
                let Ok(text) = serde_json::to_string(&json) else { continue };
                let bytes = text.len();
                // Fails where the other end takes nothing: see `connections`.
                if socket.send(Message::Text(text.into())).await.is_err() {
                    return;
                }
                place.took(bytes);
            }
            said = socket.recv() => {
                let Some(Ok(said)) = said else { return };
                if let (Some(source), Some(take), Message::Text(_) | Message::Binary(_)) =
                    (&source, &shared.watched.objects, &said)
                {
                    take(source, &said.into_data());
                }
            }
        }
    }
}
