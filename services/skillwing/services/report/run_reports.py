"""Which missions were flown in a run, and when. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from skillwing.services.history.history import OVER, PHASES
from skillwing.services.protocol import Record, RecordKind


@dataclass(frozen=True, slots=True)
class Flight:
    """One mission from its begin to its end, in robot time; `end` is None if nobody said that it was over.

    number: counts the missions of a run, from 1 on.
    """

    number: int
    mission: str
    begin: float
    end: float | None = None

    @property
    def name(self) -> str:
        return f"{self.number}-{self.mission}"


def flights_of(records: Iterable[Record]) -> tuple[Flight, ...]:
    """The missions of a run, by its records in order of time.

    One that never began, since the robot did not get ready, is over at the moment at which it was given up. One that
    said no end is over just before the next one begins.
    """
    return tuple(_flights(record for record in records if record.kind is RecordKind.MISSION and record.after in PHASES))


def _flights(phases: Iterable[Record]) -> Iterator[Flight]:
    number, open_flight = 0, None
    for record in phases:
        if open_flight is not None and (record.subject != open_flight.mission or record.before == "IDLE"):
            # Just before, for that record is the next one's, and may say how that one ended.
            yield replace(open_flight, end=max(open_flight.begin, math.nextafter(record.t, -math.inf)))
            open_flight = None
        if open_flight is None:
            number += 1
            open_flight = Flight(number, record.subject, record.t)
        if record.after in OVER:
            yield replace(open_flight, end=record.t)
            open_flight = None
    if open_flight is not None:
        yield open_flight
