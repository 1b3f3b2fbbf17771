"""`rosbags` reads the messages of a recording, and `velodyne-decoder`, which is compiled, the packets in them."""

import numpy as np
import velodyne_decoder
from rosbags.highlevel import AnyReader

from exchange import FOLDER, answer_columns, read

nearest, farthest = read("range")


def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def columns():
    model = velodyne_decoder.Model.HDL32E
    config = velodyne_decoder.Config(model=model, min_range=nearest, max_range=farthest)
    decoders, parts = {}, []
    # The recording says itself what its messages look like.
    with AnyReader([FOLDER / "packets.mcap"]) as reader:
        scans = [connection for connection in reader.connections if connection.msgtype == "velodyne_msgs/msg/VelodyneScan"]
        for connection, _, raw in reader.messages(connections=scans):
            scan = reader.deserialize(raw, connection.msgtype)
            decoder = decoders.setdefault(connection.topic, velodyne_decoder.ScanDecoder(config))
            # Its reader of messages wants stamps of ROS 1. A list crosses into the decoder four times as fast as an array.
            packets = [velodyne_decoder.VelodynePacket(seconds(packet.stamp), packet.data.tolist()) for packet in scan.packets]
            end, points = decoder.decode(velodyne_decoder.PacketVector(packets), as_pcl_structs=True)
            # A sensor tells the time since the last full hour, and the recording begins with one.
            time_ns = round(1e9 * end.device) + (1e9 * points["time"]).astype(np.int64)
            parts.append((points["x"], points["y"], points["z"], time_ns))
    return [np.concatenate(column) for column in zip(*parts)]


answer_columns("packets", columns)
