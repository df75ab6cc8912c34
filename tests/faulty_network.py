"""A network with the failures of Zenoh, in virtual time.

These promises, and their limits, were measured on Zenoh with one router (docs/reliability.md):

- Requests, replies and samples of streams may be late, lost, or overtake each other. A request may arrive twice. A
  request that its asker has given up may still be executed. An empty answer has no meaning.
- Events are late but never doubled or out of order, because subscribers recover missed ones. Two kinds are lost with
  a killed process: events that had not left it, and those that others had not recovered by then. A third kind leaves
  its publisher's memory before it is recovered.
- Liveliness tokens vanish at once with a killed process, and after a lease with a stopped or cut-off one. That process
  then sees all others vanish. Tokens return before the queries of their process are reachable again.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from skillwing.services.bus import NoReply
from skillwing.services.bus.inprocess import InProcessBus, InProcessNetwork, Namespace, Question, Traffic
from skillwing.services.bus.keys import matches

LEASE = 2.0
"""Longest time in seconds after which a silent node counts as gone."""
UNREACHABLE = 0.05
"""Longest time in seconds for which the queries of a node are unreachable although its token is there."""
RECOVERY = 0.6
"""Longest time in seconds until a lost event is recovered: publishers send a heartbeat every half second."""
SLOWEST_RECOVERY = 3.0
"""Longest time in seconds until an event is recovered that is lost for good if another one follows before."""
MOST_UNSENT = 6
"""Largest number of messages that have not left a process when it is killed."""


@dataclass(frozen=True, slots=True)
class NetworkConditions:
    """Disturbances of the network.

    latency: shortest and longest time in seconds that a message takes. slow: share of messages that take up to
    `slowest` seconds instead. loss: share that gets lost. duplication: share of requests that arrive twice. gaps: share
    of events that are lost for good, unless they are recovered before their publisher has sent another one.
    """

    latency: tuple[float, float] = (0.0002, 0.002)
    slow: float = 0.0
    slowest: float = 3.0
    loss: float = 0.0
    duplication: float = 0.0
    gaps: float = 0.0


@dataclass(eq=False, slots=True)
class _Message:
    """A message under way.

    only_cached: an event that is recovered from its publisher, as long as that lives. fleeting: the same, as long as no
    other follows it. here: it has reached its target, where it may wait for earlier ones. gone: it never does.
    """

    source: InProcessBus
    target: InProcessBus
    arrive: Callable[[], None]
    traffic: Traffic
    channel: object
    number: int
    only_cached: bool = False
    fleeting: bool = False
    here: bool = False
    gone: bool = False

    @property
    def ordered(self) -> bool:
        """True if messages of its channel keep their order."""
        return self.channel is not None and self.traffic in (Traffic.EVENT, Traffic.LIVELINESS)


@dataclass(eq=False, slots=True)
class _Session:
    """A node's connection to the router. held: messages that wait for it; backlog: actions of a stopped node."""

    cut: bool = False
    stopped: bool = False
    troubles: int = 0
    reachable_from: float = 0.0
    sent: int = 0
    last_sent: int | None = None
    held: list[_Message] = field(default_factory=list)
    backlog: list[Callable[[], None]] = field(default_factory=list)


