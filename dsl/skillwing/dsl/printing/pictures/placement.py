"""Placement of the parts of a diagram by Graphviz's `dot`, as shipped in pygraphviz.

Text sizes are computed here and not read from fonts, so that a diagram is placed alike on every machine. Lengths are in
points, x to the right and y down from the upper left corner.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from skillwing.dsl.printing.pictures.diagram import Arrow, Diagram, DiagramNode

NODE_TEXT = 13.0
ARROW_TEXT = 11.0
LINE_HEIGHT = 1.25  # of the size of the text
_START_SIZE = 10.0
_NODE_HEIGHT = 30.0
_NODE_MARGIN = 26.0  # left and right together
_INCH = 72.0

Point: TypeAlias = tuple[float, float]


class PicturesUnavailableError(RuntimeError):
    """The library that places the parts of a picture is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "Drawing SVG needs the package `pygraphviz`, which is not installed. "
            "Install `skillwing[pictures]`, or ask for `--format dot` or `--format mermaid`."
        )


@dataclass(frozen=True, slots=True)
class PlacedNode:
    """A placed node. width, height: of its outline."""

    node: DiagramNode
    center: Point
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class PlacedArrow:
    """A placed arrow. curve: start, then three points for each cubic Bezier piece. tip: of the arrow head, whose base
    is the end of the curve. label: center of its text, None for no text.
    """

    arrow: Arrow
    curve: tuple[Point, ...]
    tip: Point
    label: Point | None


@dataclass(frozen=True, slots=True)
class PlacedDiagram:
    width: float
    height: float
    nodes: tuple[PlacedNode, ...]
    arrows: tuple[PlacedArrow, ...]


def text_width(text: str, size: float) -> float:
    """An upper estimate of the width of a text in a sans-serif font."""
    return size * sum(_advance(character) for character in text)


def _advance(character: str) -> float:
    if character in "ijl.,:;|'!()[] /-":
        return 0.36
    return 0.74 if character.isupper() or character in "mw_%=<>@" else 0.6


def place(diagram: Diagram) -> PlacedDiagram:
    """Place a diagram from left to right. Raises PicturesUnavailableError."""
    try:
        from pygraphviz import AGraph  # noqa: PLC0415 - the library is optional, and heavy
    except ImportError as error:
        raise PicturesUnavailableError from error
    graph = AGraph(directed=True, strict=False)
    between_layers, between_nodes = (str(gap / _INCH) for gap in diagram.gaps)
    graph.graph_attr.update(rankdir="LR", ranksep=between_layers, nodesep=between_nodes)
    sizes = {node.id: _size(node) for node in diagram.nodes}
    for node in diagram.nodes:
        width, height = sizes[node.id]
        shape = {"start": "circle", "resource": "ellipse"}.get(node.kind, "box")
        graph.add_node(
            node.id, label="", shape=shape, fixedsize="true", width=str(width / _INCH), height=str(height / _INCH)
        )
    for number, arrow in enumerate(diagram.arrows):
        label = {"label": _box(arrow.lines)} if arrow.lines else {}
        graph.add_edge(arrow.source, arrow.target, key=str(number), arrowsize="0.8", **label)
    graph.layout(prog="dot")
    _, _, width, height = (float(number) for number in graph.graph_attr["bb"].split(","))

    def point(text: str) -> Point:
        x, y = text.split(",")
        return float(x), height - float(y)

    nodes = (PlacedNode(node, point(graph.get_node(node.id).attr["pos"]), *sizes[node.id]) for node in diagram.nodes)
    arrows: list[PlacedArrow] = []
    for number, arrow in enumerate(diagram.arrows):
        attributes = graph.get_edge(arrow.source, arrow.target, key=str(number)).attr
        tip, *curve = attributes["pos"].replace("\\\n", "").split()
        label = point(attributes["lp"]) if arrow.lines else None
        arrows.append(PlacedArrow(arrow, tuple(map(point, curve)), point(tip.removeprefix("e,")), label))
    return PlacedDiagram(width, height, tuple(nodes), tuple(arrows))


def _size(node: DiagramNode) -> tuple[float, float]:
    """Width and height of the outline of a node."""
    if node.kind == "start":
        return _START_SIZE, _START_SIZE
    widening = 1.2 if node.kind == "resource" else 1.0  # an ellipse has less room at its ends
    return text_width(node.label, NODE_TEXT) * widening + _NODE_MARGIN, _NODE_HEIGHT


def _box(lines: tuple[str, ...]) -> str:
    """An empty label of the size of the text, in Graphviz's own markup."""
    width = max(text_width(line, ARROW_TEXT) for line in lines) + 8
    height = len(lines) * ARROW_TEXT * LINE_HEIGHT + 4
    table = f'<table border="0" fixedsize="true" width="{width:.0f}" height="{height:.0f}"><tr><td></td></tr></table>'
    return f"<{table}>"
