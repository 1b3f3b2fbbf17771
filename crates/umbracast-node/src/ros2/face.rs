//! A hall as ROS 2 sees it: the topics of a recording, sent with each frame.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use umbracast::{Error, Site};
use umbracast_io::messages::CLOUD;
use umbracast_io::results::{Results, topics};
use umbracast_io::viewers::FOREGROUND_TOPIC;
use zenoh::Session;

use super::topics::{Node, Publisher};

/// Sends the topics of one hall.
pub struct Face {
    site: Site,
    /// By topic: those of the site, and the foreground's.
    publishers: BTreeMap<&'static str, Publisher>,
    node: Node,
}

impl Face {
    /// Makes the node `umbracast` and its topics; `namespace` is `/hall` where halls share a domain, else empty.
    ///
    /// # Errors
    /// A session that is closed.
    pub fn new(session: &Session, domain: u32, namespace: &str, site: &Site) -> Result<Self, Error> {
        let node = Node::new(session, domain, namespace, "umbracast")?;
        let foreground = node.publisher(FOREGROUND_TOPIC, &CLOUD)?;
        let mut publishers = BTreeMap::from([(FOREGROUND_TOPIC, foreground)]);
        for (topic, schema) in topics(site) {
            publishers.insert(topic, node.publisher(topic, &schema())?);
        }
        Ok(Self { site: site.clone(), publishers, node })
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
        for message in messages {
            // A site that was taken over may have topics that the one before had not.
            let publisher = match self.publishers.entry(message.topic) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => {
                    place.insert(self.node.publisher(message.topic, &(message.schema)())?)
                }
            };
            publisher.publish(results.logged_ns, message.bytes)?;
        }
        Ok(())
    }
}
