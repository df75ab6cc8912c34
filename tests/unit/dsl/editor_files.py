"""The skillset files on which the editor's functions are tried."""

from __future__ import annotations

from pathlib import Path

from skillwing.dsl.editor.document import Document

_ROOT = Path(__file__).parents[3]
_PLACES = (
    "services/skillwing/m600/m600.skillset",
    "examples/*/*.skillset",
    "tests/unit/dsl/cases/valid/**/*.skillset",
)
FILES = sorted(path for pattern in _PLACES for path in _ROOT.glob(pattern))
RL_FILES = sorted((_ROOT / "tests/unit/dsl/cases/rl/valid").glob("*.rl"))


def document(path: Path) -> Document:
    return Document(path.read_text(encoding="utf-8"), str(path))


def marked(text: str, file: str = "rover.skillset") -> tuple[Document, int]:
    """A document and the offset of the `|` in its text, which is taken out."""
    offset = text.index("|")
    return Document(text[:offset] + text[offset + 1 :], file), offset
