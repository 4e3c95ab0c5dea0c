#!/usr/bin/env bash
# Compares shallow water and erosion with Taichi: tests/peers/run_pipe.sh [SIDE ...], 1024 by default.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/taichi/bin/python ] || python3 -m venv $folder/taichi
$folder/taichi/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements_pipe.txt
program=$(tests/peers/built.sh bench_pipe)
$folder/taichi/bin/python tests/peers/pipe.py "$program" $folder "${REPEATS:-5}" "${@:-1024}"
