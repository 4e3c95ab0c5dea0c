#!/bin/sh
# Writes docs/validation.md: elevation models against their reference, presets against the windows of real places.
# `run.sh ranges` prints what the presets miss at the ends of the ranges of their parameters instead.
set -eu
cd "$(dirname "$0")/../.."
cargo build --release -p orograph -p orograph-tests --bin orograph --example validation
"${CARGO_TARGET_DIR:-target}/release/examples/validation" "$@"
