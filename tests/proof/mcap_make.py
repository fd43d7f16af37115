"""Writes MCAP files in all encodings and compressions, and their content for comparison.

For every file NAME.mcap, a line of cases.json gives the topic and field to read; the expected
times (ns) and values are in NAME.npz.
"""

import json
import random
import struct
import sys
from pathlib import Path

import numpy as np
from grpc_tools import protoc
from mcap.writer import CompressionType, IndexType, Writer
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START = 1_700_000_000_123_456_789
STEP = 1_000_003
COUNT = 3000
COMPRESSIONS = {
    "none": CompressionType.NONE,
    "lz4": CompressionType.LZ4,
    "zstd": CompressionType.ZSTD,
}
LINE = "=" * 80 + "\n"
STAMPED = (
    "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort\n"
    + LINE
    + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + LINE
    + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)

random.seed(20)
cases = []


def doubles(count):
    """Doubles of every magnitude, some using all bits of the mantissa."""
    values = []
    while len(values) < count:
        value = struct.unpack("<d", random.randbytes(8))[0]
        # Compensated values must be measurable by a recorder.
        if value == value and abs(value) < 1e90:
            values.append(value)
    return values


def case(folder, name, topic, field, times, values, time="header", **more):
    np.savez(folder / f"{name}.npz", times=np.array(times, dtype=np.int64), values=np.array(values))
    cases.append({"name": name, "topic": topic, "field": field, "time": time, **more})


def times():
    return [START + place * STEP for place in range(COUNT)]


