"""The formatter of skillset sources.

Four spaces of indentation, one statement on a line, columns in neighbouring lines of the same shape, at most one empty
line. A block on one line stays there if it fits. Comments stay in their places.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from skillwing.dsl.diagnostics.diagnostic import Diagnostic
from skillwing.dsl.printing.columns import Line, aligned, printed
from skillwing.dsl.printing.spacing import cells, joined
from skillwing.dsl.printing.statements import Block, Statement, read_statements
from skillwing.dsl.reading.dialect import lex
from skillwing.dsl.reading.lexemes import COMMENT, Lexeme
from skillwing.dsl.reading.parser import parse_file

INDENT = "    "
WIDTH = 100


class UnformattableError(ValueError):
    """A text cannot be formatted because it has syntax errors. diagnostics: all of them."""

    def __init__(self, file: str, diagnostics: Sequence[Diagnostic]) -> None:
        self.file = file
        self.diagnostics = tuple(diagnostics)
        super().__init__(f"`{file}` has syntax errors. Fix what `skillwing check {file}` shows, then format it.")


def format_source(text: str, file: str = "<text>") -> str:
    """Return the formatted text: the same words and comments in the same order, so the same meaning.

    file: name of the text in diagnostics; its extension selects the dialect. Raises UnformattableError.
    """
    if problems := parse_file(text, file).diagnostics:
        raise UnformattableError(file, problems)
    text = _tidied(text)
    lines = list(_lines(read_statements(text, lex(text, file)), 0))
    physical = "\n".join(printed(lines, INDENT)).split("\n")
    return "".join(f"{line.rstrip()}\n" for line in physical)


def _tidied(text: str) -> str:
    """The text with one kind of line end and no space before it, so that measured widths are right."""
    return "\n".join(line.rstrip() for line in re.split(r"\r\n?|\n", text))


def _lines(statements: Sequence[Statement], depth: int, in_effect: bool = False) -> Iterator[Line]:
    """The lines of the statements of one block."""
    run: list[Line] = []
    for index, statement in enumerate(statements):
        after_blank = statement.after_blank and (index > 0 or depth == 1)  # a skillset may begin with an empty line
        if (line := _on_one_line(statement, depth, after_blank, in_effect)) is not None:
            run.append(line)
            continue
        yield from aligned(run)
        run = []
        yield from _on_several_lines(statement, depth, after_blank)
    yield from aligned(run)


# --- on one line


def _on_one_line(statement: Statement, depth: int, after_blank: bool, in_effect: bool) -> Line | None:
    """The statement as one line; None if it needs several."""
    words, block, remark = statement.words, statement.block, _remark(statement.remarks)
    if statement.is_comment:
        comment = " ".join(_shifted(word, len(INDENT) * depth) for word in words)
        return Line(depth, (comment,), remark, after_blank)
    if any(_ends_line(word) for word in words) or not (block is None or _may_be_inline(block, depth)):
        return None
    may_break = block is not None or bool(statement.breaks)
    if may_break and len(INDENT) * depth + len(_inline(statement)) > WIDTH:
        return None
    if block is None:
        return Line(depth, cells(words), remark, after_blank)
    return Line(depth, _named_block(statement) if in_effect else (_inline(statement),), remark, after_blank)


def _may_be_inline(block: Block, depth: int) -> bool:
    """True if a block may stand on one line. The outermost block may only if it is empty."""
    return block.on_one_line and (depth > 0 or not block.statements)


def _inline(statement: Statement) -> str:
    words = joined(statement.words)
    return words if statement.block is None else f"{words} {_inline_block(statement.block)}"


def _inline_block(block: Block) -> str:
    text = " ".join(_inline_pieces(block))
    return f"{{ {text} }}" if text else "{}"


def _inline_pieces(block: Block) -> Iterator[str]:
    """The statements of a block on one line. The longer ones begin with an additional space."""
    before: Statement | None = None
    for statement in block.statements:
        room = "" if before is None or (_is_short(before) and _is_short(statement)) else " "
        yield room + " ".join([_inline(statement), *(remark.text for remark in statement.remarks)])
        before = statement


def _is_short(statement: Statement) -> bool:
    """True if a statement is a single word or `word=value`, which need less space between them."""
    return statement.block is None and not statement.remarks and " " not in joined(statement.words)


def _named_block(statement: Statement) -> tuple[str, ...]:
    """An effect with a block, cut before each of its changes."""
    assert statement.block is not None
    changes = [*_inline_pieces(statement.block)]
    if not changes:
        return joined(statement.words), "{}"
    changes[0] = f"{{ {changes[0]}"
    changes[-1] += " }"
    return joined(statement.words), *changes


# --- on several lines


def _on_several_lines(statement: Statement, depth: int, after_blank: bool) -> Iterator[Line]:
    block, remark = statement.block, _remark(statement.remarks)
    *pieces, last = _pieces(statement, depth)
    for index, piece in enumerate(pieces):
        yield Line(depth + (index > 0), (piece,), after_blank=after_blank and index == 0)
    depth_of_last, after_blank = depth + bool(pieces), after_blank and not pieces
    if block is None:
        yield Line(depth_of_last, (last,), remark, after_blank)
        return
    yield Line(depth_of_last, (f"{last} {{".lstrip(),), _remark(block.remarks), after_blank)
    keyword = next((word.kind for word in statement.words if word.kind != COMMENT), "")
    yield from _lines(block.statements, depth + 1, in_effect=keyword == "EFFECT")
    yield Line(depth, ("}",), remark)


def _pieces(statement: Statement, depth: int) -> Iterator[str]:
    """The words before the block in as many lines as they need. One that would be too long keeps its line breaks.

    If a comment ends the line, the last piece may be empty.
    """
    words = statement.words
    too_long = len(INDENT) * depth + len(joined(words)) > WIDTH
    start = 0
    for index in range(1, len(words)):
        if _ends_line(words[index - 1]) or (index in statement.breaks and too_long):
            yield joined(words, start, index)
            start = index
    yield joined(words, start)
    if _ends_line(words[-1]):
        yield ""


# --- comments


def _ends_line(word: Lexeme) -> bool:
    """True if a word is a comment that has to end its line."""
    return word.kind == COMMENT and (word.text.startswith("//") or "\n" in word.text)


def _remark(comments: Sequence[Lexeme]) -> str:
    return " ".join(comment.text.rstrip() for comment in comments)


def _shifted(comment: Lexeme, column: int) -> str:
    """A comment moved to that column, from 0, with all its lines."""
    first, *rest = comment.text.rstrip().split("\n")
    _, old = comment.source.position(comment.start)
    moved = column - (old - 1)
    return "\n".join([first, *(_moved(line, moved) for line in rest)])


def _moved(line: str, by: int) -> str:
    if by >= 0:
        return " " * by + line if line.strip() else ""
    blanks = len(line) - len(line.lstrip())
    return line[min(blanks, -by) :]
