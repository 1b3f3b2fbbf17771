//! The page and its interface over HTTP. `curl` can use the same interface.
//!
//! | path | gives |
//! |---|---|
//! | `/` | the page, whole in one answer |
//! | `/api/site` | hall, sensors, access points |
//! | `/api/frame` | the newest frame |
//! | `/api/scan` | the whole scan of a frame, thinned, while somebody asks |
//! | `/api/recording` | a recording that is looked at; below it its frames and scans |
//! | `/api/plan/NAME` | what the page of `plan` asks |
//! | `/api/live` | WebSocket: every frame, or the newest that a slow client can take |
//! | `/api/reports` | takes what access points heard of devices (POST) |
//! | `/api/objects/SOURCE` | of a node that takes them: WebSocket for lists of objects, which is answered like `/api/live` |
//! | `/api/events` | server-sent events: warnings, blockages, clear links, decisions |
//! | `/api/openapi.json` | this interface, with the JSON Schema of every row |
//! | `/health` | 200 while frames come, 503 while they do not |
//! | `/metrics` | for Prometheus |
//!
//! The server has a thread of its own with one worker. A slow or hostile client can take time from other clients
//! only, never from the pipeline, which only leaves the newest frame here.

mod body;
mod planned;
mod reported;
mod watched;
mod tls;
mod connections;
mod doors;
mod frames;
mod looked_at;
mod metrics;
mod openapi;
mod pages;

use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Duration;

use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::sse::{Event as Sent, KeepAlive, Sse};
use axum::response::{AppendHeaders, Html, IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router};
use serde_json::{Value, json};
use tokio::sync::{broadcast, oneshot, watch};
use tokio_stream::StreamExt;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::wrappers::errors::BroadcastStreamRecvError;
use umbracast::{Error, Site};

use self::connections::{Connections, Guest, Limits};
use crate::published::Published;
use doors::{Doors, Names};
pub use planned::Planner;
use tls::Tls;
pub use watched::Watched;

/// The cookie that holds the page's token.
const COOKIE: &str = "umbracast_token";
/// Events that wait for a slow client; beyond it is told how many it missed.
const EVENTS_WAITING: usize = 1024;
/// Without a frame for so long, something is wrong.
const STALE: Duration = Duration::from_secs(1);

/// The server's thread, and where it listens.
pub struct Server {
    address: SocketAddr,
    site: Arc<RwLock<Site>>,
    newest: watch::Sender<Arc<Published>>,
    events: broadcast::Sender<Said>,
    stop: oneshot::Sender<()>,
    thread: std::thread::JoinHandle<()>,
}

/// The name of an event and its JSON.
type Said = (&'static str, Arc<str>);

/// Hands frames to the server, from any thread, without waiting.
#[derive(Clone)]
pub struct Publisher {
    newest: watch::Sender<Arc<Published>>,
    events: broadcast::Sender<Said>,
}

impl Publisher {
    /// The newest frame.
    pub fn publish(&self, published: &Arc<Published>) {
        let of_links = published.events.iter().map(|event| (event.state.name(), event.json()));
        let of_devices = published.advice.iter().map(|advice| ("decision", advice.json()));
        for (name, json) in of_links.chain(of_devices) {
            let _ = self.events.send((name, json.to_string().into())); // Nobody listens: nobody misses it.
        }
        self.newest.send_replace(published.clone());
    }
}

struct Shared {
    watched: Watched,
    /// As the site file was last read.
    site: Arc<RwLock<Site>>,
    newest: watch::Sender<Arc<Published>>,
    events: broadcast::Sender<Said>,
    token: Option<String>,
    names: Names,
    doors: Mutex<Doors>,
    connections: Arc<Connections>,
    encoded: looked_at::Encoded,
}

/// Where it is served, and to whom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Door {
    /// Where it listens.
    pub address: SocketAddr,
    /// Names by which clients ask for it, beside loopback's and the address that it listens on: that of a proxy, or of this
    /// host.
    pub hosts: Vec<String>,
    /// What clients must know.
    pub token: Option<String>,
    /// Files with the certificate and its key, PEM; without them it is served as it is.
    pub tls: Option<(PathBuf, PathBuf)>,
}

impl Door {
    /// At an address, under its own name, to everybody who reaches it.
    pub fn at(address: SocketAddr) -> Self {
        Self { address, hosts: Vec::new(), token: None, tls: None }
    }
}

/// Listens on an address. Others than loopback need a token: what is seen here is where people are.
///
/// # Errors
/// An address that is taken, or that others can reach without a token; a host that is no name; files that hold no certificate
/// and its key.
pub fn start(door: Door, watched: Watched) -> Result<Server, Error> {
    start_with(Limits::default(), door, watched)
}

