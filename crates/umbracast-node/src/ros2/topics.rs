//! Nodes, publishers and subscribers that `ros2 node list` and `ros2 topic list` show.

use std::sync::atomic::{AtomicU32, Ordering};

use umbracast::Error;
use umbracast_io::messages::Schema;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::names::{self, Kind, NodeName, TopicName};
use super::type_hash;

/// A node. What it publishes and reads goes over its session.
pub struct Node {
    session: Session,
    name: NodeName,
    _token: LivelinessToken,
}

/// Sends one topic.
pub struct Publisher {
    publisher: zenoh::pubsub::Publisher<'static>,
    _token: LivelinessToken,
    sender: [u8; 16],
    /// Of the next message.
    number: i64,
}

/// Reads one topic until it is dropped.
pub struct Subscriber {
    _subscriber: zenoh::pubsub::Subscriber<()>,
    _token: LivelinessToken,
}

/// Numbers of nodes, publishers and subscribers: one row for the whole process, as every session of it may have several.
static NEXT: AtomicU32 = AtomicU32::new(0);

impl Node {
    /// A node of a domain; every topic lies in `namespace`, `/hall` or empty.
    ///
    /// # Errors
    /// A session that is closed.
    pub fn new(session: &Session, domain: u32, namespace: &str, name: &str) -> Result<Self, Error> {
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let (namespace, name) = (namespace.to_owned(), name.to_owned());
        let name = NodeName { domain, namespace, name, session: session.zid().to_string(), id };
        let token = token(session, &names::node_token(&name))?;
        Ok(Self { session: session.clone(), name, _token: token })
    }

    fn topic(&self, topic: &str, schema: &Schema) -> Result<TopicName, Error> {
        Ok(TopicName {
            topic: format!("{}{topic}", self.name.namespace),
            dds_type: names::dds_type(&schema.name),
            hash: type_hash(schema)?,
        })
    }

    /// Sends a topic, `/umbracast/tracks`. A reader that is too slow loses messages and delays nobody.
    ///
    /// # Errors
    /// A type that is not defined, a session that is closed.
    pub fn publisher(&self, topic: &str, schema: &Schema) -> Result<Publisher, Error> {
        let topic = self.topic(topic, schema)?;
        let key = names::topic_key(self.name.domain, &topic);
        let publisher =
            self.session.declare_publisher(key).congestion_control(CongestionControl::Drop).wait();
        let publisher = publisher.map_err(|e| Error::new(e.to_string()).within(&topic.topic))?;
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = names::topic_token(&self.name, id, Kind::Publisher, &topic);
        let (sender, token) = (names::sender(&name), token(&self.session, &name)?);
        Ok(Publisher { publisher, _token: token, sender, number: 1 })
    }

    /// Reads a topic: `each` is called with every message's CDR, on a thread of the session. Any hash of the type is taken:
    /// what reads the bytes checks them.
    ///
    /// # Errors
    /// A type that is not defined, a session that is closed.
    pub fn subscriber(
        &self,
        topic: &str,
        schema: &Schema,
        each: impl Fn(&[u8]) + Send + Sync + 'static,
    ) -> Result<Subscriber, Error> {
        let topic = self.topic(topic, schema)?;
        let key = names::any_hash_key(self.name.domain, &topic);
        let subscriber = self.session.declare_subscriber(key);
        let subscriber = subscriber.callback(move |sample| each(&sample.payload().to_bytes())).wait();
        let subscriber = subscriber.map_err(|e| Error::new(e.to_string()).within(&topic.topic))?;
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let token = token(&self.session, &names::topic_token(&self.name, id, Kind::Subscriber, &topic))?;
        Ok(Subscriber { _subscriber: subscriber, _token: token })
    }
}

impl Publisher {
    /// Sends a message. `time_ns` is when, in the host's time.
    ///
    /// # Errors
    /// A session that is closed.
    pub fn publish(&mut self, time_ns: i64, cdr: Vec<u8>) -> Result<(), Error> {
        let attachment = names::attachment(self.number, time_ns, &self.sender);
        self.number += 1;
        self.publisher.put(cdr).attachment(attachment).wait().map_err(|e| Error::new(e.to_string()))
    }
}

fn token(session: &Session, key: &str) -> Result<LivelinessToken, Error> {
    session.liveliness().declare_token(key).wait().map_err(|e| Error::new(e.to_string()).within(key))
}
