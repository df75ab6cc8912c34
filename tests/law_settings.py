"""Number of examples of laws for which the usual 25 are too slow, or too few."""

from __future__ import annotations

from hypothesis import settings

USUAL = 25
"""Examples of a law in `make test` (conftest.py)."""


def examples(count: int) -> settings:
    """Settings of a law with `count` examples in `make test`, and with forty times as many in `make thorough`."""
    return settings(max_examples=count * settings.default.max_examples // USUAL, deadline=None)
