"""Chi and channel steepness beside TopoToolbox, on a real model whose drainage network is unique.

TopoToolbox integrates by the trapezoidal rule; a link of `Steepness` has the area of its upper cell, whose water alone
runs along it. With that rule on TopoToolbox's network, both must agree to the last digits of single precision.
"""

import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import topotoolbox

SIDE, CELL_M, CHANNEL_M2, THETA, REFERENCE_M2 = 256, 30.0, 99_999.0, 0.45, 1e6
GRAPH = """(
    format: 1,
    world: (size: (7680, 7680), cells: (256, 256), boundary: open),
    nodes: {
        "land":  Import(file: "land.r32"),
        "flow":  Flow(height: "land"),
        "steep": Steepness(flow: "flow.flow", channel_area: 99999, hillslopes: false, reach: "1 km"),
    },
    outputs: { "chi": "steep.chi", "steepness": "steep.steepness", "area": "flow.area" },
)
"""


def ours(program, folder):
    """Returns chi, steepness and area of this program."""
    (folder / "graph.ron").write_text(GRAPH)
    sidecar = {"columns": SIDE, "rows": SIDE, "cell_m": CELL_M}
    (folder / "land.r32.json").write_text(json.dumps(sidecar))
    run = [program, "run", folder / "graph.ron", "-o", folder / "out", "--format", "r32", "--no-cache", "--quiet"]
    subprocess.run(run, check=True)
    read = lambda name: np.fromfile(folder / "out" / f"{name}.r32", "<f4").reshape(SIDE, SIDE).astype(float)
    return read("chi"), read("steepness"), read("area")


def main():
    program, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy("tests/data/bigtujunga_drained_256.f32", folder / "land.r32")
    chi, steepness, area = ours(program, folder)

    land = topotoolbox.GridObject()
    land.z = np.fromfile(folder / "land.r32", "<f4").reshape(SIDE, SIDE)
    land.cellsize = CELL_M
    flow = topotoolbox.FlowObject(land)
    cells = flow.flow_accumulation()
    streams = topotoolbox.StreamObject(flow, units="m2", threshold=CHANNEL_M2)
    rows, columns = streams.node_indices
    areas = np.array(cells.z, float)[rows, columns] * CELL_M**2
    theirs = np.array(streams.chitransform(cells, a0=REFERENCE_M2, mn=THETA), float)
    assert np.array_equal(areas, area[rows, columns]), "the networks differ"

    # the same network, with the area of the upper cell of each link
    weights, lengths = (REFERENCE_M2 / areas) ** THETA, streams.node_to_node_distance()
    by_upper = np.zeros(len(areas))
    for link in range(len(streams.source) - 1, -1, -1):
        upper, lower = streams.source[link], streams.target[link]
        by_upper[upper] = by_upper[lower] + lengths[link] * weights[upper]
    found = chi[rows, columns]
    worst = np.max(np.abs(found - by_upper) / np.maximum(by_upper, 1.0))
    inner = theirs > 0
    apart = np.percentile(found[inner] / theirs[inner] - 1.0, [5, 50, 95])

    print(f"{len(areas)} channel cells of the Big Tujunga model, {SIDE} x {SIDE} cells of {CELL_M:g} m")
    print(f"chi by the same rule: at most {worst:.1e} apart")
    print("chi above that by the trapezoidal rule: 5, 50, 95 % of the cells: " + ", ".join(f"{100 * v:.2f} %" for v in apart))
    cellwise = np.array(streams.ksn(land, cells, theta=THETA), float)
    medians = [np.median(values) for values in (steepness[rows, columns], cellwise)]
    print(f"median steepness: {medians[0]:.1f} over 1 km, {medians[1]:.1f} of single cells in TopoToolbox")
    assert worst < 1e-6, "chi differs"
    assert abs(apart[1]) < 0.02 and abs(medians[0] / medians[1] - 1.0) < 0.1, "the figures differ by more than their rules"


if __name__ == "__main__":
    main()
