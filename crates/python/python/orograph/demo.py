"""Builds a small range, measures it, and writes a picture: `python -m orograph.demo [PNG]`."""

from __future__ import annotations

import sys
import time

import numpy as np

import orograph

GRAPH = """(
    format: 1,
    world: (size: "24 km", cells: 256, seed: 2, boundary: inland),
    nodes: {
        "ground": Ridged(wavelength: "5 km", amplitude: "300 m"),
        "rise":   Uplift(shape: range, path: [("-4 km", "8 km"), ("28 km", "16 km")], front: "9 km", back: "9 km"),
        "rivers": StreamPower(version: 4, height: "ground", uplift: "rise", erodibility: 2.7e-6, duration: "2 Myr"),
        "report": Metrics(height: "rivers"),
    },
    outputs: { "height": "rivers", "measures": "report" },
)"""


def main(picture: str = "orograph_demo.png") -> None:
    graph = orograph.parse(GRAPH)
    start = time.perf_counter()
    result = graph.run()
    seconds = time.perf_counter() - start
    height = result["height"]
    array = height.array
    print(f"{graph.nodes['rivers']} on {array.shape[1]} x {array.shape[0]} cells of {height.cell_m:g} m in {seconds:.2f} s")
    print(f"heights from {array.min():.0f} m to {array.max():.0f} m, mean {array.mean(dtype=np.float64):.0f} m")
    measures = {measure["name"]: measure for measure in result["measures"]["measures"]}
    for name in ("relief", "hypsometric_integral", "slope.mean", "drainage_density"):
        if measure := measures.get(name):
            print(f"{name}: {measure['value']:.4g} {measure['unit']}".rstrip())
    # an array instead of a node: the same rivers on ground made by NumPy
    x, y = np.meshgrid(height.x, height.y)
    waves = 150 * (np.sin(x / 900) + np.cos(y / 1100)) + 300
    other = graph.run(inputs={"ground": waves})["height"].array
    print(f"on other ground: {other.min():.0f} m to {other.max():.0f} m")
    height.write_png(picture)
    print(f"wrote {picture}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
