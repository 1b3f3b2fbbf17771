"""`rosbags`, the reader of recordings in Python, and NumPy, which takes the fields of a message as a table's columns."""

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from exchange import FOLDER, answer_columns

# `sensor_msgs/PointField` numbers its types from 1.
TYPES = ["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"]


def columns():
    store = get_typestore(Stores.ROS2_HUMBLE)
    parts = []
    with AnyReader([FOLDER / "clouds.mcap"], default_typestore=store) as reader:
        clouds = [connection for connection in reader.connections if connection.msgtype == "sensor_msgs/msg/PointCloud2"]
        for connection, _, raw in reader.messages(connections=clouds):
            cloud = reader.deserialize(raw, connection.msgtype)
            order = ">" if cloud.is_bigendian else "<"
            layout = np.dtype(
                {
                    "names": [field.name for field in cloud.fields],
                    "formats": [order + TYPES[field.datatype - 1] for field in cloud.fields],
                    "offsets": [field.offset for field in cloud.fields],
                    "itemsize": cloud.point_step,
                }
            )
            points = cloud.data.view(layout)
            x, y, z = points["x"], points["y"], points["z"]
            there = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
            stamp_ns = cloud.header.stamp.sec * 1_000_000_000 + cloud.header.stamp.nanosec
            parts.append((x[there], y[there], z[there], stamp_ns + points["t"][there].astype(np.int64)))
    return [np.concatenate(column) for column in zip(*parts)]


answer_columns("clouds", columns)
