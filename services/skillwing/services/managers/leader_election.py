"""Leader election: at most one active resource manager per robot."""

from __future__ import annotations

from collections.abc import Callable

from skillwing.services.bus import Answer, Answered, Bus, NoReply, Refused
from skillwing.services.protocol import ErrorCode, Keys, QueryStates, encode

ASK_TIMEOUT = 0.5
"""Wall time in seconds that the leader has for each answer."""
ASK_AGAIN = 0.1
"""Wall time in seconds between two questions to a leader."""
PATIENCE = 10.0
"""Wall time in seconds after which a leader that neither answers nor goes counts as hung. A frozen process keeps its
token for a shorter time."""


class LeaderElection:
    """Decides whether this process may lead, and whether it still may.

    It declares itself a candidate, then asks for the states of the resources. If there is an answer, it gives way.
    Without an answer it leads, unless there is a token of another leader or of a later candidate. Of two candidates at
    the same moment at least one sees the other before its answer comes. If one was frozen or cut off, two may lead for
    a moment. Then the one that began last stays, because no process begins while it sees another leader.

    on_elected is called once, when this process may lead; on_deposed at most once, with a sentence, when it has to end.
    """

    def __init__(self, bus: Bus, keys: Keys, on_elected: Callable[[], None], on_deposed: Callable[[str], None]) -> None:
        self._bus = bus
        self._keys = keys
        self._on_elected = on_elected
        self._on_deposed = on_deposed
        self._mark = bus.new_id()
        self._leaders: set[str] = set()
        self._candidates: set[str] = set()
        self._leading = False
        self._over = False
        bus.watch_alive(keys.leader("*"), self._on_leader)
        bus.watch_alive(keys.candidate("*"), self._on_candidate)
        self._candidacy = bus.declare_alive(keys.candidate(self._mark))
        self._give_up_at = bus.wall() + PATIENCE
        self._ask()

    def _on_leader(self, key: str, alive: bool) -> None:
        mark = key.removeprefix(self._keys.leader(""))
        self._note(self._leaders, mark, alive)
        if alive and self._leading and mark > self._mark:
            self._give_way("Another resource manager became the active one while this one was away.")

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
            # Without a connection, silence means nothing.
            self._give_up_at = self._bus.wall() + PATIENCE
        match answer:
            case Answered():
                self._give_way("Another resource manager is active.")
            case Refused(error) if error.code is not ErrorCode.UNAVAILABLE:
                self._give_way("Another resource manager is active.")
            case NoReply(timed_out=False) if connected and self._is_next():
                self._lead()
            case _ if self._bus.wall() >= self._give_up_at:
                self._give_way("Another resource manager is there and does not answer; it may hang.")
            case _:
                # A leader that leaves refuses; a frozen one loses its token within its lease.
                self._bus.after(ASK_AGAIN, self._ask, wall=True)

    def _is_next(self) -> bool:
        return not self._leaders and all(mark < self._mark for mark in self._candidates)

    def _lead(self) -> None:
        self._leading = True
        self._bus.declare_alive(self._keys.leader(self._mark))
        self._candidacy.cancel()
        self._on_elected()

    def _give_way(self, why: str) -> None:
        if not self._over:
            self._over = True
            self._on_deposed(f"{why} End that one first if this is to be the one of `{self._keys.skillset}`.")
