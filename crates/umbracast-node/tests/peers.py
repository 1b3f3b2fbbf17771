"""Looks at a network with clients that know nothing of this project: `eclipse-zenoh`, `zenoh-ros2-sdk` and `rosbags`.

    python peers.py ENDPOINT DOMAIN MESSAGES FOLDER

Connects to a Zenoh endpoint (`tcp/127.0.0.1:7447`), lists the topics of a domain, reads every topic until it has had so many
messages, and decodes them with the definitions of FOLDER (`ros2/umbracast_msgs/msg`) and of ROS 2 Jazzy. Then publishes a cloud
and a scan of packets as a driver does, until the other side says that it has had enough. Prints JSON.
"""

import json
import pathlib
import struct
import subprocess
import sys
import threading
import time

import numpy
import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

endpoint, domain, messages, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), pathlib.Path(sys.argv[4])

VELODYNE = {
    "velodyne_msgs/msg/VelodynePacket": "builtin_interfaces/Time stamp\nuint8[1206] data\n",
    "velodyne_msgs/msg/VelodyneScan": "std_msgs/Header header\nVelodynePacket[] packets\n",
}
VISION = {
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections\n",
    "vision_msgs/msg/Detection3D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox3D bbox\nstring id\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
}

store = get_typestore(Stores.ROS2_JAZZY)
types = {}
for file in folder.glob("*.msg"):
    types.update(get_types_from_msg(file.read_text(), f"umbracast_msgs/msg/{file.stem}"))
for name, text in {**VELODYNE, **VISION}.items():
    if name not in store.types:
        types.update(get_types_from_msg(text, name))
store.register(types)


def type_name(dds):
    """package/msg/Type of package::msg::dds_::Type_."""
    package, _, _, kind = dds.split("::")
    return f"{package}/msg/{kind[:-1]}"


def rows(message):
    for name in ("detections", "tracks", "blockages", "losses", "bindings", "decisions", "transforms", "markers"):
        if hasattr(message, name):
            return len(getattr(message, name))
    return message.width * message.height if hasattr(message, "width") else None


config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)

# 1. Who is there, by liveliness alone.
tokens = [str(r.ok.key_expr) for r in session.liveliness().get(f"@ros2_lv/{domain}/**") if r.ok]
nodes = sorted(t.split("/")[8] for t in tokens if t.split("/")[5] == "NN")
publishers = {}
for token in (t.split("/") for t in tokens):
    if token[5] == "MP":
        publishers[token[9].replace("%", "/")] = (type_name(token[10]), token[11])

# 2. Every topic's messages, decoded; its type's hash as rosbags computes it.
found = {topic: {"type": kind, "hash": kept == store.hash_rihs01(kind), "messages": 0} for topic, (kind, kept) in publishers.items()}
enough = threading.Event()
lock = threading.Lock()


def heard(sample):
    _, *topic, dds, _ = str(sample.key_expr).split("/")
    topic, kind = "/" + "/".join(topic), type_name(dds)
    message = store.deserialize_cdr(sample.payload.to_bytes(), kind)
    attachment = sample.attachment.to_bytes()
    number, sent_ns, length = struct.unpack("<qqB", attachment[:17])
    with lock:
        of_topic = found[topic]
        of_topic["messages"] += 1
        of_topic["rows"] = rows(message)
        of_topic["attachment"] = [number, sent_ns, length, len(attachment)]
        if getattr(message, "tracks", None):
            of_topic["first"] = [int(message.tracks[0].track), message.tracks[0].x_m]
        if getattr(message, "blockages", None):
            of_topic["first"] = [message.blockages[0].access_point, message.blockages[0].p_w9]
        if all(t["messages"] >= messages for t in found.values()):
            enough.set()


subscribers = [session.declare_subscriber(f"{domain}/umbracast/**", heard), session.declare_subscriber(f"{domain}/tf/**", heard)]
warning = []


def warned(sample):
    message = store.deserialize_cdr(sample.payload.to_bytes(), "umbracast_msgs/msg/Warning")
    warning[:] = [str(sample.key_expr), message.state, message.p_w9]


subscribers.append(session.declare_subscriber("umbracast/*/warnings/*", warned))
complete = enough.wait(20)
until = time.monotonic() + 5
while not warning and time.monotonic() < until:
    time.sleep(0.05)

# 3. What a driver publishes: a cloud of two points and a scan of two packets.
header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](1700000000, 100000000), "lidar")
field = store.types["sensor_msgs/msg/PointField"]
cloud = store.types["sensor_msgs/msg/PointCloud2"](
    header=header, height=1, width=2, is_bigendian=False, point_step=16, row_step=32, is_dense=True,
    fields=[field(name, offset, 7, 1) for name, offset in (("x", 0), ("y", 4), ("z", 8), ("intensity", 12))],
    data=numpy.frombuffer(struct.pack("<8f", 1, 2, 3, 40, 5, 6, 7, 80), dtype=numpy.uint8),
)
packet = store.types["velodyne_msgs/msg/VelodynePacket"]
scan = store.types["velodyne_msgs/msg/VelodyneScan"](
    header=header, packets=[packet(header.stamp, numpy.full(1206, value, dtype=numpy.uint8)) for value in (7, 8)]
)
sent = []
for topic, kind, message in (
    ("lidar/points", "sensor_msgs/msg/PointCloud2", cloud),
    ("velodyne_packets", "velodyne_msgs/msg/VelodyneScan", scan),
):
    package, _, name = kind.split("/")
    key = f"{domain}/{topic}/{package}::msg::dds_::{name}_/{store.hash_rihs01(kind)}"
    sent.append((session.declare_publisher(key), bytes(store.serialize_cdr(message, kind))))
done = threading.Event()
over = session.declare_subscriber("test/done", lambda _: done.set())
until = time.monotonic() + 20
while not done.is_set() and time.monotonic() < until:
    for publisher, cdr in sent:
        publisher.put(cdr, attachment=struct.pack("<qqB", 1, time.time_ns(), 16) + bytes(16))
    done.wait(0.1)
session.close()

# 4. The same topics by a client made for ROS 2 over Zenoh.
listed = subprocess.run(
    [sys.executable, "-m", "zenoh_ros2_sdk.cli", "--router", endpoint.split("/")[1], "--domain-id", str(domain),
     "--timeout", "2", "--no-daemon", "topic", "list", "-t"],
    capture_output=True, text=True, timeout=60, check=True,
).stdout.split("\n")

print(json.dumps({"nodes": nodes, "topics": found, "complete": complete, "warning": warning, "answered": done.is_set(), "listed": [line for line in listed if line]}))
