"""A picture before it is drawn: nodes, arrows and their texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

NodeKind: TypeAlias = Literal["start", "state", "success", "failure", "ending", "skill", "resource"]
"""`start` is the dot before an initial arrow; `success`, `failure` and `ending` are terminal states."""


@dataclass(frozen=True, slots=True)
class DiagramNode:
    """A node. id: unique in the diagram. label: the visible text; empty for a start."""

    id: str
    label: str
    kind: NodeKind

    @property
    def is_terminal(self) -> bool:
        return self.kind in {"success", "failure", "ending"}


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow between two nodes, by their ids. lines: its text. dashed: it is of the second kind (see the legend)."""

    source: str
    target: str
    lines: tuple[str, ...] = ()
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Diagram:
    """A diagram. legend: meaning of solid and dashed arrows; empty if all are solid.

    gaps: between layers of nodes, in addition to labels, and between the nodes of a layer; in points.
    """

    title: str
    nodes: tuple[DiagramNode, ...]
    arrows: tuple[Arrow, ...]
    legend: str = ""
    gaps: tuple[float, float] = (32.0, 25.0)
