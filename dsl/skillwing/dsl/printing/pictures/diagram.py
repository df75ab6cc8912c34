"""A picture before it is drawn: nodes, arrows and what is written on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

NodeKind: TypeAlias = Literal["start", "state", "success", "failure", "ending", "skill", "resource"]
"""`start` is the dot an initial arrow comes from; `success`, `failure` and `ending` are terminal states."""


@dataclass(frozen=True, slots=True)
class Node:
    """id: unlike every other node's, and any text. label: what the reader sees; nothing on a start."""

    id: str
    label: str
    kind: NodeKind

    @property
    def is_terminal(self) -> bool:
        return self.kind in {"success", "failure", "ending"}


@dataclass(frozen=True, slots=True)
class Arrow:
    """From node to node, by their ids. lines: what is written on it. dashed: it is of the second kind (the legend)."""

    source: str
    target: str
    lines: tuple[str, ...] = ()
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Diagram:
    """legend: what solid and dashed arrows mean; empty where all are solid.

    gaps: between layers of nodes, beside what labels need, and between the nodes of a layer; in points.
    """

    title: str
    nodes: tuple[Node, ...]
    arrows: tuple[Arrow, ...]
    legend: str = ""
    gaps: tuple[float, float] = (32.0, 25.0)
