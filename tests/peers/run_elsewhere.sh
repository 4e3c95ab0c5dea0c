#!/usr/bin/env bash
# Opens what the program writes with geopandas, xarray and Blender: tests/peers/run_elsewhere.sh. Blender's module is some 350 MB.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
[ -x $folder/elsewhere/bin/python ] || python3 -m venv $folder/elsewhere
$folder/elsewhere/bin/pip install --quiet --only-binary :all: -r tests/peers/requirements_elsewhere.txt
cargo build --locked -p orograph --no-default-features
MATURIN_PEP517_ARGS="--profile dev --locked" $folder/elsewhere/bin/pip install --quiet ./crates/python
$folder/elsewhere/bin/python tests/peers/elsewhere.py target/debug/orograph $folder/elsewhere_out
