"""The in-process bus: any number of nodes in one virtual time, in lockstep and bit-reproducibly.

Every event is on one heap, ordered by (time, order of creation). Taking the next event moves the clock to its time, so
that a minute of robot time costs only the work of its callbacks. There are no threads and no wall clock. Messages take
`latency` seconds; with `jitter` each takes a seeded random time more. Messages between the same two nodes keep their
order, as on a network.

An exception in a callback leaves `run_until` with its traceback: in a test nothing is swallowed.

This network never fails. `FaultyNetwork` of the tests does to messages and nodes what a real one may do to them.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import count
from typing import Generic, Protocol, TypeVar

from skillwing.services.bus import (
    EVENT_HISTORY,
    Answer,
    Answered,
    Handle,
    Node,
    NoReply,
    Refused,
    Request,
    RunnableBus,
    Sample,
)
from skillwing.services.bus.agenda import Agenda, Entry
from skillwing.services.bus.backlog import EVENTS, STREAMS, Inbox, SampleBacklog
from skillwing.services.bus.keys import matches
from skillwing.services.protocol import ErrorReply, encode

T = TypeVar("T")


class Traffic(Enum):
    """Kind of message, which decides on its delivery: lossy, ordered, or recovered."""

    REQUEST = auto()
    REPLY = auto()
    EVENT = auto()
    STREAM = auto()
    LIVELINESS = auto()


@dataclass(frozen=True, slots=True)
class SentMessage:
    """A message at the moment when a node sends it.

    what: `put`, `ask`, `reply` or `refuse`; payload: encoded, also of a refusal.
    """

    t: float
    source: InProcessBus
    what: str
    key: str
    payload: bytes


class InProcessNetwork:
    """Robots, their nodes, and the one clock they share, which starts at 0.

    seed: of the jitter; latency: seconds that every message takes; jitter: the most that chance adds to it.
    """

    def __init__(self, seed: int = 0, latency: float = 0.0002, jitter: float = 0.0) -> None:
        self._random = random.Random(seed)
        self._latency = latency
        self._jitter = jitter
        self._now = 0.0
        self._agenda = Agenda()
        self._robots: dict[str, Namespace] = {}
        self._last_arrival: dict[tuple[InProcessBus, InProcessBus], float] = {}
        self._running = False
        self._ids = count(1)
        self.tap: Callable[[SentMessage], None] | None = None
        """Receives every message when it is sent."""

    def now(self) -> float:
        """Virtual time in seconds."""
        return self._now

    def new_id(self) -> str:
        """A new id, unique in this network."""
        return f"id-{next(self._ids):08d}"

    def bus(self, name: str, robot: str = "r1") -> RunnableBus:
        """A new node's view. Raises ValueError if a node of that name lives in that robot already."""
        if name in self._robots.setdefault(robot, Namespace(robot)).nodes:
            raise ValueError(f"robot {robot} already has a node `{name}`; close its bus first or choose another name")
        return self._join(name, robot)

    def attach(self, node: Node, robot: str = "r1") -> RunnableBus:
        """Make a bus of the node's name and attach the node to it."""
        bus = self.bus(node.name, robot)
        node.attach(bus)
        return bus

    def _join(self, name: str, robot: str) -> InProcessBus:
        joined = self._robots.setdefault(robot, Namespace(robot))
        joined.nodes[name] = InProcessBus(self, joined, name)
        return joined.nodes[name]

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """Run events until `done()` holds (True), or until `timeout` virtual seconds have passed (False).

        Without a timeout it also returns False when no event is left, for then nothing can change any more.
        """
        if self._running:
            raise RuntimeError("run_until was called from a callback; a node lives in callbacks and must not wait")
        deadline = None if timeout is None else self._now + timeout
        self._running = True
        try:
            while not done():
                if not self._step(deadline):
                    return done()
            return True
        finally:
            self._running = False

    def run_for(self, seconds: float) -> None:
        """Run all events of the next `seconds` of virtual time."""
        self.run_until(lambda: False, seconds)

    def _step(self, deadline: float | None) -> bool:
        """Run the next event. False, with the clock at the deadline, if there is none until then."""
        due = self._agenda.next_due()
        if due is None or (deadline is not None and due > deadline):
            if deadline is not None:
                self._now = deadline
            return False
        self._now = due
        action = self._agenda.take(due)
        if action is not None:
            action()
        return True

    def schedule(self, delay: float, action: Callable[[], None]) -> Entry:
        """Put an action on the agenda. Without delay it runs now, after the actions that were scheduled before it."""
        return self._agenda.add(self._now + max(delay, 0.0), action)

    def schedule_periodic(self, period: float, action: Callable[[], None]) -> Entry:
        """Put an action on the agenda at each multiple of `period` from now on."""
        return self._agenda.add_periodic(self._now, period, action)

    def perform(self, bus: InProcessBus, action: Callable[[], None]) -> None:
        """Run an action of a node now, unless the node has left."""
        if not bus.closed:
            action()

    def report_sent(self, bus: InProcessBus, what: str, key: str, payload: bytes) -> None:
        if self.tap is not None:
            self.tap(SentMessage(self._now, bus, what, key, payload))

    def forward(self, robot: Namespace, question: Question) -> None:
        """Deliver a question to the node that serves its key on arrival."""

        def arrive() -> None:
            services = robot.services.covering(question.key)
            if services:
                services[0].bus.take(question, services[0].on_request)
            else:
                self.send(question.asker, question.asker, lambda: question.complete(NoReply(timed_out=False)))

        # The server is only chosen on arrival, so the link is the asker's own.
        self.send(question.asker, question.asker, arrive)

    def send(
        self,
        source: InProcessBus,
        target: InProcessBus,
        arrive: Callable[[], None],
        traffic: Traffic = Traffic.REPLY,
        channel: object = None,
    ) -> None:
        """Run `arrive` after the time that a message from one node to another takes.

        traffic, channel: the kind of message, and the group that it must not overtake. This network ignores both: it
        loses nothing and keeps the order of each link.
        """
        del traffic, channel
        at = self._now + self._latency
        if self._jitter > 0.0:
            link = (source, target)
            at = max(at + self._random.uniform(0.0, self._jitter), self._last_arrival.get(link, 0.0))
            self._last_arrival[link] = at
        self._agenda.add(at, arrive)


