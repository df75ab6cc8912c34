"""Figures take the place of those before, in a page that stays otherwise as it is; a page without place says so."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.terminal.doc_sections import Marks, PageError, page_with

MARKS = Marks.named("wind")
ROUND = f"a\n{MARKS.begin}\nold\n{MARKS.end}\nz\n"
LINES = st.lists(st.text("abc |#-<!\u00e9"), max_size=5).map("\n".join)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    return tmp_path / "page.md"


@given(before=LINES, old=LINES, after=LINES, first=LINES, second=LINES)
def test_the_last_text_stands_between_the_marks_and_all_else_as_before(
    tmp_path_factory: pytest.TempPathFactory, before: str, old: str, after: str, first: str, second: str
) -> None:
    page = tmp_path_factory.getbasetemp() / "law.md"
    page.write_text(f"{before}\n{MARKS.begin}\n{old}\n{MARKS.end}\n{after}", encoding="utf-8")
    for text in (first, second):
        MARKS.replace(page, text)
        assert page.read_text(encoding="utf-8") == f"{before}\n{MARKS.begin}\n{text}\n{MARKS.end}\n{after}"
        assert MARKS.read(page) == text


def test_sections_of_several_commands_share_a_page(page: Path) -> None:
    for name in ("wind", "rain", "wind"):
        Marks.of_section(name).replace_or_append(page, f"## {name.capitalize()}", title="Weather")
    assert page.read_text(encoding="utf-8") == (
        "# Weather\n\n<!-- wind -->\n## Wind\n<!-- end of wind -->\n\n<!-- rain -->\n## Rain\n<!-- end of rain -->\n"
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("nothing", f"lacks `{MARKS.begin}` and `{MARKS.end}`"),
        (f"{MARKS.begin}\n", f"lacks `{MARKS.end}`"),
        (f"in words: {MARKS.begin}\n{MARKS.end}\n", f"lacks `{MARKS.begin}`"),
        (f"{MARKS.end}\n{MARKS.begin}\n", "and below it"),
        (ROUND + ROUND, "Leave one of each"),
    ],
)
def test_a_page_without_place_is_named_and_left_as_it_is(page: Path, text: str, told: str) -> None:
    page.write_text(text, encoding="utf-8")
    with pytest.raises(PageError) as raised:
        MARKS.replace(page, "new")
    assert told in str(raised.value)
    assert str(page) in str(raised.value)
    assert page.read_text(encoding="utf-8") == text


def test_half_a_place_is_not_appended_to(page: Path) -> None:
    page.write_text(f"{MARKS.begin}\nold\n", encoding="utf-8")
    with pytest.raises(PageError, match=MARKS.end):
        MARKS.check_place(page)
    with pytest.raises(PageError, match=MARKS.end):
        MARKS.replace_or_append(page, "new", title="Page")


def test_a_section_finds_a_place_in_any_folder_that_is_there(page: Path) -> None:
    MARKS.check_place(page)
    assert not page.exists()
    with pytest.raises(PageError, match="There is no folder for"):
        MARKS.check_place(page / "deeper.md")


@pytest.mark.parametrize(
    ("content", "told"),
    [(None, "There is no page"), (b"\xff", "cannot be read"), (ROUND.encode(), "lacks `<!-- rain: begin -->`")],
)
def test_an_option_refuses_a_page_before_anything_is_measured(
    page: Path, capsys: pytest.CaptureFixture[str], content: bytes | None, told: str
) -> None:
    options = ArgumentParser()
    options.add_argument("--write", type=page_with(MARKS, Marks.named("rain")))
    if content is not None:
        page.write_bytes(content)
    with pytest.raises(SystemExit):
        options.parse_args(["--write", str(page)])
    assert told in capsys.readouterr().err


def test_writing_fails_as_a_whole_or_not_at_all(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page.write_text(ROUND, encoding="utf-8")
    page.chmod(0o640)
    MARKS.replace(page, "new")
    assert page.stat().st_mode & 0o777 == 0o640

    def fail(self: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(PageError, match="No space left"):
        MARKS.replace(page, "newer")
    assert page.read_text(encoding="utf-8") == ROUND.replace("old", "new")
    assert list(page.parent.iterdir()) == [page]
