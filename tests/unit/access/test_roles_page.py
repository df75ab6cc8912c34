"""The table of roles in docs/keys.md."""

from __future__ import annotations

from roles_page import MARKS, PAGE, role_table


def test_the_page_has_the_rules_of_the_code() -> None:
    assert MARKS.read(PAGE) == role_table(), "run `make generate`"
