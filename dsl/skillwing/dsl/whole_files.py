"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from pathlib import Path


def write_whole(path: Path, content: bytes | str) -> None:
    """Replace a file, a text in UTF-8. If that fails, as on a full disk, the file of before stays.

    Readers find the old or the new content, never a part of it. A link stays a link, and the file keeps its mode. What
    is no regular file, such as a pipe, is written to. Raises OSError with the path.
    """
    encoded = content.encode() if isinstance(content, str) else content
    file = path.resolve()
    unfinished = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        if file.exists() and not file.is_file():
            file.write_bytes(encoded)
            return
        unfinished.write_bytes(encoded)
        if file.exists():
            shutil.copymode(file, unfinished)
        unfinished.replace(file)
    except OSError as error:
        with suppress(OSError):
            unfinished.unlink()
        error.filename, error.filename2 = str(path), None
        raise
