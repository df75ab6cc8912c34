"""The protocol for programs: every message as JSON Schema, and every key with its messages."""

from __future__ import annotations

from typing import Any

from skillwing.dsl.model import Skillset
from skillwing.services.protocol import PROTOCOL_VERSION, ErrorReply
from skillwing.services.wire.channels import ANY_QUERY, CHANNELS, Channel, Kind
from skillwing.services.wire.messages import DIALECT, REFERENCE, classes_of, definitions


def json_schema() -> dict[str, Any]:
    """All messages under `$defs`, and all keys under `channels`, with placeholders in capitals."""
    kinds = [kind for channel in CHANNELS for kind in (channel.message, channel.reply) if kind is not None]
    classes = dict.fromkeys(cls for kind in (*kinds, ErrorReply) for cls in classes_of(kind))
    return {
        "$schema": DIALECT,
        "title": f"Messages of Skillwing's wire protocol, version {PROTOCOL_VERSION}",
        "version": PROTOCOL_VERSION,
        "$defs": definitions(classes),
        "channels": [{"key": channel.pattern, **_facts(channel)} for channel in CHANNELS],
    }


def channels_of(skillset: Skillset) -> dict[str, Any]:
    """What a client of this skillset has to know: its name, its schema hash, and every key there is."""
    channels = [{"key": key, **_facts(channel)} for channel in CHANNELS for key in channel.keys(skillset)]
    return {
        "skillset": skillset.name,
        "schema": skillset.schema_hash,
        "version": PROTOCOL_VERSION,
        "channels": channels,
    }


def _facts(channel: Channel) -> dict[str, Any]:
    refusals = (*ANY_QUERY, *channel.refusals) if channel.kind is Kind.QUERY else ()
    return {
        "kind": channel.kind,
        "message": _references(channel.message),
        "reply": _references(channel.reply),
        "refusals": refusals,
        "offered_by": channel.offered_by,
        "used_by": channel.used_by,
        "internal": channel.internal,
        "meaning": channel.meaning,
    }


def _references(kind: Any) -> list[str]:
    return [] if kind is None else [REFERENCE.format(name=cls.__name__) for cls in classes_of(kind)]
