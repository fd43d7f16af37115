"""One number of a ROS 2 JointState recording: torqcomp compared with the Python `mcap` reader with ROS 2
decoding, on the same file, one after the other, in user plus system time on one core. Each compression is run in
several rounds, each with the reader once and then torqcomp several times; prints medians, and the smallest and largest
ratio.

Usage: python mcap_reader.py path/to/torqcomp [messages]
Needs the packages mcap and mcap-ros2-support.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

DEFINITION = (
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort\n" + "=" * 80 + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n"
    "string frame_id\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JOINTS = 6
ROUNDS = 3
RUNS = 5


def make(path, compression, messages):
    names = [f"joint_{joint}_motor" for joint in range(JOINTS)]
    with open(path, "wb") as out:
        writer = Writer(out, compression=compression)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", DEFINITION)
        for place in range(messages):
            stamp = 1_700_000_000_000_000_000 + place * 1_000_000
            numbers = [place * 0.1 + joint for joint in range(JOINTS)]
            message = {
                "header": {
                    "stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9},
                    "frame_id": "base_link",
                },
                "name": names,
                "position": numbers,
                "velocity": numbers,
                "effort": numbers,
            }
            writer.write_message("/joint_states", schema, message, stamp, stamp, place)
        writer.finish()


def python_seconds(path):
    start = time.process_time()
    total = 0.0
    with open(path, "rb") as source:
        reader = make_reader(source, decoder_factories=[DecoderFactory()])
        for _, _, _, message in reader.iter_decoded_messages(topics=["/joint_states"]):
            total += message.effort[0]
    return time.process_time() - start, total


def torqcomp_seconds(torqcomp, path):
    command = [torqcomp, "extract", str(path), "--topic", "/joint_states", "--field", "effort[0]"]
    used = []
    for _ in range(RUNS):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*command, "-o", os.devnull], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return statistics.median(used)


def main():
    torqcomp, messages = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100_000
    print("compression  messages  python s  torqcomp s  times              torqcomp messages/s")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("NONE", "ZSTD", "LZ4"):
            path = Path(folder) / f"{name}.mcap"
            make(path, getattr(CompressionType, name), messages)
            rounds = []
            for _ in range(ROUNDS):
                theirs, _ = python_seconds(path)
                rounds.append((theirs, torqcomp_seconds(torqcomp, path)))
            theirs, ours = (statistics.median(seconds) for seconds in zip(*rounds))
            ratios = sorted(theirs / ours for theirs, ours in rounds)
            times = f"{statistics.median(ratios):.0f} ({ratios[0]:.0f}..{ratios[-1]:.0f})"
            print(
                f"{name:11}  {messages:8}  {theirs:8.2f}  {ours:10.3f}  {times:17}"
                f"  {messages / ours:12.0f}"
            )


main()
