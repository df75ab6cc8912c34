"""The pages on error codes are held to what they say. `make errors` renews what follows from the code."""

from __future__ import annotations

import pytest
from error_pages import FOLDER, Page, index, pages

from skillwing.dsl.diagnostics.codes import CODES


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.code)
def test_the_example_gets_the_output_beneath_it(page: Page) -> None:
    assert page.code in {diagnostic.code for diagnostic in page.diagnostics(0)}
    assert page.renewed() == page.text, "run `make generate`"


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.code)
def test_the_fixed_example_is_fixed(page: Page) -> None:
    assert page.code not in {diagnostic.code for diagnostic in page.diagnostics(1)}


def test_every_code_has_a_page_and_a_line_in_the_index() -> None:
    assert [page.code for page in pages()] == sorted(CODES), (
        "write docs/errors/CODE.md for each code, then `make generate`"
    )
    assert (FOLDER / "README.md").read_text(encoding="utf-8") == index(), "run `make generate`"
