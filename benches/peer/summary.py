"""Prints the table of runs written by measure.py, pair by pair, and the medians of the ratios.

    python summary.py TABLE
"""

import statistics
import sys


def read(path):
    """Runs of each of the two programs, in order."""
    runs = {"peer": [], "torqcomp": []}
    with open(path, encoding="ascii") as file:
        for line in file:
            name, wall_s, cpu_s, peak_kib = line.split("\t")
            runs[name].append((float(wall_s), float(cpu_s), int(peak_kib) / 1024))
    if not runs["peer"] or len(runs["peer"]) != len(runs["torqcomp"]):
        sys.exit(f"{path}: expected as many runs of the peer as of torqcomp")
    return list(zip(runs["peer"], runs["torqcomp"]))


def spread(values, digits=2):
    return (
        f"{statistics.median(values):.{digits}f} "
        f"({min(values):.{digits}f}..{max(values):.{digits}f})"
    )


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: summary.py TABLE")
    pairs = read(sys.argv[1])
    print("                peer                     torqcomp                 peer / torqcomp")
    print("pair   wall s   CPU s  peak MiB   wall s   CPU s  peak MiB     wall      CPU")
    for number, (peer, own) in enumerate(pairs, 1):
        print(
            f"{number:4d}  {peer[0]:7.3f} {peer[1]:7.3f} {peer[2]:9.1f}  {own[0]:7.3f} {own[1]:7.3f}"
            f" {own[2]:9.1f}  {peer[0] / own[0]:7.2f}  {peer[1] / own[1]:7.2f}"
        )
    print()
    print(f"median of {len(pairs)} pairs (smallest..largest)")
    for index, name in enumerate(("wall time", "CPU time", "peak memory")):
        ratios = [peer[index] / own[index] for peer, own in pairs]
        print(f"  {name + ', peer / torqcomp:':31} {spread(ratios)}")
    for column, name in enumerate(("peer", "torqcomp")):
        peaks = [pair[column][2] for pair in pairs]
        print(f"  {'peak memory, ' + name + ':':31} {spread(peaks, 1)} MiB")


if __name__ == "__main__":
    main()
