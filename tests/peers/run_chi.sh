#!/usr/bin/env bash
# Compares chi and channel steepness with TopoToolbox on a real model: tests/peers/run_chi.sh.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/venv/bin/python ] || python3 -m venv $folder/venv
$folder/venv/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements.txt
program=${OROGRAPH:-target/release/orograph}
[ -x "$program" ] || program=target/debug/orograph
[ -x "$program" ] || { echo "no $program: build it with \`cargo build --release\`, or name it in OROGRAPH"; exit 1; }
$folder/venv/bin/python tests/peers/chi.py "$program" $folder/chi
