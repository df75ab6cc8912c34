"""Cores stay readable: no class over 200 lines, no function over 40."""

from __future__ import annotations

import ast
from pathlib import Path

from skillwing.services import core

FOLDER = Path(core.__file__).parent
LONGEST_CLASS, LONGEST_FUNCTION = 200, 40


def test_no_core_class_is_over_200_lines_and_no_function_over_40() -> None:
    found: list[str] = []
    for path in sorted(FOLDER.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            lines = (node.end_lineno or 0) - node.lineno + 1 if isinstance(node, ast.stmt) else 0
            limit = LONGEST_CLASS if isinstance(node, ast.ClassDef) else LONGEST_FUNCTION
            if isinstance(node, ast.ClassDef | ast.FunctionDef) and lines > limit:
                found.append(f"{path.name}: {node.name} has {lines} lines; divide it, {limit} are the limit")
    assert not found, "\n".join(found)
