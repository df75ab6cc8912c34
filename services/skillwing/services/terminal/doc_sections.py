"""Pages of the documentation that hold figures of commands, each between two marks: comments that no reader sees."""

from __future__ import annotations

import os
import shutil
from argparse import ArgumentTypeError
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from skillwing.services.errors import SkillwingError


class PageError(SkillwingError):
    """A page that cannot take what is to be written into it. page: which one."""

    def __init__(self, page: Path, message: str) -> None:
        self.page = page
        super().__init__(message)


@dataclass(frozen=True, slots=True)
class Marks:
    """The lines between which one command writes."""

    begin: str
    end: str

    @classmethod
    def named(cls, name: str) -> Marks:
        """For figures inside of a section that is written by hand."""
        return cls(f"<!-- {name}: begin -->", f"<!-- {name}: end -->")

    @classmethod
    def of_section(cls, name: str) -> Marks:
        """For a whole section, heading and all."""
        return cls(f"<!-- {name} -->", f"<!-- end of {name} -->")

    def replace(self, page: Path, text: str) -> None:
        """Put lines of Markdown in place of those between the marks; raises PageError for a page without these."""
        before, after = self._surroundings(page, _read(page))
        _write(page, f"{before}{self.begin}\n{text}\n{self.end}{after}")

    def replace_or_append(self, page: Path, text: str, *, title: str) -> None:
        """The same for a page that may have no marks yet, or not be there: then it is begun with its title.

        Raises PageError for marks that are not in order.
        """
        before, after = self._place(page, title)
        _write(page, f"{before}{self.begin}\n{text}\n{self.end}{after}")

    def read(self, page: Path) -> str:
        """The lines between the marks. Raises PageError for a page without these."""
        text = _read(page)
        self._surroundings(page, text)
        return text.partition(f"{self.begin}\n")[2].partition(self.end)[0].removesuffix("\n")

    def check_place(self, page: Path) -> None:
        """Raises PageError for a page that `replace_or_append` would not take."""
        self._place(page, "")
        if not page.resolve().parent.is_dir():
            raise PageError(page, f"There is no folder for {page}. Make it, or name another page.")

    def check(self, page: Path) -> None:
        """Raises PageError for a page without these marks, or with marks that are not in order."""
        self._surroundings(page, _read(page))

    def _place(self, page: Path, title: str) -> tuple[str, str]:
        """What stands before and behind the marks, which are put at the end of a page that has none."""
        old = _read(page) if page.exists() else f"# {title}\n"
        if self.begin not in old and self.end not in old:
            old = f"{old.rstrip()}\n\n{self.begin}\n{self.end}\n"
        return self._surroundings(page, old)

    def _surroundings(self, page: Path, text: str) -> tuple[str, str]:
        """What stands before and behind the marks."""
        lines = text.splitlines()
        missing = [f"`{mark}`" for mark in (self.begin, self.end) if mark not in lines]
        if missing:
            told = " and ".join(missing)
            raise PageError(page, f"{page} lacks {told}. Write such a line where the figures belong.")
        if text.count(self.begin) > 1 or text.count(self.end) > 1 or lines.index(self.end) < lines.index(self.begin):
            raise PageError(
                page,
                f"{page} needs one `{self.begin}` and below it one `{self.end}`. Leave one of each, in this order.",
            )
        before, _, rest = text.partition(self.begin)
        return before, rest.partition(self.end)[2]


def page_with(*marks: Marks) -> Callable[[str], Path]:
    """The type of an option for argparse: a page that has all these marks, to be known before hours of measuring."""

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
        raise PageError(page, f"There is no page {page}. Name one that is there.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise PageError(page, f"{page} cannot be read: {error}. Name a page in Markdown.") from error


def _write(page: Path, text: str) -> None:
    """All or nothing: whoever reads the page meanwhile, or ends this process, finds it old or new and never half."""
    page = page.resolve()
    unfinished = page.with_name(f".{page.name}.{os.getpid()}")
    try:
        unfinished.write_text(text, encoding="utf-8")
        if page.exists():
            shutil.copymode(page, unfinished)
        unfinished.replace(page)
    except OSError as error:
        unfinished.unlink(missing_ok=True)
        raise PageError(page, f"{page} cannot be written: {error}. Make room for it, or name another.") from error
