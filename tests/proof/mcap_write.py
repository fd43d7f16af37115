"""Writes an MCAP with torqcomp from each one it read, and reads it with the public packages.

It must contain everything from the input unchanged, and the added channel must equal the CSV that
torqcomp writes for the same input.
"""

import csv
import io
import json
import struct
import subprocess
import sys
from pathlib import Path

from mcap.reader import NonSeekingReader, SeekingReader
from mcap_protobuf.decoder import DecoderFactory as Protobuf
from mcap_ros1.decoder import DecoderFactory as Ros1
from mcap_ros2.decoder import DecoderFactory as Ros2

TOPIC = "/torqcomp/compensated_torque"
STAND = """schema = "torqcomp.stand/1"
[mechanics]
natural_frequency = "60 Hz"
damping_ratio = 0.05
[calibration]
torque_per_volt = "100 N m/V"
"""
# With a torque that no response describes, the record takes a separate path.
REFINED = """
[[effects]]
kind = "cubic-stiffness"
coefficient = "1e-6 1/(N m)^2"
"""
NAMES = ["ros2-none", "ros2-lz4", "ros2-zstd", "ros1", "protobuf-zstd", "json", "idl", "shape-no-chunks"]


def all_messages(reader):
    """Messages (time, topic, bytes) in a defined order."""
    return sorted(
        (message.log_time, channel.topic, message.publish_time, message.sequence, message.data)
        for _, channel, message in reader.iter_messages()
    )


def everything(reader):
    """Messages, attachments and metadata."""
    messages = all_messages(reader)
    attachments = sorted((a.name, a.log_time, a.data) for a in reader.iter_attachments())
    metadata = sorted((m.name, sorted(m.metadata.items())) for m in reader.iter_metadata())
    return messages, attachments, metadata


def value(message):
    if isinstance(message, dict):
        return message["compensated_torque_n_m"], message["timestamp"]["sec"] * 10**9 + message["timestamp"]["nsec"]
    if hasattr(message, "compensated_torque_n_m"):
        return message.compensated_torque_n_m, message.timestamp.ToNanoseconds()
    stamp = message.header.stamp
    if hasattr(stamp, "secs"):
        return message.effort[0], stamp.secs * 10**9 + stamp.nsecs
    return message.effort[0], stamp.sec * 10**9 + stamp.nanosec


class Json:
    """mcap has no JSON decoder."""

    def decoder_for(self, encoding, _schema):
        return json.loads if encoding == "json" else None


def check(name, before, after, rows):
    kept = everything(SeekingReader(io.BytesIO(before), validate_crcs=True))
    reader = SeekingReader(io.BytesIO(after), validate_crcs=True)
    messages, attachments, metadata = everything(reader)
    assert [m for m in messages if m[1] != TOPIC] == kept[0], f"{name}: messages differ"
    assert attachments == kept[1], f"{name}: attachments differ"
    assert [m for m in metadata if m[0] != "torqcomp"] == kept[2], f"{name}: metadata differ"
    assert [m for m in metadata if m[0] == "torqcomp"], f"{name}: no provenance"
    as_stream = all_messages(NonSeekingReader(io.BytesIO(after), validate_crcs=True))
    assert as_stream == messages, f"{name}: the readers disagree"
    factories = [Ros2(), Ros1(), Protobuf(), Json()]
    decoded = SeekingReader(io.BytesIO(after), decoder_factories=factories)
    found = [value(m.decoded_message) for m in decoded.iter_decoded_messages(topics=[TOPIC])]
    assert len(found) == len(rows), f"{name}: {len(found)} messages for {len(rows)} rows"
    for (torque, _), row in zip(found, rows):
        if struct.pack("<d", torque) != struct.pack("<d", float(row[1])):
            sys.exit(f"{name}: {torque!r} in the file, {row[1]} in the CSV")
    statistics = decoded.get_summary().statistics
    assert statistics.message_count == len(messages), f"{name}: the statistics are wrong"
    return len(found)


def main():
    folder, torqcomp = Path(sys.argv[1]), sys.argv[2]
    (folder / "stand.toml").write_text(STAND)
    (folder / "refined.toml").write_text(STAND + REFINED)
    cases = {case["name"]: case for case in json.loads((folder / "cases.json").read_text())}
    total = 0
    runs = [(name, "stand") for name in NAMES] + [("ros2-zstd", "refined"), ("json", "refined")]
    for name, stand in runs:
        case = next(case for key, case in cases.items() if key == name or key.startswith(name + "-"))
        source = folder / f"{case['name']}.mcap"
        out, table = folder / f"out-{name}-{stand}.mcap", folder / f"out-{name}-{stand}.csv"
        command = [torqcomp, "compensate", str(source), "--stand", str(folder / f"{stand}.toml")]
        command += ["--topic", case["topic"], "--field", case["field"], "--unit", "N m"]
        for path, kind in ((out, "mcap"), (table, "csv")):
            done = subprocess.run(
                [*command, "--format", kind, "--digits", "shortest", "-o", str(path)],
                capture_output=True,
                text=True,
            )
            if done.returncode != 0:
                sys.exit(f"{name}: exit code {done.returncode}\n{done.stderr}")
        with open(table, newline="") as text:
            rows = list(csv.reader(text))[1:]
        total += check(name, source.read_bytes(), out.read_bytes(), rows)
    print(f"{len(runs)} files written, {total} values read back, all equal to the last bit")


main()
