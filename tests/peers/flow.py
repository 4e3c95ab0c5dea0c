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

CELL_M = 30.0
STEPS, STEP_YR = 5, 1e4  # as in bench_flow.rs
LAWS = {1.0: (0.45, 1e-5), 1.5: (0.6, 3e-6), 2.0: (0.9, 1e-6)}  # n: (m, K)


def terrain(side, seed=7):
    """1000 m of relief with amplitudes of wavelength squared, and 0.5 m of white noise: full of small pits."""
    rng = np.random.default_rng(seed)
    k = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    k[0, 0] = np.inf
    shape = (side, side // 2 + 1)
    land = np.fft.irfft2((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / k**2, s=(side, side))
    land *= 1000.0 / np.ptp(land)
    return (land - land.min() + 0.5 * rng.standard_normal((side, side)) + 5.0).astype("<f4")


def timed(repeats, kernel):
    """Shortest time, mean processor time in seconds after a first run that is not counted; the last result."""
    kernel()
    shortest, before = float("inf"), time.process_time()
    for _ in range(repeats):
        start = time.perf_counter()
        result = kernel()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, (time.process_time() - before) / repeats, result


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


def ours(bench, folder, side, repeats, threads):
    """Times and results of bench_flow on that many threads."""
    command = [bench, folder / "terrain.f32", str(side), str(repeats), folder]
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
    for kernel in ("d_infinity", "mfd"):
        for program, _, _, cells in peers.runs[kernel]:
            same = np.abs(cells - results[kernel]) < 1e-3 * cells
            print(f"  {kernel}: {same[~border].mean():.3%} of inner cells drain as much as in {program}")
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


def main():
    bench, folder, repeats = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    table = []
    for side in map(int, sys.argv[4:]):
        height = terrain(side)
        height.tofile(folder / "terrain.f32")
        peers = Peers(height, repeats)
        one, results = ours(bench, folder, side, repeats, 1)
        two, again = ours(bench, folder, side, repeats, 2)
        if any(not np.array_equal(results[name], again[name]) for name in results):
            sys.exit("one and two threads differ")
        print(f"{side} x {side}, lakes on {np.mean(results['fill'] > height):.2%}")
        check(height, results, peers)
        for kernel in one:
            def row(program, threads, shortest, processor):
                ns = [f"{seconds * 1e9 / height.size:.1f}" for seconds in (shortest, processor)]
                table.append((kernel, program, threads, side, *ns, f"{processor / one[kernel][1]:.1f}"))

            row("orograph", 1, *one[kernel])
            row("orograph", 2, *two[kernel])
            for program, *seconds, _ in peers.runs.get(kernel, []):
                row(program, 1, *seconds)
    print()
    head = ("kernel", "program", "threads", "side", "ns/cell", "processor ns/cell", "ratio")
    for cells in (head, ("---",) * len(head), *table):
        print("| " + " | ".join(map(str, cells)) + " |")


main()
