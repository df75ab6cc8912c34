"""Descriptions of elements, from the comments of a source."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from skillwing.dsl.printing.statements import Statement, read_statements
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.lexemes import COMMENT, Lexeme
from skillwing.dsl.spans import Span


class Descriptions:
    """The comments directly above an element, and those behind it on its line.

    of_file: the comments before the skillset itself. Texts are Markdown, without the signs of the comments.
    """

    def __init__(self, text: str, file: str) -> None:
        statements = read_statements(text, lex(text, file))
        self._by_place = dict(_described(statements))
        self.of_file = "\n\n".join(_paragraphs(statements))

    def of(self, span: Span | None) -> str:
        """The description of the element whose name has this span; empty if there is none."""
        return "" if span is None else self._by_place.get((span.line, span.column), "")


def _described(statements: Sequence[Statement]) -> Iterator[tuple[tuple[int, int], str]]:
    """The position of each word of a described statement, with the description."""
    above: list[str] = []
    for statement in statements:
        if statement.after_blank:
            above = []
        if statement.is_comment:
            above.append(_comment(statement.words))
            continue
        behind = [*statement.remarks, *(statement.block.remarks if statement.block else ())]
        if description := "\n".join([*above, *([_comment(behind)] if behind else [])]).strip():
            for word in statement.words:
                yield word.source.position(word.start), description
        above = []
        if statement.block is not None:
            yield from _described(statement.block.statements)


def _paragraphs(statements: Sequence[Statement]) -> Iterator[str]:
    """The comments at the beginning of a file, joined to paragraphs at empty lines."""
    lines: list[str] = []
    for statement in statements:
        if not statement.is_comment:
            break
        if statement.after_blank and lines:
            yield "\n".join(lines)
            lines = []
        lines.append(_comment(statement.words))
    if lines:
        yield "\n".join(lines)


def _comment(comments: Sequence[Lexeme]) -> str:
    return " ".join(_bare(comment.text) for comment in comments if comment.kind == COMMENT)


def _bare(comment: str) -> str:
    """The text of a comment without its signs, also those at the start of each line."""
    if comment.startswith("//"):
        return comment.lstrip("/").strip()
    lines = comment.removeprefix("/*").removesuffix("*/").strip("*").split("\n")
    return "\n".join(line.strip().removeprefix("*").strip() for line in lines).strip()
