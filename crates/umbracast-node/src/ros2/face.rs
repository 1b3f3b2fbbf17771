//! A hall as ROS 2 sees it: the topics of a recording, sent with each frame.

use umbracast::{Error, Site};
use umbracast_io::messages::CLOUD;
use umbracast_io::results::{Results, TOPICS};
use umbracast_io::viewers::FOREGROUND_TOPIC;
use zenoh::Session;

use super::topics::{Node, Publisher};

/// Sends the topics of one hall.
pub struct Face {
    site: Site,
    /// In the order of [`TOPICS`], the foreground's last.
    publishers: Vec<Publisher>,
    _node: Node,
}

impl Face {
    /// Makes the node `umbracast` and its topics; `namespace` is `/hall` where halls share a domain, else empty.
    ///
    /// # Errors
    /// A session that is closed.
    pub fn new(session: &Session, domain: u32, namespace: &str, site: &Site) -> Result<Self, Error> {
        let node = Node::new(session, domain, namespace, "umbracast")?;
        let every = TOPICS.iter().map(|(topic, schema)| node.publisher(topic, &schema()));
        let publishers = every.chain([node.publisher(FOREGROUND_TOPIC, &CLOUD)]).collect::<Result<_, _>>()?;
        Ok(Self { site: site.clone(), publishers, _node: node })
    }

    /// Another site with the same sensors from the next frame on.
    pub fn take_over(&mut self, site: &Site) {
        self.site = site.clone();
    }

    /// Sends a frame.
    ///
    /// # Errors
    /// A session that is closed.
    pub fn publish(&mut self, results: &Results) -> Result<(), Error> {
        let messages = results.messages(&self.site);
        for (publisher, message) in self.publishers.iter_mut().zip(messages) {
            publisher.publish(results.logged_ns, message.bytes)?;
        }
        Ok(())
    }
}
