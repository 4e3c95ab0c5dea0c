"""Reads what the program writes with rasterio, rio-cogeo, zarr and xarray, and compares its warps with GDAL's.

`gis.py PROGRAM SIDE`: worlds and rasters have about SIDE cells a side.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import rasterio
import rasterio.enums
import rasterio.warp
import xarray as xr
from rasterio.transform import from_origin
from rasterio.vrt import WarpedVRT
from rio_cogeo.cogeo import cog_validate

ROOT = Path(__file__).resolve().parent.parent.parent


def run(program, *args):
    ran = subprocess.run([program, *map(str, args)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


def cog(program, folder, side):
    """Coordinate system, transform and numbers of a cloud-optimised GeoTIFF."""
    common = ["run", ROOT / "graphs/carve_dem.ron", "--cells", side, "--only", "height"]
    run(program, *common, "-o", folder / "cog", "--format", "cog")
    run(program, *common, "-o", folder / "raw", "--format", "r32")
    path = folder / "cog/height.tif"
    valid, errors, warnings = cog_validate(str(path), strict=True, quiet=True)
    assert valid, (errors, warnings)
    with rasterio.open(path) as file:
        assert file.crs.to_epsg() == 32611, file.crs
        assert (file.transform.c, file.transform.f) == (394313.6554542635, 3805517.8276283755), file.transform
        assert file.transform.a == -file.transform.e > 0 and file.transform.b == file.transform.d == 0
        land, overviews = file.read(1), file.overviews(1)
    assert land.tobytes() == (folder / "raw/height.r32").read_bytes()
    print(f"cog: EPSG:32611, {land.shape[1]} x {land.shape[0]} cells, valid, overviews {overviews}")


def warp(program, folder, side):
    """The largest distance, in cells of the world, between where PROJ and GDAL say that a value lies, and where ours has it.

    The rasters are ramps of columns and of rows, so a difference of values is one of positions. Where cells of the world
    are larger, GDAL widens its cubic, and we average cells as areas.
    """
    corner, epsg = (505_000.0, 5_215_000.0), 32632
    rows = []
    for source, cell in (("EPSG:4326", 0.0004), ("EPSG:3857", 40.0)):
        for metres in (20.0, 33.0, 90.0):
            span = side * metres
            world = (corner[0], corner[1] - span, corner[0] + span, corner[1])
            west, south, east, north = rasterio.warp.transform_bounds(f"EPSG:{epsg}", source, *world)
            # a margin of some cells
            origin = (west - 5.3 * cell, north + 4.7 * cell)
            columns, lines = (int((east - west) / cell) + 12, int((north - south) / cell) + 12)
            east, south = np.meshgrid(np.arange(columns, dtype="f4"), np.arange(lines, dtype="f4"))
            off = []
            for axis, ramp in enumerate((east, south)):
                name = folder / "ramp.tif"
                transform = from_origin(*origin, cell, cell)
                profile = {"driver": "GTiff", "width": columns, "height": lines, "count": 1, "dtype": "float32"}
                with rasterio.open(name, "w", crs=source, transform=transform, **profile) as file:
                    file.write(ramp, 1)
                graph = folder / "warp.ron"
                graph.write_text(
                    f"(world: (size: ({span}, {span}), cells: {side}, place: (epsg: {epsg}, corner: {corner})),"
                    ' nodes: { "land": Import(version: 2, file: "ramp.tif", quantity: scalar, placement: place) },'
                    ' outputs: { "ramp": "land" })'
                )
                run(program, "run", graph, "-o", folder / "warp", "--format", "r32", "--no-cache")
                ours = np.fromfile(folder / "warp/ramp.r32", "<f4").reshape(side, side).astype(float)
                with rasterio.open(name) as file, WarpedVRT(
                    file, crs=f"EPSG:{epsg}", transform=from_origin(*corner, metres, metres), width=side, height=side,
                    resampling=rasterio.enums.Resampling.cubic, tolerance=0.001,
                ) as warped:
                    theirs = warped.read(1).astype(float)
                at = (np.arange(side) + 0.5) * metres
                xs, ys = np.meshgrid(corner[0] + at, corner[1] - at)
                exact = rasterio.warp.transform(f"EPSG:{epsg}", source, xs.ravel(), ys.ravel())[axis]
                exact = np.abs(np.array(exact) - origin[axis]).reshape(side, side) / cell - 0.5
                step = np.abs(np.gradient(exact, axis=1 - axis))
                off.append([np.max(np.abs(a - b) / step) for a, b in ((ours, exact), (theirs, exact), (ours, theirs))])
            rows.append((source, metres, *np.max(off, axis=0)))
            assert rows[-1][2] < 0.07 and rows[-1][4] < 0.1, rows[-1]
    print("| warp to EPSG:32632 | cell m | ours, PROJ | GDAL, PROJ | ours, GDAL |\n| --- | ---: | ---: | ---: | ---: |")
    for source, metres, *off in rows:
        print(f"| {source} | {metres:.0f} | " + " | ".join(f"{value:.4f}" for value in off) + " |")


def cube(program, folder, side):
    """Labels, coordinates and statistics of a cube as xarray reads them."""
    graph = folder / "cube.ron"
    graph.write_text(
        f'(world: (size: 3200, cells: {side // 4}, place: (epsg: 32632, corner: (505000, 5215000))),'
        ' nodes: { "land": Ridged(amplitude: 300) }, outputs: { "height": "land" })'
    )
    sweep = ["--sweep", "seed=1..5", "--sweep", "land.amplitude=200 m,400 m"]
    run(program, "run", graph, "--cube", *sweep, "--above", "height=120", "-o", folder / "cube")
    run(program, "run", graph, "--seed", 4, "--set", "land.amplitude=400 m", "--format", "tiff", "-o", folder / "one")
    data = xr.open_zarr(folder / "cube/cube.zarr", consolidated=True)
    assert data.height.dims == ("land_amplitude", "seed", "y", "x"), data.height.dims
    assert data.height.units == "m" and data.land_amplitude.units == "m" and data.x.standard_name == "projection_x_coordinate"
    one = data.height.sel(land_amplitude=400, seed=4)
    with rasterio.open(folder / "one/height.tif") as file:
        assert np.array_equal(one.values, file.read(1))
        east, north = file.xy(0, 0)
        assert (float(one.x[0]), float(one.y[0])) == (east, north)
        assert rasterio.crs.CRS.from_user_input(data.spatial_ref.attrs["spatial_ref"]) == file.crs
    members = data.height.values.reshape(10, side // 4, side // 4)
    assert np.array_equal(data.height_mean.values, members.astype(float).mean(axis=0).astype("f4"))
    assert list(data["quantile"].values) == [0.05, 0.5, 0.95]
    quantiles = np.quantile(members.astype(float), data["quantile"].values, axis=0)
    assert np.allclose(data.height_quantile.values, quantiles, rtol=1e-6)
    assert np.array_equal(data.height_above.values[0], (members > 120).mean(axis=0).astype("f4"))
    print(f"cube: {dict(data.sizes)}, as xarray {xr.__version__} reads it")


def main(program, side):
    with tempfile.TemporaryDirectory() as folder:
        for check in (cog, warp, cube):
            check(program, Path(folder), side)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
