"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

_IN_PLACE_ONLY = (errno.EACCES, errno.EPERM, errno.EBUSY, errno.EROFS)
"""Error numbers of a folder that takes no new file, and of a file that is a mount of its own."""
_STREAMS = ("/dev/", "/proc/")
"""Folders of names for open files, such as /dev/stdout."""


def write_whole(path: Path, content: bytes | str) -> None:
    """Replace a file with `content`; text is written in UTF-8. If that fails, as on a full disk, the old file stays.

    Readers find the old or the new content, never a part of it. A link stays a link, and the file keeps its mode, and
    its owner where that is allowed. Pipes and devices are written to. A file that cannot be replaced, because of its
    folder or as a mount of its own, is written in place. Raises OSError with the path.
    """
    try:
        _write(path, content.encode() if isinstance(content, str) else content)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _write(path: Path, content: bytes) -> None:
    try:
        before = path.stat()
    except FileNotFoundError:
        before = None
    if before is None:
        _replace(path.resolve(), content, None)
    elif not stat.S_ISREG(before.st_mode) or str(path).startswith(_STREAMS):
        path.write_bytes(content)
    elif not os.access(path, os.W_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    else:
        try:
            _replace(path.resolve(), content, before)
        except OSError as error:
            if error.errno not in _IN_PLACE_ONLY:
                raise
            path.write_bytes(content)


def _replace(file: Path, content: bytes, before: os.stat_result | None) -> None:
    unfinished = file.with_name(f".{file.name}.{token_hex(4)}")
    try:
        with unfinished.open("xb") as opened:
            opened.write(content)
        if before is not None:
            with suppress(PermissionError):
                os.chown(unfinished, before.st_uid, before.st_gid)
            unfinished.chmod(stat.S_IMODE(before.st_mode))
        unfinished.replace(file)
    except BaseException:
        with suppress(OSError):
            unfinished.unlink()
        raise
