#!/usr/bin/env bash
# Runs every test that a graphics driver could change as on a machine without one: tests that draw are skipped with a notice,
# and all others must pass.
#
#     tests/no_driver/run.sh
#
# With QUICK=1, of the command line and the editor only those that look for a driver, draw, or open views in 3D.
set -euo pipefail
cd "$(dirname "$0")/../.."

some=()
[ -z "${QUICK:-}" ] || some=(driver vulkan 3d backends:: looks:: opening:: viewport:: welcome::)
blind() { env -u OROGRAPH_ALL_TESTS WGPU_BACKEND=vulkan VK_DRIVER_FILES=/none VK_ICD_FILENAMES=/none "$@"; }
blind cargo test --locked --workspace --test cli --test editor -- ${some[@]+"${some[@]}"}
blind cargo test --locked --workspace --exclude orograph-graph --exclude orograph-nodes --lib --test window
# The two other packages draw nothing; of their tests and of the suite, only those with `gpu` in their names can tell the
# difference.
blind cargo test --locked --workspace --lib --test suite -- gpu
