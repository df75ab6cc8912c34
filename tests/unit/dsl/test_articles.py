"""Types in sentences have the right article."""

from __future__ import annotations

import pytest

from skillwing.dsl.checking.checker import check


@pytest.mark.parametrize(
    ("kind", "shown"), [("int8", "an int8"), ("uint8", "a uint8"), ("float64", "a float64"), ("string", "a string")]
)
def test_a_datum_is_no_predicate(kind: str, shown: str) -> None:
    source = (
        f"skillset s {{ data {{ n: {kind} }} skill k {{ precondition {{ p: data=(n) }} result {{ success OK }} }} }}"
    )
    messages = [diagnostic.message for diagnostic in check(source, "s").diagnostics]
    assert f"`n` is {shown}, not a predicate." in messages
