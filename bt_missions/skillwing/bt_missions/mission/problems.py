"""What does not fit, in words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from skillwing.services.errors import InvalidOptionError


@dataclass(frozen=True, slots=True)
class Misfit:
    """What does not fit, as a sentence. place: `file:line` or `file:line:column` of the mission where it is written,
    if that is known."""

    text: str
    place: str | None = None

    def __str__(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text


class FaultyMissionError(InvalidOptionError):
    """A mission that cannot be flown for what is written in it. misfits: all that was found, by place; heading: what
    is to be said before them."""

    def __init__(self, misfits: Iterable[Misfit], *, heading: str | None = None) -> None:
        self.misfits = tuple(misfits)
        lines = [str(misfit) for misfit in self.misfits]
        super().__init__("mission", "\n".join(lines if heading is None else [heading, *lines]))
