"""Records in words: for logs, pictures and reports."""

from __future__ import annotations

from collections.abc import Sequence

from skillwing.services.protocol import Record


def headline(record: Record) -> str:
    """What changed, in the fewest words: `zed_status FAILED`."""
    return f"{record.subject} {record.after}"


def sentence(record: Record) -> str:
    """What changed and why: `zed_status: OK -> FAILED (no image for 0.5 s)`."""
    change = f"{record.before} -> {record.after}" if record.before else record.after
    return f"{record.subject}: {change}" + (f" ({record.text})" if record.text else "")


def in_words(chain: Sequence[Record]) -> str:
    """A chain of causes, root first. Neighbours that say the same (a sensor and its resource) are said once."""
    words: list[str] = []
    for record in chain:
        if not words or words[-1] != headline(record):
            words.append(headline(record))
    return " -> ".join(words)
