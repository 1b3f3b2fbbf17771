"""Makes the files of this folder with libraries that know nothing of this project.

    pip install rosbags==0.11.9 mcap==1.6.0 polars && python make.py

clouds.db3       rosbag2's SQLite storage, by rosbags
clouds.mcap      the same messages in chunks that are compressed with zstd, by mcap
../tables/matches.parquet   three rows, as polars writes them: with zstd
"""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import polars as pl
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(__file__).parent
SCAN = "std_msgs/Header header\nvelodyne_msgs/VelodynePacket[] packets\n"
PACKET = "builtin_interfaces/Time stamp\nuint8[1206] data\n"
START_NS = 1_700_000_000_000_000_000

store = get_typestore(Stores.ROS2_JAZZY)
store.register(get_types_from_msg(PACKET, "velodyne_msgs/msg/VelodynePacket"))
store.register(get_types_from_msg(SCAN, "velodyne_msgs/msg/VelodyneScan"))
T = store.types


def stamp(time_ns):
    return T["builtin_interfaces/msg/Time"](time_ns // 1_000_000_000, time_ns % 1_000_000_000)


def cloud(k):
    """Forty points on a circle of k + 1 metres, one of them without a return."""
    kind = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4")])
    points = np.zeros(40, kind)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    points["x"], points["y"], points["z"] = (k + 1) * np.cos(angle), (k + 1) * np.sin(angle), 0.5
    points["t"] = np.arange(40) * 1_000_000
    points["x"][7] = np.nan
    field = T["sensor_msgs/msg/PointField"]
    fields = [field("x", 0, 7, 1), field("y", 4, 7, 1), field("z", 8, 7, 1), field("t", 12, 6, 1)]
    header = T["std_msgs/msg/Header"](stamp(START_NS + k * 100_000_000), "lidar")
    data = points.view(np.uint8)
    return T["sensor_msgs/msg/PointCloud2"](header, 1, 40, fields, False, 16, 640, data, False)


def scan(k):
    """Two packets, filled with k."""
    time_ns = START_NS + k * 100_000_000
    packet = T["velodyne_msgs/msg/VelodynePacket"](stamp(time_ns), np.full(1206, k, np.uint8))
    header = T["std_msgs/msg/Header"](stamp(time_ns), "lidar_east")
    return T["velodyne_msgs/msg/VelodyneScan"](header, [packet, packet])


def messages():
    for k in range(3):
        yield "/lidar/points", cloud(k), START_NS + k * 100_000_000
        yield "/lidar_east/packets", scan(k), START_NS + k * 100_000_000 + 1


def make_db3():
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "clouds"
        with Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
            connections = {}
            for topic, message, time_ns in messages():
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
                data = store.serialize_cdr(message, message.__msgtype__)
                writer.write(connections[topic], time_ns, data)
        shutil.copy(next(bag.glob("*.db3")), HERE / "clouds.db3")


def make_mcap():
    with open(HERE / "clouds.mcap", "wb") as file:
        writer = McapWriter(file, compression=CompressionType.ZSTD)
        writer.start("ros2", "mcap")
        channels = {}
        for topic, message, time_ns in messages():
            kind = message.__msgtype__
            if topic not in channels:
                text = store.generate_msgdef(kind, ros_version=2)[0].encode()
                channels[topic] = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text))
            writer.add_message(channels[topic], time_ns, bytes(store.serialize_cdr(message, kind)), time_ns)
        writer.finish()


def make_table():
    whole = {"scene": pl.UInt32, "frame": pl.UInt64, "time_ns": pl.Int64, "person": pl.UInt32, "track": pl.UInt64}
    rows = [(0, 7, 800_000_000, 1, 3), (0, 7, 800_000_000, 2, 4), (1, 0, 100_000_000, 0, 0)]
    (HERE / "../tables").mkdir(exist_ok=True)
    pl.DataFrame(rows, schema=whole, orient="row").write_parquet(HERE / "../tables/matches.parquet")


make_db3()
make_mcap()
make_table()
