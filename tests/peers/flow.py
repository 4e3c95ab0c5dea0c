"""Flow routing and river incision beside other programs, on one terrain: checks the work, then prints the times.

Run by `run.sh`, which installs the peers and builds `bench_flow`.
"""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import fastscapelib as fs
import numpy as np
import richdem as rd
import topotoolbox as tt

import routing
from land import hills

CELL_M = 30.0
STEPS, STEP_YR = 5, 1e4  # as in bench_flow.rs
GROWTH = ("fill", "route", "route_sinks", "d_infinity", "mfd", "first_n1")
OUTPUT_BYTES = {"fill": 4, "route": 4, "route_sinks": 4, "d_infinity": 8, "mfd": 8, "first_n1": 24}  # a cell
LAWS = {1.0: (0.45, 1e-5), 1.5: (0.6, 3e-6), 2.0: (0.9, 1e-6)}  # n: (m, K)


def terrain(side, relief=1000.0, seed=7):
    """Relief of so many metres with amplitudes of wavelength squared, and 0.5 m of white noise: full of small pits."""
    rng = np.random.default_rng(seed)
    land = hills(side, rng, relief)
    return (land + 0.5 * rng.standard_normal((side, side)) + 5.0).astype("<f4")


def timed(repeats, kernel):
    """Shortest time, median processor time in seconds after a first run that is not counted; the last result."""
    kernel()
    shortest, processor = float("inf"), []
    for _ in range(repeats):
        start, before = time.perf_counter(), time.process_time()
        result = kernel()
        processor.append(time.process_time() - before)
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, float(np.median(processor)), result


@contextmanager
def silent():
    """Sends what native code prints nowhere."""
    kept = [os.dup(1), os.dup(2)]
    with open(os.devnull, "w") as nowhere:
        [os.dup2(nowhere.fileno(), to) for to in (1, 2)]
        try:
            yield
        finally:
            [os.dup2(copy, to) for to, copy in zip((1, 2), kept)]


class Peers:
    """Every peer's run of each kernel: name -> [(program, shortest time, processor time, result)]."""

    def __init__(self, height, repeats):
        self.runs = {}
        side = height.shape[0]
        single, double = height.copy(), height.astype("f8")

        def run(kernel, package, repeats, call):
            with silent():
                run = (f"{package} {version(package)}", *timed(repeats, call))
            self.runs.setdefault(kernel, []).append(run)

        dem = tt.GridObject()
        dem.z, dem.cellsize = single, CELL_M
        run("fill", "topotoolbox", repeats, lambda: np.asarray(dem.fillsinks().z))
        rich = rd.rdarray(single, no_data=-9999.0)
        run("fill", "py-richdem", repeats, lambda: np.asarray(rd.FillDepressions(rich, in_place=False)))

        grid = fs.RasterGrid([side, side], [CELL_M, CELL_M], fs.NodeStatus.FIXED_VALUE)
        plain = fs.FlowGraph(grid, [fs.SingleFlowRouter()])
        sinks = fs.FlowGraph(grid, [fs.SingleFlowRouter(), fs.MSTSinkResolver()])

        def cells(graph):
            graph.update_routes(double)
            return graph.accumulate(1.0) / CELL_M**2

        run("route", "fastscapelib", repeats, lambda: cells(plain))
        run("route", "py-richdem", repeats, lambda: np.asarray(rd.FlowAccumulation(rich, method="D8")))
        for kernel, method in (("d_infinity", {"method": "Dinf"}), ("mfd", {"method": "Freeman", "exponent": 1.1})):
            run(kernel, "py-richdem", repeats, lambda: np.asarray(rd.FlowAccumulation(rich, **method)))
        run("route_sinks", "fastscapelib", repeats, lambda: cells(sinks))
        run("route_sinks", "topotoolbox", repeats, lambda: np.asarray(tt.FlowObject(dem).flow_accumulation().z))

        for n, (m, erodibility) in LAWS.items():
            for name, steps in (("steps", STEPS), ("first", 1)):
                law = fs.SPLEroder(sinks, erodibility, m, n, 1e-3)

                def erode():
                    land = double.copy()
                    for _ in range(steps):
                        sinks.update_routes(land)
                        land -= law.erode(land, sinks.accumulate(1.0), STEP_YR)
                    return land

                run(f"{name}_n{n:g}", "fastscapelib", 1, erode)

        sinks.update_routes(double)
        self.receivers = sinks.impl().receivers[:, 0].astype("i8")

    def downstream(self, here):
        """Cells that are in `here` or whose water passes through it."""
        passed, receivers = here.ravel().copy(), self.receivers
        for _ in range(int(np.log2(passed.size)) + 1):
            passed |= passed[receivers]
            receivers = receivers[receivers]
        return passed.reshape(here.shape)


