"""Diagrams as SVG: legible on a light and on a dark page, without fonts or scripts of its own."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from math import hypot

from skillwing.dsl.printing.pictures.diagram import Diagram
from skillwing.dsl.printing.pictures.placement import (
    ARROW_TEXT,
    LINE_HEIGHT,
    NODE_TEXT,
    PlacedArrow,
    PlacedNode,
    Point,
    place,
    text_width,
)

_MARGIN = 16.0
_TITLE_TEXT = 15.0
_HEADER = 30.0
_LEGEND = 18.0
_HEAD = 3.4  # half the width of an arrow head

_STYLE = """
svg { font-family: Arial, Helvetica, "Liberation Sans", sans-serif; }
.paper { fill: #ffffff; }
text { fill: #1d2733; text-anchor: middle; dominant-baseline: central; }
.title { font-weight: bold; text-anchor: start; }
.legend { fill: #5c6773; text-anchor: start; }
.node { fill: #f3f6f9; stroke: #44525f; stroke-width: 1.3; }
.skill { fill: #e8f0fb; stroke: #2f6fb5; }
.resource { fill: #fff6e0; stroke: #a8791a; }
.success { fill: #e6f6ea; stroke: #23803f; }
.failure { fill: #fdebea; stroke: #b3382f; }
.start, .head { fill: #44525f; stroke: none; }
.arrow { fill: none; stroke: #44525f; stroke-width: 1.3; }
.dashed { stroke-dasharray: 5 4; stroke-width: 1.1; }
@media (prefers-color-scheme: dark) {
  .paper { fill: #14191f; }
  text { fill: #e4e9ee; }
  .legend { fill: #98a4b0; }
  .node { fill: #222a33; stroke: #9aa8b5; }
  .skill { fill: #1b2c42; stroke: #6fa8e8; }
  .resource { fill: #352b14; stroke: #d9ab4a; }
  .success { fill: #16301e; stroke: #58bf78; }
  .failure { fill: #3a1c1a; stroke: #e8776e; }
  .start, .head { fill: #9aa8b5; }
  .arrow { stroke: #9aa8b5; }
}
"""


def to_svg(diagram: Diagram) -> str:
    """Draw the diagram; the same one gives the same text. Raises PicturesUnavailableError."""
    return "\n".join(_lines(diagram)) + "\n"


def _lines(diagram: Diagram) -> Iterator[str]:
    placement = place(diagram)
    header = _HEADER + (_LEGEND if diagram.legend else 0)
    titles = max(text_width(diagram.title, _TITLE_TEXT), text_width(diagram.legend, ARROW_TEXT))
    width = max(placement.width, titles) + 2 * _MARGIN
    height = placement.height + header + 2 * _MARGIN
    size = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
    yield f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img">'
    yield f"<title>{escape(diagram.title)}</title>"
    yield f"<style>{_STYLE}</style>"
    yield f'<rect class="paper" width="{width:.0f}" height="{height:.0f}"/>'
    yield _text((_MARGIN, _MARGIN + _TITLE_TEXT / 2), diagram.title, _TITLE_TEXT, "title")
    if diagram.legend:
        yield _text((_MARGIN, _MARGIN + _TITLE_TEXT + _LEGEND / 2), diagram.legend, ARROW_TEXT, "legend")
    yield f'<g transform="translate({_MARGIN:g} {_MARGIN + header:g})">'
    for arrow in placement.arrows:
        yield from _arrow(arrow)
    for node in placement.nodes:
        yield from _node(node)
    for arrow in placement.arrows:
        yield from _label(arrow)
    yield "</g>"
    yield "</svg>"


def _node(placed: PlacedNode) -> Iterator[str]:
    node, (x, y), width, height = placed.node, placed.center, placed.width, placed.height
    if node.kind == "start":
        yield f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="{width / 2:.1f}"/>'
        return
    if node.kind == "resource":
        yield f'<ellipse class="node resource" cx="{x:.1f}" cy="{y:.1f}" rx="{width / 2:.1f}" ry="{height / 2:.1f}"/>'
    else:
        for inset in (0.0, 3.0) if node.is_terminal else (0.0,):
            yield _rectangle(placed, inset)
    yield _text(placed.center, node.label, NODE_TEXT)


def _rectangle(placed: PlacedNode, inset: float) -> str:
    (x, y), width, height = placed.center, placed.width - 2 * inset, placed.height - 2 * inset
    corner = 2.0 if placed.node.kind == "skill" else 9.0 - inset
    place_and_size = f'x="{x - width / 2:.1f}" y="{y - height / 2:.1f}" width="{width:.1f}" height="{height:.1f}"'
    return f'<rect class="node {placed.node.kind}" {place_and_size} rx="{corner:g}"/>'


def _arrow(placed: PlacedArrow) -> Iterator[str]:
    start, *rest = (f"{x:.1f} {y:.1f}" for x, y in placed.curve)
    dashed = " dashed" if placed.arrow.dashed else ""
    yield f'<path class="arrow{dashed}" d="M{start} C{" ".join(rest)}"/>'
    (x, y), (tip_x, tip_y) = placed.curve[-1], placed.tip
    length = hypot(tip_x - x, tip_y - y) or 1.0
    across_x, across_y = -(tip_y - y) / length * _HEAD, (tip_x - x) / length * _HEAD
    corners = ((x + across_x, y + across_y), placed.tip, (x - across_x, y - across_y))
    yield f'<polygon class="head" points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in corners)}"/>'


def _label(placed: PlacedArrow) -> Iterator[str]:
    if placed.label is None:
        return
    x, y = placed.label
    step = ARROW_TEXT * LINE_HEIGHT
    top = y - step * (len(placed.arrow.lines) - 1) / 2
    for number, line in enumerate(placed.arrow.lines):
        yield _text((x, top + step * number), line, ARROW_TEXT)


def _text(at: Point, text: str, size: float, kind: str = "") -> str:
    named = f' class="{kind}"' if kind else ""
    return f'<text{named} x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="{size:g}">{escape(text)}</text>'
