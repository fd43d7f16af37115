#!/usr/bin/env bash
# Reads MCAP files written by the public Python packages for ROS 2, ROS 1, protobuf and JSON with
# torqcomp, and files written by torqcomp with those packages: values equal to the last bit.
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
# The official JavaScript readers, which verify every checksum.
if command -v npm >/dev/null && command -v node >/dev/null; then
    cp tests/proof/mcap_check.mjs "$work"
    (cd "$work" && npm install --silent --no-audit --no-fund @mcap/core@2 @mcap/support@1 >/dev/null)
    (cd "$work" && node mcap_check.mjs out-*.mcap)
else
    echo "SKIPPED: node and npm are not installed; the files were not read with @mcap/core"
fi
# The official command-line tool. It is in no registry (crates.io, npm, PyPI, Debian; the Go proxy has no
# version of it), so it runs only if installed from its own releases.
if command -v mcap >/dev/null; then
    for file in "$work"/out-*.mcap; do
        mcap doctor --strict-message-order=false "$file"
    done
else
    echo "SKIPPED: the command-line tool mcap is not installed; \"mcap doctor\" was not run"
fi
