#!/usr/bin/env bash
# Compares the writing of files with other programs: tests/peers/run_write.sh [SIDE], 4096 by default.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/write/bin/python ] || python3 -m venv $folder/write
$folder/write/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements_write.txt
program=$(tests/peers/built.sh bench_write)
$folder/write/bin/python tests/peers/write.py "$program" $folder "${REPEATS:-5}" "${1:-4096}"
