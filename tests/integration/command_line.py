"""The command line, run in the test's own process."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any
from unittest.mock import patch

import pytest

from skillwing.services.terminal import cli


@dataclass
class Said:
    """Output and exit code of a command."""

    code: int
    out: str
    error: str

    @property
    def json(self) -> Any:
        assert self.out, f"no output, exit code {self.code}: {self.error}"
        return json.loads(self.out)


Command = Callable[..., Said]


def run_command(*words: str) -> Said:
    """`skillwing WORDS...`."""
    out, error = StringIO(), StringIO()
    with (
        patch.object(sys, "argv", ["skillwing", *words]),
        redirect_stdout(out),
        redirect_stderr(error),
        pytest.raises(SystemExit) as ended,
    ):
        cli.main()
    code = ended.value.code
    return Said(code if isinstance(code, int) else 0, out.getvalue(), error.getvalue())
