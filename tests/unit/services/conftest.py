"""A core on a workbench; and whatever a core refuses in these tests, it refuses in words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import pytest
from rig import Bench
from soundness import assert_sound

from skillwing.services.core.refusal import RefusedError


def is_sentence(text: str) -> bool:
    """True for a text that begins with a capital or a name, is not shouted, and ends like a sentence."""
    begins = text[:1] == "`" or text[:1].isupper()
    return begins and text.endswith((".", "?")) and any(letter.islower() for letter in text)


@pytest.fixture(autouse=True)
def refusals_in_words() -> Iterator[None]:
    """Every refusal can be sent. One sentence is the problem; another is the remedy, unless it names what exists."""
    right = RefusedError.__init__

    def refuse(self: RefusedError, *args: Any, **kwargs: Any) -> None:
        right(self, *args, **kwargs)
        assert_sound(self.reply, 0.0)
        assert is_sentence(self.message), self.message
        assert is_sentence(self.help) or (self.known and not self.help), (self.message, self.help)

    with patch.object(RefusedError, "__init__", refuse):
        yield


@pytest.fixture
def bench() -> Bench:
    """A core on a workbench, whose battery is charged."""
    bench = Bench()
    bench.battery(80.0)
    return bench