class InProcessBus:
    """One node's view of an `InProcessNetwork`; see `Bus` for what each method promises."""

    def __init__(self, network: InProcessNetwork, robot: Namespace, name: str) -> None:
        self._network = network
        self.robot = robot
        self._name = name
        self._serving: dict[Question, None] = {}
        self.streams = SampleBacklog(STREAMS)
        self.events = SampleBacklog(EVENTS)
        self._beside: list[RunnableBus] = []
        self.closed = False
        self.given_up = False
        """True after a cut or a stop that was longer than the lease: the network counts its session as dead."""

    @property
    def name(self) -> str:
        return self._name

    def beside(self, robot: str) -> RunnableBus:
        """See `MultiRobotBus`. Raises ValueError if that robot has a node of this name already."""
        if robot == self.robot.name:
            return self
        self._beside.append(self._network.bus(f"{self._name}@{self.robot.name}", robot))
        return self._beside[-1]

    def with_own_time(self, robot: str, *, follows: bool) -> RunnableBus:
        """See `MultiRobotBus`: all robots of this network have one time. Raises as `beside` does."""
        del follows
        return self.beside(robot)

    def now(self) -> float:
        return self._network.now()

    @property
    def follows_time(self) -> bool:
        return True

    def new_id(self) -> str:
        return self._network.new_id()

    def wall(self) -> float:
        return self._network.now()

    @property
    def connected(self) -> bool:
        return not (self.closed or self.given_up)

    @property
    def identity(self) -> None:
        return None

    @property
    def routed(self) -> bool:
        return self.connected

    @property
    def unanswered(self) -> int:
        """Number of received questions that are not answered yet."""
        return sum(not question.answered for question in self._serving)

    def advertise(self, key: str, *, events: bool = False) -> _Publisher:
        publisher = _Publisher(self._network, self.robot, self, key, deque(maxlen=EVENT_HISTORY) if events else None)
        self.robot.publishers.append(publisher)
        return publisher

    def subscribe(
        self,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool = False,
        latest_only: bool = False,
    ) -> _Registration:
        subscription = _Subscription(self, key_expression, on_sample, events=events, latest_only=latest_only)
        self.robot.subscriptions.add(subscription)
        if events:
            for publisher in self.robot.publishers:
                if matches(key_expression, publisher.key):
                    for sample in publisher.history or ():
                        subscription.send(publisher, sample)
        return _Registration(lambda: self.robot.remove_subscription(subscription))

    def serve(self, key_expression: str, on_request: Callable[[Request], None]) -> _Registration:
        service = Service(self, key_expression, on_request)
        self.robot.services.add(service)
        return _Registration(lambda: self.robot.services.discard(service))

    def ask(
        self,
        key: str,
        payload: bytes,
        on_answer: Callable[[Answer], None],
        *,
        timeout: float = 2.0,
        attachment: bytes = b"",
    ) -> None:
        question = Question(self, key, payload, attachment, on_answer)
        question.expiry = self.after(timeout, lambda: question.complete(NoReply(timed_out=True)))
        self._network.report_sent(self, "ask", key, payload)
        self._network.forward(self.robot, question)

    def take(self, question: Question, on_request: Callable[[Request], None]) -> None:
        """Serve a question that has arrived here."""
        if not question.completed:
            question.server = self
            self._serving[question] = None
        on_request(_Request(self, question))

    def answer(self, question: Question, answer: Answer) -> None:
        """Send the answer to a question that is served here; a closed bus sends nothing."""
        if self.closed:
            return
        question.answered = True
        match answer:
            case Answered():
                self._network.report_sent(self, "reply", question.key, answer.payload)
            case Refused():
                self._network.report_sent(self, "refuse", question.key, encode(answer.error))
            case NoReply():
                pass
        self._network.send(self, question.asker, lambda: question.complete(answer))

    def release(self, question: Question) -> None:
        """Forget a question whose asker no longer waits."""
        self._serving.pop(question, None)

    def declare_alive(self, key: str) -> _Registration:
        self.robot.announce(self, key, alive=True)
        registration = _Registration(lambda: self.robot.announce(self, key, alive=False))
        self.robot.tokens.append((self, key, registration))
        return registration

    def watch_alive(self, key_expression: str, on_change: Callable[[str, bool], None]) -> _Registration:
        watch = Watch(self._network, self, key_expression, on_change)
        for key in self.robot.visible_tokens():
            watch.send(self, key, alive=True)
        self.robot.watches.append(watch)
        return _Registration(lambda: self.robot.remove_watch(watch))

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Entry:
        return self._network.schedule(delay, self._while_open(action))

    def every(self, period: float, action: Callable[[], None]) -> Entry:
        def fire() -> None:
            if self.closed:
                entry.cancel()
            else:
                self._network.perform(self, action)

        entry = self._network.schedule_periodic(period, fire)
        return entry

    def post(self, action: Callable[[], None]) -> None:
        self._network.schedule(0.0, self._while_open(action))

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        return self._network.run_until(done, timeout)

    def close(self) -> None:
        """Leave the network as a process that dies: at once, with everything that was declared. Idempotent."""
        if self.closed:
            return
        self.closed = True
        for each in self._beside:
            each.close()
        self.robot.remove_node(self)
        abandoned, self._serving = self._serving, {}
        for question in abandoned:
            complete = lambda q=question: q.complete(NoReply(timed_out=False))  # noqa: E731
            self._network.send(self, question.asker, complete, Traffic.LIVELINESS)

    def perform(self, action: Callable[[], None]) -> None:
        """Run an action of this node now, unless it has left."""
        self._network.perform(self, action)

    def _while_open(self, action: Callable[[], None]) -> Callable[[], None]:
        """The action, as long as this bus is not closed."""
        return lambda: self.perform(action)


