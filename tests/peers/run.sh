#!/usr/bin/env bash
# Compares flow routing and river incision with other programs: tests/peers/run.sh [SIDE ...], 1024 by default.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/venv/bin/python ] || python3 -m venv $folder/venv
$folder/venv/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements.txt
program=$(tests/peers/built.sh bench_flow)
$folder/venv/bin/python tests/peers/flow.py "$program" $folder "${REPEATS:-5}" "${@:-1024}"
