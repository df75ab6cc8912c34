from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# How long an example takes tells nothing where the machine does other work as well.
settings.register_profile("skillwing", deadline=None, max_examples=50)
settings.register_profile("thorough", deadline=None, max_examples=1000)  # make thorough
settings.load_profile("skillwing")

ONE_AT_A_TIME = ("chaos", "fuzz", "history", "integration")
"""Folders of tests that start processes, and want the machine's cores for them."""


@pytest.hookimpl(tryfirst=True)  # before xdist looks for the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """For `pytest -n 2 --dist loadgroup`: files stay whole, and what starts processes runs one after the other."""
    for item in items:
        folder = item.path.relative_to(Path(__file__).parent).parts[0]
        item.add_marker(pytest.mark.xdist_group("processes" if folder in ONE_AT_A_TIME else str(item.path)))
