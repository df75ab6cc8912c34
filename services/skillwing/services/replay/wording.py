"""Events and answers in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

from skillwing.services.core.events import Event
from skillwing.services.protocol import RecordKind

_OMITTED = frozenset({"type", "v", "t", "record", "schema", "kind"})
"""Fields that the words of a step leave out."""


def event_in_words(event: Event) -> str:
    """An event as its tag and fields: `end: goal_id 0190..., skill goto, ...`."""
    return _in_words(msgspec.to_builtins(event))


def answer_in_words(answer: Mapping[str, Any]) -> str:
    """An answer as plain values, as clauses: the reply, then verdicts and changes that were published."""
    match answer:
        case {"type": "refused", "error": error}:
            return f"refused ({error['code']}): {error['message']}"
        case {"type": "broken", "error": error}:
            return f"the core broke: {error}"
        case {"reply": reply, "publications": publications}:
            return "; ".join(["no reply" if reply is None else _in_words(reply), *_changes(publications)])
        case _:
            return str(answer)


def _changes(publications: list[dict[str, Any]]) -> Iterator[str]:
    for each in publications:
        match each:
            case {"kind": RecordKind.RESOURCE, "subject": resource, "before": before, "after": after}:
                yield f"`{resource}` {before} -> {after}"
            case {"type": _}:
                yield _in_words(each)
            case _:
                pass


def _in_words(fields: Mapping[str, Any]) -> str:
    shown = [
        f"{name} {value}" for name, value in fields.items() if name not in _OMITTED and value not in (None, "", {})
    ]
    return f"{fields.get('type', 'states')}: {', '.join(shown)}" if shown else str(fields.get("type"))