# --- what lives on the network ---------------------------------------------------------------------------------------


class _Registration:
    """A handle that undoes its declaration once."""

    def __init__(self, undo: Callable[[], None]) -> None:
        self._undo: Callable[[], None] | None = undo

    def cancel(self) -> None:
        undo, self._undo = self._undo, None
        if undo is not None:
            undo()


class _Declared(Protocol):
    """A declaration of a node, for the keys that its expression covers."""

    @property
    def bus(self) -> InProcessBus: ...
    @property
    def key_expression(self) -> str: ...


D = TypeVar("D", bound=_Declared)


class KeyIndex(Generic[D]):
    """Declarations of nodes, in their order. Look-ups are cached: each put of a stream and each question needs one."""

    def __init__(self) -> None:
        self._all: list[D] = []
        self._covering: dict[str, list[D]] = {}

    def __iter__(self) -> Iterator[D]:
        return iter(self._all)

    def covering(self, key: str) -> list[D]:
        """The declarations whose expression covers a key."""
        found = self._covering.get(key)
        if found is None:
            found = self._covering[key] = [each for each in self._all if matches(each.key_expression, key)]
        return found

    def of(self, bus: InProcessBus) -> list[D]:
        """The declarations of one node."""
        return [each for each in self._all if each.bus is bus]

    def add(self, declared: D) -> None:
        self._all.append(declared)
        self._covering.clear()

    def discard(self, declared: D) -> None:
        _discard(self._all, declared)
        self._covering.clear()


