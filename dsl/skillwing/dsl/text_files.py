"""Text files written by people."""

from __future__ import annotations

import errno
from pathlib import Path


def text_of_file(file: Path) -> str:
    """The text of a file, with line feeds for line ends. Raises OSError if it cannot be read, or is not in UTF-8."""
    content = file.read_bytes()
    try:
        return text_in(content)
    except ValueError as error:
        raise OSError(errno.EILSEQ, str(error), str(file)) from None


def text_in(content: bytes) -> str:
    """The text of bytes, with line feeds for line ends. Raises ValueError if they are not in UTF-8."""
    try:
        return content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        raise ValueError(f"it is not text in UTF-8, from byte {column} of line {line} on") from None
