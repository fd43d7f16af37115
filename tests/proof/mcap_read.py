"""Reads every case with torqcomp and compares it to the last bit."""

import csv
import json
import struct
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import numpy as np


def bits(value):
    return struct.pack("<d", value)


def read(torqcomp, folder, case):
    out = folder / f"{case['name']}.csv"
    command = [torqcomp, "extract", str(folder / f"{case['name']}.mcap")]
    command += ["--topic", case["topic"], "--field", case["field"], "--time", case["time"]]
    done = subprocess.run([*command, "-o", str(out)], capture_output=True, text=True)
    expected = 3 if case.get("cut") else 1 if case.get("refused") else 0
    if done.returncode != expected:
        sys.exit(f"{case['name']}: exit code {done.returncode}, not {expected}\n{done.stderr}")
    if case.get("refused"):
        return None
    with open(out, newline="") as rows:
        reader = csv.reader(rows)
        assert next(reader)[0] == "time_s"
        return [(Decimal(time), float(value)) for time, value, *_ in reader]


def compare(case, rows, stored):
    times, values = stored["times"], stored["values"]
    if case.get("cut"):
        assert 0 < len(rows) < len(times), f"{case['name']}: {len(rows)} rows of a cut file"
    else:
        assert len(rows) == len(times), f"{case['name']}: {len(rows)} rows, not {len(times)}"
    for place, (time, value) in enumerate(rows):
        where = f"{case['name']}, row {place + 1}"
        if bits(value) != bits(values[place]):
            sys.exit(f"{where}: {value!r}, not {values[place]!r}")
        exact = Decimal(int(times[place])) / Decimal(10**9)
        # A time in seconds as a double has no more than 16 digits.
        if abs(time - exact) > Decimal("2.5e-7"):
            sys.exit(f"{where}: at {time} s, not {exact} s")


def main():
    folder, torqcomp = Path(sys.argv[1]), sys.argv[2]
    cases = json.loads((folder / "cases.json").read_text())
    files = total = 0
    for case in cases:
        rows = read(torqcomp, folder, case)
        if rows is None:
            continue
        compare(case, rows, np.load(folder / f"{case['name']}.npz"))
        files += 1
        total += len(rows)
    print(f"{files} files, {total} values read, all equal to the last bit")


main()
