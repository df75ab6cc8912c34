"""Checked skillsets on their way from a launcher to its processes.

All processes of a system read the same skillset file. The launcher parses and checks it once, and writes the result to
the standard input of each process. It counts for exactly the text that was checked: a process that finds another text
in the file, such as after a change, parses and checks that.
"""

from __future__ import annotations

import os
import pickle
import zlib
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from skillwing.dsl import INCLUDING, SkillsetError, add_checked, expressions, model, parse, spans
from skillwing.dsl.text_files import text_of_file

MOST_BYTES = 32_768
"""Size up to which skillsets are handed on: a pipe's buffer has room for it, so that nobody waits for a reader."""

_CODE = b"%d\n" % max(Path(module.__file__ or "").stat().st_mtime_ns for module in (expressions, model, spans))
"""Time of the classes that this process has loaded. A process that starts after an update has others."""


def pack_skillsets(files: Iterable[str]) -> bytes:
    """The skillsets of these files, for the standard input of a process; empty without any.

    Files with errors are left out, for a process that needs one tells of them; so are `.rl` files (`parse`).
    """
    texts: list[tuple[str, str]] = []
    for file in dict.fromkeys(file for file in files if not file.endswith(INCLUDING)):
        with suppress(OSError):
            texts.append((text_of_file(Path(file)), file))
    packed = _packed(tuple(texts))
    return packed if len(packed) <= MOST_BYTES else b""


@lru_cache(maxsize=8)
def _packed(texts: tuple[tuple[str, str], ...]) -> bytes:
    checked: list[tuple[str, str, object]] = []
    for text, file in texts:
        with suppress(SkillsetError):
            skillset = parse(text, file)
            _ = skillset.schema_hash  # calculated once for all processes
            checked.append((text, file, skillset))
    return _CODE + zlib.compress(pickle.dumps(checked), 1) if checked else b""


def read_skillsets(stdin: int, size: int) -> None:
    """Read the skillsets of `pack_skillsets` from a descriptor, for `load` and `parse` of this process.

    size: their bytes. A launcher that ends meanwhile leaves less, and one from before an update has other classes: then
    this process checks its skillset itself.
    """
    packed = b""
    while len(packed) < size and (part := os.read(stdin, size - len(packed))):
        packed += part
    if len(packed) == size and packed.startswith(_CODE):
        for text, file, skillset in pickle.loads(zlib.decompress(packed.removeprefix(_CODE))):
            add_checked(text, file, skillset)
