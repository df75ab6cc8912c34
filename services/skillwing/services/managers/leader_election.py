"""That one resource manager of a robot judges and no second one beside it, be it started by hand, with other books."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answer, Answered, Bus, NoReply, Refused
from skillwing.services.protocol import ErrorCode, Keys, QueryStates, encode

ASK_TIMEOUT = 0.5
"""Wall time in seconds that whoever judges has for each answer."""
ASK_AGAIN = 0.1
"""Wall time in seconds between two questions whether anybody judges."""
PATIENCE = 10.0
"""Wall time in seconds after which one that neither answers nor goes counts as hung: longer than a frozen process keeps
its token."""


class LeaderElection:
    """Finds out whether this process may judge, and whether it still may.

    It declares itself a candidate, then asks for the states of the resources. Who gets an answer gives way. Who gets
    none judges, unless the token of another judge stands, or that of a candidate that came later: of two candidates at
    the same moment at least one sees the other before its answer comes. Should two judge all the same, for one was
    frozen or cut off, the one that began last stays: nobody begins while he can see another.

    on_free is called once, when this process may judge; on_taken at most once, with a sentence, when it is to end.
    """

    def __init__(self, bus: Bus, keys: Keys, on_free: Callable[[], None], on_taken: Callable[[str], None]) -> None:
        self._bus = bus
        self._keys = keys
        self._on_free = on_free
        self._on_taken = on_taken
        self._mark = bus.new_id()
        self._judges: set[str] = set()
        self._candidates: set[str] = set()
        self._judging = False
        self._over = False
        bus.watch_alive(keys.leader("*"), self._on_judge)
        bus.watch_alive(keys.candidate("*"), self._on_candidate)
        self._candidacy = bus.declare_alive(keys.candidate(self._mark))
        self._give_up_at = bus.wall() + PATIENCE
        self._ask()

    def _on_judge(self, key: str, alive: bool) -> None:
        mark = key.removeprefix(self._keys.leader(""))
        self._note(self._judges, mark, alive)
        if alive and self._judging and mark > self._mark:
            self._give_way("Another resource manager has begun to judge while this one was away.")

    def _on_candidate(self, key: str, alive: bool) -> None:
        self._note(self._candidates, key.removeprefix(self._keys.candidate("")), alive)

    def _note(self, others: set[str], mark: str, alive: bool) -> None:
        if mark != self._mark:
            (others.add if alive else others.discard)(mark)

    def _ask(self) -> None:
        if not self._over:
            self._bus.ask(self._keys.resource_states, encode(QueryStates()), self._on_answer, timeout=ASK_TIMEOUT)

    def _on_answer(self, answer: Answer) -> None:
        if self._over:
            return
        connected = self._bus.connected
        if not connected:
            # What we do not hear means nothing.
            self._give_up_at = self._bus.wall() + PATIENCE
        match answer:
            case Answered():
                self._give_way("Another resource manager judges here.")
            case Refused(error) if error.code is not ErrorCode.UNAVAILABLE:
                self._give_way("Another resource manager judges here.")
            case NoReply(timed_out=False) if connected and self._is_next():
                self._begin()
            case _ if self._bus.wall() >= self._give_up_at:
                self._give_way("Another resource manager is here and does not answer, as if it hung.")
            case _:
                # Whoever leaves refuses; whoever is frozen loses its token within its lease.
                self._bus.after(ASK_AGAIN, self._ask, wall=True)

    def _is_next(self) -> bool:
        return not self._judges and all(mark < self._mark for mark in self._candidates)

    def _begin(self) -> None:
        self._judging = True
        self._bus.declare_alive(self._keys.leader(self._mark))
        self._candidacy.cancel()
        self._on_free()

    def _give_way(self, why: str) -> None:
        if not self._over:
            self._over = True
            self._on_taken(f"{why} End that one first if this is to be the one of `{self._keys.skillset}`.")
