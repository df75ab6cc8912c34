"""The page `docs/protocol.md`: everything that a client in another language needs, made from the code."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator

import msgspec

from skillwing.services import names
from skillwing.services.bus import EVENT_HISTORY, backlog
from skillwing.services.bus.zenoh_entities import REFUSAL, TIMEOUT_REPLY
from skillwing.services.bus.zenoh_session import LEASE
from skillwing.services.core.checks import LONGEST_GOAL_ID
from skillwing.services.protocol import MAX_MESSAGE_BYTES, MAX_NESTING, PROTOCOL_VERSION, ErrorCode, ErrorReply
from skillwing.services.protocol_page.exchange import DOOR, Said, play
from skillwing.services.wire.channel import ANY_QUERY, Channel, words
from skillwing.services.wire.channels import CHANNELS, INTERNAL, PUBLIC
from skillwing.services.wire.messages import enumerations, links, sections
from skillwing.services.wire.template import PageTemplate

BYTES_PER_LINE = 32


def _code(code: ErrorCode) -> str:
    return f"[`{code}`](#refusals)"


TEMPLATE = PageTemplate(
    "skillwing.services.protocol_page",
    "protocol.md.template",
    {
        "PROTOCOL_VERSION": PROTOCOL_VERSION,
        "LEASE": LEASE * 1000,
        "MAX_MESSAGE_BYTES": MAX_MESSAGE_BYTES,
        "MAX_NESTING": MAX_NESTING,
        "LONGEST_GOAL_ID": LONGEST_GOAL_ID,
        "REFUSAL": REFUSAL,
        "TIMEOUT_REPLY": TIMEOUT_REPLY.decode(),
        "EVENT_HISTORY": EVENT_HISTORY,
        "STREAM_BACKLOG": backlog.STREAM_BACKLOG,
        "MOST_REQUESTS": backlog.MOST_REQUESTS,
        "WAITING": f"{backlog.MOST_BYTES // backlog.MIB} MiB",
        "RESOURCE_MANAGER": names.RESOURCE_MANAGER,
        "DATA_MANAGER": names.DATA_MANAGER,
        "SKILL_PROCESS": names.skill_process("SKILL"),
        "CLIENT": f"{names.CLIENT}NAME",
    },
    _code,
)


def protocol_page() -> str:
    """The whole page, in Markdown."""
    kinds = [*(kind for channel in CHANNELS for kind in (channel.message, channel.reply)), ErrorReply]
    tables: dict[str, Iterable[str]] = {
        "public_keys": _keys(PUBLIC),
        "internal_keys": _keys(INTERNAL),
        "messages": sections(kinds),
        "enumerations": enumerations(kinds),
        "skillset": [DOOR],
        "exchange": [line for said in play() for line in _exchange_lines(said)],
        "ANY_QUERY": [", ".join(map(_code, ANY_QUERY))],
    }
    return TEMPLATE.page(CHANNELS, tables | {f"where_{code}": [_where(code)] for code in ErrorCode})


def _keys(channels: Iterable[Channel]) -> Iterator[str]:
    return TEMPLATE.table(("key", "kind", "message", "reply", "offered by", "used by"), channels, _cells)


def _cells(channel: Channel) -> tuple[str, ...]:
    message, reply = links(channel.message), links(channel.reply)
    return f"`{channel.pattern}`", channel.kind, message, reply, words(channel.offered_by), words(channel.used_by)


def _where(code: ErrorCode) -> str:
    if code in ANY_QUERY:
        return "every query"
    tails = (channel.pattern.removeprefix("SKILLSET/") for channel in CHANNELS if code in channel.refusals)
    return ", ".join(f"`{tail}`" for tail in tails)


def _exchange_lines(said: Said) -> Iterator[str]:
    yield f"**{said.t:.4f} s**, {said.who} {said.how} on `{said.key}`:\n"
    decoded = msgspec.json.format(msgspec.json.encode(msgspec.msgpack.decode(said.payload)), indent=0).decode()
    yield "```"
    yield from textwrap.wrap(said.payload.hex(), BYTES_PER_LINE * 2)
    yield "```\n"
    yield f"```json\n{decoded}\n```\n"
