"""Where others route differently, and how: every routing against plain NumPy on a small terrain."""

import numpy as np

STEPS = [(0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1)]  # as the codes: E, NE, N, ...
FACETS = [(0, 1), (2, 1), (2, 3), (4, 3), (4, 5), (6, 5), (6, 7), (0, 7)]


def neighbours(land):
    """Heights and numbers of the eight neighbours of every cell; infinity beyond the raster."""
    rows, columns = land.shape
    heights = np.pad(land.astype("f8"), 1, constant_values=np.inf)
    numbers = np.pad(np.arange(land.size).reshape(land.shape), 1)
    at = lambda of, step: of[1 + step[0] : 1 + step[0] + rows, 1 + step[1] : 1 + step[1] + columns]
    return [(at(heights, step), at(numbers, step)) for step in STEPS]


def accumulate(land, gives):
    """Number of cells that drain through each; `gives` are pairs of receivers and shares. The border keeps its water."""
    border = np.ones(land.shape, bool)
    border[1:-1, 1:-1] = False
    cells = np.ones(land.size)
    gives = [(to.ravel(), np.where(border, 0.0, share).ravel()) for to, share in gives]
    for cell in np.argsort(-land.ravel(), kind="stable"):
        for to, share in gives:
            cells[to[cell]] += cells[cell] * share[cell]
    return cells.reshape(land.shape)


def d8(land, lowest=False):
    """The neighbour of steepest descent, or the lowest one however far its centre is."""
    steepest, to = np.zeros(land.shape), np.zeros(land.shape, int)
    for (height, number), step in zip(neighbours(land), STEPS):
        slope = (land - height) / (1.0 if lowest else np.hypot(*step))
        to = np.where(slope > steepest, number, to)
        steepest = np.maximum(slope, steepest)
    return accumulate(land, [(to, steepest > 0.0)])


def d_infinity(land, swapped=False):
    """Tarboton's two receivers; `swapped` gives each the share of the other where both get some."""
    around, zero = neighbours(land), np.zeros(land.shape)
    steepest, angle, side_to, corner_to = zero, zero, zero.astype(int), zero.astype(int)
    for side, corner in FACETS:
        (side_height, side_number), (corner_height, corner_number) = around[side], around[corner]
        with np.errstate(invalid="ignore"):
            leg_1, leg_2 = land - side_height, side_height - corner_height
            turn, slope = np.arctan2(leg_2, leg_1), np.hypot(leg_1, leg_2)
        slope = np.where(turn < 0.0, leg_1, np.where(turn > np.pi / 4, (land - corner_height) / np.sqrt(2.0), slope))
        steeper = slope > steepest
        steepest = np.where(steeper, slope, steepest)
        angle = np.where(steeper, np.clip(turn / (np.pi / 4), 0.0, 1.0), angle)
        side_to, corner_to = np.where(steeper, side_number, side_to), np.where(steeper, corner_number, corner_to)
    if swapped:
        angle = np.where((angle > 0.0) & (angle < 1.0), 1.0 - angle, angle)
    falls = steepest > 0.0
    return accumulate(land, [(side_to, falls * (1.0 - angle)), (corner_to, falls * angle)])


def agreement(cells, expected):
    """Share of the inner cells that drain as much as expected."""
    return float(np.mean((np.abs(cells - expected) < 1e-3 * expected)[1:-1, 1:-1]))