def ours(bench, folder, height, repeats, threads, kernels=()):
    """Times, bytes and results of bench_flow on that many threads."""
    side = height.shape[0]
    height.astype("<f4").tofile(folder / "terrain.f32")
    command = [bench, folder / "terrain.f32", str(side), str(repeats), folder, *kernels]
    environment = os.environ | {"RAYON_NUM_THREADS": str(threads)}
    lines = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.split("\n")
    times = {name: tuple(map(float, seconds)) for name, *seconds in (line.split() for line in lines if line)}
    files = {"fill": "filled", "route": "cells", "route_sinks": "cells_sinks"}
    read = lambda name: np.fromfile(folder / f"{files.get(name, name)}.f32", "<f4").reshape(side, side)
    return times, {name: read(name) for name in times}


def check(height, results, peers):
    """That the same work was done. Exits where it was not; prints what is a matter of choice."""
    for program, _, _, filled in peers.runs["fill"]:
        if not np.array_equal(filled, results["fill"]):
            sys.exit(f"the filled surface differs from that of {program}")
    border = np.ones_like(height, bool)
    border[1:-1, 1:-1] = False
    total = results["route_sinks"][border].sum(dtype="f8")
    if total != height.size:
        sys.exit(f"{total} of {height.size} cells leave the world")
    agree = {}
    for kernel in ("route", "route_sinks"):
        for program, _, _, cells in peers.runs[kernel]:
            same = np.abs(cells - results[kernel]) < 0.5
            agree[kernel, program] = same
            print(f"  {kernel}: {same[~border].mean():.3%} of inner cells drain as many cells as in {program}")
    for program, _, _, cells in peers.runs["mfd"]:
        print(f"  mfd: {routing.agreement(cells, results['mfd']):.3%} of inner cells drain as much as in {program}")
    lakes = results["fill"] > height
    for n in LAWS:
        name = f"first_n{n:g}"
        program, _, _, eroded = peers.runs[name][0]
        # Where neither a lake nor another choice of pass is downstream.
        alike = ~peers.downstream(lakes | ~agree["route_sinks", program])
        error = np.abs(eroded - results[name])[alike].max()
        means = [float((height - land).mean(dtype="f8")) for land in (results[name], eroded)]
        print(f"  {name}: at most {error:.1e} m from {program} on the {alike.mean():.1%} that drain without a lake;")
        print(f"    mean erosion of all {means[0]:.4f} m, {means[1]:.4f} m")
        if error > 0.01:
            sys.exit("the erosion differs")


def check_routing(bench, folder):
    """On a small terrain: our receivers are those of plain NumPy, and py-richdem's are what this knows of them."""
    height = terrain(128)
    results = ours(bench, folder, height, 1, 1, ("route", "d_infinity"))[1]
    rich = rd.rdarray(height.copy(), no_data=-9999.0)
    with silent():
        theirs = {name: np.asarray(rd.FlowAccumulation(rich, method=name)) for name in ("D8", "Dinf")}
    wide = height.astype("f8")
    for what, cells, expected in (
        ("route: ours is steepest descent", results["route"], routing.d8(wide)),
        ("route: py-richdem's goes to the lowest neighbour", theirs["D8"], routing.d8(wide, lowest=True)),
        ("d_infinity: ours is Tarboton's", results["d_infinity"], routing.d_infinity(wide)),
        ("d_infinity: py-richdem's swaps the two shares", theirs["Dinf"], routing.d_infinity(wide, swapped=True)),
    ):
        same = routing.agreement(cells, expected)
        print(f"  {what}, on {same:.3%} of inner cells")
        if same < 0.999:
            sys.exit("the receivers are not what they were said to be")


