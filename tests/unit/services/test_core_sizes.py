"""Sizes of the cores: no class has 200 lines, and no function more than 40."""

from __future__ import annotations

import ast
from pathlib import Path

from skillwing.services import core

LONGEST_CLASS, LONGEST_FUNCTION = 199, 40


def test_no_class_or_function_of_a_core_is_long() -> None:
    long: list[str] = []
    for path in sorted(Path(core.__path__[0]).glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ClassDef | ast.FunctionDef):
                continue
            limit = LONGEST_CLASS if isinstance(node, ast.ClassDef) else LONGEST_FUNCTION
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            if lines > limit:
                long.append(f"{path.name}: {node.name} has {lines} lines; at most {limit} are allowed. Split it.")
    assert not long, "\n".join(long)
