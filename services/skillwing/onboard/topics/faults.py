"""Faults that a simulated vehicle and its radio link can be given."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import msgspec

from skillwing.onboard.topics.common import Component, Done, Empty
from skillwing.onboard.topics.processes import LINK, OPERATOR, VEHICLE
from skillwing.onboard.topics.rows import query
from skillwing.onboard.topics.sensors import SensorStatus
from skillwing.services.protocol import ErrorCode, Label, Message
from skillwing.services.wire.channel import Channel, Duty

FAULT = "fl/fault"
FAULTS = "fl/fault/all"
LINK_FAULT = "fl/link/fault"


def fault_id(part: str, kind: str, since: float) -> str:
    """Id of a fault's timeline record, the root of a cause chain. since: robot time at which it was switched on."""
    return f"fault/{part}/{kind}@{since:.3f}"


def read_fault_id(fault: str) -> tuple[str, float | None]:
    """Kind of a fault and the time at which it was switched on; None for an id without a time."""
    kind, _, since = fault.rpartition("/")[2].partition("@")
    try:
        return kind, float(since)
    except ValueError:
        return kind, None


Magnitude: TypeAlias = Component
"""Severity of a fault, in the fault's unit. Some kinds accept a smaller range (docs/sensors.md)."""
FASTEST_LINK = 1e4
Megabits: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=FASTEST_LINK)]
"""A bandwidth [Mbit/s]."""


class SetFault(Message, frozen=True, kw_only=True):
    """Switch a fault. Kinds: of a sensor blackout, freeze, noise, bias, dropout, slow; of a rotor stopped, weak."""

    sensor: Label
    kind: Label
    on: bool = True
    magnitude: Magnitude | None = None


class FaultState(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part that can fail: the `kinds` of its faults, those that are `active`, and its health (None of a rotor)."""

    name: Label
    kinds: tuple[str, ...]
    active: tuple[str, ...] = ()
    status: SensorStatus | None = None


class Faults(Message, frozen=True, kw_only=True):
    of: tuple[FaultState, ...]


class SetLinkFault(Message, frozen=True, kw_only=True):
    """Switch a fault of the link. Kinds: narrow (`magnitude` is what is left, in Mbit/s), cut."""

    kind: Label
    on: bool = True
    magnitude: Megabits | None = None


TOPICS: tuple[Channel, ...] = (
    query(FAULT, SetFault, Done, VEHICLE, (OPERATOR,), Duty.TRIALS, ErrorCode.UNKNOWN_NAME),
    query(FAULTS, Empty, Faults, VEHICLE, (OPERATOR,), Duty.TRIALS),
    query(LINK_FAULT, SetLinkFault, Done, LINK, (OPERATOR,), Duty.TRIALS, ErrorCode.UNKNOWN_NAME),
)
