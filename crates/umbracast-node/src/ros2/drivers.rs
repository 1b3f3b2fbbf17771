//! Reads what sensor drivers publish in ROS 2, without ROS: packets and clouds.

use std::sync::Arc;

use umbracast::Error;
use umbracast::lidar::Packet;
use umbracast_io::messages::{self, CLOUD, SCAN, SENSOR_PACKETS};
use umbracast_io::point_cloud::{self, PointCloud};

use super::topics::{Node, Subscriber};

/// Reads `velodyne_msgs/VelodyneScan` of a Velodyne's driver, usually `/velodyne_packets`, and
/// `umbracast_msgs/SensorPackets` of any other sensor, on the same topic. `each` gets every packet, or none for a message
/// that holds none.
///
/// # Errors
/// A session that is closed.
pub fn packets(
    node: &Node,
    topic: &str,
    each: impl Fn(Option<Packet>) + Send + Sync + 'static,
) -> Result<[Subscriber; 2], Error> {
    let each = Arc::new(each);
    let given = move |packets: Option<Vec<Packet>>| match packets {
        Some(packets) => packets.into_iter().for_each(|packet| each(Some(packet))),
        None => each(None),
    };
    let other = given.clone();
    Ok([
        node.subscriber(topic, &SCAN, move |cdr| given(messages::read_scan(cdr)))?,
        node.subscriber(topic, &SENSOR_PACKETS, move |cdr| other(messages::read_sensor_packets(cdr)))?,
    ])
}

/// Reads `sensor_msgs/PointCloud2` of any driver. `each` gets every cloud, or none for a message that is no cloud.
///
/// # Errors
/// A session that is closed.
pub fn clouds(
    node: &Node,
    topic: &str,
    each: impl Fn(Option<PointCloud>) + Send + Sync + 'static,
) -> Result<Subscriber, Error> {
    node.subscriber(topic, &CLOUD, move |cdr| each(point_cloud::read(cdr)))
}
