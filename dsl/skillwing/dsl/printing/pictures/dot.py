"""Diagrams in the DOT language of Graphviz."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.printing.pictures.diagram import Arrow, Diagram, DiagramNode

_SHAPES = {
    "start": 'shape=point, width=0.12, label=""',
    "state": "shape=box, style=rounded",
    "success": "shape=box, style=rounded, peripheries=2, color=darkgreen",
    "failure": "shape=box, style=rounded, peripheries=2, color=firebrick",
    "ending": "shape=box, style=rounded, peripheries=2",
    "skill": "shape=box",
    "resource": "shape=ellipse",
}


def to_dot(diagram: Diagram) -> str:
    """The diagram as a graph for `dot` and other tools that read its language."""
    return "\n".join(_lines(diagram)) + "\n"


def _lines(diagram: Diagram) -> Iterator[str]:
    title = diagram.title + (f"\n{diagram.legend}" if diagram.legend else "")
    yield f"digraph {_quoted(diagram.title)} {{"
    yield f"    graph [rankdir=LR, label={_quoted(title)}, labelloc=t, fontname=Helvetica]"
    yield "    node [fontname=Helvetica]"
    yield "    edge [fontname=Helvetica, fontsize=11]"
    yield from map(_node, diagram.nodes)
    yield from map(_arrow, diagram.arrows)
    yield "}"


def _node(node: DiagramNode) -> str:
    label = "" if node.kind == "start" else f", label={_quoted(node.label)}"
    return f"    {_quoted(node.id)} [{_SHAPES[node.kind]}{label}]"


def _arrow(arrow: Arrow) -> str:
    attributes = [f"label={_quoted(chr(10).join(arrow.lines))}"] if arrow.lines else []
    attributes += ["style=dashed"] if arrow.dashed else []
    ends = f"    {_quoted(arrow.source)} -> {_quoted(arrow.target)}"
    return f"{ends} [{', '.join(attributes)}]" if attributes else ends


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
