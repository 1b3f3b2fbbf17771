"""Reads a recording with two libraries that know nothing of this project, and says what each found.

    python peers.py RECORDING

Prints JSON: for each library, for each topic, the messages read and a few values of the last one.
"""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


def values(message):
    """What a test can compare: how many rows, and the first row's first numbers."""
    for name in ("tracks", "blockages", "detections", "packets", "transforms"):
        rows = getattr(message, name, None)
        if rows is not None:
            first = rows[0] if len(rows) else None
            numbers = {key: getattr(first, key) for key in ("track", "x_m", "y_m", "p_w9", "points") if hasattr(first, key)}
            return {"rows": len(rows), "first": numbers}
    return {}


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


def main():
    path = Path(sys.argv[1])
    print(json.dumps({"rosbags": of_rosbags(path), "mcap-ros2-support": of_mcap_ros2(path)}))


if __name__ == "__main__":
    main()
