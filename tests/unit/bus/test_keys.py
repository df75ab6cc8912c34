from __future__ import annotations

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.bus.keys import matches


@pytest.mark.parametrize(
    ("expression", "key", "covered"),
    [
        ("a/b", "a/b", True),
        ("a/b", "a/b/c", False),
        ("a/*", "a/b", True),
        ("a/*", "a", False),
        ("a/*", "a/b/c", False),
        ("a/**", "a", True),
        ("a/**", "a/b/c", True),
        ("**/c", "a/b/c", True),
        ("a/**/d", "a/b/c", False),
        ("a/*/c", "a/b/c", True),
    ],
)
def test_matches(expression: str, key: str, covered: bool) -> None:
    assert matches(expression, key) is covered


chunk = st.sampled_from(["a", "b", "cc"])
keys = st.lists(chunk, min_size=1, max_size=5).map("/".join)
expressions = st.lists(chunk | st.sampled_from(["*", "**"]), min_size=1, max_size=5).map("/".join)


@given(expressions, keys)
def test_agrees_with_zenoh(expression: str, key: str) -> None:
    canonical = zenoh.KeyExpr.autocanonize(expression)
    assert matches(expression, key) == canonical.includes(zenoh.KeyExpr(key))
