//! Connections: how many are allowed, how long they may be silent, and which is closed when there are too many.
//!
//! A connection that has not yet made a permitted request may be closed for a newer one, the oldest first. Silent
//! connections therefore cannot lock others out. A connection with a permitted request keeps its place. A client that
//! reads nothing is dropped and never waited for.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, Ipv6Addr};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::Sleep;

use super::tls::Tls;

/// A request's head and what is read ahead, bytes: ours have some hundreds.
const HEAD_BYTES: usize = 16 << 10;
/// What the system holds for a client that does not read: some frames, then it is noticed.
const SEND_BUFFER_BYTES: usize = 256 << 10;
/// Where no connection can be taken (no file descriptor is left), some end meanwhile.
const REST: Duration = Duration::from_millis(100);

/// What clients may do.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Connections at once.
    pub open: usize,
    /// Of them, of one address.
    pub open_of_address: usize,
    /// WebSockets and event streams at once.
    pub streams: usize,
    /// Of them, of one address.
    pub streams_of_address: usize,
    /// A request is whole so long after the connection, or after the answer before it.
    pub ask_within: Duration,
    /// Something of what is sent is taken within so long.
    pub take_within: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            open: 256,
            open_of_address: 128,
            streams: 64,
            streams_of_address: 32,
            ask_within: Duration::from_secs(10),
            take_within: Duration::from_secs(5),
        }
    }
}

/// Everybody who is connected.
#[derive(Debug)]
pub struct Connections {
    limits: Limits,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// By number, so that the oldest comes first.
    open: BTreeMap<u64, Open>,
    /// How many streams each address has.
    streams: BTreeMap<IpAddr, usize>,
    count: u64,
    refused: u64,
    /// Bytes of frames that streams have taken.
    streamed: u64,
}

#[derive(Debug)]
struct Open {
    from: IpAddr,
    let_in: bool,
    task: Option<AbortHandle>,
}

/// A connection, for whoever answers its requests. Its place is free again when the last of them is gone.
#[derive(Debug, Clone)]
pub struct Guest(Arc<Seat>);

#[derive(Debug)]
struct Seat {
    number: u64,
    from: IpAddr,
    connections: Arc<Connections>,
}

/// One of the streams that may be open; given back when it ends, however it ends.
#[derive(Debug)]
pub struct Stream(Guest);

impl Connections {
    /// Nobody yet.
    pub fn new(limits: Limits) -> Arc<Self> {
        Arc::new(Self { limits, state: Mutex::default() })
    }

    /// Open WebSockets and event streams.
    pub fn streams(&self) -> usize {
        self.lock().streams.values().sum()
    }

    /// Bytes of frames that all streams together have taken.
    pub fn streamed(&self) -> u64 {
        self.lock().streamed
    }

    /// Connections that were closed unheard because there were too many.
    pub fn refused(&self) -> u64 {
        self.lock().refused
    }