fn start_with(limits: Limits, door: Door, watched: Watched) -> Result<Server, Error> {
    let Door { address, hosts, token, tls } = door;
    if !address.ip().is_loopback() && token.is_none() {
        return Err(Error::new(format!(
            "{address}: expected a token (UMBRACAST_TOKEN) for an address that other hosts can reach, found none"
        )));
    }
    token.as_deref().map_or(Ok(()), doors::check_token)?;
    let names = Names::new(address, &hosts)?;
    let tls = tls.map(|(cert, key)| Tls::open(&cert, &key)).transpose()?;
    let listener = TcpListener::bind(address).map_err(|e| Error::new(e.to_string()).within(address))?;
    let failed = |e: std::io::Error| Error::new(e.to_string()).within(address);
    listener.set_nonblocking(true).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    let newest = watch::Sender::new(Arc::new(Published::default()));
    let events = broadcast::Sender::new(EVENTS_WAITING);
    let (stop, stopped) = oneshot::channel();
    let site = Arc::new(RwLock::new(watched.site.clone()));
    let (sender, event_sender) = (newest.clone(), events.clone());
    let connections = Connections::new(limits);
    let open = connections.clone();
    let doors = Mutex::default();
    let shared = Shared {
        watched,
        site: site.clone(),
        newest: sender,
        events: event_sender,
        token,
        names,
        doors,
        connections,
        encoded: looked_at::Encoded::default(),
    };
    let thread = std::thread::spawn(move || {
        runtime.block_on(async move {
            let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
            let serving = connections::serve(listener, tls, router(Arc::new(shared)), open);
            // Streams never end by themselves, so nobody is waited for.
            tokio::select! { () = serving => (), _ = stopped => () }
        });
    });
    Ok(Server { address, site, newest, events, stop, thread })
}

impl Server {
    /// Where it listens: the port is known where a free one was asked for.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// For whoever makes frames.
    pub fn publisher(&self) -> Publisher {
        Publisher { newest: self.newest.clone(), events: self.events.clone() }
    }

    /// Another site from now on; frames tell that it was read again.
    pub fn take_over(&self, site: &Site) {
        *self.site.write().unwrap_or_else(PoisonError::into_inner) = site.clone();
    }

    /// Closes every connection.
    pub fn stop(self) {
        let _ = self.stop.send(());
        let _ = self.thread.join();
    }
}

fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(page))
        .route("/api/site", get(site))
        .route("/api/frame", get(frames::newest))
        .route("/api/live", get(frames::live))
        .route("/api/objects/{source}", get(frames::objects))
        .route("/api/scan", get(looked_at::scan))
        .route("/api/recording", get(looked_at::about))
        .route("/api/recording/frames", get(looked_at::frames))
        .route("/api/recording/scan", get(looked_at::recorded_scan))
        .route("/api/plan/{name}", post(planned::answer))
        .route("/api/reports", post(reported::take))
        .route("/api/events", get(events))
        .route("/api/openapi.json", get(async || Json(openapi::document())))
        .route("/health", get(health))
        .route("/metrics", get(metrics_text))
        .layer(from_fn_with_state(shared.clone(), guard))
        .with_state(shared)
}

/// Lets in who may see this.
async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let guest = request.extensions().get::<Guest>().cloned();
    let now_ns = shared.watched.clock.now_ns();
    if let Some(guest) = &guest
        && doors::lock(&shared.doors).is_closed(guest.from(), now_ns)
    {
        return (StatusCode::TOO_MANY_REQUESTS, "too many wrong tokens: try again in a minute\n")
            .into_response();
    }
    match refused(&shared.names, shared.token.as_deref(), &request) {
        Some(refusal) => {
            if let Some(guest) =
                guest.filter(|_| refusal.0 == StatusCode::UNAUTHORIZED && given(&request).is_some())
            {
                doors::lock(&shared.doors).note_wrong(guest.from(), now_ns);
            }
            refusal.into_response()
        }
        None => {
            if let Some(guest) = guest {
                guest.let_in();
            }
            next.run(request).await
        }
    }
}

