"""Typical Python script: read a record, divide out the stand's response, write the torque.

    python peer.py [--tuned] RECORD OUTPUT

The whole record is read by polars, transformed by SciPy, multiplied by the inverse response of the
stand in stand.toml up to 2400 Hz (with an edge that ends at 2880 Hz), transformed back and written
by polars. --tuned skips the frequencies above the edge, and avoids copies.
"""

import argparse
import sys

import numpy as np
import polars as pl
from scipy import fft

# The stand: J θ'' + f θ' + K θ = T, in slug ft², ft lbf s/rad and ft lbf/rad.
INERTIA = 5.85e-3
DAMPING = 3.07
STIFFNESS = 8.1e4
# Recorded torque per volt, in N m.
TORQUE_PER_VOLT = 1.23e3 * 1.3558179483314004
# The band: passed in full up to BAND_HZ, rejected from BAND_END_HZ.
BAND_HZ = 2400.0
BAND_END_HZ = 2880.0
# The edge is the running integral of a Kaiser window of this shape.
EDGE_BETA = 26.0
EDGE_NODES = 20_001


def band_gain(frequency_hz):
    """1 up to BAND_HZ, 0 from BAND_END_HZ, smooth in between; for ascending frequencies."""
    gain = np.zeros_like(frequency_hz)
    start, end = np.searchsorted(frequency_hz, (BAND_HZ, BAND_END_HZ))
    gain[:start] = 1.0
    window = np.kaiser(EDGE_NODES, EDGE_BETA)
    fallen = np.concatenate(([0.0], np.cumsum(0.5 * (window[1:] + window[:-1]))))
    place = (frequency_hz[start:end] - BAND_HZ) / (BAND_END_HZ - BAND_HZ)
    gain[start:end] = 1.0 - np.interp(place, np.linspace(0.0, 1.0, EDGE_NODES), fallen / fallen[-1])
    return gain


def inverse_response(frequency_hz):
    """Applied torque over recorded torque."""
    omega = 2.0 * np.pi * frequency_hz
    return 1.0 - (INERTIA / STIFFNESS) * omega**2 + 1j * (DAMPING / STIFFNESS) * omega


def compensate(volts, rate_hz):
    """The torque in N m."""
    frequency_hz = fft.rfftfreq(len(volts), 1.0 / rate_hz)
    spectrum = fft.rfft(volts)
    spectrum *= TORQUE_PER_VOLT * band_gain(frequency_hz) * inverse_response(frequency_hz)
    return fft.irfft(spectrum, len(volts))


def compensate_tuned(volts, rate_hz):
    """The same, without computing frequencies outside the band."""
    length = len(volts)
    spectrum = fft.rfft(volts)
    passed = min(len(spectrum), int(np.ceil(BAND_END_HZ * length / rate_hz)))
    frequency_hz = np.arange(passed) * (rate_hz / length)
    spectrum[:passed] *= TORQUE_PER_VOLT * band_gain(frequency_hz) * inverse_response(frequency_hz)
    spectrum[passed:] = 0.0
    return fft.irfft(spectrum, length, overwrite_x=True)


def main():
    parser = argparse.ArgumentParser(description="Compensate a record with polars and SciPy.")
    parser.add_argument("record", help="CSV with the columns time_s,bridge_V")
    parser.add_argument("output", help="CSV to write, time_s,compensated_torque_n_m")
    parser.add_argument("--tuned", action="store_true", help="skip frequencies above the edge")
    args = parser.parse_args()

    frame = pl.read_csv(args.record)
    missing = {"time_s", "bridge_V"} - set(frame.columns)
    if missing or len(frame) < 2:
        sys.exit(f"{args.record}: expected at least two rows of time_s,bridge_V")
    time_s = frame["time_s"]
    rate_hz = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    run = compensate_tuned if args.tuned else compensate
    torque = run(frame["bridge_V"].to_numpy(), rate_hz)
    pl.DataFrame({"time_s": time_s, "compensated_torque_n_m": torque}).write_csv(args.output)


if __name__ == "__main__":
    main()
