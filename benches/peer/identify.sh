#!/usr/bin/env bash
# Compares `torqcomp identify` with typical Python scripts on records of a million samples. See README.md.
set -euo pipefail

rows=${1:-1000000}
pairs=${2:-5}
[[ $rows =~ ^[1-9][0-9]{4,8}$ && $pairs =~ ^[1-9][0-9]?$ ]] || {
    echo "usage: benches/peer/identify.sh [ROWS, at least 10000 [PAIRS]]" >&2
    exit 2
}
fail() {
    echo "identify.sh: $*" >&2
    exit 1
}

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=benches/peer
python=${PYTHON:-python3}
command -v cargo >/dev/null || fail "cargo not found; install Rust"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "set PYTHON to Python 3.11 or later"
target=$(cargo metadata --format-version 1 --no-deps |
    "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
cache=${PEER_CACHE:-$target/peer}
data=${PEER_DATA:-$cache}/identify-$rows
mkdir -p "$cache" "$data"

venv=$cache/venv-identify
if ! cmp -s "$here/requirements-identify.txt" "$venv/installed.txt"; then
    rm -rf "$venv"
    "$python" -m venv "$venv" || fail "cannot make a virtual environment"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        -r "$here/requirements-identify.txt" || fail "pip could not install the packages"
    cp "$here/requirements-identify.txt" "$venv/installed.txt"
fi
python=$venv/bin/python
if [[ -z ${TORQCOMP:-} ]]; then
    cargo build --release --bin torqcomp || fail "torqcomp does not build"
fi
torqcomp=${TORQCOMP:-$target/release/torqcomp}
if [[ ! -f $data/response.csv || $here/identify_make.py -nt $data/response.csv ]]; then
    "$python" "$here/identify_make.py" "$rows" "$data" || fail "no records to measure with"
fi

# The torqcomp command for a job: the modal one finds the number of modes itself.
ours() {
    local both=(response "$data/response.csv" --applied applied --measured measured
        --excitation random --segment 16384 --band 100..2300)
    case $1 in
    decay) echo "$torqcomp" identify decay "$data/decay.csv" --json ;;
    response) echo "$torqcomp" identify "${both[@]}" --modes 2 --json ;;
    modal) echo "$torqcomp" identify "${both[@]}" --json ;;
    esac
}

echo "machine:  $(nproc) cores; load average $(cut -d ' ' -f 1 /proc/loadavg) before the first run"
echo "records:  $rows samples each; read once before"
for job in decay response modal; do
    record=$data/response.csv
    [[ $job == decay ]] && record=$data/decay.csv
    read -ra command <<<"$(ours $job)"
    "${command[@]}" >"$data/ours.json" 2>/dev/null || fail "torqcomp failed at $job"
    "$python" "$here/identify_peer.py" "$job" "$record" "$data/peer.json" || fail "the peer failed at $job"
    echo "$job"
    "$python" "$here/identify_agree.py" "$data/ours.json" "$data/peer.json" ||
        fail "the results do not agree; nothing is measured"
    table=$data/$job.tsv
    rm -f "$table"
    for ((pair = 1; pair <= pairs; pair++)); do
        "$python" "$here/measure.py" "$table" torqcomp "${command[@]}"
        "$python" "$here/measure.py" "$table" peer \
            "$python" "$here/identify_peer.py" "$job" "$record" "$data/peer.json"
    done
    "$python" "$here/summary.py" "$table"
done
