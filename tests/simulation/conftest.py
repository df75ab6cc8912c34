"""A simulated world silences the log of everything in it; other tests read theirs."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def log_level() -> Iterator[None]:
    logger = logging.getLogger("skillwing")
    level = logger.level
    yield
    logger.setLevel(level)
