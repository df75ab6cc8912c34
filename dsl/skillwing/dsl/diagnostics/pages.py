"""The page on each code: `docs/errors/CODE.md` in the repository, and a copy of it in an installed package."""

from __future__ import annotations

from pathlib import Path

_INSTALLED = Path(__file__).parent / "pages"
_REPOSITORY = Path(__file__).parents[4] / "docs" / "errors"


def page_on(code: str) -> str:
    """The Markdown text of the page on a code. Raises FileNotFoundError if there is none."""
    folder = _INSTALLED if _INSTALLED.is_dir() else _REPOSITORY
    return (folder / f"{code}.md").read_text(encoding="utf-8")
