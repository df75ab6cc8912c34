"""An XML file as elements that know their line."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from skillwing.bt_missions.xml.problems import Problem, TreeFileError


@dataclass(slots=True)
class Element:
    """One tag with its attributes and what stands in it; text between tags means nothing in a tree file."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list["Element"])


def read_document(file: Path) -> Element:
    """The root element of a file. Raises TreeFileError where it cannot be read, or is no XML."""
    try:
        content = file.read_bytes()
    except OSError as error:
        raise TreeFileError(file, [Problem(0, f"It cannot be read: {error.strerror or error}.")]) from error
    return parse_document(content, file)


def parse_document(content: bytes, file: Path) -> Element:
    """The root element of a file's content; `file` is only named. Raises TreeFileError."""
    reader = expat.ParserCreate()
    outside = Element("", {}, 0)
    open_elements = [outside]

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, reader.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def refuse_entities(*_: object) -> None:
        # A tree has no use for them, and nested ones can fill the memory.
        raise TreeFileError(file, [Problem(reader.CurrentLineNumber, "Take out the entity; a tree needs none.")])

    reader.StartElementHandler = start
    reader.EndElementHandler = lambda tag: open_elements.pop()
    reader.EntityDeclHandler = refuse_entities
    try:
        reader.Parse(content, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise TreeFileError(file, [Problem(error.lineno, f"This is no XML: {reason}.")]) from error
    return outside.children[0]