    /// A place for a new connection, of an older one where there is none; `None` where everybody else was let in.
    fn take(self: &Arc<Self>, from: IpAddr) -> Option<Guest> {
        let from = of_network(from);
        let mut state = self.lock();
        let of_address = state.open.values().filter(|open| open.from == from).count();
        let all = state.open.len();
        if of_address >= self.limits.open_of_address || all >= self.limits.open {
            state.refused += 1;
            let crowded = of_address >= self.limits.open_of_address;
            let goes = |open: &Open| !open.let_in && (!crowded || open.from == from);
            let oldest = state.open.iter().find(|(_, open)| goes(open)).map(|(&number, _)| number)?;
            if let Some(task) = state.open.remove(&oldest).and_then(|open| open.task) {
                task.abort();
            }
        }
        let number = state.count;
        state.count += 1;
        state.open.insert(number, Open { from, let_in: false, task: None });
        Some(Guest(Arc::new(Seat { number, from, connections: self.clone() })))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Guest {
    /// Where it is connected from.
    pub fn from(&self) -> IpAddr {
        self.0.from
    }

    /// It asked for what it may see: from now on it keeps its place.
    pub fn let_in(&self) {
        self.with(|open| open.let_in = true);
    }

    /// A stream for it, unless there are too many.
    pub fn stream(&self) -> Option<Stream> {
        let limits = self.0.connections.limits;
        let mut state = self.0.connections.lock();
        let all: usize = state.streams.values().sum();
        let own = state.streams.get(&self.0.from).copied().unwrap_or(0);
        if all >= limits.streams || own >= limits.streams_of_address {
            return None;
        }
        state.streams.insert(self.0.from, own + 1);
        Some(Stream(self.clone()))
    }

    fn with(&self, change: impl FnOnce(&mut Open)) {
        if let Some(open) = self.0.connections.lock().open.get_mut(&self.0.number) {
            change(open);
        }
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.connections.lock().open.remove(&self.number);
    }
}

impl Stream {
    /// It has taken so many bytes more.
    pub fn took(&self, bytes: usize) {
        self.0.0.connections.lock().streamed += bytes as u64;
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        let Seat { from, connections, .. } = &*self.0.0;
        let mut state = connections.lock();
        if let Some(own) = state.streams.get_mut(from) {
            *own -= 1;
            if *own == 0 {
                state.streams.remove(from);
            }
        }
    }
}

/// Whose connections are counted together: an IPv6 host has all addresses of its network.
fn of_network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) => Ipv6Addr::from_bits(v6.to_bits() >> 64 << 64).into(),
        v4 => v4,
    }
}

/// Takes connections for good.
pub async fn serve(listener: TcpListener, tls: Option<Tls>, router: Router, connections: Arc<Connections>) {
    loop {
        let Ok((stream, from)) = listener.accept().await else {
            tokio::time::sleep(REST).await;
            continue;
        };
        let Some(guest) = connections.take(from.ip()) else { continue };
        let _ = stream.set_nodelay(true); // Frames are small and late enough; without it they are only later.
        let _ = socket2::SockRef::from(&stream).set_send_buffer_size(SEND_BUFFER_BYTES); // Or the system's own.
        let task = tokio::spawn(greet(stream, tls.clone(), router.clone(), guest.clone()));
        guest.with(|open| open.task = Some(task.abort_handle()));
    }
}

/// Agrees on a cipher where that is asked for, then converses.
async fn greet(stream: TcpStream, tls: Option<Tls>, router: Router, guest: Guest) {
    let limits = guest.0.connections.limits;
    let stream = Patient { stream, take_within: limits.take_within, waiting: None };
    let Some(tls) = tls else { return converse(stream, router, guest).await };
    if let Ok(Some(stream)) = tokio::time::timeout(limits.ask_within, tls.accept(stream)).await {
        converse(stream, router, guest).await;
    }
}

/// One connection, from its first request to its end, or to the WebSocket that it becomes.
async fn converse<S>(stream: S, router: Router, guest: Guest)
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let limits = guest.0.connections.limits;
    let router = TowerToHyperService::new(router);
    let answer = service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(guest.clone());
        router.call(request)
    });
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.ask_within)
        .max_buf_size(HEAD_BYTES)
        .serve_connection(TokioIo::new(stream), answer)
        .with_upgrades();
    let _ = connection.await; // Whatever it was, it is over.
}

/// A connection that fails when its other end takes nothing for a while.
struct Patient<S> {
    stream: S,
    take_within: Duration,
    /// Runs while a write waits.
    waiting: Option<Pin<Box<Sleep>>>,
}

impl<S> Patient<S> {
    fn in_time<T>(&mut self, cx: &mut Context<'_>, polled: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if polled.is_ready() {
            self.waiting = None;
            return polled;
        }
        let take_within = self.take_within;
        let waiting = self.waiting.get_or_insert_with(|| Box::pin(tokio::time::sleep(take_within)));
        waiting.as_mut().poll(cx).map(|()| Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Patient<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        pin!(&mut self.stream).poll_read(cx, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Patient<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let polled = pin!(&mut self.stream).poll_write(cx, bytes);
        self.in_time(cx, polled)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = pin!(&mut self.stream).poll_flush(cx);
        self.in_time(cx, polled)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = pin!(&mut self.stream).poll_shutdown(cx);
        self.in_time(cx, polled)
    }
}