@dataclass(eq=False)
class Namespace:
    """The nodes and declarations of one robot. Other robots do not see them."""

    name: str
    nodes: dict[str, InProcessBus] = field(default_factory=dict)
    publishers: list[_Publisher] = field(default_factory=list)
    watches: list[Watch] = field(default_factory=list)
    tokens: list[tuple[InProcessBus, str, _Registration]] = field(default_factory=list)
    services: KeyIndex[Service] = field(default_factory=KeyIndex)
    subscriptions: KeyIndex[_Subscription] = field(default_factory=KeyIndex)

    def remove_subscription(self, subscription: _Subscription) -> None:
        subscription.active = False
        self.subscriptions.discard(subscription)

    def remove_watch(self, watch: Watch) -> None:
        watch.active = False
        _discard(self.watches, watch)

    def visible_tokens(self) -> tuple[str, ...]:
        """Keys of the tokens that are visible on the network."""
        return tuple(dict.fromkeys(key for owner, key, _ in self.tokens if not owner.given_up))

    def announce(self, source: InProcessBus, key: str, *, alive: bool) -> None:
        """Report a token that appears or vanishes to the watches, unless another one of the same key remains."""
        if not alive:
            self.tokens[:] = [token for token in self.tokens if token[:2] != (source, key)]
        if key not in self.visible_tokens() and not source.given_up:
            for watch in list(self.watches):
                watch.send(source, key, alive=alive)

    def remove_node(self, bus: InProcessBus) -> None:
        for subscription in self.subscriptions.of(bus):
            self.remove_subscription(subscription)
        self.publishers[:] = [each for each in self.publishers if each.bus is not bus]
        for service in self.services.of(bus):
            self.services.discard(service)
        for watch in [each for each in self.watches if each.bus is bus]:
            self.remove_watch(watch)
        for owner, _, registration in list(self.tokens):
            if owner is bus:
                registration.cancel()
        if self.nodes.get(bus.name) is bus:
            del self.nodes[bus.name]


