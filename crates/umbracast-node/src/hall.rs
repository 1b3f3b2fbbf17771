//! A node's connection to its hall: what it publishes with which priority, what it receives, and which nodes are
//! there.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use umbracast::Error;
use umbracast_io::fields::{self, Message};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Queryable};
use zenoh::sample::SampleKind;

use crate::keys::Keys;
use crate::role::Role;

/// How much a message matters beside the others, and what becomes of it where the wire is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Urgency {
    /// Warnings: before all else, never given up while the wire holds.
    Warning,
    /// Small results of each frame. Where the wire is full the next frame's are worth more: given up, as all below.
    Result,
    /// What the next stage waits for.
    Stage,
    /// Points.
    Points,
    /// What can wait.
    Rest,
}

/// One node among those of its hall. A clone is the same node.
#[derive(Debug, Clone)]
pub struct Hall {
    session: zenoh::Session,
    keys: Keys,
    traffic: Arc<Traffic>,
}

/// What was published.
#[derive(Debug, Default)]
pub struct Traffic {
    /// Messages.
    pub messages: AtomicU64,
    /// Their bytes.
    pub bytes: AtomicU64,
}

/// Where messages of one key leave.
#[derive(Debug)]
pub struct Outlet {
    publisher: Publisher<'static>,
    traffic: Arc<Traffic>,
}

impl Hall {
    /// Of an open session.
    pub fn new(session: zenoh::Session, keys: Keys) -> Self {
        Self { session, keys, traffic: Arc::default() }
    }

    /// The hall's keys.
    pub fn keys(&self) -> &Keys {
        &self.keys
    }

    /// The session, for what speaks other formats.
    pub fn session(&self) -> &zenoh::Session {
        &self.session
    }

    /// What was published so far: messages and bytes.
    pub fn published(&self) -> (u64, u64) {
        let Traffic { messages, bytes } = &*self.traffic;
        (messages.load(Ordering::Relaxed), bytes.load(Ordering::Relaxed))
    }

    /// The name of this node: no other has it.
    pub fn id(&self) -> String {
        self.session.zid().to_string()
    }

    /// A place for messages of one key.
    ///
    /// # Errors
    /// A key that is none.
    pub fn outlet(&self, key: &str, urgency: Urgency) -> Result<Outlet, Error> {
        let (priority, congestion, express) = match urgency {
            Urgency::Warning => (Priority::RealTime, CongestionControl::Block, true),
            Urgency::Result => (Priority::InteractiveHigh, CongestionControl::Drop, true),
            Urgency::Stage => (Priority::InteractiveLow, CongestionControl::Drop, true),
            Urgency::Points => (Priority::Data, CongestionControl::Drop, true),
            Urgency::Rest => (Priority::DataLow, CongestionControl::Drop, false),
        };
        let declared = self.session.declare_publisher(key.to_owned());
        let declared = declared.priority(priority).congestion_control(congestion).express(express);
        let publisher = declared.wait().map_err(|e| said(key, e))?;
        Ok(Outlet { publisher, traffic: self.traffic.clone() })
    }

    /// Hears what is published on a key, or on all that match it, as long as what is returned lives.
    ///
    /// # Errors
    /// A key that is none.
    pub fn hear(
        &self,
        key: &str,
        hear: impl Fn(&str, &ZBytes) + Send + Sync + 'static,
    ) -> Result<Subscriber<()>, Error> {
        let heard = move |sample: zenoh::sample::Sample| {
            if sample.kind() == SampleKind::Put {
                hear(sample.key_expr().as_str(), sample.payload());
            }
        };
        let declared = self.session.declare_subscriber(key.to_owned()).callback(heard);
        declared.wait().map_err(|e| said(key, e))
    }

    /// Hears rows of a leader ([`Outlet::put_rows`]), with its term.
    ///
    /// # Errors
    /// A key that is none.
    pub fn hear_rows(
        &self,
        key: &str,
        hear: impl Fn(u64, &ZBytes) + Send + Sync + 'static,
    ) -> Result<Subscriber<()>, Error> {
        let heard = move |sample: zenoh::sample::Sample| {
            if sample.kind() == SampleKind::Put {
                let term = sample.attachment().and_then(|term| term.to_bytes().as_ref().try_into().ok());
                hear(term.map_or(0, u64::from_le_bytes), sample.payload());
            }
        };
        let declared = self.session.declare_subscriber(key.to_owned()).callback(heard);
        declared.wait().map_err(|e| said(key, e))
    }

