#!/usr/bin/env bash
# Many short logs: one run of torqcomp over their folder, a shell loop over one-file runs of a Python reader, and one run of
# torqcomp over one record of the same rows. See README.md.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: benches/peer/many.sh [LOGS [ROWS [PAIRS]]] [-- FLAG ...]

  LOGS    number of logs [1000]
  ROWS    samples in each [20000]
  PAIRS   runs of torqcomp over the folder and over the one record, in turns [5]; the loop runs once
  -- FLAG ...   more flags for torqcomp, such as --no-sync or --jobs 2

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

# Runs a command and prints the seconds that it took.
seconds() {
    sync -f "$data"
    local begun=$EPOCHREALTIME
    "$@" >"$data/said" 2>&1 || { cat "$data/said" >&2; fail "$1 failed"; }
    awk -v from="$begun" -v to="$EPOCHREALTIME" 'BEGIN { printf "%.3f\n", to - from }'
}

loop() {
    mkdir -p "$data/loop"
    for log in "$data"/logs/*.csv; do
        "$python" "$here/peer.py" "$log" "$data/loop/${log##*/}"
    done
}

folder() {
    rm -rf "$data/out"
    "$torqcomp" compensate "$data/logs" --stand "$here/stand.toml" --band rated --quiet -o "$data/out/" "${flags[@]}"
}

one() {
    local alone=()
    for flag in "${flags[@]}"; do
        [[ $flag == --no-sync ]] && alone+=("$flag")
    done
    "$torqcomp" compensate "$record" --stand "$here/stand.toml" --band rated --quiet --force -o "$data/one.csv" "${alone[@]}"
}

load=$(cut -d ' ' -f 1 /proc/loadavg)
cat "$record" "$data"/logs/*.csv >/dev/null
for ((pair = 1; pair <= pairs; pair++)); do
    a=$(seconds folder)
    b=$(seconds one)
    echo "$a $b" >>"$data/pairs"
done
looped=$(seconds loop)

# The results of both ways agree, but for the ends of each log.
first=$(find "$data/logs" -name '*.csv' | sort | head -n 1)
name=$(basename "$first" .csv)
"$python" "$here/compare.py" --ends $((rows / 4)) "$data/loop/$name.csv" "$data/out/$name.torque.csv" ||
    fail "the results do not agree"

median() {
    sort -n | awk '{ v[NR] = $1 } END { printf "%.3f\n", NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'
}
folder_s=$(cut -d ' ' -f 1 "$data/pairs" | median)
one_s=$(cut -d ' ' -f 2 "$data/pairs" | median)
ratio=$(awk '{ print $1 / $2 }' "$data/pairs" | median)
bytes=$(stat -c %s "$record")
echo "$logs logs of $rows rows, $((bytes / 1000000)) MB, on $(stat -f -c %T "$data"); $(nproc) cores, load average $load before"
echo "one run over the folder:       $folder_s s (median of $pairs)  ${flags[*]}"
echo "one run over one record:       $one_s s; the folder takes $ratio times as long (median of pairs)"
echo "shell loop over Python runs:   $looped s, $(awk -v a="$looped" -v b="$folder_s" 'BEGIN { printf "%.1f", a / b }') times as long as the folder"
