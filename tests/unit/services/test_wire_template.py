"""Pages that are made from a Markdown template: figures, tables, and prose about keys."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest

from skillwing.services.protocol import ErrorCode, Message, QueryStates
from skillwing.services.wire import template
from skillwing.services.wire.channel import Channel, Kind
from skillwing.services.wire.template import Meaning, PageTemplate

TEXT = """\
Wait $SECONDS s.

$keys

- **`a`** (query): Ask in $SECONDS s. *Without it:* Nothing.
"""


class Reading(Message, frozen=True, kw_only=True):
    """A reading, in
    metres. It has no fields."""


ASKED = Channel("a", Kind.QUERY, "one", ("other",), QueryStates, QueryStates, (ErrorCode.TOO_LATE,), array="bytes")
PUBLISHED = Channel("b", Kind.STREAM, "one", ("other",), Reading)
UNUSED = Channel("c", Kind.STREAM, "one", (), Reading)


def page_of(text: str, folder: Path) -> PageTemplate:
    (folder / "page").write_text(text, encoding="utf-8")
    with patch.object(template, "files", lambda package: folder):
        return PageTemplate("package", "page", {"SECONDS": 0.5}, str.lower)


@pytest.fixture
def page(tmp_path: Path) -> PageTemplate:
    return page_of(TEXT, tmp_path)


def test_figures_tables_and_facts_are_filled_in(page: PageTemplate) -> None:
    keys = page.table(("key",), [ASKED], lambda channel: [channel.pattern])
    assert page.page([ASKED], {"keys": keys}) == (
        "Wait 0.5 s.\n\n| key |\n|---|\n| a |\n\n"
        "- **`a`** (query): Ask in 0.5 s. Reply: bytes. Refused with too_late. *Without it:* Nothing.\n"
    )


def test_a_key_without_prose_is_explained_by_the_first_sentence_of_its_message(page: PageTemplate) -> None:
    (*_, item) = page.table(("key",), [ASKED, PUBLISHED], lambda channel: [channel.pattern])
    assert item == "- **`b`** (stream): A reading, in metres."
    assert page.meaning(ASKED) == Meaning("Ask in 0.5 s.", "Nothing.")


def test_only_the_absence_of_an_unused_key_needs_no_prose(page: PageTemplate) -> None:
    assert page.meaning(PUBLISHED).without == ""
    assert page.meaning(UNUSED) == Meaning("A reading, in metres.", "No effect on the robot.")


def test_items_come_in_the_order_of_their_rows(page: PageTemplate) -> None:
    table = page.table(("key",), [UNUSED, ASKED], lambda channel: [channel.pattern])
    items = [line[:7] for line in page.page([UNUSED, ASKED], {"keys": table}).splitlines() if line.startswith("- ")]
    assert items == ["- **`c`", "- **`a`"]


def test_a_missing_table_or_key_is_an_error(page: PageTemplate) -> None:
    with pytest.raises(KeyError):
        page.page([ASKED], {})
    with pytest.raises(KeyError):
        page.page([PUBLISHED], {"keys": []})


def test_an_item_of_two_lines_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"The item `b` of page has a second line: '`token` tells it.'. Write each"):
        page_of(f"{TEXT}- **`b`** (stream): Readings. The\n  `token` tells it.\n", tmp_path)
