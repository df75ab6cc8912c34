"""The page `docs/functional-layer.md`: the topics between robot and skills, made from the code."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from skillwing.onboard.guidance import body_motion, core, heading_control, limits, path_monitor, trajectory
from skillwing.onboard.interface.table import PLACES, TOPICS
from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.services.bus import EVENT_HISTORY
from skillwing.services.protocol import ErrorCode
from skillwing.services.wire.channel import Channel, Kind, words
from skillwing.services.wire.messages import DIALECT, definitions, enumerations, links, sections
from skillwing.services.wire.template import PageTemplate

TEMPLATE = PageTemplate(
    "skillwing.onboard.interface",
    "functional-layer.md.template",
    {
        "EVENT_HISTORY": EVENT_HISTORY,
        "LARGEST_COMPONENT": LARGEST_COMPONENT,
        "ARRIVED_WITHIN": body_motion.ARRIVED_WITHIN,
        "AT_REST": body_motion.AT_REST,
        "DRIFT": body_motion.DRIFT,
        "FLARE_HEIGHT": body_motion.FLARE_HEIGHT,
        "MAX_CLIMB": body_motion.MAX_CLIMB,
        "PATIENCE": body_motion.PATIENCE,
        "TOUCHDOWN_SPEED": body_motion.TOUCHDOWN_SPEED,
        "ALIGNED": heading_control.ALIGNED,
        "TURN_RATE": heading_control.TURN_RATE,
        "FENCE_MARGIN": limits.FENCE_MARGIN,
        "HIGHEST": limits.HIGHEST,
        "HOLD_TIME": limits.HOLD_TIME,
        "LOWEST": limits.LOWEST,
        "MAX_SPEED": limits.MAX_SPEED,
        "SETPOINT_TIMEOUT": limits.SETPOINT_TIMEOUT,
        "MARGIN": path_monitor.MARGIN,
        "STALE": path_monitor.STALE,
        "ALONE": core.LAND_AFTER,
        "ACCELERATION": trajectory.ACCELERATION,
        "BRAKING": trajectory.BRAKING,
    },
    "`{}`".format,
)
KINDS = [kind for topic in TOPICS for kind in (topic.message, topic.reply)]


def interface_page() -> str:
    """The whole page, in Markdown."""
    tables: dict[str, Iterable[str]] = {place: _topics(topics) for place, topics in PLACES.items()}
    tables |= {"messages": sections(KINDS), "enumerations": enumerations(KINDS)}
    return TEMPLATE.page(TOPICS, tables)


def interface_schema() -> dict[str, Any]:
    """All messages as JSON Schema under `$defs`, and all rows of the table under `topics`."""
    return {
        "$schema": DIALECT,
        "title": "Messages of Skillwing's functional layer",
        "$defs": definitions(KINDS),
        "topics": [_facts(topic) for topic in TOPICS],
    }


def _topics(topics: Iterable[Channel]) -> Iterator[str]:
    return TEMPLATE.table(("key", "kind", "message", "rate", "offered by", "used by", "duty"), topics, _cells)


def _cells(topic: Channel) -> tuple[str, ...]:
    message = " → ".join(links(kind) for kind in (topic.message, topic.reply) if kind is not None)
    used_by = words(topic.used_by) or "observers"
    return f"`{topic.pattern}`", topic.kind, message, topic.rate_text, words(topic.offered_by), used_by, str(topic.duty)


def _facts(topic: Channel) -> dict[str, Any]:
    meaning = TEMPLATE.meaning(topic)
    return {
        "key": topic.pattern,
        "kind": topic.kind,
        "message": topic.message.__name__,
        "reply": None if topic.reply is None else topic.reply.__name__,
        "array": topic.array,
        "rate": topic.rate,
        "when": topic.when,
        "duty": topic.duty,
        "offered_by": words(topic.offered_by),
        "used_by": topic.used_by,
        "refusals": (ErrorCode.BAD_REQUEST, *topic.refusals) if topic.kind is Kind.QUERY else (),
        "meaning": meaning.text,
        "without": meaning.without,
    }
