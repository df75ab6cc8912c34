"""What is said of a value that does not fit: nobody has to know how Python writes it."""

from __future__ import annotations

import pytest

from skillwing.dsl.model import Field, ScalarType
from skillwing.services.core.values import fit_fields


@pytest.mark.parametrize(
    ("value", "shown"), [(True, "true"), (None, "nothing"), ((3.0, 1.0), "[3.0, 1.0]"), ([[False]], "[[false]]")]
)
def test_a_value_is_shown_as_it_is_typed(value: object, shown: str) -> None:
    _, problems = fit_fields((Field("dist", ScalarType("int8")),), {"dist": value})
    assert [problem.sentence for problem in problems] == [f"`dist` is {shown}; it takes a whole number (int8)."]
