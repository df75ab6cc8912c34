"""Pieces of Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """A table without its empty columns; nothing if there are no rows."""
    kept = [column for column in range(len(head)) if any(row[column] for row in rows)]
    if not kept:
        return
    yield _row([head[column] for column in kept])
    yield _row(["---"] * len(kept))
    yield from (_row([_cell(row[column]) for column in kept]) for row in rows)
    yield ""


def code(text: str) -> str:
    """The text as code, if there is one."""
    return f"`{text}`" if text else ""


def link(text: str, heading: str) -> str:
    """A link to a heading of words. GitHub's anchors are in lower case with dashes."""
    return f"[{text}](#{heading.lower().replace(' ', '-')})"


def prose(text: str) -> Iterator[str]:
    """A description as paragraphs; nothing if it is empty."""
    if text:
        yield from (_safe(text), "")


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(text: str) -> str:
    return " ".join(_safe(text).split()).replace("|", "\\|")


def _safe(text: str) -> str:
    return text.replace("<", "&lt;")
