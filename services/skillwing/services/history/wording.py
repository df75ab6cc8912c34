"""Words for records and robot times: for logs, pictures, reports and the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from itertools import groupby

from skillwing.services.protocol import Record

NEAREST = 5
"""Causes of a long chain that are shown in addition to its root."""
UNIX_TIMES = 1e9
"""Seconds from which a robot time is Unix time; simulated worlds begin at 0."""


def time_text(t: float) -> str:
    """Robot time: seconds of a simulated world, or date and time."""
    if t < UNIX_TIMES:
        return f"{t:.2f} s"
    return datetime.fromtimestamp(t).astimezone().isoformat(sep=" ", timespec="milliseconds").partition("+")[0]


def clock_text(t: float) -> str:
    """Robot time in a live view: seconds of a simulated world, or the time of day."""
    return f"{t:.1f} s" if t < UNIX_TIMES else datetime.fromtimestamp(t).astimezone().strftime("%H:%M:%S")


def headline(record: Record) -> str:
    """The change in the fewest words: `zed_status FAILED`."""
    return f"{record.subject} {record.after}"


def brief(record: Record) -> str:
    """The change and its reason: `zed FAILED: no image for 0.5 s`."""
    return headline(record) + (f": {record.text}" if record.text else "")


def ends(chain: Sequence[Record]) -> list[Record]:
    """A chain of causes, root first, with the last record of consecutive ones about the same subject."""
    return [each for each, then in zip(chain, [*chain[1:], None], strict=False) if then is None or _differ(each, then)]


def headlines(chain: Sequence[Record]) -> list[str]:
    """The ends of a chain of causes as headlines, root first, without equal neighbours."""
    return [words for words, _ in groupby(headline(each) for each in ends(chain))]


def abridge(causes: Sequence[str]) -> list[str]:
    """The root and the nearest of many causes, given root first. Each step of a mission is the cause of the next, so
    that chains grow with the mission."""
    left_out = len(causes) - NEAREST - 1
    return [causes[0], f"... {left_out} more", *causes[-NEAREST:]] if left_out > 1 else list(causes)


def chain_text(chain: Sequence[Record]) -> str:
    """A chain of causes in one line: `zed_status FAILED -> zed_depthmap RI`."""
    return " -> ".join(abridge(headlines(chain)))


def _differ(one: Record, other: Record) -> bool:
    return (one.kind, one.subject) != (other.kind, other.subject)
