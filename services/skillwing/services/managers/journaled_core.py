"""A resource core whose every step is stored in a journal before it counts."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Protocol, TypeAlias

from msgspec.structs import replace

from skillwing.services.core.events import Event
from skillwing.services.core.latest_data import LatestData
from skillwing.services.core.refusal import RefusedError
from skillwing.services.core.resource_core import ResourceCore, Step
from skillwing.services.core.snapshot import EMPTY_SNAPSHOT, Snapshot
from skillwing.services.journal.errors import JournalError, JournalTakenError
from skillwing.services.journal.journal import Journal
from skillwing.services.protocol import ErrorCode, Record


class Stepper(Protocol):
    """A resource core, or a wrapper round one."""

    def step(self, event: Event, now: float) -> Step: ...


MakeCore: TypeAlias = Callable[[Snapshot, LatestData | None], ResourceCore]
"""Makes a core that continues from a snapshot, and from these data."""
Wrap: TypeAlias = Callable[[ResourceCore, Snapshot, LatestData | None], Stepper]
"""Wraps a new core; the other arguments are those that it was made with."""
LARGEST_SETBACK = 1.0
"""Seconds by which the latest tick may lie before the time of the latest step."""

log = logging.getLogger(__name__)


class UnwrittenError(RefusedError):
    """A step that could not be stored, and has not happened."""

    def __init__(self, why: JournalError) -> None:
        text = f"The resource manager cannot store the step: {why}"
        super().__init__(ErrorCode.UNAVAILABLE, text, help="Ask again once the journal can be written.")


class JournaledCore:
    """A core that stores each step. The first call is `begin`, or `resume` if the journal is not empty. wrap: makes the
    layer between core and journal."""

    def __init__(self, journal: Journal, make_core: MakeCore, wrap: Wrap = lambda core, snapshot, data: core) -> None:
        self._journal = journal
        self._make_core = make_core
        self._wrap = wrap
        self._failing = False
        self._use(EMPTY_SNAPSHOT)

    def begin(self, now: float, epoch: str) -> None:
        """Begin an empty journal, with the name of a new series of step numbers. Raises JournalWriteError."""
        # Numbers keep growing when a process without a journal takes over, if the robot's clock has begun.
        self._use(replace(self._made_from, step=max(self.core.last_step, int(now * 1000)), epoch=epoch))
        self._journal.begin_epoch(epoch)
        self._journal.write(self.core.initial_entries(), (), now, self.core.last_step)

    def resume(self, snapshot: Snapshot, now: float, *, follows_time: bool, epoch: str) -> bool:
        """Continue from the journal's snapshot; the first event is then to be `Resumed`.

        follows_time: as of `Bus`. If so, robot time before the journal's has started again, and nothing is as it was.
        Then the old journal is set aside for an empty one, which takes over only the last token and step; returns
        False. epoch: as of `begin`, for that journal. Unix time never starts again, so that setting a clock costs no
        grant. Raises JournalWriteError.
        """
        if follows_time and now < snapshot.t - LARGEST_SETBACK:
            moved = self._journal.set_aside()
            log.warning("robot time has started again; the journal until %.1f s is now %s", snapshot.t, moved)
            self._use(Snapshot(last_token=snapshot.last_token, step=snapshot.step))
            self.begin(now, epoch)
            return False
        self._use(snapshot)
        return True

    def step(self, event: Event, now: float) -> Step:
        """Take a step and store its entries.

        Raises RefusedError if the core refuses, UnwrittenError, and JournalTakenError if another process has the
        journal. After any other exception of the core, its state is the one before the step. Any other JournalError
        means that the journal cannot even be read: then it is unknown what this process has granted.
        """
        try:
            step = self._stepper.step(event, now)
            self._write(step, now)
        except (RefusedError, JournalTakenError):
            raise
        except JournalError as error:
            self._complain(error)
            self._go_back()
            raise UnwrittenError(error) from error
        except Exception:
            self._go_back()
            raise
        return step

    def check_hold(self) -> None:
        """Make sure that this process still has the journal, for an answer that takes no step. Raises as `step`."""
        try:
            self._journal.check_hold()
        except JournalTakenError:
            raise
        except JournalError as error:
            self._complain(error)
            self._go_back()
            raise UnwrittenError(error) from error

    def _write(self, step: Step, now: float) -> None:
        records = [each for each in step.publications if isinstance(each, Record)]
        if not step.entries and not records:
            self._journal.check_hold()
            return
        self._journal.write(step.entries, records, now, step.number)
        if self._failing:
            self._failing = False
            log.warning("the journal is being written again")

    def _go_back(self) -> None:
        """Return to the last step that was stored. Raises JournalError."""
        self._use(self._journal.snapshot() or EMPTY_SNAPSHOT, self.core.data)

    def _use(self, snapshot: Snapshot, data: LatestData | None = None) -> None:
        self._made_from = snapshot
        self.core = self._make_core(snapshot, data)
        self._stepper = self._wrap(self.core, snapshot, data)

    def _complain(self, error: JournalError) -> None:
        if not self._failing:
            log.error("%s Until then every request that would change something is refused.", error)
        self._failing = True
