"""Output of a system that runs on when nobody takes it."""

from __future__ import annotations

import errno
import io
import os
from pathlib import Path

from skillwing.services.terminal.output import LossyOutput


def test_a_reader_that_is_gone_ends_nothing() -> None:
    reading, writing = os.pipe()
    with os.fdopen(writing, "w", encoding="utf-8") as stream:
        output = LossyOutput(stream)
        os.close(reading)
        for _ in range(3):
            output.write("skill/goto was killed by SIGKILL.\n")
            output.flush()
        assert os.fstat(stream.fileno()).st_rdev == Path(os.devnull).stat().st_rdev


class Gone(io.StringIO):
    """A terminal that was closed."""

    def write(self, text: str, /) -> int:
        raise OSError(errno.EIO, "Input/output error")


def test_a_terminal_that_is_gone_ends_nothing() -> None:
    assert LossyOutput(Gone()).write("m600 has stopped.") > 0
