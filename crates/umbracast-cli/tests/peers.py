"""Reads a recording with two libraries that know nothing of this project, and says what each found.

    python peers.py RECORDING

Prints JSON: for each library, for each topic, the messages read and a few values of the last one; and the types whose
definition in the recording is not that of ROS 2 Jazzy.
"""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DELETEALL = 3


def values(message):
    """What a test can compare: how many rows, and the first row's first numbers."""
    if hasattr(message, "markers"):
        return {"drawn": drawn(message.markers)}
    if hasattr(message, "height"):
        return {"rows": message.width * message.height}
    for name in ("tracks", "blockages", "detections", "packets", "transforms"):
        rows = getattr(message, name, None)
        if rows is not None:
            first = rows[0] if len(rows) else None
            numbers = {key: getattr(first, key) for key in ("track", "x_m", "y_m", "p_w9", "points") if hasattr(first, key)}
            if hasattr(first, "bbox"):
                position = first.results[0].pose.pose.position
                numbers = {"id": first.id, "x_m": position.x, "y_m": position.y}
            found = {"rows": len(rows), "first": numbers}
            if hasattr(message, "header"):
                stamp = message.header.stamp
                found["time_ns"] = stamp.sec * 1_000_000_000 + stamp.nanosec
            return found
    return {}


def drawn(markers):
    """How many things of each namespace; of lists how many ends."""
    found = {"deleted first": int(markers[0].action == DELETEALL)}
    for marker in markers[1:]:
        many = max(1, len(marker.points)) if marker.type in (5, 7) else 1
        found[marker.ns] = found.get(marker.ns, 0) + many
        if len(marker.colors) not in (0, len(marker.points)):
            raise ValueError(f"{marker.ns}: {len(marker.colors)} colours of {len(marker.points)} points")
    return found


def of_rosbags(path):
    found = {}
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            topic = found.setdefault(connection.topic, {"messages": 0})
            topic["messages"] += 1
            topic["last"] = values(message)
    return found


def of_mcap_ros2(path):
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            topic = found.setdefault(channel.topic, {"messages": 0})
            topic["messages"] += 1
            topic["last"] = values(message)
    return found


def not_of_ros2(path):
    """By the hash that ROS 2 tells types by. `vision_msgs` is no part of ROS 2 itself: the hash is of its own definitions."""
    jazzy = get_typestore(Stores.ROS2_JAZZY)
    with open(path, "rb") as file:
        schemas = make_reader(file).get_summary().schemas.values()
    other = []
    for schema in schemas:
        own = get_typestore(Stores.EMPTY)
        own.register(get_types_from_msg(schema.data.decode(), schema.name))
        known = {name for name in own.fielddefs if name in jazzy.fielddefs}
        constants = {name for name in known if set(own.fielddefs[name][0]) != set(jazzy.fielddefs[name][0])}
        other += [name for name in known if own.hash_rihs01(name) != jazzy.hash_rihs01(name) or name in constants]
    return sorted(set(other))


def main():
    path = Path(sys.argv[1])
    found = {"rosbags": of_rosbags(path), "mcap-ros2-support": of_mcap_ros2(path)}
    print(json.dumps(found | {"types that are not those of ROS 2": not_of_ros2(path)}))


if __name__ == "__main__":
    main()
