"""Positions in a text, in three ways of counting.

Offsets count characters (code points) from the start. Spans of the language count lines at `\n` and columns in
characters, both from 1. The Language Server Protocol counts lines from 0, and a `\r` ends a line too. Its columns count
units of the encoding that client and server agreed on, by default UTF-16.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property
from typing import Literal as OneOf
from typing import TypeAlias

Encoding: TypeAlias = OneOf["utf-8", "utf-16", "utf-32"]
_PROTOCOL_LINE_END = re.compile(r"\r\n|\r|\n")
# The codec, without byte order mark, and the bytes of a unit.
_CODECS: dict[Encoding, tuple[str, int]] = {
    "utf-8": ("utf-8", 1),
    "utf-16": ("utf-16-le", 2),
    "utf-32": ("utf-32-le", 4),
}


class Lines:
    """The starts of the lines of a text, for both ways of counting them."""

    def __init__(self, text: str) -> None:
        self.text = text

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer("\n", self.text))]

    @cached_property
    def _protocol_starts(self) -> list[int]:
        return [0, *(match.end() for match in _PROTOCOL_LINE_END.finditer(self.text))]

    def offset(self, line: int, column: int) -> int:
        """The offset of a line and column of the language. Positions outside the text are moved into it."""
        start = self._starts[min(max(line, 1), len(self._starts)) - 1]
        return min(start + max(column, 1) - 1, len(self.text))

    def line(self, offset: int) -> int:
        """The line of the language, from 1, that contains an offset."""
        return bisect_right(self._starts, offset)

    def to_protocol(self, offset: int, encoding: Encoding = "utf-16") -> tuple[int, int]:
        """Line and character of the protocol."""
        line = bisect_right(self._protocol_starts, offset) - 1
        return line, _units(self.text[self._protocol_starts[line] : offset], encoding)

    def from_protocol(self, line: int, character: int, encoding: Encoding = "utf-16") -> int:
        """The offset of a position of the protocol. Positions behind the end of a line are moved to that end."""
        if line >= len(self._protocol_starts):
            return len(self.text)
        offset = self._protocol_starts[line]
        while character > 0 and offset < len(self.text) and self.text[offset] not in "\r\n":
            character -= _units(self.text[offset], encoding)
            offset += 1
        return offset


def _units(text: str, encoding: Encoding) -> int:
    codec, size = _CODECS[encoding]
    return len(text.encode(codec, "surrogatepass")) // size