    /// Answers who asks for a key, as long as what is returned lives.
    ///
    /// # Errors
    /// A key that is none.
    pub fn answer(
        &self,
        key: &str,
        answer: impl Fn(Query) + Send + Sync + 'static,
    ) -> Result<Queryable<()>, Error> {
        let declared = self.session.declare_queryable(key.to_owned()).callback(answer);
        declared.wait().map_err(|e| said(key, e))
    }

    /// Asks all who can answer; what came until then, or until all have answered.
    pub fn ask(&self, key: &str, wait: Duration) -> Vec<(String, Vec<u8>)> {
        let asked = self.session.get(key).target(QueryTarget::All);
        let asked = asked.consolidation(ConsolidationMode::None).timeout(wait).wait();
        let Ok(replies) = asked else { return Vec::new() };
        let reply = |reply: zenoh::query::Reply| {
            let sample = reply.into_result().ok()?;
            Some((sample.key_expr().to_string(), sample.payload().to_bytes().into_owned()))
        };
        replies.into_iter().filter_map(reply).collect()
    }

    /// Tells that a node of this role is here, as long as what is returned lives. `name` may say more.
    ///
    /// # Errors
    /// A name that is no chunk of a key.
    pub fn show(&self, role: Role, name: Option<&str>) -> Result<LivelinessToken, Error> {
        let key = self.keys.node(role, &name.map_or(self.id(), |name| format!("{name}.{}", self.id())));
        self.session.liveliness().declare_token(key.clone()).wait().map_err(|e| said(&key, e))
    }

    /// Hears who comes (true) and who goes (false), those who are there first.
    ///
    /// # Errors
    /// A key that is none.
    pub fn watch_nodes(
        &self,
        role: Role,
        seen: impl Fn(&str, bool) + Send + Sync + 'static,
    ) -> Result<Subscriber<()>, Error> {
        let key = self.keys.node(role, "*");
        let heard = move |sample: zenoh::sample::Sample| {
            let id = sample.key_expr().as_str().rsplit('/').next().unwrap_or_default();
            seen(id, sample.kind() == SampleKind::Put);
        };
        let declared = self.session.liveliness().declare_subscriber(key.clone());
        declared.history(true).callback(heard).wait().map_err(|e| said(&key, e))
    }

    /// Who of a role is there.
    pub fn nodes(&self, role: Role, wait: Duration) -> Vec<String> {
        let asked = self.session.liveliness().get(self.keys.node(role, "*")).timeout(wait).wait();
        let Ok(replies) = asked else { return Vec::new() };
        let id = |reply: zenoh::query::Reply| {
            let sample = reply.into_result().ok()?;
            sample.key_expr().as_str().rsplit('/').next().map(str::to_owned)
        };
        replies.into_iter().filter_map(id).collect()
    }
}

impl Outlet {
    /// Publishes a message. What the wire does not take is lost: the next frame is worth more.
    pub fn put<M: Message>(&self, message: &mut M) {
        self.put_bytes(fields::encode(message));
    }

    /// Publishes rows, which are the bytes of recordings. The term of the tracker that led is attached: eight bytes, the lowest
    /// first.
    pub fn put_rows(&self, term: u64, rows: Vec<u8>) {
        self.count(&rows);
        // An error is a session that was closed.
        let _ = self.publisher.put(rows).attachment(term.to_le_bytes()).wait();
    }

    /// Whether anybody listens; true where that cannot be known.
    pub fn is_heard(&self) -> bool {
        self.publisher.matching_status().wait().map_or(true, |status| status.matching())
    }

    /// Publishes bytes.
    pub fn put_bytes(&self, bytes: Vec<u8>) {
        self.count(&bytes);
        // An error is a session that was closed.
        let _ = self.publisher.put(bytes).wait();
    }

    fn count(&self, bytes: &[u8]) {
        self.traffic.messages.fetch_add(1, Ordering::Relaxed);
        self.traffic.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
    }
}

fn said(key: &str, error: zenoh::Error) -> Error {
    Error::new(error.to_string()).within(key)
}
