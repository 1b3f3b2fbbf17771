//! Names as `rmw_zenoh` writes them: keys, liveliness tokens, and what goes with a message.

use sha2::{Digest, Sha256};
use umbracast::Error;

/// Reliable, volatile, the last ten; everything else as `rmw_zenoh` takes it by itself.
const QUALITY: &str = "::,10:,:,:,,";

/// What a node, a publisher or a subscriber is in the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Somebody who sends a topic.
    Publisher,
    /// Somebody who reads one.
    Subscriber,
}

/// A node in the graph of ROS 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeName {
    /// `ROS_DOMAIN_ID`.
    pub domain: u32,
    /// In front of every topic, `/hall`; empty for none.
    pub namespace: String,
    /// As `ros2 node list` shows it behind the namespace.
    pub name: String,
    /// The Zenoh session's.
    pub session: String,
    /// A number that no other node of the session has.
    pub id: u32,
}

/// A topic of one type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicName {
    /// With the namespace, `/hall/umbracast/tracks`.
    pub topic: String,
    /// As DDS writes it, see [`dds_type`].
    pub dds_type: String,
    /// See [`super::type_hash()`].
    pub hash: String,
}

/// The key of a topic's messages.
pub fn topic_key(domain: u32, topic: &TopicName) -> String {
    let TopicName { topic, dds_type, hash } = topic;
    format!("{domain}/{}/{dds_type}/{hash}", topic.trim_matches('/'))
}

/// The same whatever the hash, for those who read: Humble has none.
pub fn any_hash_key(domain: u32, topic: &TopicName) -> String {
    topic_key(domain, &TopicName { hash: "*".to_owned(), ..topic.clone() })
}

/// `package::msg::dds_::Type_` of `package/msg/Type`.
pub fn dds_type(name: &str) -> String {
    let mut parts = name.split('/');
    let (package, kind) = (parts.next().unwrap_or_default(), parts.next_back().unwrap_or_default());
    format!("{package}::msg::dds_::{kind}_")
}

/// What says that a node is there.
pub fn node_token(node: &NodeName) -> String {
    let NodeName { domain, session, id, .. } = node;
    format!("@ros2_lv/{domain}/{session}/{id}/{id}/NN/{}", place(node))
}

/// What says that a publisher or a subscriber is there. `id` is a number that nobody else of the session has.
pub fn topic_token(node: &NodeName, id: u32, kind: Kind, topic: &TopicName) -> String {
    let NodeName { domain, session, id: node_id, .. } = node;
    let TopicName { topic, dds_type, hash } = topic;
    let kind = match kind {
        Kind::Publisher => "MP",
        Kind::Subscriber => "MS",
    };
    let topic = mangled(topic);
    format!(
        "@ros2_lv/{domain}/{session}/{node_id}/{id}/{kind}/{}/{topic}/{dds_type}/{hash}/{QUALITY}",
        place(node)
    )
}

/// Sixteen bytes that nobody else has: `rmw_zenoh` takes them from the token too, by another hash.
pub fn sender(token: &str) -> [u8; 16] {
    std::array::from_fn({
        let digest = Sha256::digest(token.as_bytes());
        move |k| digest[k]
    })
}

/// What goes with a message: its number from 1 up, when it was sent, who sent it.
pub fn attachment(number: i64, time_ns: i64, sender: &[u8; 16]) -> [u8; 33] {
    let mut bytes = [0; 33];
    bytes[..8].copy_from_slice(&number.to_le_bytes());
    bytes[8..16].copy_from_slice(&time_ns.to_le_bytes());
    bytes[16] = sender.len() as u8;
    bytes[17..].copy_from_slice(sender);
    bytes
}

/// Takes a hall's name as a namespace.
///
/// # Errors
/// A name that ROS 2 cannot write.
pub fn namespace(hall: &str) -> Result<String, Error> {
    let first = hall.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if first && hall.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && !hall.contains("__") {
        return Ok(format!("/{hall}"));
    }
    Err(Error::new(format!(
        "expected a name that ROS 2 can write (letters, digits and single _, not beginning with a digit), found {hall:?}"
    )))
}

/// Enclave, namespace and name of a node.
fn place(node: &NodeName) -> String {
    let namespace = if node.namespace.is_empty() { "%".to_owned() } else { mangled(&node.namespace) };
    format!("%/{namespace}/{}", mangled(&node.name))
}

fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(namespace: &str) -> NodeName {
        let (name, session) = ("umbracast".to_owned(), "abc".to_owned());
        NodeName { domain: 7, namespace: namespace.to_owned(), name, session, id: 1 }
    }

    fn topic() -> TopicName {
        TopicName {
            topic: "/hall/umbracast/tracks".to_owned(),
            dds_type: dds_type("umbracast_msgs/msg/Tracks"),
            hash: "RIHS01_00".to_owned(),
        }
    }

    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        assert_eq!(
            topic_key(7, &topic()),
            "7/hall/umbracast/tracks/umbracast_msgs::msg::dds_::Tracks_/RIHS01_00"
        );
        assert_eq!(any_hash_key(7, &topic()), "7/hall/umbracast/tracks/umbracast_msgs::msg::dds_::Tracks_/*");
        assert_eq!(node_token(&node("")), "@ros2_lv/7/abc/1/1/NN/%/%/umbracast");
        assert_eq!(
            topic_token(&node("/hall"), 4, Kind::Publisher, &topic()),
            "@ros2_lv/7/abc/1/4/MP/%/%hall/umbracast/%hall%umbracast%tracks/\
             umbracast_msgs::msg::dds_::Tracks_/RIHS01_00/::,10:,:,:,,"
        );
    }

    #[test]
    fn an_attachment_holds_number_time_and_sender() {
        let bytes = attachment(3, 5, &[9; 16]);
        assert_eq!((bytes[0], bytes[8], bytes[16]), (3, 5, 16));
        assert_eq!(bytes[17..], [9; 16]);
        assert_ne!(sender("one"), sender("other"));
    }

    #[test]
    fn a_hall_that_ros_cannot_name_is_refused() {
        assert_eq!(namespace("hall_3").unwrap(), "/hall_3");
        for wrong in ["", "3rd", "a b", "a-b", "a__b", "a/b", "größe"] {
            assert!(namespace(wrong).is_err(), "{wrong}");
        }
    }
}
