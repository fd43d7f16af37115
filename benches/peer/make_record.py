"""Writes the test record: `time_s,bridge_V` at 20 kHz, about 25 bytes per row.

    python make_record.py [--rows N] [--seed N] OUTPUT

The response of the stand in stand.toml to a mean torque and harmonics of 60 Hz, with white noise.
The same rows and seed give the same file.
"""

import argparse
import os
import sys

import numpy as np

RATE_HZ = 20_000
FUNDAMENTAL_HZ = 60
# Period of 60 Hz at 20 kHz in samples (three turns).
PERIOD_SAMPLES = 1000
CHUNK_ROWS = 250 * PERIOD_SAMPLES

# The stand, in slug ft², ft lbf s/rad, ft lbf/rad, N m/V.
INERTIA, DAMPING, STIFFNESS = 5.85e-3, 3.07, 8.1e4
TORQUE_PER_VOLT = 1.23e3 * 1.3558179483314004

MEAN_TORQUE_N_M = 2.0
HIGHEST_ORDER = 40
NOISE_V = 2e-7


def response(frequency_hz):
    """Recorded torque over applied torque."""
    omega = 2.0 * np.pi * frequency_hz
    return STIFFNESS / (STIFFNESS - INERTIA * omega**2 + 1j * DAMPING * omega)


def one_period(random):
    """Volts of the mean and the harmonics, over PERIOD_SAMPLES samples."""
    time_s = np.arange(PERIOD_SAMPLES) / RATE_HZ
    volts = np.full(PERIOD_SAMPLES, MEAN_TORQUE_N_M / TORQUE_PER_VOLT)
    for order in range(1, HIGHEST_ORDER + 1):
        frequency_hz = order * FUNDAMENTAL_HZ
        # A single-phase motor pulsates most at twice the supply frequency.
        torque = (2.0 if order == 2 else 0.3) / order
        phase = random.uniform(0.0, 2.0 * np.pi)
        answer = response(frequency_hz) * torque / TORQUE_PER_VOLT
        volts += np.abs(answer) * np.cos(
            2.0 * np.pi * frequency_hz * time_s + phase + np.angle(answer)
        )
    return volts


def write_rows(file, rows, seed):
    random = np.random.default_rng(seed)
    chunk = np.tile(one_period(random), CHUNK_ROWS // PERIOD_SAMPLES)
    table = np.empty((CHUNK_ROWS, 2))
    line = b"%.5f,%.8e\n"
    file.write(b"time_s,bridge_V\n")
    for first in range(0, rows, CHUNK_ROWS):
        count = min(CHUNK_ROWS, rows - first)
        table[:count, 0] = np.arange(first, first + count) / RATE_HZ
        table[:count, 1] = chunk[:count] + NOISE_V * random.standard_normal(count)
        file.write(line * count % tuple(table[:count].ravel().tolist()))


def main():
    parser = argparse.ArgumentParser(description="Write a test record.")
    parser.add_argument("output", help="CSV to write")
    parser.add_argument("--rows", type=int, default=10_000_000, help="samples [10000000]")
    parser.add_argument("--seed", type=int, default=1, help="seed of the noise and phases [1]")
    args = parser.parse_args()
    if args.rows < 2:
        sys.exit("--rows: expected at least 2")

    # The record is created complete or not at all.
    part = f"{args.output}.part"
    try:
        with open(part, "wb") as file:
            write_rows(file, args.rows, args.seed)
        os.replace(part, args.output)
    except OSError as error:
        sys.exit(f"{args.output}: cannot write the record: {error.strerror}")
    finally:
        if os.path.exists(part):
            os.remove(part)


if __name__ == "__main__":
    main()
