#!/usr/bin/env bash
# Compares the reading of compressed GeoTIFF with GDAL: tests/peers/run_read.sh [SIDE], 10000 by default.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/gis/bin/python ] || python3 -m venv $folder/gis
$folder/gis/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements_gis.txt
program=$(tests/peers/built.sh bench_read)
$folder/gis/bin/python tests/peers/read.py "$program" $folder "${REPEATS:-5}" "${1:-10000}"
