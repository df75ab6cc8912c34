"""Cells of the trial of cuts, their promises, and their table. Pure."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import product
from math import inf

import msgspec

KNOWN_WITHIN = 3.0
"""Wall seconds after a cut within which the operator's screen has to show it."""
BACK_WITHIN = 5.0
"""Wall seconds after the end of a cut within which the screen has to say that the link is back."""
NOTICED_FROM = 3.0
"""Wall seconds of the shortest cut that has to be shown: Zenoh notices a silent router after 2 s."""
GRACE = 20.0
"""`owner_grace` of the missions on the ground that have one [wall s]."""


class Moment(StrEnum):
    TAKE_OFF = "take-off"
    CRUISE = "cruise"
    RETURN = "return"
    LANDING = "landing"


class Place(StrEnum):
    """Place of the mission's process."""

    ON_BOARD = "on board"
    GROUND = "on the ground"
    GROUND_WITH_GRACE = "on the ground, grace"


SAYS = {
    Place.ON_BOARD: ("A mission on board goes on.",),
    Place.GROUND: ("The goals end after some seconds.", "then it lands."),
    Place.GROUND_WITH_GRACE: (f"The goals run on for {GRACE:g} s, then they end.", "then it lands."),
}
"""Parts of the sentence on the screen: what the robot does by itself."""
COLUMNS = (
    *("mission", "cut at", "for", "operator knows after", "link back after"),
    *("the drone", "on the ground after", "the mission"),
)
CUTS = (0.5, 3.0, 10.0, inf)
"""Lengths of the cuts [wall s]."""


class LinkCell(msgspec.Struct, frozen=True):
    """A flight with one cut. seconds: its length, None for a cut for good."""

    place: Place
    moment: Moment
    seconds: float | None

    @property
    def cut(self) -> str:
        return "for good" if self.seconds is None else f"{self.seconds:g} s"

    @property
    def name(self) -> str:
        return f"{self.place} / {self.moment} / {self.cut}"

    @property
    def heals(self) -> bool:
        return self.seconds is not None

    @property
    def is_noticeable(self) -> bool:
        return self.seconds is None or self.seconds >= NOTICED_FROM

    @property
    def has_to_succeed(self) -> bool:
        """True for a mission that no link is needed for, or whose grace is longer than the cut."""
        in_grace = self.place is Place.GROUND_WITH_GRACE and self.seconds is not None and self.seconds < GRACE
        return self.place is Place.ON_BOARD or in_grace


class LinkResult(msgspec.Struct, frozen=True):
    """Outcome of a flight.

    heard: the robot has heard how the mission ended. known: wall seconds from the cut to the sentence on the operator's
    screen, None without one. screen: that sentence. back: wall seconds from the end of the cut to the sentence that the
    link is back. mission: last status as seen on the robot. succeeded: by that status, and by the command's exit code.
    landed: wall seconds from the cut to standing still on the ground, None without a landing. collisions, left_fence:
    ground truth. load: of the machine. code: exit code of the command; None if it was still there in the end. flown_by:
    digest of the code that flew, empty for results before it was noted. day: of the flight. keys: flown over TLS, with
    certificates.
    """

    cell: LinkCell
    known: float | None
    screen: str
    mission: str
    heard: bool
    succeeded: bool
    landed: float | None
    from_home: float
    collisions: int
    left_fence: bool
    code: int | None
    load: float
    back: float | None = None
    flown_by: str = ""
    day: str = ""
    keys: bool = False

    @property
    def problems(self) -> tuple[str, ...]:
        """Promises that the flight breaks."""
        found: list[str] = []
        if self.collisions:
            found.append(f"{self.collisions} collisions")
        if self.left_fence:
            found.append("left the fence")
        if self.landed is None:
            found.append("still flies")
        if self.cell.is_noticeable:
            found += self._problems_of_screen()
        if self.cell.heals and self.code is None:
            found.append("the command does not end")
        if self.cell.has_to_succeed and not self.succeeded:
            found.append("the mission failed")
        return tuple(found)

    def _problems_of_screen(self) -> list[str]:
        found: list[str] = []
        if self.known is None or self.known > KNOWN_WITHIN:
            found.append("the operator does not know in time")
        elif not all(part in self.screen for part in SAYS[self.cell.place]):
            found.append("the screen does not say what the robot does")
        if self.cell.heals and (self.back is None or self.back > BACK_WITHIN):
            found.append("the operator does not know in time that the link is back")
        return found

    @property
    def kept(self) -> bool:
        return not self.problems


def cells() -> Iterator[LinkCell]:
    for place, moment, seconds in product(Place, Moment, CUTS):
        yield LinkCell(place, moment, None if seconds == inf else seconds)


def link_table(results: Sequence[LinkResult]) -> list[str]:
    """One row for each flight, in the order of the cells. results: at least one, by the same code."""
    order = {cell: number for number, cell in enumerate(cells())}
    lines = [f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    for each in sorted(results, key=lambda result: order[result.cell]):
        cell = each.cell
        known = "–" if each.known is None else f"{each.known:.1f} s"
        back = "–" if each.back is None else f"{each.back:.1f} s"
        landed = "–" if each.landed is None else f"{each.landed:.0f} s"
        mission = each.mission if each.heard else "the robot hears no end of it"
        columns = (cell.place, cell.moment, cell.cut, known, back, _drone(each), landed, mission)
        lines.append(f"| {' | '.join(map(str, columns))} |")
    kept, load = sum(each.kept for each in results), max((each.load for each in results), default=0.0)
    machine = f"{platform.machine()}, {os.cpu_count()} cores at a load of up to {load:.0f}"
    code = " and ".join(sorted({each.flown_by or "unknown" for each in results}))
    days = " to ".join(dict.fromkeys((min(each.day for each in results), max(each.day for each in results))))
    flown = f"{kept} of {len(results)} as promised"
    missing = len(order) - len(results)
    rest = f"; {missing} of {len(order)} cells are not flown yet" if missing else ""
    return [*lines, "", f"{flown}{rest}; seed 1, code {code}, {machine}, {days}."]


def _drone(result: LinkResult) -> str:
    where = "at home" if result.from_home < 2.0 else f"{result.from_home:.0f} m from home"
    done = "still flies" if result.landed is None else f"lands {where}"
    return "; ".join([done, *(f"**{problem}**" for problem in result.problems)])
