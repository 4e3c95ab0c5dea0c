"""Spectral synthesis as NumPy and SciPy do it, and their transforms alone: processor nanoseconds per cell, one thread.

    python spectral.py SIDE [SIDE ...]
"""

import sys
import time

import numpy
import scipy.fft


def land(side):
    """Gaussian waves whose power falls with the 3.6th power of frequency, summed and scaled to a relief of 250 m."""
    draws = numpy.random.default_rng(1)
    south = numpy.fft.fftfreq(side, 1 / side).astype(numpy.float32)
    east = numpy.arange(side // 2 + 1, dtype=numpy.float32)
    square = south[:, None] ** 2 + east[None, :] ** 2
    square[0, 0] = 1
    root = square ** numpy.float32(-0.9)
    root[0, 0] = 0
    height = scipy.fft.irfft2(waves(draws, side) * root, s=(side, side), workers=1)
    height -= height.mean()
    height *= 250 / height.std()
    return height


def waves(draws, side):
    shape = (side, side // 2 + 1)
    real, imaginary = (draws.standard_normal(shape, dtype=numpy.float32) for _ in range(2))
    return (real + 1j * imaginary).astype(numpy.complex64)


def best(run, cells, times=3):
    spent = []
    for _ in range(times):
        start = time.process_time()
        run()
        spent.append(time.process_time() - start)
    return min(spent) * 1e9 / cells


for side in map(int, sys.argv[1:]):
    some = waves(numpy.random.default_rng(2), side)
    shape, cells = (side, side), side * side
    print(f"{side}: node {best(lambda: land(side), cells):.1f}", end=", ")
    print(f"scipy.fft.irfft2 {best(lambda: scipy.fft.irfft2(some, s=shape, workers=1), cells):.1f}", end=", ")
    print(f"numpy.fft.irfft2 {best(lambda: numpy.fft.irfft2(some, s=shape), cells):.1f}")
