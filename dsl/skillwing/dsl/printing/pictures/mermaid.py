"""Diagrams in the language of Mermaid, which Markdown viewers render."""

from __future__ import annotations

from collections.abc import Iterator

from skillwing.dsl.printing.pictures.diagram import Arrow, Diagram, DiagramNode

_SHAPES = {
    "start": ("((", "))"),
    "state": ("([", "])"),
    "success": ("[[", "]]"),
    "failure": ("[[", "]]"),
    "ending": ("[[", "]]"),
    "skill": ("[", "]"),
    "resource": ("([", "])"),
}
_STYLES = {"start": "fill:#555,stroke:#555", "success": "stroke:#2a7", "failure": "stroke:#c33"}
_ESCAPES = str.maketrans({"#": "#35;", '"': "#quot;", "<": "#lt;", ">": "#gt;", "`": "#96;"})


def to_mermaid(diagram: Diagram) -> str:
    """The diagram as a flowchart, because Mermaid's state diagrams have no dashed transitions."""
    return "\n".join(_lines(diagram)) + "\n"


def _lines(diagram: Diagram) -> Iterator[str]:
    ids = {node.id: f"n{number}" for number, node in enumerate(diagram.nodes)}
    yield "flowchart LR"
    yield f"    %% {diagram.title}"
    for node in diagram.nodes:
        yield f"    {_node(node, ids[node.id])}"
    for arrow in diagram.arrows:
        yield f"    {ids[arrow.source]} {_arrow(arrow)} {ids[arrow.target]}"
    for kind, style in _STYLES.items():
        if members := [ids[node.id] for node in diagram.nodes if node.kind == kind]:
            yield f"    classDef {kind} {style}"
            yield f"    class {','.join(members)} {kind}"


def _node(node: DiagramNode, identifier: str) -> str:
    opening, closing = _SHAPES[node.kind]
    return f"{identifier}{opening}{_quoted((node.label or ' ',))}{closing}"


def _arrow(arrow: Arrow) -> str:
    line, head = ("-.", ".->") if arrow.dashed else ("--", "-->")
    return f"{line} {_quoted(arrow.lines)} {head}" if arrow.lines else ("-.->" if arrow.dashed else "-->")


def _quoted(lines: tuple[str, ...]) -> str:
    return '"' + "<br>".join(line.translate(_ESCAPES) for line in lines) + '"'
