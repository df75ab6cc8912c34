"""The page `docs/functional-layer.md`: what stands between robot and skills, made from the code."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from skillwing.onboard.interface.opening import OPENING
from skillwing.onboard.interface.table import PLACES, TOPICS
from skillwing.onboard.interface.topic import Kind, Topic
from skillwing.services.protocol import Message
from skillwing.services.wire.messages import DIALECT, classes_of, definitions, enumeration, link, parts_of, section

LEGEND = """\
Offered by `sim` is what a vehicle has to offer in its place. The duty is that of whoever offers it: what **must** be
there, or nothing flies; what **should** be, or it flies worse; what is there **for some skills**; and what is for
**trials only**, for judges, recordings and tests, which no skill misses.
"""


def interface_page() -> str:
    """The whole page, in Markdown."""
    return "\n".join([OPENING, *_topics(), *_messages()])


def interface_schema() -> dict[str, Any]:
    """All messages as JSON Schema under `$defs`, and all rows of the table under `topics`."""
    return {
        "$schema": DIALECT,
        "title": "Messages of Skillwing's functional layer",
        "$defs": definitions(_classes()),
        "topics": [topic.facts() for topic in TOPICS],
    }


# --- topics ----------------------------------------------------------------------------------------------------------


def _topics() -> Iterator[str]:
    yield "## Topics\n"
    yield LEGEND
    for place, topics in PLACES.items():
        yield f"### {place}\n"
        yield "| key | kind | message | rate | offered by | used by | duty |"
        yield "|---|---|---|---|---|---|---|"
        yield from (_row(topic) for topic in topics)
        yield ""
        yield from (_meaning(topic) for topic in topics)
        yield ""


def _row(topic: Topic) -> str:
    message = link(topic.message.__name__)
    if topic.reply is not None:
        message += f" → {link(topic.reply.__name__)}"
    used_by = ", ".join(topic.used_by) or "onlookers"
    cells = (f"`{topic.pattern}`", topic.kind, message, rate_text(topic), topic.offered_by, used_by, topic.duty)
    return f"| {' | '.join(cells)} |"


def rate_text(topic: Topic) -> str:
    """How often, in a few words; empty for a query."""
    hertz = "" if topic.rate is None else f"{topic.rate:g} Hz"
    together = " " if topic.when.startswith("and ") else ", "
    return together.join(each for each in (hertz, topic.when) if each)


def _meaning(topic: Topic) -> str:
    holds = f" {'Reply' if topic.kind is Kind.QUERY else 'Payload'}: {topic.array}." if topic.array else ""
    refused = f" Refused with {', '.join(f'`{code}`' for code in topic.refusals)}." if topic.refusals else ""
    return f"- **`{topic.pattern}`**: {topic.meaning}{holds}{refused} *Without it:* {topic.without}"


# --- messages --------------------------------------------------------------------------------------------------------


def _classes() -> dict[type[Message], None]:
    kinds = (kind for topic in TOPICS for kind in (topic.message, topic.reply) if kind is not None)
    return dict.fromkeys(kinds)


def _messages() -> Iterator[str]:
    classes = [cls for kind in _classes() for cls in classes_of(kind)]
    structs, enums = parts_of(classes)
    yield "## Messages\n"
    for cls in (*classes, *structs):
        yield from section(cls)
    yield "## Enumerations\n"
    for enum in enums:
        yield from enumeration(enum)
