"""Exceptions. Their text is what the command line prints; the attributes name the place and the remedy."""

from __future__ import annotations

import dataclasses
import json
from typing import Any


@dataclasses.dataclass(frozen=True)
class Problem:
    """A problem of a graph file."""

    file: str
    line: int
    column: int
    severity: str
    code: str
    message: str
    help: str | None


class Error(Exception):
    """A graph cannot be read or built.

    ``file``, ``line``, ``column`` and ``node`` name the place if it is known, ``code`` is the kind of error in kebab case,
    ``help`` the remedy, and ``problems`` are all problems of a graph file.
    """

    def __init__(self, text: str, facts: str = "{}") -> None:
        super().__init__(text)
        known: dict[str, Any] = json.loads(facts)
        self.message: str = known.get("message", text)
        self.code: str = known.get("code", "")
        self.help: str | None = known.get("help")
        self.node: str | None = known.get("node")
        self.file: str | None = known.get("file")
        self.line: int | None = known.get("line")
        self.column: int | None = known.get("column")
        fields = [field.name for field in dataclasses.fields(Problem)]
        self.problems: list[Problem] = [
            Problem(**{name: problem.get(name) for name in fields}) for problem in known.get("problems", [])
        ]


class GraphError(Error):
    """The graph file or the request is wrong."""


class RunError(Error):
    """The graph could not be built: memory, disk or threads."""
