"""Terrain from a node graph, on NumPy arrays.

>>> import orograph
>>> graph = orograph.load("graphs/hello.ron")
>>> graph.set("rivers.duration", "1 Myr")
>>> result = graph.run(cells=256)
>>> result["height"].array.shape
(256, 256)
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from . import _orograph
from ._arrays import Raster, samples
from ._errors import Error, GraphError, Problem, RunError
from ._orograph import configure

if TYPE_CHECKING:
    import xarray

__all__ = [
    "Error",
    "Graph",
    "GraphError",
    "Problem",
    "Raster",
    "Result",
    "RunError",
    "Timing",
    "configure",
    "load",
    "nodes",
    "parse",
    "schema",
]


def load(path: str | PathLike[str]) -> Graph:
    """Reads a graph file, or an archive of one. Raises `GraphError` if it has problems."""
    return Graph(_orograph.Graph.load(path))


def parse(text: str, folder: str | PathLike[str] = ".") -> Graph:
    """Reads the text of a graph file. File names in it are relative to the folder."""
    return Graph(_orograph.Graph.parse(text, folder))


def nodes() -> dict[str, dict[str, Any]]:
    """The declarations of all kinds of nodes by name, as `orograph nodes --format json` prints them."""
    return {node["id"]: node for node in json.loads(_orograph.nodes())}


def schema() -> dict[str, Any]:
    """The JSON Schema of graph files, as `orograph schema` prints it."""
    found: dict[str, Any] = json.loads(_orograph.schema())
    return found


@dataclasses.dataclass(frozen=True)
class Timing:
    """The cost of a node in a run."""

    node: str
    kind: str
    seconds: float
    bytes: int
    origin: str
    """``computed``, ``memory`` or ``disk``."""


class Result(Mapping[str, Any]):
    """The outputs of a run by name: a `Raster`, lines as GeoJSON (a dictionary), or a report (a dictionary)."""

    def __init__(self, outputs: dict[str, Any], timings: list[Timing], warnings: list[tuple[str, str]]) -> None:
        self._outputs = outputs
        self.timings = timings
        self.warnings = warnings
        """Nodes with their warnings."""

    def __getitem__(self, name: str) -> Any:
        if name not in self._outputs:
            raise KeyError(f"there is no output `{name}`; there are {', '.join(f'`{known}`' for known in self)}")
        return self._outputs[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._outputs)

    def __len__(self) -> int:
        return len(self._outputs)

    def __repr__(self) -> str:
        return f"<orograph.Result: {', '.join(self)}>"

    def to_xarray(self) -> xarray.Dataset:
        """All rasters with their coordinates."""
        import xarray

        rasters = {name: raster.to_xarray() for name, raster in self.items() if isinstance(raster, Raster)}
        planes = {name: raster.rename(plane=f"{name}_plane") for name, raster in rasters.items() if raster.ndim == 3}
        return xarray.Dataset(rasters | planes)


class Graph:
    """A graph file in memory. `load` and `parse` make it."""

    def __init__(self, graph: _orograph.Graph) -> None:
        self._graph = graph

    @property
    def text(self) -> str:
        """The text of the file, with the changes of `set`; comments and layout are kept."""
        return self._graph.text()

    @property
    def json(self) -> dict[str, Any]:
        """The file as JSON, in the form of `schema`."""
        found: dict[str, Any] = json.loads(self._graph.json())
        return found

    @property
    def description(self) -> dict[str, Any]:
        """World, inputs, parameters, outputs and expectations, as `orograph check --describe --json` prints them."""
        found: dict[str, Any] = json.loads(self._graph.describe())
        return found

    @property
    def nodes(self) -> dict[str, str]:
        """The kinds of the nodes by name."""
        return {name: next(iter(node)) for name, node in self.json["nodes"].items()}

    @property
    def outputs(self) -> list[str]:
        """The names of the outputs."""
        return [output["name"] for output in self.description["outputs"]]

    def set(self, name: str, value: object) -> None:
        """Sets an exposed parameter, or a parameter or an input of a node (``"rivers.duration"``).

        A text is in the notation of the file: ``"2 Myr"``, ``"smooth_max"``, or ``"strata.repose"`` for a wire. Numbers,
        booleans, pairs and lists of pairs may also be given as they are.
        """
        self._graph.set(name, _text(value))

    def run(
        self,
        only: str | list[str] | None = None,
        *,
        cells: int | tuple[int, int] | None = None,
        seed: int | None = None,
        window: str | None = None,
        supersample: int | None = None,
        set: Mapping[str, object] | None = None,
        inputs: Mapping[str, npt.ArrayLike] | None = None,
        progress: Callable[[str, float], object] | None = None,
    ) -> Result:
        """Builds the outputs, or only those of some names.

        ``cells``, ``seed``, ``window`` (``"4 km,6 km,2 km x 2 km"``) and ``set`` change this run, and not the graph.
        ``supersample=2`` computes on cells half as large, in four times the time and memory, and gives their means.
        ``inputs`` are arrays over the whole world by the name of an exposed input, of a node or of ``"node.output"``;
        they take the place of what the graph would compute. ``progress`` is called with the name of a node and the
        finished part of its work; an exception that it raises stops the run, as Ctrl-C does.

        Results stay in memory, so that a later run computes only what has changed.
        """
        names = [only] if isinstance(only, str) else list(only or [])
        both = (cells, 0) if isinstance(cells, int) else cells
        settings = [(name, _text(value)) for name, value in (set or {}).items()]
        arrays = [samples(name, array) for name, array in (inputs or {}).items()]
        found, timings, warnings = self._graph.run(names, both, window, supersample, seed, settings, arrays, progress)
        outputs = {
            name: Raster(name, value) if isinstance(value, _orograph.Raster) else json.loads(value[1])
            for name, value in found
        }
        return Result(outputs, [Timing(*timing) for timing in timings], warnings)


def _text(value: object) -> str:
    """A value in the notation of a graph file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return f"({', '.join(_text(item) for item in value)})"
    if isinstance(value, list):
        return f"[{', '.join(_text(item) for item in value)}]"
    if isinstance(value, dict):
        return f"({', '.join(f'{name}: {_text(item)}' for name, item in value.items())})"
    if hasattr(value, "item") and not isinstance(value, (int, float)):
        return _text(value.item())
    if isinstance(value, (int, float)):
        return repr(float(value)) if isinstance(value, float) else repr(int(value))
    raise TypeError(f"{value!r} is not a value of a graph file; write a text, a number, a pair or a list")