@dataclass(eq=False, slots=True)
class _Publisher:
    network: InProcessNetwork
    robot: Namespace
    bus: InProcessBus
    key: str
    history: deque[Sample] | None

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        if self.bus.closed:
            return
        self.network.report_sent(self.bus, "put", self.key, payload)
        sample = Sample(self.key, payload, attachment)
        if self.history is not None:
            self.history.append(sample)
        for subscription in self.robot.subscriptions.covering(self.key):
            subscription.send(self, sample)


class _Subscription:
    """Samples on their way to one node. They wait while the node does not run, as `FaultyNetwork` can make it."""

    def __init__(
        self,
        bus: InProcessBus,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool,
        latest_only: bool,
    ) -> None:
        self.bus = bus
        self.key_expression = key_expression
        self.active = True
        self._on_sample = on_sample
        self._events = events
        self._inbox = Inbox(
            bus.events if events else bus.streams,
            self._deliver,
            # The newest of a key is delivered when everything that arrives at this instant has arrived.
            bus.post if latest_only else bus.perform,
            latest_only=latest_only,
            label=f"{bus.name} on {key_expression}",
        )

    def send(self, publisher: _Publisher, sample: Sample) -> None:
        recovered = self._events and publisher.history is not None
        traffic = Traffic.EVENT if recovered else Traffic.STREAM
        publisher.network.send(publisher.bus, self.bus, lambda: self._inbox.receive(sample), traffic, (publisher, self))

    def _deliver(self, sample: Sample) -> None:
        if self.active:
            self._on_sample(sample)


@dataclass(eq=False, slots=True)
class Watch:
    network: InProcessNetwork
    bus: InProcessBus
    key_expression: str
    on_change: Callable[[str, bool], None]
    active: bool = True

    def send(self, source: InProcessBus, key: str, *, alive: bool) -> None:
        if matches(self.key_expression, key):
            arrive = lambda: self.deliver(key, alive)  # noqa: E731
            self.network.send(source, self.bus, arrive, Traffic.LIVELINESS, (self, key))

    def deliver(self, key: str, alive: bool) -> None:
        if self.active:
            self.on_change(key, alive)


@dataclass(eq=False, slots=True)
class Service:
    bus: InProcessBus
    key_expression: str
    on_request: Callable[[Request], None]


@dataclass(eq=False, slots=True)
class Question:
    """A query under way, on the asker's side. The first answer completes it."""

    asker: InProcessBus
    key: str
    payload: bytes
    attachment: bytes
    on_answer: Callable[[Answer], None]
    expiry: Handle | None = None
    server: InProcessBus | None = None
    answered: bool = False
    completed: bool = False

    def complete(self, answer: Answer) -> None:
        if self.completed:
            return
        self.completed = True
        if self.expiry is not None:
            self.expiry.cancel()
        if self.server is not None:
            self.server.release(self)
        if not self.asker.closed:
            self.on_answer(answer)


class _Request:
    """A question on the side of its server."""

    def __init__(self, bus: InProcessBus, question: Question) -> None:
        self._bus = bus
        self._question = question
        self._answered = False

    @property
    def key(self) -> str:
        return self._question.key

    @property
    def asker(self) -> None:
        return None

    @property
    def payload(self) -> bytes:
        return self._question.payload

    @property
    def attachment(self) -> bytes:
        return self._question.attachment

    def reply(self, payload: bytes, attachment: bytes = b"") -> None:
        self._answer(Answered(payload, attachment))

    def refuse(self, error: ErrorReply) -> None:
        self._answer(Refused(error))

    def _answer(self, answer: Answer) -> None:
        if self._answered:
            raise RuntimeError(f"the query on `{self.key}` was answered twice; answer each query once")
        self._answered = True
        self._bus.answer(self._question, answer)


def _discard(items: list[T], item: T) -> None:
    if item in items:
        items.remove(item)
