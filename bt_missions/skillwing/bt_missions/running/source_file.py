"""The file in which somebody wrote a mission."""

from __future__ import annotations

from pathlib import Path

from skillwing.services.errors import InvalidOptionError


def read_source(file: Path) -> bytes:
    """What the file holds. Raises InvalidOptionError where there is none, or it cannot be read."""
    try:
        return file.read_bytes()
    except FileNotFoundError as error:
        raise InvalidOptionError("mission", f"There is no file `{file}`. Name the file of a mission.") from error
    except OSError as error:
        what = "is a directory" if file.is_dir() else f"cannot be read: {error.strerror or error}"
        raise InvalidOptionError("mission", f"`{file}` {what}. Name the file of a mission.") from error


def refuse_if_not_utf8(content: bytes, file: Path) -> None:
    """Raise InvalidOptionError for what is not text as missions are written."""
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidOptionError("mission", f"`{file}` is not a text file in UTF-8. Save it as one.") from error
