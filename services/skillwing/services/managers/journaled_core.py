"""A resource core and its journal, which is told of each step before anybody else is."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeAlias

from skillwing.services.core.kept import Kept
from skillwing.services.core.latest import LatestData
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import Publication, ResourceCore, Step
from skillwing.services.journal.errors import JournalTakenError, JournalWriteError
from skillwing.services.journal.journal import Journal
from skillwing.services.protocol import ErrorCode, Record

MakeCore: TypeAlias = Callable[[Kept | None, LatestData | None], ResourceCore]
"""Makes a core that goes on from what was kept, and from these data."""
LARGEST_SETBACK = 1.0
"""Seconds by which robot time may lie before the journal's: somebody may have set the machine's clock."""

log = logging.getLogger(__name__)


class JournaledCore:
    """Use `begin`, or `resume` if the journal holds something, before anything else."""

    def __init__(self, journal: Journal, make_core: MakeCore) -> None:
        self._journal = journal
        self._make_core = make_core
        self._failing = False
        self.core = make_core(None, None)

    def begin(self, now: float) -> None:
        """Begin an empty journal. Raises JournalWriteError."""
        self._journal.write(self.core.inventory(), (), now)

    def resume(self, kept: Kept, now: float) -> Step[tuple[Publication, ...]] | None:
        """Go on from what the journal holds; the step is not written yet.

        Returns None where robot time has begun anew: nothing is as it was then, and an empty journal takes the place
        of the old one, which is set aside. Raises JournalWriteError.
        """
        if now < kept.t - LARGEST_SETBACK:
            moved = self._journal.set_aside()
            log.warning("robot time has begun anew; the journal until %.1f s is now %s", kept.t, moved)
            self.begin(now)
            return None
        self.core = self._make_core(kept, None)
        return self.core.resume(kept, now)

    def write(self, step: Step[Any], now: float) -> None:
        """Write down what a step must not forget.

        Raises JournalTakenError, and RefusedError where nothing can be written: the core stands where it stood before.
        """
        records = [each for each in step.publications if isinstance(each, Record)]
        if not step.entries and not records:
            return
        try:
            self._journal.write(step.entries, records, now)
        except JournalTakenError:
            raise
        except JournalWriteError as error:
            if not self._failing:
                log.error("%s Until then every request that would change something is refused.", error)
            self._failing = True
            self.core = self._make_core(self._journal.kept(), self.core.data)
            raise RefusedError(
                ErrorCode.UNAVAILABLE, f"The resource manager cannot write it down: {error}", help="Then ask again."
            ) from error
        if self._failing:
            log.warning("the journal is being written again")
        self._failing = False
