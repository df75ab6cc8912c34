"""Records in words: for logs, pictures and reports."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.services.protocol import Record


def headline(record: Record) -> str:
    """What changed, in the fewest words: `zed_status FAILED`."""
    return f"{record.subject} {record.after}"


def brief(record: Record) -> str:
    """What changed and why: `zed FAILED: no image for 0.5 s`."""
    return headline(record) + (f": {record.text}" if record.text else "")


def headlines(chain: Sequence[Record]) -> list[str]:
    """A chain of causes, root first. Neighbours that say the same are said once."""
    words = [headline(record) for record in chain]
    return [word for word, before in zip(words, [None, *words], strict=False) if word != before]


def in_words(chain: Sequence[Record]) -> str:
    """A chain of causes in one line: `zed_status FAILED -> zed_depthmap RI`."""
    return " -> ".join(headlines(chain))
