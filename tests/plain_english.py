"""Checks of plain English (CONTRIBUTING.md): `python tests/plain_english.py PATH ...` prints one line a problem.

Docstrings start with a noun or a verb, sentences have at most 25 words, and some words are not used at all.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path

LONGEST_SENTENCE = 25
ARCHAIC = (
    *("mend", "mends", "mended", "mending", "whoever", "anew", "lest", "hence", "whence", "besides"),
    *("befall", "befalls", "befallen", "befell", "thereby", "whereby"),
)
RETIRED = (
    *("Scribe", "hand_over", "DatumKept", "GoalOver", "gives_up_unheard", "why_not", "SoleJudge", "Attendance"),
    *("RollCall", "bear_silence", "bear_doubt", "in_doubt", "taken_away", "GoalPursuit", "disowned"),
    *("await_news", "set_back", "marked_page", "failing_code", "Vigil", "Twins", "Fitting", "FITTINGS", "Lookout"),
    *("CRAWL", "LandingGear", "Headway", "Whereabouts", "Shortfall", "unruly", "Misfit", "unbuilt", "CALM"),
)
"""Names that had one meaning here and none elsewhere. Each has a successor with the name of the field."""
RETIRED_CLASSES = {
    *("Kept", "Shelf", "Recent", "Standing", "Presence", "Death", "Rest", "View", "Nose", "Hold", "Crew", "Witness"),
    *("Price", "Course", "Judge", "Slips"),
}
"""Words of everyday language that are no longer names of classes."""

_FIRST = re.compile(
    r"(who|what|whether|how|where|when|which|that|why|whose|whatever|whoever|of|so|by|with"
    r"|for|in|at|as|until|and|from|over|below|about|above|if|told|this|it|there|those|its"
    r"|has|another|never|not|too|farther|even|also|only|nor|or|but|called|like|then|while"
    r"|after|before|since|still|more|they|nobody|somebody|everybody|nothing|something"
    r"|anything|everything|such|to|beside|between|without|under|because|raised)\b",
    re.IGNORECASE,
)
"""First words of docstrings that do not name the thing."""
_NAME = re.compile(r"[A-Za-z]+(?:_[A-Za-z]+|[a-z][A-Z][A-Za-z]*)[A-Za-z_]*")
_PART = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_ARCHAIC = re.compile(rf"\b({'|'.join(ARCHAIC)})\b", re.IGNORECASE)
_RETIRED = re.compile(rf"\b({'|'.join(RETIRED)})\b")
_FENCE = re.compile(r"^ *(```|~~~).*?^ *\1", re.MULTILINE | re.DOTALL)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_CODE = re.compile(r"`[^`\n]+`")
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_SENTENCE_END = re.compile(r"(?<=[.!?:;])[\"')*_]*\s+")
_ABBREVIATION = re.compile(r"\b(e\.g|i\.e|etc|vs|cf|Fig|al|No)\.")
_WORD = re.compile(r"[A-Za-z0-9][\w'’.,/%+-]*")
_BLOCK_START = re.compile(r"^([-*+]|\d+\.|#+|>)\s+")


def problems(path: Path) -> Iterator[tuple[int, str]]:
    """Line and description of each problem in a file. Only Python and Markdown are read as sentences."""
    text = path.read_text(encoding="utf-8")
    if path.name != Path(__file__).name:
        yield from (
            (number, f"retired name: {word}")
            for number, line in lines_with(RETIRED, text)
            for word in _RETIRED.findall(line)
        )
    if path.suffix == ".py":
        yield from python_problems(text)
    elif path.suffix == ".md":
        yield from markdown_problems(text)
    else:
        lines = lines_with(ARCHAIC, text)
        yield from ((number, f"archaic word: {word}") for number, line in lines for word in _ARCHAIC.findall(line))


def lines_with(words: tuple[str, ...], text: str) -> Iterator[tuple[int, str]]:
    """Number and text of each line that may have one of these words. Most files have none and are not split."""
    lower = text.lower()
    present = [word.lower() for word in words if word.lower() in lower]
    if present:
        lines = enumerate(text.splitlines(), 1)
        yield from ((number, line) for number, line in lines if any(word in line.lower() for word in present))


def markdown_problems(text: str) -> Iterator[tuple[int, str]]:
    """Problems of the prose of a Markdown text."""
    for number, paragraph in paragraphs(text):
        yield from ((number, problem) for problem in prose_problems(paragraph))


def python_problems(text: str) -> Iterator[tuple[int, str]]:
    """Problems of docstrings, comments and names of classes."""
    tree = ast.parse(text)
    for line, doc in docstrings(tree):
        first = _FIRST.match(doc.strip())
        if first and first.group(0)[0].isupper():  # generated remarks on fields are no sentences: `in 0.1..20.0`
            yield line, f"begins with `{first.group(0)}`: {doc.strip()[:80]}"
        prose = "\n".join("" if each.startswith("    ") else each for each in inspect.cleandoc(doc).splitlines())
        yield from ((line + number - 1, problem) for number, problem in markdown_problems(prose))
    for number, source in lines_with(ARCHAIC, text):
        comment = re.search(r"(?:^|\s)# (.*)", source)
        words = _ARCHAIC.findall(comment.group(1)) if comment else ()
        yield from ((number, f"archaic word: {word}") for word in words)
        parts = {part.lower() for name in _NAME.findall(source) for part in _PART.findall(name)}
        yield from ((number, f"archaic word in a name: {part}") for part in sorted(parts & set(ARCHAIC)))
    for node in statements(tree):
        if isinstance(node, ast.ClassDef) and node.name in RETIRED_CLASSES:
            yield node.lineno, f"retired class name: {node.name}"


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and text of every docstring, those below constants and fields among them."""
    for node in (tree, *statements(tree)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for statement in node.body:
                value = statement.value if isinstance(statement, ast.Expr) else None
                if isinstance(value, ast.Constant) and isinstance(value.value, str):
                    yield statement.lineno, value.value


def statements(tree: ast.AST) -> Iterator[ast.stmt]:
    """Statements below a node, at any depth. Expressions, most of a tree, hold none and are left out."""
    for part in ("body", "handlers", "orelse", "finalbody", "cases"):
        for node in getattr(tree, part, ()):
            if isinstance(node, ast.stmt):
                yield node
            yield from statements(node)


def paragraphs(text: str) -> Iterator[tuple[int, str]]:
    """Line and text of each paragraph, list item, heading and table cell, without code blocks and comments."""
    text = _COMMENT.sub(_blank, _FENCE.sub(_blank, text))
    block: list[str] = []
    start = 1
    for number, line in enumerate([*text.splitlines(), ""], 1):
        stripped = line.strip()
        is_row = stripped.startswith("|")
        if block and (not stripped or is_row or _BLOCK_START.match(stripped)):
            yield start, " ".join(block)
            block = []
        if is_row:
            yield from ((number, cell.strip()) for cell in re.split(r"(?<!\\)\|", stripped) if cell.strip(" -:"))
        elif stripped:
            start = start if block else number
            block.append(_BLOCK_START.sub("", stripped, count=1) if not block else stripped)


def prose_problems(paragraph: str) -> Iterator[str]:
    """Problems of one paragraph."""
    for sentence in sentences(paragraph):
        count = len(_WORD.findall(sentence))
        if count > LONGEST_SENTENCE:
            yield f"{count} words: {sentence[:100]}"
    yield from (f"archaic word: {word}" for word in _ARCHAIC.findall(_CODE.sub("", paragraph)))


def sentences(paragraph: str) -> Iterator[str]:
    """Sentences; a code span counts as one word, and a colon or semicolon ends a sentence."""
    text = _ABBREVIATION.sub(r"\1", _CODE.sub("code", _LINK.sub(r"\1", paragraph)))
    yield from (" ".join(part.split()) for part in _SENTENCE_END.split(text) if part.strip())


def _blank(match: re.Match[str]) -> str:
    return "\n" * match.group(0).count("\n")


if __name__ == "__main__":
    found = [
        f"{path}:{line}: {problem}"
        for name in sys.argv[1:]
        for path in (sorted(Path(name).rglob("*")) if Path(name).is_dir() else [Path(name)])
        if path.suffix in {".py", ".md"}
        for line, problem in problems(path)
    ]
    sys.stdout.write("\n".join([*found, f"{len(found)} problems"]) + "\n")
