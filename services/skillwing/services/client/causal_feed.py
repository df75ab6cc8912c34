"""Subscriptions to what a robot's managers tell, in causal order."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from functools import partial

from skillwing.services.bus import Answered, Bus, Handle, Refused, Sample
from skillwing.services.bus.identity import signed, split_asker
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_view import CausalView, Delivered
from skillwing.services.client.retry import LONGEST_DELAY, ask_until_answered
from skillwing.services.core.attribution import vouched
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.protocol import (
    GoalStatus,
    Keys,
    ProtocolError,
    QueryReady,
    QueryStates,
    ReadyReport,
    Record,
    ResourceStates,
    ResourceStep,
    decode,
    encode,
)

HOLD_TIME = 0.1
"""Wall time in seconds for a missing step to arrive by itself. Then the states are asked for."""
SILENCES_UNTIL_SHOWN = 10
"""Unanswered questions for the states, 5 s to 26 s, after which statuses are shown without them."""
HOLDS_UNTIL_SHOWN = 10
"""Replies, a second apart, that a lost goal still holds its grant. After them its loss is shown all the same."""
NO_ANSWER = "Its resources may still be taken: the resource manager does not answer."
STILL_HELD = "Its resources may still be taken: the resource manager has not released them."

log = logging.getLogger(__name__)


class CausalFeed:
    """Steps of the resource manager and statuses of goals, each status after the step that it follows from.

    on_step, on_status: called in causal order. Without `on_status` no statuses are subscribed to. on_change: called
    after them if the states changed. If the resource manager does not answer, the missing step is left out, with a
    warning in the log.
    """

    def __init__(
        self,
        bus: Bus,
        keys: Keys,
        *,
        on_step: Callable[[ResourceStep], None] = lambda step: None,
        on_status: Callable[[GoalStatus], None] | None = None,
        on_change: Callable[[], None] = lambda: None,
    ) -> None:
        self._bus = bus
        self._keys = keys
        self._on_step, self._on_status, self._on_change = on_step, on_status, on_change
        self._due: deque[Delivered] = deque()
        """Messages whose turn has come, and which are not handed on yet."""
        self._timer: Handle | None = None
        self._asking = False
        self._silent = False
        self._unreadable = ""
        """The error in the latest states that could not be read, which is logged once."""
        self._reported = 0
        """Version of the states that were last reported."""
        self.view = CausalView()
        bus.subscribe(keys.resource_steps, message_reader(ResourceStep, self._take_step), events=True)
        if on_status is not None:
            bus.subscribe(keys.status("*"), message_reader(GoalStatus, self.take_status), events=True)
        bus.watch_alive(keys.alive(RESOURCE_MANAGER), self._on_manager)
        self._ask_states()

    @property
    def silent(self) -> bool:
        """The resource manager does not answer: what is shown may lack the states that it follows from."""
        return self._silent or self.view.incomplete

    def take_status(self, status: GoalStatus) -> None:
        """Take a status that came as a reply, in its turn."""
        self._deliver(self.view.take_status(status))

    def note_question(self) -> int:
        """Note a request whose reply holds the states, and return its number, for its reply."""
        return self.view.note_question()

    def take_change(self, payload: bytes, question: int, then: Callable[[], None]) -> None:
        """Take the encoded states after a requested change, and call `then` once they are known here.

        The reply to a later request may have overtaken this one: then it does not count, and the states are asked for.
        """
        states = self.take_states(payload, question)
        if states is None:
            then()
        else:
            self.after_step(states.step, lambda remark: then())

    def take_states(self, payload: bytes, question: int) -> ResourceStates | None:
        """Take encoded states that came as a reply. Any other reply is left out, and gives None."""
        try:
            states = decode(payload, ResourceStates)
        except ProtocolError as error:
            if str(error) != self._unreadable:
                self._unreadable = str(error)
                log.warning("Left out the states of %s: %s", RESOURCE_MANAGER, error)
            return None
        self._deliver(self.view.take_states(states, question))
        return states

    def after_step(self, step: int, then: Callable[[str], None]) -> None:
        """Call `then` once the states after a step are known, or if the resource manager does not answer.

        It gets a sentence in that case, else an empty one.
        """
        if self.view.number is not None and self.view.number >= step:
            then("")
        else:
            self._ask_states(then)

    def after_release(self, skill: str, goal_id: str, then: Callable[[str], None]) -> None:
        """Call `then` once the states are known from after the release of a goal that its client has lost.

        No status and no step names that release, so the resource manager is asked whether the goal holds its grant.
        Only then the states are asked for. `then` gets a sentence if the states before it are shown, else an empty one.
        """
        replies = 0

        def ask() -> None:
            question = encode(QueryReady(skill=skill))
            ask_until_answered(
                self._bus,
                self._keys.resource_ready,
                question,
                receive,
                keep_retrying=lambda silences: silences < (1 if self._silent else SILENCES_UNTIL_SHOWN),
                on_silence=give_up,
            )

        def receive(answer: Answered | Refused) -> None:
            nonlocal replies
            replies += 1
            if _is_released(answer, goal_id):
                self._ask_states(then)
            elif replies < HOLDS_UNTIL_SHOWN:
                self._bus.after(LONGEST_DELAY, ask, wall=True)
            else:
                then(STILL_HELD)

        def give_up() -> None:
            self._silent = True
            if not self._asking:
                self._ask_states()  # until there is an answer
            then(NO_ANSWER)

        ask()

    def _take_step(self, step: ResourceStep) -> None:
        self._deliver(self.view.take_step(step))

    def _deliver(self, messages: tuple[Delivered, ...]) -> None:
        """Hand on what is due. If a callback raises, the rest follows at the next turn of the node."""
        self._due.extend(messages)
        try:
            self._hand_on()
        except BaseException:
            self._bus.post(lambda: self._deliver(()))
            raise

    def _hand_on(self) -> None:
        """Hand on the messages that are due, and report a change of the states."""
        while self._due:
            message = self._due.popleft()
            if isinstance(message, ResourceStep):
                self._on_step(message)
            elif self._on_status is not None:
                self._on_status(message)
        if self.view.version != self._reported:
            self._reported = self.view.version
            self._on_change()
        if self.view.waiting and self._timer is None and not self._asking:
            self._timer = self._bus.after(HOLD_TIME, self._ask_if_waiting, wall=True)

    def _ask_if_waiting(self) -> None:
        self._timer = None
        if self.view.waiting:
            self._ask_states()

    def _on_manager(self, key: str, alive: bool) -> None:
        del key
        if alive:
            self._ask_states()

    def _ask_states(self, then: Callable[[str], None] = lambda remark: None) -> None:
        """Ask for the states until there is an answer. then: called once, with a sentence if the answer stays away."""
        waiting = [then]

        def answered(answer: Answered | Refused, question: int) -> None:
            self._asking = self._silent = False
            if isinstance(answer, Answered) and self.take_states(answer.payload, question) is not None:
                tell("")
            else:
                self._deliver(())
                tell(NO_ANSWER)

        def keep_retrying(silences: int) -> bool:
            """Show what is held back if the silence lasts, and go on asking."""
            if silences >= SILENCES_UNTIL_SHOWN:
                self._give_up()
                tell(NO_ANSWER)
            return True

        def tell(remark: str) -> None:
            if waiting:
                waiting.pop()(remark)

        self._asking = True
        ask_until_answered(
            self._bus,
            self._keys.resource_states,
            encode(QueryStates()),
            partial(answered, question=self.view.note_question()),
            keep_retrying=keep_retrying,
        )

    def _give_up(self) -> None:
        self._silent = True
        held = self.view.give_up()
        if held:
            log.warning("the resource manager is silent: goals are shown without the states that they follow from")
        self._deliver(held)


def _is_released(answer: Answered | Refused, goal_id: str) -> bool:
    """True if a reply says that the goal holds no grant."""
    if isinstance(answer, Refused):
        return False
    try:
        report = decode(answer.payload, ReadyReport)
    except ProtocolError:
        return False
    return all(skill.running is None or skill.running.goal_id != goal_id for skill in report.skills)


def follow_records(
    bus: Bus,
    keys: Keys,
    on_record: Callable[[Record], object],
    on_status: Callable[[GoalStatus], object] = lambda status: None,
) -> CausalFeed:
    """Follow all timeline records of a robot and the statuses of its goals. The feed has the states.

    Steps of the resource manager and statuses come in causal order, with their records; that of a status right before
    it. Other records, such as switches of missions, are handed on at once: they may come before their causes. Records
    from before the subscription come in any order of processes. With keys, records have the true name of their source.
    """

    def take_step(step: ResourceStep) -> None:
        for record in step.records:
            on_record(record)

    def take_status(status: GoalStatus) -> None:
        if (record := status.as_record()) is not None:
            on_record(record)
        on_status(status)

    if bus.identity is None:
        bus.subscribe(keys.timeline, message_reader(Record, on_record), events=True)
    else:
        bus.subscribe(signed(keys.timeline, "*"), lambda sample: _take_vouched(sample, on_record), events=True)
    return CausalFeed(bus, keys, on_step=take_step, on_status=take_status)


def _take_vouched(sample: Sample, on_record: Callable[[Record], object]) -> None:
    """Take a record with the name of its writer, as the router guarantees it."""

    def take(record: Record) -> None:
        known = vouched(record, split_asker(sample.key)[1] or "")
        if known is not None:
            on_record(known)

    message_reader(Record, take)(sample)
