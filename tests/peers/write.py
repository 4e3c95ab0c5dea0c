"""Writing a large raster beside other programs: checks that all hold the same numbers, then prints the times.

Run by `run_write.sh`, which installs the peers and builds `bench_write`.
"""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import rasterio
from PIL import Image
from rio_cogeo.cogeo import cog_validate

from land import terrain


def timed(repeats, write):
    """The shortest elapsed and the median processor time in seconds, after a first run that is not counted."""
    write()
    elapsed, processor = [], []
    for _ in range(repeats):
        start, before = time.perf_counter(), time.process_time()
        write()
        elapsed.append(time.perf_counter() - start)
        processor.append(time.process_time() - before)
    return min(elapsed), statistics.median(processor)


def exr(path, land, compression):
    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Y": OpenEXR.Channel("Y", land)}).write(str(path))


def cog(path, land):
    """As GDAL writes it with the compression, predictor and overviews of ours, on one thread."""
    profile = {
        "driver": "COG", "width": land.shape[1], "height": land.shape[0], "count": 1, "dtype": "float32",
        "crs": "EPSG:32632", "transform": rasterio.transform.from_origin(0, 0, 10, 10),
        "COMPRESS": "DEFLATE", "LEVEL": 6, "PREDICTOR": "YES", "BLOCKSIZE": 512, "OVERVIEW_RESAMPLING": "AVERAGE",
    }
    with rasterio.open(path, "w", **profile) as file:
        file.write(land, 1)


def read_cog(path):
    """The numbers of a file that is valid as cloud-optimised."""
    valid, errors, warnings = cog_validate(str(path), strict=True, quiet=True)
    assert valid, (errors, warnings)
    with rasterio.open(path) as file:
        return file.read(1)


def main(bench, folder, repeats, side):
    folder = Path(folder)
    land = terrain(side)
    raw = folder / "write.f32"
    land.tofile(raw)
    low, high = float(land.min()), float(land.max())
    codes = ((land.astype(np.float64) - low) * (65535.0 / (high - low)) + 0.5).astype(np.uint16)
    rows = []
    for threads in (1, 2):
        environment = {**os.environ, "RAYON_NUM_THREADS": str(threads)}
        told = subprocess.run(
            [bench, raw, str(side), str(repeats), folder], env=environment, check=True, capture_output=True, text=True
        )
        for line in told.stdout.splitlines():
            name, elapsed, processor, size = line.split()
            rows.append((name, "orograph", threads, float(elapsed), float(processor), int(size)))
        files = {path.name: path.read_bytes() for path in sorted(folder.glob("ours_*"))}
        if threads == 1:
            alone = files
        assert files == alone, "the number of threads changes a file"
    assert np.array_equal(cv2.imread(str(folder / "ours_png16.png"), cv2.IMREAD_UNCHANGED), codes)
    assert np.array_equal(OpenEXR.File(str(folder / "ours_exr.exr")).channels()["Y"].pixels, land)

    assert np.array_equal(read_cog(folder / "ours_cog.tif"), land)

    peers = [
        ("cog", f"GDAL {rasterio.__gdal_version__}", "tif", lambda path: cog(path, land)),
        ("png16", f"Pillow {Image.__version__}", "png", lambda path: Image.fromarray(codes).save(path)),
        ("png16", f"OpenCV {cv2.__version__}", "png", lambda path: cv2.imwrite(str(path), codes)),
    ]
    version = OpenEXR.OPENEXR_VERSION if hasattr(OpenEXR, "OPENEXR_VERSION") else OpenEXR.__version__
    for name in ("NO", "ZIP", "PIZ"):
        compression = getattr(OpenEXR, f"{name}_COMPRESSION")
        label = f"OpenEXR {version}, {'uncompressed' if name == 'NO' else name}"
        peers.append(("exr", label, "exr", lambda path, compression=compression: exr(path, land, compression)))
    for name, program, extension, write in peers:
        path = folder / f"peer.{extension}"
        elapsed, processor = timed(repeats, lambda: write(path))
        rows.append((name, program, "", elapsed, processor, path.stat().st_size))
        if extension == "png":
            assert np.array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), codes)
        elif extension == "tif":
            assert np.array_equal(read_cog(path), land)
        else:
            assert np.array_equal(OpenEXR.File(str(path)).channels()["Y"].pixels, land)

    ours = {row[0]: row[4] for row in rows if row[1:3] == ("orograph", 1)}
    print(f"{side} x {side} cells\n")
    print("| format | program | threads | ms | processor ms | MB | ratio |\n| --- | --- | --- | ---: | ---: | ---: | ---: |")
    for name, program, threads, elapsed, processor, size in rows:
        ratio = processor / ours[name]
        print(
            f"| {name} | {program} | {threads} | {elapsed * 1e3:.0f} | {processor * 1e3:.0f} | {size / 1e6:.1f} |"
            f" {ratio:.1f} |"
        )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
