"""The protocol for programs: every message as JSON Schema, and every key with its messages."""

from __future__ import annotations

from typing import Any

from skillwing.dsl.model import Skillset
from skillwing.services.protocol import PROTOCOL_VERSION, ErrorReply
from skillwing.services.protocol_page.page import TEMPLATE
from skillwing.services.wire.channel import ANY_QUERY, Channel, Kind, words
from skillwing.services.wire.channels import CHANNELS, INTERNAL, keys_in
from skillwing.services.wire.messages import DIALECT, REFERENCE, classes_of, definitions


def json_schema() -> dict[str, Any]:
    """All messages under `$defs`, and all keys under `channels`, with placeholders in capitals."""
    kinds = [kind for channel in CHANNELS for kind in (channel.message, channel.reply)]
    return {
        "$schema": DIALECT,
        "title": f"Messages of Skillwing's wire protocol, version {PROTOCOL_VERSION}",
        "version": PROTOCOL_VERSION,
        "$defs": definitions([*kinds, ErrorReply]),
        "channels": [{"key": channel.pattern, **_facts(channel)} for channel in CHANNELS],
    }


def channels_of(skillset: Skillset) -> dict[str, Any]:
    """The facts that a client of this skillset needs: its name, its schema hash, and every key of its robots."""
    return {
        "skillset": skillset.name,
        "schema": skillset.schema_hash,
        "version": PROTOCOL_VERSION,
        "channels": [{"key": key, **_facts(channel)} for channel in CHANNELS for key in keys_in(skillset, channel)],
    }


def _facts(channel: Channel) -> dict[str, Any]:
    return {
        "kind": channel.kind,
        "message": _references(channel.message),
        "reply": _references(channel.reply),
        "refusals": (*ANY_QUERY, *channel.refusals) if channel.kind is Kind.QUERY else (),
        "offered_by": words(channel.offered_by),
        "used_by": words(channel.used_by),
        "internal": channel in INTERNAL,
        "meaning": TEMPLATE.meaning(channel).text,
    }


def _references(kind: Any) -> list[str]:
    return [REFERENCE.format(name=cls.__name__) for cls in classes_of(kind)]
