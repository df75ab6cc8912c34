"""What the tests of the M600's managers share may assert as they do."""

from __future__ import annotations

import pytest

pytest.register_assert_rewrite("depthmap_cases", "goto_cases")
