#!/usr/bin/env bash
# Compares noise with other libraries: tests/peers/run_noise.sh [SIDE], 4096 by default. FASTNOISE2 names a folder with the
# sources of FastNoise2, which CXX (clang is best) and CMake then build.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=target/peers
program=$(tests/peers/built.sh bench_noise)
RUSTFLAGS="-C target-cpu=native" cargo build --release --manifest-path tests/peers/noise/Cargo.toml --target-dir $folder/noise
peers=("$folder/noise/release/noise-peers")
if [ -n "${FASTNOISE2:-}" ]; then
    build=$folder/fastnoise2
    cmake -S "$FASTNOISE2" -B $build -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=OFF \
        -DFASTNOISE2_TOOLS=OFF -DFASTNOISE2_TESTS=OFF -DFASTNOISE2_UTILITY=OFF ${FASTSIMD:+-DCPM_FastSIMD_SOURCE="$FASTSIMD"}
    cmake --build $build
    mapfile -t include < <(find $build -type d -name include -printf '-I%p\n')
    "${CXX:-clang++}" -std=c++17 -O3 -DFASTNOISE_STATIC_LIB -DFASTNOISE2_VERSION='"1.1.1"' \
        -I"$FASTNOISE2/include" ${FASTSIMD:+-I"$FASTSIMD/include"} "${include[@]}" \
        tests/peers/fastnoise2.cpp "$(find $build -name '*FastNoise.a')" -o $folder/noise-fastnoise2
    peers+=("$folder/noise-fastnoise2")
fi
pin=()
command -v taskset > /dev/null && pin=(taskset -c 0)
"${pin[@]}" python3 tests/peers/noise.py "${1:-4096}" "${REPEATS:-5}" "$program" "${peers[@]}"
