from __future__ import annotations

import pytest
from fake_interface import FakeMission


@pytest.fixture
def mission() -> FakeMission:
    return FakeMission()