def check_drained(bench, folder, side=256):
    """On land without lakes the mean erosion is that of fastscapelib with a small tolerance."""
    with silent():
        rich = rd.rdarray(terrain(side), no_data=-9999.0)
        height = np.asarray(rd.FillDepressions(rich, epsilon=True)).astype("<f4")
    results = ours(bench, folder, height, 1, 1, [f"first_n{n:g}" for n in LAWS])[1]
    grid = fs.RasterGrid([side, side], [CELL_M, CELL_M], fs.NodeStatus.FIXED_VALUE)
    graph = fs.FlowGraph(grid, [fs.SingleFlowRouter()])
    land = height.astype("f8")
    graph.update_routes(land)
    area = graph.accumulate(1.0)
    for n, (m, erodibility) in LAWS.items():
        theirs = fs.SPLEroder(graph, erodibility, m, n, 1e-9).erode(land, area, STEP_YR).mean()
        mean = float((land - results[f"first_n{n:g}"]).mean())
        print(f"  first_n{n:g}: mean erosion of drained land {mean:.5f} m, {theirs:.5f} m in fastscapelib")
        if abs(mean - theirs) > 1e-4 * theirs:
            sys.exit("the mean erosion differs")


def growth(bench, folder, repeats, sides):
    """Cost and memory per cell as worlds grow, on land whose slopes and pits are alike: relief grows with the side."""
    rows, first = [], {}
    for side in sides:
        times, results = ours(bench, folder, terrain(side, 1000.0 * side / sides[0]), repeats, 1, GROWTH)
        for kernel, (_, processor, held) in times.items():
            ns = processor * 1e9 / side**2
            first.setdefault(kernel, ns)
            spare = held / side**2 - OUTPUT_BYTES[kernel]
            rows.append((kernel, side, f"{ns:.1f}", f"{ns / first[kernel]:.2f}", f"{spare:.1f}"))
    print_table(("kernel", "side", "processor ns/cell", "growth", "bytes/cell above inputs and outputs"), rows)


def print_table(head, rows):
    print()
    for cells in (head, ("---",) * len(head), *rows):
        print("| " + " | ".join(map(str, cells)) + " |")


def main():
    bench, folder, repeats = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    check_routing(bench, folder)
    check_drained(bench, folder)
    table = []
    for side in map(int, sys.argv[4:]):
        height = terrain(side)
        peers = Peers(height, repeats)
        one, results = ours(bench, folder, height, repeats, 1)
        two, again = ours(bench, folder, height, repeats, 2)
        if any(not np.array_equal(results[name], again[name]) for name in results):
            sys.exit("one and two threads differ")
        print(f"{side} x {side}, lakes on {np.mean(results['fill'] > height):.2%}")
        check(height, results, peers)
        for kernel in one:
            def row(program, threads, shortest, processor):
                ns = [f"{seconds * 1e9 / height.size:.1f}" for seconds in (shortest, processor)]
                table.append((kernel, program, threads, side, *ns, f"{processor / one[kernel][1]:.1f}"))

            row("orograph", 1, *one[kernel][:2])
            row("orograph", 2, *two[kernel][:2])
            for program, *seconds, _ in peers.runs.get(kernel, []):
                row(program, 1, *seconds)
    print_table(("kernel", "program", "threads", "side", "ns/cell", "processor ns/cell", "ratio"), table)
    growth(bench, folder, repeats, [int(side) for side in os.environ.get("GROWTH", "1024 4096").split()])


main()
