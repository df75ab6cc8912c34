"""The recent part of a history in bounded memory, for runs of any length. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from skillwing.dsl.model import Skillset
from skillwing.services.core.bounded_dict import BoundedDict
from skillwing.services.history.history import History
from skillwing.services.protocol import GoalStatus, Record, RecordKind

RECORDS_KEPT = 20_000
"""Records that a recorder remembers: two minutes at 20 starts a second."""
GOALS_KEPT = 2_000
"""Goals that a recorder remembers."""
STATUSES_KEPT = 50
"""Statuses of a goal that a recorder remembers: the first ones and the latest. Each modification of inputs adds one."""
LONGEST_CHAIN = 200
"""Records of a chain of causes that are shown live. Chains of missions grow with each step."""
NEAR_CAUSES = 16
"""Causes that are kept of each latest change, however old they are."""
SUBJECTS_KEPT = 500
"""Resources and missions whose latest records are kept. A skillset has fewer; others may come from strangers."""
_BATCH = 10
"""Share of the limit, as its divisor, that is forgotten at once."""


class RecentHistory(History):
    """A history that forgets the oldest records and goals.

    It keeps what is still true: the latest change of each resource and each mission with its nearest causes, and the
    latest goal of each skill. Of a goal with many statuses it keeps the first and the latest ones. `forgotten_until` is
    the time of the last goal that was forgotten; None without one.
    """

    def __init__(
        self,
        skillset: Skillset | None = None,
        *,
        records: int = RECORDS_KEPT,
        goals: int = GOALS_KEPT,
        longest_chain: int = LONGEST_CHAIN,
    ) -> None:
        super().__init__(skillset, longest_chain=longest_chain)
        self.forgotten_until: float | None = None
        self._most_records = records
        self._most_goals = goals
        self._order: dict[str, None] = {}
        """Goals in the order of their latest news."""
        self._latest_change = BoundedDict[tuple[RecordKind, str], str](SUBJECTS_KEPT)
        self._latest_goal = BoundedDict[str, str](SUBJECTS_KEPT)

    def add_record(self, record: Record) -> bool:
        if not super().add_record(record):
            return False
        if record.kind in _LASTING:
            self._latest_change[record.kind, record.subject] = record.id
        if record.goal_id in self._ends:
            self._note_goal(record.goal_id)
        if len(self._records) > self._most_records:
            self._forget_records()
        return True

    def add_status(self, status: GoalStatus) -> bool:
        if not super().add_status(status):
            return False
        if len(known := self._statuses[status.goal_id]) > STATUSES_KEPT:
            middle = range(STATUSES_KEPT // 2, STATUSES_KEPT)
            del known[next((each for each in middle if known[each].terminal is None), middle.start)]
        self._latest_goal[status.skill] = status.goal_id
        self._note_goal(status.goal_id)
        return True

    @property
    def lasting_records(self) -> tuple[Record, ...]:
        """The latest change of each resource and mission, with its nearest causes: a new file begins with them."""
        return tuple(self._records[record_id] for record_id in self._lasting())

    @property
    def lasting_statuses(self) -> tuple[GoalStatus, ...]:
        """The statuses of the goals that run, and of each skill's latest goal: a new file begins with them."""
        lasting = set(self._latest_goal.values())
        goals = [goal_id for goal_id in self._statuses if goal_id in lasting or self._runs(goal_id)]
        return tuple(status for goal_id in goals for status in self._statuses[goal_id])

    def _runs(self, goal_id: str) -> bool:
        return goal_id in self._statuses and self.bar(goal_id).terminal is None

    def _note_goal(self, goal_id: str) -> None:
        self._order.pop(goal_id, None)
        self._order[goal_id] = None
        if len(self._order) > self._most_goals:
            self._forget_goal()

    def _forget_goal(self) -> None:
        """Forget the goal without news for the longest time that has ended, and is not the latest of its skill."""
        lasting = set(self._latest_goal.values())
        candidates = (goal_id for goal_id in islice(self._order, 2 * SUBJECTS_KEPT) if goal_id not in lasting)
        ended = (goal_id for goal_id in candidates if not self._runs(goal_id))
        oldest = next(ended, next(iter(self._order)))
        del self._order[oldest]
        self._ends.pop(oldest, None)
        if (statuses := self._statuses.pop(oldest, None)) is not None:
            last = max(status.t for status in statuses)
            self.forgotten_until = max(last, self.forgotten_until or last)

    def _forget_records(self) -> None:
        """Forget the oldest records. Many at once, because the lasting ones are looked for each time."""
        lasting = self._lasting()
        spare = max(1, self._most_records // _BATCH) + len(self._records) - self._most_records
        old = [record_id for _, record_id in zip(range(spare + len(lasting)), self._records, strict=False)]
        for record_id in [each for each in old if each not in lasting][:spare]:
            del self._records[record_id]

    def _lasting(self) -> dict[str, None]:
        """Ids of the lasting records, causes first."""
        return {record.id: None for latest in self._latest_change.values() for record in self._near_causes(latest)}

    def _near_causes(self, latest: str) -> Iterator[Record]:
        near: list[Record] = []
        record = self._records.get(latest)
        while record is not None and len(near) <= NEAR_CAUSES and record not in near:
            near.append(record)
            record = self._records.get(record.cause or "")
        yield from reversed(near)


_LASTING = frozenset({RecordKind.RESOURCE, RecordKind.MISSION})
