#!/usr/bin/env bash
# Reads what the program writes with programs of geographic information systems, and compares its warps with GDAL's:
# tests/peers/run_gis.sh [SIDE], 512 by default.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/gis/bin/python ] || python3 -m venv $folder/gis
$folder/gis/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements_gis.txt
program=target/debug/orograph
# with QUICK=1, the program that the tests have built
[ -n "${QUICK:-}" ] && [ -x $program ] || cargo build --locked --package orograph
$folder/gis/bin/python tests/peers/gis.py $program "${1:-512}"
