#!/usr/bin/env bash
# Builds a program of a comparison and prints its path: tests/peers/built.sh NAME. With QUICK=1 it is the one that
# `cargo test --workspace` has built, whose kernels are optimised as well.
set -euo pipefail
cd "$(dirname "$0")/../.."
if [ -n "${QUICK:-}" ]; then
    cargo build --locked --workspace --example "$1" >&2
    echo "target/debug/examples/$1"
else
    cargo build --locked --release --package orograph-nodes --example "$1" >&2
    echo "target/release/examples/$1"
fi
