"""Assertions in the modules shared by the tests of the M600's managers."""

from __future__ import annotations

import pytest

pytest.register_assert_rewrite("depthmap_cases", "goto_cases")
