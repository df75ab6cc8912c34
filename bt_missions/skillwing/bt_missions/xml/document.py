"""XML file as elements with their lines, and the problems of a tree file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.parsers import expat

from skillwing.bt_missions.mission.files import read_source, refuse_if_not_utf8
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem


@dataclass(frozen=True, slots=True)
class FileProblem:
    """A problem of a tree file. line, column: from 1, or 0 for the whole; text: the problem and its fix, and
    behind these perhaps lines with an excerpt."""

    line: int
    text: str
    column: int = 0

    def without_excerpt(self) -> FileProblem:
        """The same problem in one line, as for a log."""
        return replace(self, text=self.text.partition("\n")[0])

    def in_file(self, file: Path) -> MissionProblem:
        """The same problem, with its place."""
        place = ":".join(str(part) for part in (file, self.line, self.column) if part)
        return MissionProblem(self.text, place)


def by_place(problems: Iterable[FileProblem]) -> list[FileProblem]:
    """Problems of one file by line and column."""
    return sorted(problems, key=lambda problem: (problem.line, problem.column, problem.text))


class TreeFileError(FaultyMissionError):
    """A tree file that cannot run. problems: all that were found, by place."""

    def __init__(self, file: Path, problems: Iterable[FileProblem]) -> None:
        self.file = file
        super().__init__(problem.in_file(file) for problem in by_place(set(problems)))


_XML = expat.errors
_REASONS = {
    _XML.XML_ERROR_NO_ELEMENTS: 'There is no tag in this file. Begin with `<root BTCPP_format="4">`.',
    _XML.XML_ERROR_JUNK_AFTER_DOC_ELEMENT: "The root tag was closed before this. Put everything into one.",
    _XML.XML_ERROR_DUPLICATE_ATTRIBUTE: "This tag has an attribute twice. Take one of them out.",
    _XML.XML_ERROR_UNDEFINED_ENTITY: "What this `&` begins is not known. Write `&amp;` for the character itself.",
    _XML.XML_ERROR_UNCLOSED_TOKEN: "What begins here is not closed. Add what is missing: a quote or a `>`.",
    _XML.XML_ERROR_UNKNOWN_ENCODING: "The encoding that is declared here is not known. Save the file in UTF-8.",
}
"""Problem of a file that is not XML, by the message of the parser."""
_NO_XML = "This is no XML from here on. Look for a `<`, a quote, a `=` or a `>` that is missing or too many."


@dataclass(slots=True)
class Element:
    """One tag with its attributes and children. Text between tags has no meaning in a tree file.

    column: from 1, or 0 for the whole line.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list["Element"])
    column: int = 0


def read_document(file: Path) -> Element:
    """The root element of a file.

    Raises InvalidOptionError if it cannot be read, TreeFileError if it is not XML.
    """
    return parse_document(read_source(file), file)


def parse_document(content: bytes, file: Path) -> Element:
    """The root element of a file's content; `file` is only for messages. Raises as `read_document` does."""
    reader = expat.ParserCreate()
    outside = Element("", {}, 0)
    open_elements = [outside]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, reader.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def refuse_entities(*_: object) -> None:
        # A tree needs none, and nested ones can fill the memory.
        raise TreeFileError(file, [FileProblem(reader.CurrentLineNumber, "Take out the entity; a tree needs none.")])

    reader.StartElementHandler = start
    reader.EndElementHandler = lambda tag: open_elements.pop()
    reader.EntityDeclHandler = refuse_entities
    try:
        reader.Parse(content, True)
    except expat.ExpatError as error:
        refuse_if_not_utf8(content, file)
        text = _reason(expat.ErrorString(error.code), open_elements[1:])
        raise TreeFileError(file, [FileProblem(error.lineno, text, error.offset + 1)]) from error
    except (LookupError, ValueError) as error:  # an unknown encoding
        text = _REASONS[_XML.XML_ERROR_UNKNOWN_ENCODING]
        raise TreeFileError(file, [FileProblem(reader.CurrentLineNumber, text)]) from error
    return outside.children[0]


def _reason(message: str, open_elements: list[Element]) -> str:
    """Sentence for a message of the parser. open_elements: those that were open there, the innermost last."""
    if open_elements and message in (_XML.XML_ERROR_TAG_MISMATCH, _XML.XML_ERROR_NO_ELEMENTS):
        unclosed = open_elements[-1]
        return f"`<{unclosed.tag}>` of line {unclosed.line} is not closed before this. Write `</{unclosed.tag}>`."
    return _REASONS.get(message, _NO_XML)
