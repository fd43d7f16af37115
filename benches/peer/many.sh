#!/usr/bin/env bash
# Many short logs: one run of torqcomp over their folder, a shell loop over single-file runs of a Python script, and one
# run of torqcomp over one record of the same rows, the torqcomp runs with and without sync to the disk. See README.md.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: benches/peer/many.sh [LOGS [ROWS [PAIRS]]] [-- FLAG ...]

  LOGS    number of logs [1000]
  ROWS    samples in each [20000]
  PAIRS   runs of torqcomp over the folder and over the one record, in turns [5]; the loop runs once
  -- FLAG ...   more flags for torqcomp over the folder, such as --jobs 2

environment
  TORQCOMP     the program [a release build]
  PEER_PYTHON  Python with the packages of requirements.txt [the environment that run.sh makes]
  PEER_DATA    folder of the logs and the results, such as /dev/shm/peer [peer, in cargo's target folder]
TEXT
}

fail() {
    echo "many.sh: $*" >&2
    exit 1
}

counts=()
while (($#)); do
    case $1 in
    --)
        shift
        break
        ;;
    *[!0-9]* | "")
        usage
        [[ $1 == -h || $1 == --help ]] && exit 0
        exit 2
        ;;
    *) counts+=("$1") ;;
    esac
    shift
done
logs=${counts[0]:-1000} rows=${counts[1]:-20000} pairs=${counts[2]:-5}
flags=("$@")

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=benches/peer
target=${CARGO_TARGET_DIR:-target}
data=${PEER_DATA:-$target/peer}/many
python=${PEER_PYTHON:-$target/peer/venv/bin/python}
[[ -x $(command -v "$python") ]] || fail "no Python at $python; run benches/peer/run.sh once, or set PEER_PYTHON"
torqcomp=${TORQCOMP:-}
if [[ -z $torqcomp ]]; then
    cargo build --release --bin torqcomp || fail "torqcomp does not build"
    torqcomp=$target/release/torqcomp
fi

# --- one record, and the same rows as many logs ---------------------------------------------------

rm -rf "$data"
mkdir -p "$data/logs"
record=$data/record.csv
"$python" "$here/make_record.py" --rows $((logs * rows)) "$record" || fail "no record to measure with"
heading=$(head -n 1 "$record")
tail -n +2 "$record" | heading=$heading split -l "$rows" -d -a 5 --additional-suffix .csv \
    --filter '{ echo "$heading"; cat; } >"$FILE"' - "$data/logs/"
[[ $(find "$data/logs" -name '*.csv' | wc -l) == "$logs" ]] || fail "the record was not split into $logs logs"

# --- measure --------------------------------------------------------------------------------------

# Runs a command and prints its wall time and CPU time in seconds.
seconds() {
    sync -f "$data"
    local TIMEFORMAT='%R %U %S'
    { time "$@" >"$data/said" 2>&1; } 2>"$data/took" || { cat "$data/said" >&2; fail "$1 failed"; }
    awk '{ printf "%.3f %.3f\n", $1, $2 + $3 }' "$data/took"
}

loop() {
    mkdir -p "$data/loop"
    for log in "$data"/logs/*.csv; do
        "$python" "$here/peer.py" "$log" "$data/loop/${log##*/}"
    done
}

folder() {
    rm -rf "$data/out"
    "$torqcomp" compensate "$data/logs" --stand "$here/stand.toml" --band rated --quiet -o "$data/out/" "$@" "${flags[@]}"
}

one() {
    "$torqcomp" compensate "$record" --stand "$here/stand.toml" --band rated --quiet --force -o "$data/one.csv" "$@"
}

load=$(cut -d ' ' -f 1 /proc/loadavg)
cat "$record" "$data"/logs/*.csv >/dev/null
for ((pair = 1; pair <= pairs; pair++)); do
    echo "$(seconds folder --no-sync) $(seconds one --no-sync) $(seconds folder) $(seconds one)" >>"$data/pairs"
done
read -r looped _ < <(seconds loop)

# Both results agree, except at the ends of each log.
first=$(find "$data/logs" -name '*.csv' | sort | head -n 1)
name=$(basename "$first" .csv)
"$python" "$here/compare.py" --ends $((rows / 4)) "$data/loop/$name.csv" "$data/out/$name.torque.csv" ||
    fail "the results do not agree"

median() {
    sort -n | awk '{ v[NR] = $1 } END { printf "%.3f\n", NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'
}
# Median of a column, or of the ratio of two.
column() { awk -v of="$1" '{ print $of }' "$data/pairs" | median; }
ratio() { awk -v a="$1" -v b="$2" '{ print $a / ($b > 0 ? $b : 0.001) }' "$data/pairs" | median; }
bytes=$(stat -c %s "$record")
echo "$logs logs of $rows rows, $((bytes / 1000000)) MB, on $(stat -f -c %T "$data"); $(nproc) cores, load average $load before"
echo "medians of $pairs pairs           folder s  one record s  ratio   processor time: folder s  one record s  ratio"
print_pair() {
    printf '%-30s %9s %13s %6.2f %25s %13s %6.2f\n' "$1" "$(column "$2")" "$(column $(($2 + 2)))" "$(ratio "$2" $(($2 + 2)))" \
        "$(column $(($2 + 1)))" "$(column $(($2 + 3)))" "$(ratio $(($2 + 1)) $(($2 + 3)))"
}
print_pair "without waiting for the disk" 1
print_pair "results durable" 5
echo "shell loop over Python runs: $looped s, $(awk -v a="$looped" -v b="$(column 5)" 'BEGIN { printf "%.1f", a / b }') times as long as the folder with durable results"
