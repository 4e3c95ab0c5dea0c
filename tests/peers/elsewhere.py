"""What the program writes, as GIS, xarray and Blender read it: elsewhere.py PROGRAM FOLDER."""

import subprocess
import sys
from pathlib import Path

import geopandas
import numpy as np

import orograph

PROGRAM, FOLDER = sys.argv[1], Path(sys.argv[2])
GRAPH = "graphs/rivers_dem.ron"
EPSG, WEST, NORTH, SIDE, CELL = 32611, 394313.6554542635, 3805517.8276283755, 15360.0, 30.0


def lines() -> str:
    rivers = geopandas.read_file(FOLDER / "rivers.geojson")
    assert rivers.crs.to_epsg() == EPSG, rivers.crs
    west, south, east, north = rivers.total_bounds
    assert WEST <= west < east <= WEST + SIDE and NORTH - SIDE <= south < north <= NORTH, rivers.total_bounds
    off = np.abs(rivers.geometry.length / rivers["length_m"] - 1).max()
    assert off < 1e-4, off
    longest = rivers.geometry.length.max()
    return f"geopandas: {len(rivers)} rivers in EPSG:{rivers.crs.to_epsg()}, the longest {longest:.0f} m; lengths within {off:.1e}"


def cells() -> str:
    data = orograph.load(GRAPH).run(["order", "discharge", "conditioned"]).to_xarray()
    assert data["conditioned"].attrs["crs"] == f"EPSG:{EPSG}"
    assert np.allclose([data.x[0], data.y[0]], [WEST + CELL / 2, NORTH - CELL / 2], atol=1e-6)
    assert np.allclose(np.diff(data.x), CELL) and np.allclose(np.diff(data.y), -CELL)
    # the largest river of the lines runs through cells that xarray finds by their coordinates
    rivers = geopandas.read_file(FOLDER / "rivers.geojson")
    largest = rivers.loc[rivers["area_m2"].idxmax()].geometry
    places = np.array(largest.coords)[:-1, :2]
    found = [float(data["order"].sel(x=x, y=y, method="nearest")) for x, y in places]
    share = float(np.mean(np.array(found) > 0))
    assert share > 0.95, share
    return f"xarray: {share:.1%} of the vertices of the largest river are on cells with a river"


def mesh(ending: str) -> str:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    path = str(FOLDER / f"conditioned.{ending}")
    (bpy.ops.import_scene.gltf if ending == "glb" else bpy.ops.wm.obj_import)(filepath=path)
    found = [thing for thing in bpy.data.objects if thing.type == "MESH"]
    assert len(found) == 1, found
    points = np.array([found[0].matrix_world @ vertex.co for vertex in found[0].data.vertices])
    extent = np.ptp(points, axis=0)
    heights = orograph.load(GRAPH).run("conditioned")["conditioned"].array
    relief = float(np.ptp(heights))
    assert np.all(np.abs(extent[:2] - (SIDE - CELL)) <= CELL + 1) and abs(extent[2] - relief) < 0.02 * relief, (extent, relief)
    faces = len(found[0].data.polygons)
    return f"Blender {bpy.app.version_string}: {ending} with {faces} triangles, {extent[0]:.0f} x {extent[1]:.0f} x {extent[2]:.0f} m"


def main() -> None:
    for ending in ("glb", "obj"):
        run = [PROGRAM, "run", GRAPH, "-o", str(FOLDER), "-q", "--lines", "metres", "--mesh", ending, "--only", "rivers", "--only", "conditioned"]
        subprocess.run(run, check=True)
        if ending == "glb":
            print(lines(), cells(), sep="\n")
        print(mesh(ending))


if __name__ == "__main__":
    main()