/// The token that a request carries: in its head, in its address, or in the cookie that the page was given.
fn given(request: &Request) -> Option<&str> {
    let head = |name| request.headers().get(name).and_then(|value| value.to_str().ok());
    let bearer = head(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
    let mut in_query = request.uri().query().into_iter().flat_map(|query| query.split('&'));
    let mut cookies = head(header::COOKIE).into_iter().flat_map(|cookies| cookies.split("; "));
    bearer
        .or_else(|| in_query.find_map(|pair| pair.strip_prefix("token=")))
        .or_else(|| cookies.find_map(|cookie| cookie.strip_prefix(COOKIE)?.strip_prefix('=')))
}

/// A request under a name that is not this server's is refused, and so is what a browser sends for a page from elsewhere: it
/// carries that page's origin. Then the token is asked for, where there is one.
fn refused(names: &Names, token: Option<&str>, request: &Request) -> Option<(StatusCode, &'static str)> {
    let head = |name| request.headers().get(name).and_then(|value| value.to_str().ok());
    let host = head(header::HOST).unwrap_or_default();
    if !names.hold(host) {
        let refusal = "expected the Host to be localhost, the address that is served (--serve), or a name given with --host\n";
        return Some((StatusCode::FORBIDDEN, refusal));
    }
    let is_foreign = |origin: &str| origin.split_once("://").is_none_or(|(_, name)| name != host);
    // An origin that is no text is nobody's.
    if request.headers().contains_key(header::ORIGIN) && head(header::ORIGIN).is_none_or(is_foreign) {
        return Some((StatusCode::FORBIDDEN, "expected a request of this page's own\n"));
    }
    let refusal = (StatusCode::UNAUTHORIZED, "expected a token: Authorization: Bearer, or ?token=\n");
    token.filter(|token| !given(request).is_some_and(|given| same(given, token))).map(|_| refusal)
}

/// Compares in a time that tells nothing of where they differ.
fn same(given: &str, token: &str) -> bool {
    let differing = given.bytes().zip(token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    given.len() == token.len() && differing == 0
}

/// The page keeps the token of its address in a cookie that no script reads and no other site's page sends, and takes it out of
/// the address.
async fn page(State(shared): State<Arc<Shared>>, request: Request) -> impl IntoResponse {
    let page = if shared.watched.planner.is_some() { pages::PLAN } else { pages::WATCH };
    let cookie = given(&request).map(|token| format!("{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"));
    let policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; \
                  img-src data:; frame-ancestors 'none'";
    let heads = [(header::CONTENT_SECURITY_POLICY, policy), (header::CACHE_CONTROL, "no-store")];
    (heads, cookie.map(|cookie| [(header::SET_COOKIE, cookie)]).map(AppendHeaders), Html(page))
}

async fn site(State(shared): State<Arc<Shared>>) -> Json<Value> {
    let site = shared.site.read().unwrap_or_else(PoisonError::into_inner).clone();
    Json(json!({
        "title": shared.watched.title, "fields_deg": looked_at::fields_deg(&site), "site": site,
        "recorded": shared.watched.recording.is_some(),
    }))
}

async fn events(State(shared): State<Arc<Shared>>, Extension(guest): Extension<Guest>) -> Response {
    let Some(place) = guest.stream() else { return full() };
    let stream = BroadcastStream::new(shared.events.subscribe()).map(move |event| {
        let _held = &place;
        Ok::<_, std::convert::Infallible>(match event {
            Ok((name, json)) => Sent::default().event(name).data(&*json),
            Err(BroadcastStreamRecvError::Lagged(missed)) => {
                Sent::default().event("missed").data(missed.to_string())
            }
        })
    });
    Sse::new(stream).keep_alive(KeepAlive::default()).into_response()
}

fn full() -> Response {
    (StatusCode::SERVICE_UNAVAILABLE, "as many streams as are allowed are open\n").into_response()
}

async fn health(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let newest = shared.newest.borrow().clone();
    // A recording or a plan has no frame that could be late.
    let is_still = shared.watched.recording.is_some() || shared.watched.planner.is_some();
    let stale = !is_still && shared.age(&newest).is_none_or(|age| age > STALE);
    let status = if stale { StatusCode::SERVICE_UNAVAILABLE } else { StatusCode::OK };
    let value = json!({
        "well": !stale,
        "age_ms": shared.age(&newest).map(|age| age.as_millis() as u64),
        "sensors": shared.watched.site.sensors.iter().zip(&newest.sensors)
            .map(|(sensor, &gave)| json!({ "name": sensor.name, "gave": gave })).collect::<Vec<_>>(),
        "frames_skipped": newest.frames_skipped,
        "health": newest.health,
        "recorder": shared.watched.counters.recorder(),
    });
    (status, Json(value))
}

async fn metrics_text(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let newest = shared.newest.borrow().clone();
    let text = metrics::text(&shared.watched, &newest, &shared.connections);
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4")], text)
}

impl Shared {
    /// How long ago it was published; none before the first frame.
    fn age(&self, published: &Published) -> Option<Duration> {
        let age_ns = self.watched.clock.now_ns() - published.published_ns;
        (published.published_ns > 0).then(|| Duration::from_nanos(age_ns.max(0) as u64))
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
#[cfg(test)]
#[path = "hostile_tests.rs"]
mod hostile_tests;