class FaultyNetwork(InProcessNetwork):
    """An `InProcessNetwork` with disturbances, whose nodes can be cut off, stopped and killed. All chance is seeded.

    Nodes are named by their buses, so that a stopped process and its successor may have the same name.
    on_fate: gets a sentence about each message that does not simply arrive.
    """

    def __init__(self, seed: int = 0, conditions: NetworkConditions | None = None) -> None:
        super().__init__(seed)
        self.conditions = conditions or NetworkConditions()
        self.on_fate: Callable[[str], None] | None = None
        self._sessions: dict[InProcessBus, _Session] = {}
        self._lanes: dict[object, deque[_Message]] = {}
        self._gaps = random.Random(f"{seed}/gaps")
        """A source of chance of its own: without gaps, a seed has the same fates as before there were any."""

    # --- what can be done to nodes -----------------------------------------------------------------------------------

    def join(self, name: str) -> InProcessBus:
        """A new node's bus, also if a node of that name still exists."""
        bus = self._join(name, "r1")
        self._session(bus)
        return bus

    def cut(self, bus: InProcessBus, *, noticed: bool = False) -> None:
        """Cut a node off from the router. Both sides notice after the lease, or at once if the router ended."""
        session = self._session(bus)
        session.cut = True
        self._fall_silent(bus, session, 0.0 if noticed else self._lease())

    def reconnect(self, bus: InProcessBus) -> None:
        """Connect a node again. Idempotent."""
        session = self._session(bus)
        if session.cut:
            session.cut = False
            session.troubles += 1
            if not session.stopped:
                self._resume_session(bus, session)

    def stop(self, bus: InProcessBus) -> None:
        """Stop a node, as SIGSTOP does. After the lease it counts as gone for the others."""
        session = self._session(bus)
        session.stopped = True
        self._fall_silent(bus, session, self._lease())

    def wake(self, bus: InProcessBus) -> None:
        """Continue a node, as SIGCONT does. It runs its missed actions, and may notice only then that it was gone."""
        session = self._session(bus)
        if not session.stopped:
            return
        session.stopped = False
        session.troubles += 1
        backlog, session.backlog = session.backlog, []
        if bus.given_up and self._random.random() < 0.5:
            self._lose_sight(bus)
        for action in backlog:
            self.schedule(0.0, lambda action=action: self.perform(bus, action))
        if not session.cut:
            self._resume_session(bus, session)

    def kill(self, bus: InProcessBus) -> None:
        """Kill a node, as SIGKILL does. Some of its last messages never leave the process."""
        session = self._session(bus)
        session.last_sent = session.sent - self._random.randint(0, MOST_UNSENT)
        session.backlog.clear()
        bus.close()

    def _fall_silent(self, bus: InProcessBus, session: _Session, after: float) -> None:
        session.troubles += 1
        trouble = session.troubles
        self._agenda.add(self._now + after, lambda: self._give_up(bus) if session.troubles == trouble else None)

    def _give_up(self, bus: InProcessBus) -> None:
        """End a node's lease: the others see its tokens vanish, and it sees theirs vanish."""
        if bus.closed or bus.given_up:
            return
        before = bus.robot.visible_tokens()
        bus.given_up = True
        self._tell_others(bus, [key for key in before if key not in bus.robot.visible_tokens()], alive=False)
        if not self._session(bus).stopped:
            self._lose_sight(bus)

    def _lose_sight(self, bus: InProcessBus) -> None:
        """Let the node see all other tokens vanish."""
        others = [key for owner, key, _ in bus.robot.tokens if owner is not bus]
        for watch in bus.robot.watches:
            for key in others if watch.bus is bus else ():
                if matches(watch.key_expression, key):
                    self.perform(bus, lambda watch=watch, key=key: watch.deliver(key, False))

    def _resume_session(self, bus: InProcessBus, session: _Session) -> None:
        if bus.closed:
            return
        held, session.held = session.held, []
        shows = bus.given_up
        if shows:
            before = bus.robot.visible_tokens()
            bus.given_up = False
            session.reachable_from = self._now + self._random.uniform(0.0, UNREACHABLE)
            self._tell_others(bus, [key for key in bus.robot.visible_tokens() if key not in before], alive=True)
        # What was on its way about tokens comes before what the router tells about the present ones.
        for message in held:
            self._launch(message)
        if shows:
            self._show_others(bus)

    def _tell_others(self, bus: InProcessBus, keys: list[str], *, alive: bool) -> None:
        for watch in bus.robot.watches:
            for key in keys if watch.bus is not bus else ():
                watch.send(bus, key, alive=alive)

    def _show_others(self, bus: InProcessBus) -> None:
        for watch in bus.robot.watches:
            for key in bus.robot.visible_tokens() if watch.bus is bus else ():
                watch.send(bus, key, alive=True)

    # --- what happens to messages ------------------------------------------------------------------------------------

    def perform(self, bus: InProcessBus, action: Callable[[], None]) -> None:
        session = self._sessions.get(bus)
        if session is not None and session.stopped:
            session.backlog.append(action)
        else:
            super().perform(bus, action)

    def forward(self, robot: Namespace, question: Question) -> None:
        asker = question.asker
        for _ in range(2 if self._happens(self.conditions.duplication) else 1):
            self.send(asker, asker, lambda: self._route(robot, question), Traffic.REQUEST)

    def _route(self, robot: Namespace, question: Question) -> None:
        """Route a request at the router, to the latest of several processes of one name."""
        services = [each for each in robot.services.covering(question.key) if not each.bus.given_up]
        service = services[-1] if services else None
        if service is None or self._session(service.bus).reachable_from > self._now:
            self._note("nobody is reachable on", question.key)
            self._nobody_answers(question)
            return
        server = service.bus

        def take() -> None:
            if server.closed:
                self._nobody_answers(question)
            elif session.cut:
                self._hold(session, _Message(question.asker, server, take, Traffic.REQUEST, None, 0))
            else:
                self.perform(server, lambda: server.take(question, service.on_request))

        session = self._session(server)
        late = self._random.uniform(0.0, self.conditions.slowest) if self._happens(self.conditions.slow) else 0.0
        self._agenda.add(self._now + late, take)

    def _nobody_answers(self, question: Question) -> None:
        complete = lambda: question.complete(NoReply(timed_out=False))  # noqa: E731
        self.send(question.asker, question.asker, complete, Traffic.LIVELINESS)

    def send(
        self,
        source: InProcessBus,
        target: InProcessBus,
        arrive: Callable[[], None],
        traffic: Traffic = Traffic.REPLY,
        channel: object = None,
    ) -> None:
        session = self._session(source)
        session.sent += 1
        message = _Message(source, target, arrive, traffic, channel, session.sent)
        if message.ordered:
            self._lanes.setdefault(channel, deque()).append(message)
        if traffic is Traffic.EVENT and self._leaves_gap(message):
            self._launch(message, self._gaps.uniform(0.0, SLOWEST_RECOVERY))
        elif traffic is Traffic.LIVELINESS or not self._happens(self.conditions.loss):
            self._launch(message)
        elif traffic is Traffic.EVENT:
            self._note("to be recovered:", message)
            message.only_cached = True
            self._launch(message, self._random.uniform(0.0, RECOVERY))
        else:
            self._note("lost:", message)

    def _leaves_gap(self, event: _Message) -> bool:
        """Lose the events before this one that are still to be recovered. True if the same may happen to this one."""
        for earlier in [each for each in self._lanes[event.channel] if each.fleeting and not each.here]:
            self._note("lost for good:", earlier)
            earlier.gone = True
            self._drop(earlier)
        event.fleeting = event.only_cached = self.conditions.gaps > 0.0 and self._gaps.random() < self.conditions.gaps
        return event.fleeting

    def _launch(self, message: _Message, delay: float = 0.0) -> None:
        conditions = self.conditions
        # A request is routed at once, and late at its server.
        if message.traffic not in (Traffic.LIVELINESS, Traffic.REQUEST) and self._happens(conditions.slow):
            delay += self._random.uniform(0.0, conditions.slowest)
        at = self._now + delay + self._random.uniform(*conditions.latency)
        self._agenda.add(at, lambda: self._arrive(message))

    def _arrive(self, message: _Message) -> None:
        if message.gone:
            return
        source, target = self._session(message.source), self._session(message.target)
        by_router = message.traffic is Traffic.LIVELINESS
        if not by_router and source.last_sent is not None and message.number > source.last_sent:
            self._note("never left its process:", message)
            self._drop(message)
        elif message.only_cached and message.source.closed:
            self._note("died with its publisher:", message)
            self._drop(message)
        elif source.cut and not by_router:
            self._hold(source, message)
        elif target.cut:
            self._hold(target, message)
        elif message.ordered:
            message.here = True
            self._deliver_in_order(message.channel)
        else:
            self._hand_over(message)

    def _hand_over(self, message: _Message) -> None:
        """Deliver a message. Requests are routed first, and samples wait in the backlog of a stopped node."""
        if message.traffic in (Traffic.REQUEST, Traffic.STREAM, Traffic.EVENT):
            message.arrive()
        else:
            self.perform(message.target, message.arrive)

    def _deliver_in_order(self, channel: object) -> None:
        """Deliver the messages that wait for no earlier one."""
        lane = self._lanes[channel]
        while lane and lane[0].here:
            self._hand_over(lane.popleft())

    def _drop(self, message: _Message) -> None:
        if message.ordered:
            self._lanes[message.channel].remove(message)
            self._deliver_in_order(message.channel)

    def _hold(self, session: _Session, message: _Message) -> None:
        """Keep a message until the session is connected again, if its kind may get through then."""
        if message.traffic is Traffic.STREAM or (
            message.traffic in (Traffic.REQUEST, Traffic.REPLY) and self._happens(0.5)
        ):
            self._note("lost, cut off:", message)
        else:
            self._note("held, cut off:", message)
            message.only_cached = message.traffic is Traffic.EVENT
            session.held.append(message)

    def _session(self, bus: InProcessBus) -> _Session:
        session = self._sessions.get(bus)
        if session is None:
            start = self._now + self._random.uniform(0.0, UNREACHABLE)
            session = self._sessions[bus] = _Session(reachable_from=start)
        return session

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._random.random() < share

    def _lease(self) -> float:
        return self._random.uniform(0.75 * LEASE, LEASE)

    def _note(self, fate: str, what: _Message | str) -> None:
        if self.on_fate is not None:
            if isinstance(what, _Message):
                what = f"{what.traffic.name.lower()} from {what.source.name} to {what.target.name}"
            self.on_fate(f"{fate} {what}")
