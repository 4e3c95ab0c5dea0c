#!/usr/bin/env bash
# Installs the Python package into a fresh environment and runs its tests: crates/python/tests/run.sh. The module is built
# in the dev profile beside the rest, in which the kernels are optimised, so that most of it is there already.
set -euo pipefail
cd "$(dirname "$0")/../../.."
environment=target/python
if ! { python3 -m venv --clear "$environment" &&
    "$environment/bin/pip" install --quiet --only-binary :all: -r crates/python/tests/requirements.txt; } >/dev/null 2>&1; then
    echo "SKIPPED: the packages that the tests need cannot be installed here"
    exit 0
fi
cargo build --locked -p orograph --no-default-features
MATURIN_PEP517_ARGS="--profile dev --locked" "$environment/bin/pip" install --quiet ./crates/python
"$environment/bin/python" -m mypy --strict --no-error-summary crates/python/python/orograph
"$environment/bin/python" -m mypy.stubtest --ignore-disjoint-bases orograph._orograph
OROGRAPH="$PWD/target/debug/orograph" "$environment/bin/python" -m pytest -q crates/python/tests
