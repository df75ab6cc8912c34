"""A core on a workbench; and whatever a core refuses in these tests, it refuses in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import pytest
from rig import Bench
from soundness import assert_sound

from skillwing.services.core.refusal import RefusedError


@pytest.fixture(autouse=True)
def refusals_in_words() -> Iterator[None]:
    """Every refusal can be sent, and says what is wrong and either what to do or what exists."""
    right = RefusedError.__init__

    def refuse(self: RefusedError, *args: Any, **kwargs: Any) -> None:
        right(self, *args, **kwargs)
        assert_sound(self.reply, 0.0)
        assert self.message.endswith((".", "?"))
        assert self.help or self.known, self.message

    with patch.object(RefusedError, "__init__", refuse):
        yield


@pytest.fixture
def bench() -> Bench:
    """A core on a workbench, whose battery is charged."""
    bench = Bench()
    bench.battery(80.0)
    return bench
