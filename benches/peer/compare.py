"""Checks that two results agree: same rows, same time stamps, same torque away from the ends.

    python compare.py [--ends N] [--tolerance R] PEER TORQCOMP

The programs extrapolate the record differently, so samples near its ends are excluded.
The difference is given as its rms relative to the rms of the peer's torque about its mean.
"""

import argparse
import sys

import numpy as np
import polars as pl

COLUMNS = ["time_s", "compensated_torque_n_m"]


def read(path):
    try:
        frame = pl.read_csv(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        sys.exit(f"{path}: cannot read the result: {error}")
    if frame.columns != COLUMNS:
        sys.exit(f"{path}: expected the columns {','.join(COLUMNS)}, got {','.join(frame.columns)}")
    return [frame[name].to_numpy() for name in COLUMNS]


def main():
    parser = argparse.ArgumentParser(description="Compare two compensated records.")
    parser.add_argument("peer")
    parser.add_argument("torqcomp")
    parser.add_argument("--ends", type=int, default=20_000, help="samples left out at each end")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="largest relative rms")
    args = parser.parse_args()

    time_a, torque_a = read(args.peer)
    time_b, torque_b = read(args.torqcomp)
    if len(time_a) != len(time_b):
        sys.exit(f"the results differ in length: {len(time_a)} and {len(time_b)} rows")
    # Stamps are compared to a tenth of a microsecond; one sample is 50 µs.
    apart = np.abs(time_a - time_b).max()
    if not apart < 1e-7:
        sys.exit(f"the time stamps differ by up to {apart:.3g} s")
    middle = slice(args.ends, len(time_a) - args.ends)
    if len(time_a[middle]) < 1000:
        sys.exit(f"{len(time_a)} rows are too few to compare with {args.ends} excluded at each end")
    difference = torque_b[middle] - torque_a[middle]
    relative = np.sqrt(np.mean(difference**2)) / np.std(torque_a[middle])
    print(
        f"results agree to {relative:.2g} (relative rms over {difference.size} samples, "
        f"largest difference {np.abs(difference).max():.2g} N m)"
        if relative <= args.tolerance
        else f"relative rms difference {relative:.3g}, at most {args.tolerance:g} expected"
    )
    # A NaN difference also fails.
    sys.exit(0 if relative <= args.tolerance else 1)


if __name__ == "__main__":
    main()
