"""The types of included files. A file with nothing but types is a library of types."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from os.path import realpath
from pathlib import Path

from skillwing.dsl.diagnostics.report import DiagnosticReport
from skillwing.dsl.reading.dialect import OtherFileError, ReadOther
from skillwing.dsl.reading.lexemes import Lexeme
from skillwing.dsl.reading.recovery.lexical_errors import shown
from skillwing.dsl.reading.rl.syntax import IncludeNode, RlFile, TypesNode
from skillwing.dsl.reading.syntax import CoinedWord
from skillwing.dsl.spans import Word


@dataclass(slots=True)
class Included:
    """Declarations of the included files.

    types: each at the `include` that leads to it. is_whole: all files could be read.
    """

    types: list[Word] = field(default_factory=list[Word])
    is_whole: bool = True


def included_by(root: RlFile, file: str, read: ReadOther, report: DiagnosticReport) -> Included:
    """Read the files that a file includes, and those that they include. Each is relative to the one that names it."""
    reading = _Reading(read, report)
    path = Path(file)
    reading.follow(root, [path])
    return reading.included


def inlined(root: object, lexemes: Sequence[Lexeme], file: str, read: ReadOther) -> str:
    """The text with types in place of the first `include`, and nothing in place of the others."""
    text = lexemes[0].source.text if lexemes else ""
    if not isinstance(root, RlFile):
        return text
    own = {word.text for word in _types_of(root)}
    others = dict.fromkeys(word.text for word in included_by(root, file, read, DiagnosticReport()).types)
    names = [name for name in others if name not in own]
    written, at = "", 0
    for start, end in _extents(lexemes):
        types = f"type {{ {' '.join(names)} }}" if names and not at else ""
        written, at = written + text[at:start] + types, end
    return written + text[at:]


def _extents(lexemes: Sequence[Lexeme]) -> Iterator[tuple[int, int]]:
    """The offsets of each `include`, which stand before the skillset."""
    start: int | None = None
    is_block = False
    for lexeme in lexemes:
        if lexeme.kind == "SKILLSET":
            return
        if lexeme.kind == "INCLUDE":
            start, is_block = lexeme.start, False
        elif start is not None and lexeme.kind == "OPEN":
            is_block = True
        elif start is not None and lexeme.kind == ("CLOSE" if is_block else "STRING"):
            yield start, lexeme.end
            start = None


class _Reading:
    def __init__(self, read: ReadOther, report: DiagnosticReport) -> None:
        self.included = Included()
        self._read = read
        self._report = report
        self._known: set[str] = set()

    def follow(self, root: RlFile, chain: Sequence[Path], place: Word | None = None) -> None:
        """Read the files that the last one of a chain includes. place: the `include` in the first that leads there."""
        for word in _files_of(root):
            if _is_written(word):
                self._include(chain[-1].parent / word.text[1:-1], chain, place or word)
            else:
                self.included.is_whole = False

    def _include(self, path: Path, chain: Sequence[Path], place: Word) -> None:
        real, *ring = (realpath(shown(str(each))) for each in (path, *chain))
        if real in ring:
            names = " -> ".join(shown(each.name) for each in (*chain[ring.index(real) :], path))
            advice = "Move the types that both need to a file of their own, and include that."
            self._report.add("SW099", place.span, f"The files include each other: {names}.", advice)
            return
        if real in self._known:
            return
        self._known.add(real)
        try:
            root = self._read(path)
        except OtherFileError as error:
            self.included.is_whole = False
            name, includer = shown(str(path)), shown(chain[-1].name)
            by = "" if len(chain) == 1 else f", which `{includer}` includes,"
            advice = f"Name a file relative to the folder of `{includer}`."
            if error.is_text:
                advice = f"Fix it: `skillwing check {name}` lists all its errors."
            self._report.add("SW098", place.span, f"`{name}`{by} {error}.", advice)
            return
        if isinstance(root, RlFile):
            self._take(root, path, place)
            self.follow(root, (*chain, path), place)

    def _take(self, root: RlFile, path: Path, place: Word) -> None:
        self.included.types += (CoinedWord(word.text, place.span) for word in _types_of(root))
        if root.name is not None:
            message = f"`{shown(path.name)}` holds the skillset `{root.name.text}`, of which only the types are read."
            advice = "Two skillsets cannot run as one. Check that file and run its skillset apart."
            self._report.add("SW100", place.span, message, advice)


def _is_written(word: Word) -> bool:
    """False for a name that a repair has put in the place of an unclosed one."""
    return not isinstance(word, Lexeme) or word.source.text[word.start : word.end] == word.text


def _types_of(root: RlFile) -> Iterable[Word]:
    return (word for node in root.nodes if isinstance(node, TypesNode) for word in node.names)


def _files_of(root: RlFile) -> Iterable[Word]:
    return (file for node in root.nodes if isinstance(node, IncludeNode) for file in node.files)
