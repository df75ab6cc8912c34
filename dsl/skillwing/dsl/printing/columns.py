"""Lines of text with aligned columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

_BEFORE_REMARK = "   "


@dataclass(frozen=True, slots=True)
class Line:
    """One line, or several with a long comment.

    depth: of indentation. cells: the text, cut where columns may be aligned; all cells but the last may be padded.
    remark: comments behind the text. after_blank: an empty line stands before it.
    """

    depth: int
    cells: tuple[str, ...]
    remark: str = ""
    after_blank: bool = False

    @property
    def text(self) -> str:
        return " ".join(self.cells)

    @property
    def is_bracket(self) -> bool:
        """True if the line opens or closes a block of several lines, and so belongs to no column."""
        return self.text.endswith("{") or self.text == "}"


def aligned(lines: Sequence[Line]) -> Iterator[Line]:
    """Pad the cells, then the text before the remarks, of consecutive lines at one depth."""
    for shaped, run in _runs(lines, lambda line: len(line.cells) > 1):
        yield from _padded(run) if shaped else run


def printed(lines: Sequence[Line], indent: str) -> Iterator[str]:
    """The lines as text, with aligned remarks on neighbouring lines."""
    for remarked, run in _runs(lines, lambda line: bool(line.remark) and not line.is_bracket):
        width = max(len(line.text) for line in run) if remarked else 0
        for line in run:
            if line.after_blank:
                yield ""
            behind = f"{_BEFORE_REMARK}{line.remark}" if line.remark else ""
            yield f"{indent * line.depth}{line.text:{width if behind else 0}}{behind}"


def _runs(lines: Sequence[Line], belongs: Callable[[Line], bool]) -> Iterator[tuple[bool, list[Line]]]:
    """Runs of neighbouring lines of one depth, without an empty line between, of which all or none belong."""
    group = 0
    groups: list[int] = []
    for index, line in enumerate(lines):
        group += line.after_blank or (index > 0 and line.depth != lines[index - 1].depth)
        groups.append(group)
    numbered = zip(groups, lines, strict=True)
    for (_, shaped), run in groupby(numbered, key=lambda pair: (pair[0], belongs(pair[1]))):
        yield shaped, [line for _, line in run]


def _padded(run: Sequence[Line]) -> Iterator[Line]:
    """Pad each cell but the last to the widest of its column."""
    columns = max(len(line.cells) for line in run)
    widths = [
        max((len(line.cells[at]) for line in run if len(line.cells) > at + 1), default=0) for at in range(columns)
    ]
    for line in run:
        *cells, last = line.cells
        yield replace(line, cells=(*(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=False)), last))
