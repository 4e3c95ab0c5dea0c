"""Land for comparisons with other programs: the same for all of them."""

import numpy as np


def hills(side, rng, relief=1000.0):
    """Relief of so many metres above 0, with amplitudes that grow with the square of the wavelength."""
    k = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    k[0, 0] = np.inf
    shape = (side, side // 2 + 1)
    land = np.fft.irfft2((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / k**2, s=(side, side))
    land *= relief / np.ptp(land)
    return land - land.min()


def terrain(side, seed=7):
    """Such hills in single precision."""
    return hills(side, np.random.default_rng(seed)).astype("<f4")
