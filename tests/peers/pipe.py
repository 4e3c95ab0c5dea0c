"""Shallow water and erosion beside Taichi, with the same scheme on one terrain: checks the work, then prints the times.

Run by `run_pipe.sh`, which installs Taichi and builds `bench_pipe`.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import taichi as ti

from land import terrain

CELL_M, GRAVITY, RAIN = 30.0, 9.81, 20.0 / 3.6e6
CAPACITY, SETTLING, ENTRAINMENT, ACCELERATION = 0.01 / 0.02, 0.02, 0.2, 2000.0
FILM_M, DEEP_M, THICKEST, STEEPEST = 1e-4, 5.0, 0.3, 2.0
STEPS, COURANT = 40, 0.02
# Our longest step as long as no water is 5 cm deep, so that both take the same ones.
SECONDS = STEPS * COURANT * CELL_M / np.sqrt(GRAVITY * np.float32(0.05)) * (1.0 - 1e-9)
# A step of ours is timed over a longer run, in which what the node does before and after counts little.
TIMED_S = 8 * SECONDS


@ti.func
def clamped(k, n):
    return ti.min(ti.max(k, 0), n - 1)


@ti.data_oriented
class Pipes:
    """Virtual pipes as high as the water over the face, erosion by the work of the water, conservative upwind transport.

    One kernel per stage and one field per raster, as the documentation of Taichi writes such solvers.
    """

    def __init__(self, height):
        self.n = height.shape[0]
        self.height = height
        field = lambda: ti.field(ti.f32, shape=(self.n, self.n))
        self.bed, self.depth, self.wet, self.sediment, self.load = (field() for _ in range(5))
        self.west, self.north, self.share, self.flow = (field() for _ in range(4))

    def reset(self):
        self.bed.from_numpy(self.height)
        for raster in (self.depth, self.wet, self.sediment, self.load, self.west, self.north, self.share, self.flow):
            raster.fill(0.0)

    @ti.kernel
    def rain(self, dt: ti.f32):
        for j, i in self.wet:
            self.wet[j, i] = self.depth[j, i] + dt * RAIN

    @ti.func
    def face(self, q, ja, ia, jb, ib, dt):
        a, b = self.wet[ja, ia], self.wet[jb, ib]
        step = self.bed[ja, ia] - self.bed[jb, ib]
        depth = ti.max(a + ti.min(step, 0.0), b - ti.max(step, 0.0))
        moved = q + GRAVITY * dt / CELL_M * depth * (step + a - b)
        return ti.select(depth > 1e-4, moved, 0.0)

    @ti.kernel
    def discharge(self, dt: ti.f32):
        for j, i in self.wet:
            if i > 0:
                self.west[j, i] = self.face(self.west[j, i], j, i - 1, j, i, dt)
            if j > 0:
                self.north[j, i] = self.face(self.north[j, i], j - 1, i, j, i, dt)

    @ti.func
    def east_of(self, j, i):
        q = 0.0
        if i + 1 < self.n:
            q = self.west[j, i + 1]
        return q

    @ti.func
    def south_of(self, j, i):
        q = 0.0
        if j + 1 < self.n:
            q = self.north[j + 1, i]
        return q

    @ti.kernel
    def shares(self, dt: ti.f32):
        for j, i in self.wet:
            out = ti.max(self.east_of(j, i), 0.0) + ti.max(-self.west[j, i], 0.0)
            out += ti.max(self.south_of(j, i), 0.0) + ti.max(-self.north[j, i], 0.0)
            out *= dt / CELL_M
            self.share[j, i] = ti.select(out > self.wet[j, i], self.wet[j, i] / (out + 1e-30), 1.0)

    @ti.kernel
    def limit(self):
        for j, i in self.wet:
            if i > 0:
                self.west[j, i] *= ti.select(self.west[j, i] > 0.0, self.share[j, i - 1], self.share[j, i])
            if j > 0:
                self.north[j, i] *= ti.select(self.north[j, i] > 0.0, self.share[j - 1, i], self.share[j, i])

    @ti.func
    def fall(self, ja, ia, jb, ib):
        levels = self.bed[ja, ia] + self.wet[ja, ia] - self.bed[jb, ib] - self.wet[jb, ib]
        return ti.min(ti.max(levels, -STEEPEST * CELL_M), STEEPEST * CELL_M)

    @ti.kernel
    def exchange(self, dt: ti.f32):
        for j, i in self.wet:
            west, east, north, south = self.west[j, i], self.east_of(j, i), self.north[j, i], self.south_of(j, i)
            before = self.wet[j, i]
            after = ti.max(before + dt / CELL_M * (west - east + north - south), 0.0)
            self.depth[j, i] = after
            mean = 0.5 * (before + after)
            q = 0.5 * ti.sqrt((west + east) ** 2 + (north + south) ** 2)
            self.flow[j, i] += q * dt
            im, ip, jm, jp = ti.max(i - 1, 0), ti.min(i + 1, self.n - 1), ti.max(j - 1, 0), ti.min(j + 1, self.n - 1)
            work = west * self.fall(j, im, j, i) - east * self.fall(j, ip, j, i)
            work += north * self.fall(jm, i, j, i) - south * self.fall(jp, i, j, i)
            work = ti.max(work, 0.0) / (2.0 * CELL_M)
            sine = work / ti.max(ti.sqrt(work * work + q * q), 1e-30)
            t = ti.min(ti.max((mean / FILM_M - 1.0) / 2.0, 0.0), 1.0)
            power = CAPACITY * sine * q * t * t * (3.0 - 2.0 * t) * ti.max(1.0 - mean / DEEP_M, 0.0)
            missing = ti.min(power, THICKEST * mean) - self.sediment[j, i]
            rate = ti.select(missing > 0.0, ENTRAINMENT, SETTLING / ti.max(mean, 1e-6)) * dt
            most = ti.min((0.005 + 0.05 * mean) * dt, 0.05 * CELL_M)
            taken = ti.min(ti.max(ACCELERATION * missing * (1.0 - ti.exp(-rate)), -most), most)
            lowest = self.bed[j, i]
            for dj, di in ti.static(ti.ndrange((-1, 2), (-1, 2))):
                lowest = ti.min(lowest, self.bed[clamped(j + dj, self.n), clamped(i + di, self.n)])
            taken = ti.min(taken, 0.25 * (self.bed[j, i] - lowest))
            self.share[j, i] = ti.max(taken, -self.sediment[j, i] * ACCELERATION)
            self.load[j, i] = self.sediment[j, i] + self.share[j, i] / ACCELERATION

    @ti.kernel
    def lower(self):
        for j, i in self.bed:
            self.bed[j, i] -= self.share[j, i]

    @ti.func
    def carried(self, q, ja, ia, jb, ib):
        part = 0.0
        if q > 0.0:
            part = self.load[ja, ia] / self.wet[ja, ia]
        if q < 0.0:
            part = self.load[jb, ib] / self.wet[jb, ib]
        return q * part

    @ti.kernel
    def transport(self, dt: ti.f32):
        for j, i in self.load:
            im, ip, jm, jp = ti.max(i - 1, 0), ti.min(i + 1, self.n - 1), ti.max(j - 1, 0), ti.min(j + 1, self.n - 1)
            gain = self.carried(self.west[j, i], j, im, j, i) - self.carried(self.east_of(j, i), j, i, j, ip)
            gain += self.carried(self.north[j, i], jm, i, j, i) - self.carried(self.south_of(j, i), j, i, jp, i)
            self.sediment[j, i] = ti.max(self.load[j, i] + dt / CELL_M * gain, 0.0)

    def run(self):
        dt = SECONDS / STEPS
        for _ in range(STEPS):
            self.rain(dt)
            self.discharge(dt)
            self.shares(dt)
            self.limit()
            self.exchange(dt)
            self.lower()
            self.transport(dt)
        ti.sync()


def ours(bench, folder, side, seconds, repeats, threads, *changes):
    """Number of steps, elapsed and processor time of each, and results of bench_pipe on that many threads."""
    command = [bench, folder / "terrain.f32", str(side), str(seconds), str(repeats), folder, "talus=89", f"courant={COURANT}", f"film={FILM_M}", "width=0", *changes]
    environment = os.environ | {"RAYON_NUM_THREADS": str(threads)}
    line = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    steps, elapsed, processor = map(float, line.split())
    read = lambda name: np.fromfile(folder / f"pipe_{name}.f32", "<f4").reshape(side, side)
    return steps, elapsed / steps, processor / steps, {name: read(name) for name in ("height", "water", "sediment")}


def taichi(height, repeats, threads):
    """Elapsed time and median processor time of a step after a first run that is not counted, and the results."""
    ti.init(arch=ti.cpu, cpu_max_num_threads=threads, fast_math=True, default_fp=ti.f32, log_level=ti.ERROR)
    pipes = Pipes(height)
    elapsed, processor = [], []
    for _ in range(repeats + 1):
        pipes.reset()
        ti.sync()
        start, before = time.perf_counter(), time.process_time()
        pipes.run()
        elapsed.append(time.perf_counter() - start)
        processor.append(time.process_time() - before)
    results = {"height": pipes.bed.to_numpy(), "water": pipes.depth.to_numpy(), "sediment": pipes.sediment.to_numpy()}
    return min(elapsed[1:]) / STEPS, float(np.median(processor[1:])) / STEPS, results


def check(height, found, peer):
    """That the same work was done. Exits where it was not."""
    rain = SECONDS * RAIN
    for name, results in (("orograph", found), ("taichi", peer)):
        if abs(results["water"].mean(dtype="f8") / rain - 1.0) > 1e-3:
            sys.exit(f"{name} has not the water that fell")
    apart = np.abs(found["water"] - peer["water"])
    moved = [np.abs(results["height"] - height).mean(dtype="f8") for results in (found, peer)]
    print(f"  depths: {apart.mean():.1e} m apart in the mean of {rain:.1e} m; the bed moved {moved[0]:.4f} m and {moved[1]:.4f} m")
    if apart.mean() > 0.01 * rain or abs(moved[0] / moved[1] - 1.0) > 0.002:
        sys.exit("the results differ")


def main():
    bench, folder, repeats = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    table = []
    for side in map(int, sys.argv[4:]):
        height = terrain(side)
        height.tofile(folder / "terrain.f32")
        print(f"{side} x {side}")
        rows = []
        for threads in (1, 2):
            steps, _, _, found = ours(bench, folder, side, SECONDS, 1, threads, "scheme=pipes")
            if steps != STEPS:
                sys.exit(f"{steps:.0f} steps, not {STEPS}: some water is deeper than 5 cm")
            _, *seconds, _ = ours(bench, folder, side, TIMED_S, repeats, threads, "scheme=pipes")
            rows.append(("pipes", "orograph", threads, *seconds))
            *seconds, peer = taichi(height, repeats, threads)
            check(height, found, peer)
            rows.append(("pipes", f"taichi {'.'.join(map(str, ti.__version__))}", threads, *seconds))
            _, *seconds, _ = ours(bench, folder, side, TIMED_S, repeats, threads)
            rows.append(("inertial", "orograph", threads, *seconds))
        for scheme, program, threads, elapsed, processor in rows:
            own = next(row for row in rows if row[:3] == ("pipes", "orograph", threads))
            ns = [seconds * 1e9 / height.size for seconds in (elapsed, processor)]
            ratio = processor / own[4]
            table.append((scheme, program, threads, side, *(f"{value:.1f}" for value in ns), f"{ratio:.1f}"))
    print()
    head = ("scheme", "program", "threads", "side", "ns/cell/step", "processor ns/cell/step", "ratio")
    for cells in (head, ("---",) * len(head), *table):
        print("| " + " | ".join(map(str, cells)) + " |")


main()
