"""Reading a large GeoTIFF beside GDAL on one thread: checks that both read the same numbers, then prints the times.

Run by `run_read.sh`, which installs the peer and builds `bench_read`. The files are those that GDAL writes.
"""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rasterio

from land import terrain

KINDS = [
    ("float32, tiles, predictor 3", "float32", {"tiled": True, "blockxsize": 512, "blockysize": 512, "predictor": 3}),
    ("float32, strips", "float32", {}),
    ("int16, tiles, predictor 2", "int16", {"tiled": True, "blockxsize": 256, "blockysize": 256, "predictor": 2}),
]


def read(path):
    with rasterio.open(path) as file:
        return file.read(1, out_dtype="float32")


def main(bench, folder, repeats, side):
    # a quarter of the land, four times: as large, and sooner made
    land = np.tile(terrain((side + 1) // 2), (2, 2))[:side, :side]
    print(f"{side} x {side} cells, deflate\n")
    print("| file | MB | program | ms | processor ms | ratio |\n| --- | ---: | --- | ---: | ---: | ---: |")
    for name, dtype, options in KINDS:
        path = Path(folder) / "read.tif"
        profile = {
            "driver": "GTiff", "width": side, "height": side, "count": 1, "dtype": dtype, "compress": "deflate",
            "crs": "EPSG:32632", "transform": rasterio.transform.from_origin(0, 0, 10, 10), **options,
        }
        with rasterio.open(path, "w", **profile) as file:
            file.write(land.astype(dtype), 1)
        told = subprocess.run(
            [bench, path, str(repeats)], env={**os.environ, "RAYON_NUM_THREADS": "1"}, check=True, capture_output=True,
            text=True,
        )
        elapsed, ours, total = map(float, told.stdout.split())
        there = read(path)
        assert abs(total - there.sum(dtype="f8")) <= 1e-9 * abs(total), (total, there.sum(dtype="f8"))
        del there
        times, processor = [], []
        for _ in range(repeats):
            start, before = time.perf_counter(), time.process_time()
            read(path)
            times.append(time.perf_counter() - start)
            processor.append(time.process_time() - before)
        peer, size = statistics.median(processor), path.stat().st_size / 1e6
        print(f"| {name} | {size:.0f} | orograph | {elapsed * 1e3:.0f} | {ours * 1e3:.0f} | {ours / peer:.2f} |")
        print(f"| | | GDAL {rasterio.__gdal_version__} | {min(times) * 1e3:.0f} | {peer * 1e3:.0f} | 1.00 |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
