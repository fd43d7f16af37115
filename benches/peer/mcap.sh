#!/usr/bin/env bash
# Compares torqcomp with the Python MCAP reader on ROS 2 messages. See README.md.
# usage: benches/peer/mcap.sh [MESSAGES]
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
cd "$here/../.."
target=${CARGO_TARGET_DIR:-target}
cache=${PEER_CACHE:-$target/peer-mcap}
torqcomp=${TORQCOMP:-}
if [[ -z $torqcomp ]]; then
    cargo build --release --locked
    torqcomp=$target/release/torqcomp
fi
if [[ ! -x $cache/bin/python ]]; then
    "${PYTHON:-python3}" -m venv "$cache"
fi
# The pinned versions of the other comparisons.
grep '^mcap' "$here/requirements.txt" | "$cache/bin/pip" install --quiet --requirement /dev/stdin
exec "$cache/bin/python" "$here/mcap_reader.py" "$torqcomp" "${1:-200000}"
