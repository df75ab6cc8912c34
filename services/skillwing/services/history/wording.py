"""Records in words: for logs, pictures and reports."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from skillwing.services.protocol import Record

NEAREST = 5
"""Causes that are told of a long chain, besides its root."""


def headline(record: Record) -> str:
    """What changed, in the fewest words: `zed_status FAILED`."""
    return f"{record.subject} {record.after}"


def brief(record: Record) -> str:
    """What changed and why: `zed FAILED: no image for 0.5 s`."""
    return headline(record) + (f": {record.text}" if record.text else "")


def ends(chain: Sequence[Record]) -> list[Record]:
    """A chain of causes, root first, without steps: of what one subject went through in a row only the end."""
    return [each for each, then in zip(chain, [*chain[1:], None], strict=False) if then is None or _differ(each, then)]


def headlines(chain: Sequence[Record]) -> list[str]:
    """The ends of a chain of causes in the fewest words, root first. Neighbours that say the same are said once."""
    return [words for words, _ in groupby(headline(each) for each in ends(chain))]


def abridged(causes: Sequence[str]) -> list[str]:
    """Of many causes, given root first, the root and the nearest ones. A mission makes one step the cause of the next,
    so that chains grow with it."""
    left_out = len(causes) - NEAREST - 1
    return [causes[0], f"... {left_out} more", *causes[-NEAREST:]] if left_out > 1 else list(causes)


def in_words(chain: Sequence[Record]) -> str:
    """A chain of causes in one line: `zed_status FAILED -> zed_depthmap RI`."""
    return " -> ".join(abridged(headlines(chain)))


def _differ(one: Record, other: Record) -> bool:
    return (one.kind, one.subject) != (other.kind, other.subject)
