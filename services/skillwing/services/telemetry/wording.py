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
    """A chain of causes, root first. Of what one subject went through in a row only the end is said.

    Neighbours that say the same are said once.
    """
    steps = zip(chain, [*chain[1:], None], strict=False)
    words = [headline(each) for each, then in steps if then is None or _thing(each) != _thing(then)]
    return [word for word, before in zip(words, [None, *words], strict=False) if word != before]


def in_words(chain: Sequence[Record]) -> str:
    """A chain of causes in one line: `zed_status FAILED -> zed_depthmap RI`."""
    return " -> ".join(headlines(chain))


def _thing(record: Record) -> tuple[str, str]:
    return record.kind, record.subject
