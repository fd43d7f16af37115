#!/usr/bin/env bash
# Time of a complete diagnosis of two records of 32,000 samples, compared with one candidate fitted with SciPy.
#
# usage: benches/peer/diagnose.sh [EFFECT]      (default cubic-stiffness)
#
# environment: PYTHON [python3], a Python with numpy and scipy, or able to create an environment with them;
# PEER_CACHE, the folder of that environment [peer, in cargo's target folder]; CARGO_TARGET_DIR as for cargo
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
effect=${1:-cubic-stiffness}
python=${PYTHON:-python3}
target=${CARGO_TARGET_DIR:-$root/target}
venv=${PEER_CACHE:-$target/peer}/venv
if ! "$python" -c 'import numpy, scipy' 2>/dev/null; then
    [[ -x $venv/bin/python ]] || "$python" -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt"
    python=$venv/bin/python
fi
data=$(mktemp -d)
trap 'rm -rf "$data"' EXIT

cd "$root"
cargo build --release --bin torqcomp --example blind
"$target/release/examples/blind" make "$data" --per-effect 1 --only "$effect" >"$data/log"
cd "$data/$effect/000"
echo "cores: $(nproc)"
echo "torqcomp diagnose, all candidates:"
TIMEFORMAT='%R s on the wall, %U s of the processors'
time "$target/release/torqcomp" diagnose --stand stand.toml --train train.csv --holdout holdout.csv \
    --applied applied_n_m --measured measured_n_m --quiet | head -12
echo "SciPy least_squares, cubic stiffness alone:"
"$python" "$here/diagnose.py" train.csv holdout.csv
