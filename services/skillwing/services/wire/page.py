"""The page `docs/protocol.md`: everything that a client in another language has to know, made from the code."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

import msgspec

from skillwing.services.protocol import Ending, ErrorCode, ErrorReply, State
from skillwing.services.wire.channels import ANY_QUERY, CHANNELS, Channel
from skillwing.services.wire.exchange import DOOR, Said, play
from skillwing.services.wire.meanings import ENDINGS, REFUSALS, STATES
from skillwing.services.wire.messages import classes_of, enumeration, link, links, parts_of, section
from skillwing.services.wire.opening import OPENING

BYTES_PER_LINE = 32


def protocol_page() -> str:
    """The whole page, in Markdown."""
    return "\n".join([OPENING, *_keys(), *_refusals(), *_goal_words(), *_messages(), *_exchange()])


# --- keys ------------------------------------------------------------------------------------------------------------


def _keys() -> Iterator[str]:
    yield "## Keys\n"
    yield "Words in capitals stand for names of the skillset. Every query may also be refused with"
    yield f"{_codes(ANY_QUERY)}.\n"
    groups = {
        "### For clients\n": [channel for channel in CHANNELS if not channel.internal],
        "### Between managers\n\nListen if you like; only managers speak here.\n": [
            channel for channel in CHANNELS if channel.internal
        ],
    }
    for heading, channels in groups.items():
        yield heading
        yield "| key | kind | message | reply | offered by | used by |"
        yield "|---|---|---|---|---|---|"
        yield from (_row(channel) for channel in channels)
        yield ""
        yield from (_meaning(channel) for channel in channels)
        yield ""


def _row(channel: Channel) -> str:
    message, reply = ("" if kind is None else links(kind) for kind in (channel.message, channel.reply))
    cells = (f"`{channel.pattern}`", channel.kind, message, reply, channel.offered_by, channel.used_by)
    return f"| {' | '.join(cells)} |"


def _meaning(channel: Channel) -> str:
    refused = f" Refused with {_codes(channel.refusals)}." if channel.refusals else ""
    return f"- **`{channel.pattern}`** ({channel.kind}): {channel.meaning}{refused}"


def _codes(codes: tuple[ErrorCode, ...]) -> str:
    return ", ".join(f"[`{code}`](#refusals)" for code in codes)


# --- words -----------------------------------------------------------------------------------------------------------


def _refusals() -> Iterator[str]:
    yield "## Refusals\n"
    yield f"A refused request has changed nothing. {link('ErrorReply')} carries one of these codes:\n"
    yield "| code | means | what to do | where |"
    yield "|---|---|---|---|"
    for code in ErrorCode:
        meaning, remedy = REFUSALS[code]
        yield f"| `{code}` | {meaning} | {remedy} | {_where(code)} |"
    yield ""


def _where(code: ErrorCode) -> str:
    if code in ANY_QUERY:
        return "every query"
    return ", ".join(f"`{_tail(channel)}`" for channel in CHANNELS if code in channel.refusals)


def _tail(channel: Channel) -> str:
    return channel.pattern.removeprefix("SKILLSET/")


def _goal_words() -> Iterator[str]:
    yield "## States and ends of a goal\n"
    yield "| state | means |\n|---|---|"
    yield from (f"| `{state}` | {STATES[state]} |" for state in State)
    yield "\n| end | means | sets, besides `reason` |\n|---|---|---|"
    yield from (f"| `{ending}` | {' | '.join(ENDINGS[ending])} |" for ending in Ending)
    yield ""


# --- messages --------------------------------------------------------------------------------------------------------


def _messages() -> Iterator[str]:
    classes: dict[type[msgspec.Struct], None] = {}
    for channel in CHANNELS:
        for kind in (channel.message, channel.reply):
            classes |= dict.fromkeys(() if kind is None else classes_of(kind))
    classes[ErrorReply] = None
    structs, enums = parts_of(classes)
    yield "## Messages\n"
    for cls in (*classes, *structs):
        yield from section(cls)
    yield "## Enumerations\n"
    for enum in enums:
        yield from enumeration(enum)


# --- the exchange ----------------------------------------------------------------------------------------------------


def _exchange() -> Iterator[str]:
    yield "## An exchange, byte by byte\n"
    yield "Played by the real managers of this skillset, with a mock that needs 0.7 s:\n"
    yield f"```\n{DOOR}```\n"
    yield "A client starts a goal that succeeds, then another one, during which the power fails. It interrupts the"
    yield "first one, which is over by then, and one that never was. Defaults are written out here, and need not be.\n"
    for said in play():
        yield from _told(said)


def _told(said: Said) -> Iterator[str]:
    yield f"**{said.t:.4f} s**, {said.who} {said.how} on `{said.key}`:\n"
    decoded = msgspec.json.format(msgspec.json.encode(msgspec.msgpack.decode(said.payload)), indent=0).decode()
    yield "```"
    yield from textwrap.wrap(said.payload.hex(), BYTES_PER_LINE * 2)
    yield "```\n"
    yield f"```json\n{decoded}\n```\n"
