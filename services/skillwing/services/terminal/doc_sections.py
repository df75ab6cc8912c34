"""Generated sections of documentation pages: a command writes each between two marks, which are Markdown comments."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from skillwing.dsl.whole_files import write_whole
from skillwing.services.errors import SkillwingError


class PageError(SkillwingError):
    """A page into which a section cannot be written. page: its path."""

    def __init__(self, page: Path, message: str) -> None:
        self.page = page
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Marks:
    """The two lines between which a command writes."""

    begin: str
    end: str

    @classmethod
    def named(cls, name: str) -> Marks:
        """Marks for figures inside of a handwritten section."""
        return cls(f"<!-- {name}: begin -->", f"<!-- {name}: end -->")

    @classmethod
    def of_section(cls, name: str) -> Marks:
        """Marks for a whole section with its heading."""
        return cls(f"<!-- {name} -->", f"<!-- end of {name} -->")

    def replace(self, page: Path, text: str) -> None:
        """Replace the lines between the marks; raises PageError for a page without these marks."""
        before, after = self._surroundings(page, _read(page))
        _write(page, f"{before}{self.begin}\n{text}\n{self.end}{after}")

    def replace_or_append(self, page: Path, text: str, *, title: str) -> None:
        """The same for a page without marks, or a new page, which begins with its title.

        Raises PageError for marks that are not in order.
        """
        before, after = self._place(page, title)
        _write(page, f"{before}{self.begin}\n{text}\n{self.end}{after}")

    def read(self, page: Path) -> str:
        """The lines between the marks. Raises PageError for a page without these marks."""
        text = _read(page)
        self._surroundings(page, text)
        return text.partition(f"{self.begin}\n")[2].partition(self.end)[0].removesuffix("\n")

    def check_place(self, page: Path) -> None:
        """Raise PageError for a page that `replace_or_append` would reject."""
        self._place(page, "")
        if not page.resolve().parent.is_dir():
            raise PageError(page, f"There is no folder for {page}. Make it, or name another page.")

    def check(self, page: Path) -> None:
        """Raise PageError for a page without these marks, or with marks that are not in order."""
        self._surroundings(page, _read(page))

    def _place(self, page: Path, title: str) -> tuple[str, str]:
        """The text before and after the marks; a page without marks gets them at its end."""
        old = _read(page) if page.exists() else f"# {title}\n"
        if self.begin not in old and self.end not in old:
            old = f"{old.rstrip()}\n\n{self.begin}\n{self.end}\n"
        return self._surroundings(page, old)

    def _surroundings(self, page: Path, text: str) -> tuple[str, str]:
        """The text before and after the marks."""
        lines = text.splitlines()
        missing = [f"`{mark}`" for mark in (self.begin, self.end) if mark not in lines]
        if missing:
            lines = " and ".join(missing)
            raise PageError(page, f"{page} lacks {lines}. Write such a line at the place of the figures.")
        if text.count(self.begin) > 1 or text.count(self.end) > 1 or lines.index(self.end) < lines.index(self.begin):
            raise PageError(
                page,
                f"{page} needs one `{self.begin}` and below it one `{self.end}`. Leave one of each, in this order.",
            )
        before, _, rest = text.partition(self.begin)
        return before, rest.partition(self.end)[2]


def page_with(*marks: Marks) -> Callable[[str], Path]:
    """The type of an argparse option: a page with all these marks, checked before a long measurement."""

    def page_of(path: str) -> Path:
        page = Path(path)
        try:
            for each in marks:
                each.check(page)
        except PageError as error:
            raise ArgumentTypeError(str(error)) from error
        return page

    return page_of


def _read(page: Path) -> str:
    try:
        return page.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise PageError(page, f"There is no page {page}. Name one that exists.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise PageError(page, f"{page} cannot be read: {error}. Name a page in Markdown.") from error


def _write(page: Path, text: str) -> None:
    try:
        write_whole(page, text)
    except OSError as error:
        raise PageError(
            page, f"{page} cannot be written: {error.strerror}. Make room for it, or name another."
        ) from error
