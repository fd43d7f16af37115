#!/usr/bin/env bash
# Compares torqcomp with a typical Python script on one record. See README.md.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: benches/peer/run.sh [--rows N] [--pairs N] [--threads N] [--tuned] [-- FLAG ...]

  --rows N      samples in the record [10000000]
  --pairs N     measured runs of each program [7]
  --threads N   threads of torqcomp [its default]; the peer always has all cores
  --tuned       let the peer spare the frequencies above the band
  -- FLAG ...   more flags for torqcomp, such as --digits 9

environment
  PEER_CACHE        folder of the Python environment [peer, in cargo's target folder]
  PEER_DATA         folder of the record and the outputs [the same], such as /dev/shm/peer
  PYTHON            Python 3.11 or later [python3]
  CARGO_TARGET_DIR  as cargo takes it
TEXT
}

fail() {
    echo "run.sh: $*" >&2
    exit 1
}

usage_error() {
    echo "run.sh: $*" >&2
    usage >&2
    exit 2
}

is_count() {
    [[ $1 =~ ^[1-9][0-9]{0,11}$ ]]
}

rows=10000000
pairs=7
peer_flags=()
torqcomp_flags=()
while (($#)); do
    case $1 in
    --rows | --pairs | --threads)
        (($# >= 2)) || usage_error "$1 needs a number"
        is_count "$2" || usage_error "$1: expected a whole number greater than zero, got \"$2\""
        case $1 in
        --rows) rows=$2 ;;
        --pairs) pairs=$2 ;;
        --threads) torqcomp_flags+=(--threads "$2") ;;
        esac
        shift 2
        ;;
    --tuned)
        peer_flags+=(--tuned)
        shift
        ;;
    -h | --help)
        usage
        exit 0
        ;;
    --)
        shift
        torqcomp_flags+=("$@")
        break
        ;;
    *) usage_error "unknown option \"$1\"" ;;
    esac
done
((rows >= 50000)) || usage_error "--rows: expected at least 50000"

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=benches/peer
python=${PYTHON:-python3}

# --- requirements ---------------------------------------------------------------------------------

[[ -r /proc/self/status ]] || fail "needs Linux: peak memory is read from /proc"
command -v cargo >/dev/null || fail "cargo not found; install Rust"
command -v "$python" >/dev/null || fail "$python not found; install Python 3.11 or later, or set PYTHON"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "$python is too old; set PYTHON to Python 3.11 or later"

target=$(cargo metadata --format-version 1 --no-deps |
    "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])') ||
    fail "cargo metadata failed"
cache=${PEER_CACHE:-$target/peer}
data=${PEER_DATA:-$cache}
mkdir -p "$cache" "$data" || fail "cannot make the folders $cache and $data"

# --- set-up: Python environment, torqcomp, record -------------------------------------------------

venv=$cache/venv
if ! cmp -s "$here/requirements.txt" "$venv/installed.txt"; then
    echo "installing $(tr '\n' ' ' <"$here/requirements.txt")..." >&2
    rm -rf "$venv"
    "$python" -m venv "$venv" ||
        fail "cannot make a virtual environment; some systems need the package python3-venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        -r "$here/requirements.txt" || fail "pip could not install the packages"
    cp "$here/requirements.txt" "$venv/installed.txt"
fi
python=$venv/bin/python

cargo build --release --bin torqcomp || fail "torqcomp does not build"
torqcomp=$target/release/torqcomp

record=$data/record-$rows.csv
if [[ ! -f $record || $here/make_record.py -nt $record ]]; then
    echo "writing $rows rows to $record..." >&2
    "$python" "$here/make_record.py" --rows "$rows" "$record" || fail "no record to measure with"
fi

# --- the two programs -----------------------------------------------------------------------------

declare -A output=(
    [peer]=$data/out-peer-$$.csv
    [torqcomp]=$data/out-torqcomp-$$.csv
)
table=$data/runs-$$.tsv
trap 'rm -f "${output[@]}" "$table"' EXIT

peer_command=("$python" "$here/peer.py" "${peer_flags[@]}" "$record" "${output[peer]}")
torqcomp_command=("$torqcomp" compensate "$record" --stand "$here/stand.toml"
    -o "${output[torqcomp]}" --band rated --quiet "${torqcomp_flags[@]}")

measure() {
    local name=$1
    local -n command=${name}_command
    rm -f "${output[$name]}"
    # Pending writes of the previous run must not slow down this one.
    sync -f "$data"
    "$python" "$here/measure.py" "$table" "$name" "${command[@]}" || fail "$name failed"
}

# --- do they agree? This also warms the page cache. -----------------------------------------------

load=$(cut -d ' ' -f 1 /proc/loadavg)
cat "$record" >/dev/null
"${peer_command[@]}" || fail "peer failed"
"${torqcomp_command[@]}" || fail "torqcomp failed"
"$python" "$here/compare.py" "${output[peer]}" "${output[torqcomp]}" ||
    fail "the results do not agree; nothing is measured"
peer_bytes=$(stat -c %s "${output[peer]}")
torqcomp_bytes=$(stat -c %s "${output[torqcomp]}")

# --- measure --------------------------------------------------------------------------------------

for ((pair = 1; pair <= pairs; pair++)); do
    # The programs alternate in going first.
    if ((pair % 2)); then
        measure peer
        measure torqcomp
    else
        measure torqcomp
        measure peer
    fi
done

mib() {
    awk -v bytes="$1" 'BEGIN { printf "%.1f MiB", bytes / 1048576 }'
}

cpu=$(awk -F ': *' '/^model name/ { print $2; exit }' /proc/cpuinfo)
echo
echo "record:    $rows rows, $(mib "$(stat -c %s "$record")")," \
    "on $(stat -f -c %T "$data"); read once before"
echo "machine:   $(nproc) cores, ${cpu:-$(uname -m)}; load average $load before the first run"
echo "peer:      $("$python" -c 'import platform, numpy, polars, scipy
print("Python", platform.python_version(), "numpy", numpy.__version__,
      "scipy", scipy.__version__, "polars", polars.__version__)')" \
    "${peer_flags[*]}; writes $(mib "$peer_bytes")"
echo "torqcomp:  $("$torqcomp" --version) ${torqcomp_flags[*]}; writes $(mib "$torqcomp_bytes")"
echo
"$python" "$here/summary.py" "$table"
