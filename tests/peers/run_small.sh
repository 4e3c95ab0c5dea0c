#!/usr/bin/env bash
# Runs the comparisons whose peers the Python package index has, once each on 128 cells: tests/peers/run_small.sh. Where the
# peers cannot be installed, a notice says so.
set -euo pipefail
cd "$(dirname "$0")/../.."
for peers in venv:requirements.txt:run.sh venv:requirements.txt:run_chi.sh taichi:requirements_pipe.txt:run_pipe.sh write:requirements_write.txt:run_write.sh gis:requirements_gis.txt:run_gis.sh gis:requirements_gis.txt:run_read.sh; do
    IFS=: read -r folder requirements script <<<"$peers"
    if ! { python3 -m venv "target/peers/$folder" && "target/peers/$folder/bin/pip" install --quiet --only-binary :all: \
        -r "tests/peers/$requirements"; } >/dev/null 2>&1; then
        echo "SKIPPED $script: its peers cannot be installed here"
        continue
    fi
    QUICK=1 REPEATS=1 GROWTH=128 "tests/peers/$script" 128
done
