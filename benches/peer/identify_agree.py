"""Compares frequencies and damping ratios of torqcomp's JSON report with those of the peer.

    python identify_agree.py TORQCOMP.json PEER.json

Ends with code 1 if a frequency differs by more than 0.01 % or a damping ratio by more than 2 %.
"""

import json
import sys


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        parameters = json.load(file)["parameters"]
    with open(sys.argv[2], encoding="ascii") as file:
        peer = json.load(file)
    for name, key, within in (
        ("natural_frequency", "frequency_hz", 1e-4),
        ("damping_ratio", "damping_ratio", 2e-2),
    ):
        ours = [p["value"] for p in parameters if p["name"].endswith(name)]
        theirs = peer[key]
        print(f"  {name}: torqcomp {ours}, peer {theirs}")
        if len(ours) != len(theirs):
            sys.exit(f"{name}: {len(ours)} modes against {len(theirs)}")
        for a, b in zip(ours, theirs):
            if abs(a / b - 1.0) > within:
                sys.exit(f"{name}: {a} and {b} differ by more than {100 * within} %")


if __name__ == "__main__":
    main()