def stamp(time):
    return {"sec": time // 10**9, "nanosec": time % 10**9}


def ros2_joints(folder):
    """mcap-ros2-support, every compression; by place, from the end and by name."""
    for compression, kind in COMPRESSIONS.items():
        values = doubles(COUNT)
        name = f"ros2-{compression}"
        with open(folder / f"{name}.mcap", "wb") as out:
            writer = Ros2Writer(out, compression=kind)
            schema = writer.register_msgdef("sensor_msgs/msg/JointState", STAMPED)
            for place, (time, value) in enumerate(zip(times(), values)):
                message = {
                    "header": {"stamp": stamp(time), "frame_id": "f" * (5 * place // COUNT)},
                    "name": ["left", "motor_joint"],
                    "position": [] if place % 3 else [1.0],
                    "velocity": [0.5] * (place % 4),
                    "effort": [-value, value],
                }
                writer.write_message("/joint_states", schema, message, time + 5000, time + 4000, place)
            writer.finish()
        for number, field in enumerate(["effort[1]", "effort[-1]", "effort[name=motor_joint]"]):
            other = f"{name}-{number}"
            (folder / f"{other}.mcap").hardlink_to(folder / f"{name}.mcap")
            case(folder, other, "/joint_states", field, times(), values)


class Cdr:
    """CDR as the standard describes it; big-endian and XCDR2 have no public Python writer."""

    def __init__(self, kind, largest):
        self.head = bytes([0, kind, 0, 0])
        self.order = "<" if kind & 1 else ">"
        self.largest = largest
        self.out = bytearray()

    def put(self, form, *values):
        size = struct.calcsize(form)
        for value in values:
            self.out += b"\0" * (-len(self.out) % min(size, self.largest))
            self.out += struct.pack(self.order + form, value)

    def text(self, text):
        self.put("I", len(text) + 1)
        self.out += text.encode() + b"\0"

    def bytes(self):
        return self.head + bytes(self.out)


OUTER = (
    "uint8 a\nproof_msgs/Empty e\nproof_msgs/Inner[2] pair\nproof_msgs/Inner[] many\n"
    "string<=20 word \"x\"\nint16 LIMIT=7\nfloat32[3] vector\nbool flag\nint64 big\n"
    "float64 value\n"
)
INNER = "uint8 x\nfloat64 y\nstring z\n"


def outer_by_rosbags(place, value, y):
    store = outer_by_rosbags.store
    kind = {name: store.types[f"proof_msgs/msg/{name}"] for name in ("Outer", "Inner", "Empty")}
    inners = [kind["Inner"](x=i, y=y + i, z="z" * (i + place % 3)) for i in range(3)]
    message = kind["Outer"](
        a=1,
        e=kind["Empty"](),
        pair=inners[:2],
        many=inners[: 1 + place % 3],
        word="w" * (place % 20),
        vector=np.array([1, 2, 3], dtype=np.float32),
        flag=True,
        big=-(2**62),
        value=value,
    )
    return bytes(store.serialize_cdr(message, "proof_msgs/msg/Outer"))


def outer_by_hand(kind, largest, has_sizes):
    def inners(cdr, place, y, count, has_count):
        part = Cdr(kind, largest)
        # Padding counts from the start of the message, so the front is included.
        part.out += cdr.out
        if has_sizes:
            part.put("I", 0)
        start = len(part.out)
        if has_count:
            part.put("I", count)
        for i in range(count):
            part.put("B", i)
            part.put("d", y + i)
            part.text("z" * (i + place % 3))
        if has_sizes:
            part.out[start - 4 : start] = struct.pack(part.order + "I", len(part.out) - start)
        cdr.out = part.out

    def write(place, value, y):
        cdr = Cdr(kind, largest)
        cdr.put("B", 1, 0)
        inners(cdr, place, y, 2, False)
        inners(cdr, place, y, 1 + place % 3, True)
        cdr.text("w" * (place % 20))
        cdr.put("f", 1, 2, 3)
        cdr.put("B", 1)
        cdr.put("q", -(2**62))
        cdr.put("d", value)
        return cdr.bytes()

    return write


def nested_types(folder):
    """Nested, empty, fixed and bounded types; rosbags' serialisation, and the other layouts."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = {}
    types.update(get_types_from_msg(OUTER, "proof_msgs/msg/Outer"))
    types.update(get_types_from_msg(INNER, "proof_msgs/msg/Inner"))
    types.update(get_types_from_msg("", "proof_msgs/msg/Empty"))
    store.register(types)
    outer_by_rosbags.store = store
    text = OUTER + LINE + "MSG: proof_msgs/Empty\n" + LINE + "MSG: proof_msgs/Inner\n" + INNER
    by_hand = outer_by_hand(1, 8, False)
    assert all(by_hand(i, 0.5, 1.5) == outer_by_rosbags(i, 0.5, 1.5) for i in range(40))
    layouts = {
        "little": outer_by_rosbags,
        "big": outer_by_hand(0, 8, False),
        "xcdr2-little": outer_by_hand(7, 4, True),
        "xcdr2-big": outer_by_hand(6, 4, True),
        "xcdr2-without-sizes": outer_by_hand(7, 4, False),
    }
    for layout, write in layouts.items():
        values, ys = doubles(COUNT), doubles(COUNT)
        name = f"nested-{layout}"
        with open(folder / f"{name}.mcap", "wb") as out:
            writer = Writer(out, chunk_size=50_000, compression=CompressionType.ZSTD)
            writer.start("ros2", "proof")
            schema = writer.register_schema("proof_msgs/msg/Outer", "ros2msg", text.encode())
            channel = writer.register_channel("/outer", "cdr", schema)
            for place, time in enumerate(times()):
                data = write(place, values[place], ys[place])
                writer.add_message(channel, time, data, time)
            writer.finish()
        case(folder, name, "/outer", "value", times(), values, time="log")
        (folder / f"{name}-y.mcap").hardlink_to(folder / f"{name}.mcap")
        case(folder, f"{name}-y", "/outer", "many[0].y", times(), ys, time="log")


def idl(folder):
    """The same bytes as ros2msg, described in IDL."""
    text = (
        LINE
        + "IDL: proof_msgs/msg/Sample\nmodule proof_msgs { module msg {\n"
        + "  module Sample_Constants { const long COUNT = 3; };\n"
        + "  typedef double double__3[3];\n"
        + '  struct Sample { builtin_interfaces::msg::Time stamp; @unit(value="N m") double torque;\n'
        + "    proof_msgs::msg::double__3 vector; sequence<string> names; float last; };\n"
        + "}; };\n"
        + LINE
        + "IDL: builtin_interfaces/msg/Time\nmodule builtin_interfaces { module msg {\n"
        + "  struct Time { int32 sec; uint32 nanosec; }; }; };\n"
    )
    values = doubles(COUNT)
    with open(folder / "idl.mcap", "wb") as out:
        writer = Writer(out, compression=CompressionType.LZ4)
        writer.start("ros2", "proof")
        schema = writer.register_schema("proof_msgs/msg/Sample", "ros2idl", text.encode())
        channel = writer.register_channel("/sample", "cdr", schema)
        for time, value in zip(times(), values):
            head = struct.pack("<iI", time // 10**9, time % 10**9)
            body = head + struct.pack("<4d", value, 1, 2, 3) + struct.pack("<If", 0, 0.5)
            writer.add_message(channel, time + 9, b"\0\1\0\0" + body, time)
        writer.finish()
    case(folder, "idl", "/sample", "torque", times(), values)


def ros1_by_rosbags(folder):
    """ROS 1 by rosbags, as mcap-ros1-support needs ROS itself to write."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = store.types["sensor_msgs/msg/JointState"]
    header = store.types["std_msgs/msg/Header"]
    time_kind = store.types["builtin_interfaces/msg/Time"]
    text = (
        "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
        + LINE
        + "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    )
    values = doubles(COUNT)
    with open(folder / "ros1.mcap", "wb") as out:
        writer = Writer(out, compression=CompressionType.LZ4)
        writer.start("ros1", "proof")
        schema = writer.register_schema("sensor_msgs/JointState", "ros1msg", text.encode())
        channel = writer.register_channel("/joints", "ros1", schema)
        empty = np.array([], dtype=np.float64)
        for place, (time, value) in enumerate(zip(times(), values)):
            message = kind(
                header=header(
                    seq=place,
                    stamp=time_kind(sec=time // 10**9, nanosec=time % 10**9),
                    frame_id="abc"[: 4 * place // COUNT],
                ),
                name=["a", "bc"],
                position=empty,
                velocity=empty,
                effort=np.array([0.0, value]),
            )
            data = store.serialize_ros1(message, "sensor_msgs/msg/JointState")
            writer.add_message(channel, time, bytes(data), time)
        writer.finish()
    case(folder, "ros1", "/joints", "effort[name=bc]", times(), values)


PROTO = """syntax = "proto3";
package proof;
import "google/protobuf/timestamp.proto";
message Inner { double x = 1; sint64 n = 2; fixed32 f = 3; }
message Sample {
  google.protobuf.Timestamp timestamp = 1;
  repeated string name = 2;
  repeated double effort = 3;
  repeated Inner inner = 4;
  map<string, double> table = 5;
  Inner one = 6;
  repeated float single = 7 [packed = false];
  oneof choice { double torque = 8; string text = 9; }
}
"""


def protobuf(folder):
    (folder / "sample.proto").write_text(PROTO)
    import grpc_tools

    include = Path(grpc_tools.__file__).parent / "_proto"
    arguments = ["", f"-I{folder}", f"-I{include}", f"--python_out={folder}", "sample.proto"]
    assert protoc.main(arguments) == 0
    sys.path.insert(0, str(folder))
    import sample_pb2

    columns = {field: doubles(COUNT) for field in ("effort", "inner", "table", "one", "torque")}
    singles = [float(np.float32(random.uniform(-1, 1))) for _ in range(COUNT)]
    numbers = [random.randrange(-(2**52), 2**52) for _ in range(COUNT)]
    fields = {
        "effort[name=b]": columns["effort"],
        "inner[-1].x": columns["inner"],
        "table[key=k].value": columns["table"],
        "one.x": columns["one"],
        "one.n": [float(n) for n in numbers],
        "torque": columns["torque"],
        "single[1]": singles,
    }
    for compression, kind in COMPRESSIONS.items():
        with open(folder / f"protobuf-{compression}.mcap", "wb") as out:
            with ProtobufWriter(out, compression=kind) as writer:
                for place, time in enumerate(times()):
                    message = sample_pb2.Sample(
                        name=["a", "b"],
                        effort=[1.0, columns["effort"][place]],
                        inner=[sample_pb2.Inner(x=7)] * (place % 3)
                        + [sample_pb2.Inner(x=columns["inner"][place])],
                        table={"j": 0.0, "k": columns["table"][place]},
                        one=sample_pb2.Inner(x=columns["one"][place], n=numbers[place], f=5),
                        single=[0.0, singles[place]],
                        torque=columns["torque"][place],
                    )
                    message.timestamp.FromNanoseconds(time)
                    writer.write_message("/sample", message, log_time=time + 7, publish_time=time)
        for number, (field, values) in enumerate(fields.items()):
            name = f"protobuf-{compression}-{number}"
            (folder / f"{name}.mcap").hardlink_to(folder / f"protobuf-{compression}.mcap")
            case(folder, name, "/sample", field, times(), values)


def json_file(folder):
    values = doubles(COUNT)
    with open(folder / "json.mcap", "wb") as out:
        writer = Writer(out, compression=CompressionType.ZSTD)
        writer.start("", "proof")
        schema = writer.register_schema("Sample", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/json", "json", schema)
        for time, value in zip(times(), values):
            message = {
                "timestamp": {"sec": time // 10**9, "nsec": time % 10**9},
                "joints": [{"name": "a", "torque": 0}, {"name": "b", "torque": value}],
            }
            writer.add_message(channel, time + 3, json.dumps(message).encode(), time)
        writer.finish()
    case(folder, "json", "/json", "joints[name=b].torque", times(), values)


def shapes(folder):
    """Files without chunks, without summary, with attachments, with a restarted publisher, truncated."""
    variants = {
        "no-chunks": {"use_chunking": False},
        "no-index": {"index_types": IndexType.NONE},
        "no-statistics": {"use_statistics": False, "repeat_channels": False},
        "no-crc": {"enable_crcs": False},
        "small-chunks": {"chunk_size": 100},
    }
    for name, options in variants.items():
        values = doubles(COUNT)
        with open(folder / f"shape-{name}.mcap", "wb") as out:
            writer = Writer(out, **options)
            writer.start("ros2", "proof")
            writer.add_attachment(1, 2, "notes.txt", "text/plain", b"n" * 100_000)
            writer.add_metadata("about", {"stand": "A"})
            schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
            first = writer.register_channel("/x", "cdr", schema)
            second = writer.register_channel("/x", "cdr", schema, {"publisher": "2"})
            for place, (time, value) in enumerate(zip(times(), values)):
                data = b"\0\1\0\0" + struct.pack("<d", value)
                writer.add_message(second if 2 * place > COUNT else first, time, data, time)
            writer.finish()
        case(folder, f"shape-{name}", "/x", "data", times(), values, time="log")
    whole = (folder / "shape-small-chunks.mcap").read_bytes()
    stored = np.load(folder / "shape-small-chunks.npz")
    (folder / "shape-cut.mcap").write_bytes(whole[: len(whole) // 2])
    case(
        folder,
        "shape-cut",
        "/x",
        "data",
        stored["times"],
        stored["values"],
        time="log",
        cut=True,
    )


def two_publishers(folder):
    """Two nodes publishing on one topic at the same time: not one signal, so rejected."""
    with open(folder / "two-publishers.mcap", "wb") as out:
        writer = Writer(out)
        writer.start("ros2", "proof")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
        nodes = [writer.register_channel("/x", "cdr", schema, {"publisher": name}) for name in "12"]
        for place, time in enumerate(times()):
            writer.add_message(nodes[place % 2], time, b"\0\1\0\0" + struct.pack("<d", 1.0), time)
        writer.finish()
    cases.append({"name": "two-publishers", "topic": "/x", "field": "data", "time": "log", "refused": True})


def main():
    folder = Path(sys.argv[1])
    ros2_joints(folder)
    nested_types(folder)
    idl(folder)
    ros1_by_rosbags(folder)
    protobuf(folder)
    json_file(folder)
    shapes(folder)
    two_publishers(folder)
    (folder / "cases.json").write_text(json.dumps(cases))


main()
