#!/usr/bin/env bash
# MCAP files written by the public Python packages of ROS 2, ROS 1, protobuf and JSON are read with
# torqcomp, and what torqcomp writes is read with theirs: values equal to the last bit.
#
# Needs python3 with venv and a package index. Usage: tests/proof/mcap.sh [path/to/torqcomp]
set -euo pipefail
cd "$(dirname "$0")/../.."
torqcomp=${1:-}
if [ -z "$torqcomp" ]; then
    cargo build --release --locked
    torqcomp=${CARGO_TARGET_DIR:-target}/release/torqcomp
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
venv=${TORQCOMP_PROOF_VENV:-$work/venv}
if [ ! -x "$venv/bin/python" ]; then
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check -r tests/proof/requirements.txt
fi
"$venv/bin/python" tests/proof/mcap_make.py "$work"
"$venv/bin/python" tests/proof/mcap_read.py "$work" "$torqcomp"
"$venv/bin/python" tests/proof/mcap_write.py "$work" "$torqcomp"
# The official command-line tool, where there is one.
if command -v mcap >/dev/null; then
    for file in "$work"/out-*.mcap; do
        mcap doctor --strict-message-order=false "$file"
    done
fi
