"""A resource core and its journal, which is told of each step before anybody else is."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias, TypeVar

from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import EMPTY_SNAPSHOT, ResourceCore, Step
from skillwing.services.core.snapshot import Snapshot
from skillwing.services.journal.errors import JournalError, JournalTakenError
from skillwing.services.journal.journal import Journal
from skillwing.services.protocol import ErrorCode, Record

R = TypeVar("R")
TakeStep: TypeAlias = Callable[[ResourceCore, float], Step[R]]
"""Has a core take one step at a robot time."""
MakeCore: TypeAlias = Callable[[Snapshot | None, LatestData | None], ResourceCore]
"""Makes a core that goes on from what was kept, and from these data."""
LARGEST_SETBACK = 1.0
"""Seconds by which the latest tick may lie before the time of the latest step."""

log = logging.getLogger(__name__)


class UnwrittenError(RefusedError):
    """A step that could not be written down, and has not happened."""

    def __init__(self, why: JournalError) -> None:
        text = f"The resource manager cannot write it down: {why}"
        super().__init__(ErrorCode.UNAVAILABLE, text, help="Then ask again.")


class JournaledCore:
    """Use `begin`, or `resume` if the journal holds something, before anything else."""

    def __init__(self, journal: Journal, make_core: MakeCore) -> None:
        self._journal = journal
        self._make_core = make_core
        self._failing = False
        self.core = make_core(None, None)

    def begin(self, now: float) -> None:
        """Begin an empty journal. Raises JournalWriteError."""
        self._journal.write(self.core.initial_entries(), (), now)

    def resume(self, kept: Snapshot, now: float, *, follows_time: bool) -> bool:
        """Go on from what the journal holds; the core's own `resume` is to be its first step.

        follows_time: as `Bus` says. Where it does, robot time before the journal's has begun anew: nothing is as it was
        then, and an empty journal, which knows the last token only, takes the place of the old one, which is set aside;
        returns False. Unix time never begins anew, and nobody lets go of anything because a clock was set.
        Raises JournalWriteError.
        """
        if follows_time and now < kept.t - LARGEST_SETBACK:
            moved = self._journal.set_aside()
            log.warning("robot time has begun anew; the journal until %.1f s is now %s", kept.t, moved)
            self.core = self._make_core(replace(EMPTY_SNAPSHOT, last_token=kept.last_token), None)
            self.begin(now)
            return False
        self.core = self._make_core(kept, None)
        return True

    def take(self, step: TakeStep[R], now: float) -> Step[R]:
        """Have the core take a step, and write down what it must not forget. Whoever has only to answer makes sure that
        he is still the one who may.

        Raises RefusedError where the core refuses, UnwrittenError, JournalTakenError where another process judges now,
        and whatever else may go wrong in the core: it then stands where it stood before. Raises any other JournalError
        where not even that can be read: this process does not know any more what it has granted.
        """
        try:
            taken = step(self.core, now)
            self._write(taken, now)
        except (RefusedError, JournalTakenError):
            raise
        except JournalError as error:
            self._complain(error)
            self._go_back()
            raise UnwrittenError(error) from error
        except Exception:
            self._go_back()
            raise
        return taken

    def _write(self, step: Step[Any], now: float) -> None:
        records = [each for each in step.publications if isinstance(each, Record)]
        if not step.entries and not records:
            self._journal.check_hold()
            return
        self._journal.write(step.entries, records, now)
        if self._failing:
            self._failing = False
            log.warning("the journal is being written again")

    def _go_back(self) -> None:
        """To where the last step has led that was written down. Raises JournalError."""
        self.core = self._make_core(self._journal.snapshot(), self.core.data)

    def _complain(self, error: JournalError) -> None:
        if not self._failing:
            log.error("%s Until then every request that would change something is refused.", error)
        self._failing = True
