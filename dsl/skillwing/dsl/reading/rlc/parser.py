"""The parser of `.rlc` files."""

from __future__ import annotations

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.reading.parser import recovered
from skillwing.dsl.reading.rlc.dialect import RLC
from skillwing.dsl.reading.rlc.syntax import CompositionsNode


def parse_compositions(text: str, file: str) -> tuple[CompositionsNode, tuple[Diagnostic, ...]]:
    """The compositions of a file, and all its syntax errors. Raises nothing, whatever the text contains.

    file: its name, for the spans.
    """
    root, broken = recovered(RLC, text, file)
    found = () if broken.is_empty else tuple(broken.diagnostics)
    return (root if isinstance(root, CompositionsNode) else CompositionsNode(())), found
