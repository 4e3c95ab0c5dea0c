#!/usr/bin/env bash
# Kills real runs at random times and looks at what they leave: tests/faults/run.sh [KILLS] [FIRST SEED]
#
# Two builds of the same graph, with other seeds, replace each other's files. After each kill every file must be of one
# build, all of the same one, and each raster must have its own JSON file; then a run of another output into the folder
# completes or removes what the killed one began, after which one build must be whole. Prints how many kills fell into
# which state, and exits with 1 after a mixture.
set -euo pipefail
kills=${1:-1000}
RANDOM=${2:-1}
cd "$(dirname "$0")/../.."
# OROGRAPH names a program that is already built
program=${OROGRAPH:-}
if [ -z "$program" ]; then
    cargo build --release --locked -p orograph
    program=$(realpath "${CARGO_TARGET_DIR:-target}/release/orograph")
fi
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
export OROGRAPH_CACHE= LC_ALL=C

cat > g.ron <<'GRAPH'
(
    world: (size: "8 km", cells: 128),
    nodes: {
        "land": Ridged(wavelength: "3 km"), "relief": Hillshade(height: "land"), "slope": Slope(height: "land"),
    },
    outputs: { "height": "land", "relief": "relief.colour", "slope": "slope.slope", "mask": "slope.mask" },
)
GRAPH
echo '(world: (size: 100, cells: 2), nodes: { "c": Constant(value: 1) }, outputs: { "other": "c" })' > other.ron

options=(run g.ron -q --format png16 --engine unity)
run() { "$program" "${options[@]}" --seed "$1" -o "$2"; }
# there may be no files
digest() { (cd "$1" && find . -maxdepth 1 -type f ! -name 'other.*' ! -name '.orograph-*' -exec sha256sum {} + | sort); }
for seed in 1 2; do run $seed clean$seed; digest clean$seed > set$seed; done

# the time of a run in microseconds, the median of five
times=$(for _ in 1 2 3 4 5; do start=${EPOCHREALTIME/./}; run 1 timed; echo $((${EPOCHREALTIME/./} - start)); done | sort -n)
span=$(echo "$times" | sed -n 3p)

run 1 out
now=1 committing=0 incomplete=0 completed=0 undone=0 finished=0 mixed=0
for ((kill = 1; kill <= kills; kill++)); do
    next=$((3 - now))
    "$program" "${options[@]}" --seed $next -o out 2> /dev/null &
    job=$!
    # half of them in the middle third, where files are written and exchanged
    wait=$(((RANDOM * 32768 + RANDOM) % span))
    if ((RANDOM % 2)); then wait=$((span / 3 + wait / 3)); fi
    sleep "$(printf '%d.%06d' $((wait / 1000000)) $((wait % 1000000)))"
    kill -KILL $job 2> /dev/null || true
    { wait $job && finished=$((finished + 1)); } 2> /dev/null || true
    if compgen -G 'out/.orograph-*/commit.json' > /dev/null; then committing=$((committing + 1)); fi

    digest out > seen
    wrong=
    if [ -n "$(comm -23 seen set1)" ] && [ -n "$(comm -23 seen set2)" ]; then wrong="files of two builds"; fi
    for raster in out/*.png out/*.raw out/*.r16; do
        case $raster in *preview*|*'*'*) continue ;; esac
        [ -f "$raster.json" ] || wrong="$raster without its JSON file"
    done
    if ! cmp -s seen set1 && ! cmp -s seen set2; then incomplete=$((incomplete + 1)); fi

    "$program" run other.ron -q -o out
    digest out > seen
    if cmp -s seen set$next; then
        completed=$((completed + 1))
        now=$next
    elif cmp -s seen set$now; then undone=$((undone + 1)); else wrong="no whole build after the next run"; fi
    if compgen -G 'out/.orograph-*' > /dev/null; then wrong="leftovers after the next run"; fi
    if [ -n "$wrong" ]; then
        mixed=$((mixed + 1))
        echo "kill $kill: $wrong" >&2
        ls -la out >&2
        run $now out
    fi
done
echo "$kills kills, run of $((span / 1000)) ms: $finished after its end, $committing during the exchange" \
    "($incomplete with files missing until the next run); then $completed builds new, $undone as before; $mixed mixed"
[ $mixed -eq 0 ]
