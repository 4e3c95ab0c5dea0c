"""Arrays between NumPy and a graph."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _orograph

if TYPE_CHECKING:
    import xarray


def samples(name: str, array: npt.ArrayLike) -> tuple[str, list[int], Any]:
    """The array as C-ordered 32-bit floats: the same memory if it is that already, else a copy."""
    given = np.asarray(array)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"the array for `{name}` has the type {given.dtype}; it needs numbers (float, int or bool)")
    if given.ndim not in (2, 3):
        raise ValueError(
            f"the array for `{name}` has {given.ndim} dimensions; it needs rows and columns, or planes, rows and columns"
        )
    if isinstance(array, np.ma.MaskedArray) and np.ma.is_masked(array):
        raise ValueError(f"the array for `{name}` has masked cells; fill them first")
    with np.errstate(over="ignore"):
        floats = np.ascontiguousarray(given, dtype=np.float32)
    return name, list(given.shape), floats.reshape(-1)


class Raster:
    """An output with a number, or several, for each cell. Row 0 is north, column 0 west.

    ``numpy.asarray(raster)`` is ``raster.array``.
    """

    def __init__(self, name: str, raster: _orograph.Raster) -> None:
        self.name = name
        self._raster = raster
        self.array: npt.NDArray[np.float32] = np.asarray(raster)
        """The samples, without a copy and read-only: rows and columns, after planes if there are several."""

    @property
    def kind(self) -> str:
        """``height``, ``mask``, ``scalar``, ``vector``, ``colour``, ``normal`` or ``weights``."""
        return self._raster.kind

    @property
    def unit(self) -> str:
        """The symbol of the unit; empty for plain numbers."""
        return self._raster.unit

    @property
    def cell_m(self) -> float:
        """Side of a cell in metres."""
        return self._raster.cell_m

    @property
    def epsg(self) -> int | None:
        """EPSG code of the coordinate system of a world with a place."""
        place = self._raster.place
        return place[0] if place else None

    @property
    def x(self) -> npt.NDArray[np.float64]:
        """Centres of the columns: eastings in a world with a place, else metres from the world's west side."""
        count, cell = self.array.shape[-1], self.cell_m
        place = self._raster.place
        west = place[1][0] if place else self._raster.origin[0] * cell
        return west + (np.arange(count, dtype=np.float64) + 0.5) * cell

    @property
    def y(self) -> npt.NDArray[np.float64]:
        """Centres of the rows: northings in a world with a place, else metres south of the world's north side."""
        count, cell = self.array.shape[-2], self.cell_m
        along = (np.arange(count, dtype=np.float64) + 0.5) * cell
        place = self._raster.place
        return place[1][1] - along if place else self._raster.origin[1] * cell + along

    @property
    def address(self) -> int:
        """The address of the first sample."""
        return self._raster.address

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is False and dtype is not None and np.dtype(dtype) != self.array.dtype:
            raise ValueError(f"`{self.name}` cannot become {np.dtype(dtype)} without a copy")
        return self.array.astype(dtype or self.array.dtype, copy=bool(copy))

    def __repr__(self) -> str:
        shape = " x ".join(str(count) for count in self.array.shape)
        return f"<orograph.Raster {self.name!r}: {self.kind}, {shape}{f', {self.unit}' if self.unit else ''}>"

    def to_xarray(self) -> xarray.DataArray:
        """The raster with its coordinates. The samples are not copied."""
        import xarray

        attributes: dict[str, Any] = {"long_name": self.name, "kind": self.kind}
        if self.unit:
            attributes["units"] = self.unit
        if self.epsg is not None:
            attributes["crs"] = f"EPSG:{self.epsg}"
        names = ("easting", "northing") if self.epsg is not None else ("metres east", "metres south")
        coordinates = {
            "y": ("y", self.y, {"units": "m", "long_name": names[1], "axis": "Y"}),
            "x": ("x", self.x, {"units": "m", "long_name": names[0], "axis": "X"}),
        }
        dimensions = ("y", "x") if self.array.ndim == 2 else ("plane", "y", "x")
        return xarray.DataArray(self.array, coordinates, dimensions, self.name, attributes)

    def write_png(self, path: str | PathLike[str]) -> None:
        """Writes a picture: a height as a map, a colour as it is, other numbers from black to white."""
        self._raster.write_png(path)
