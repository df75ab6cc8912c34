"""The bus of everything a user runs: a Zenoh session, one mailbox, one thread.

Zenoh calls back on threads of its own. Those callbacks only put actions into the mailbox. `run_until` runs the actions
and the timers on its caller's thread, so that a node has one thread and needs no locks.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue

import zenoh
import zenoh.ext

from skillwing.services.bus import (
    EVENT_HISTORY,
    Answer,
    Answered,
    Handle,
    NoReply,
    Refused,
    Request,
    Sample,
    Topology,
)
from skillwing.services.bus.agenda import Agenda, Entry
from skillwing.services.bus.backlog import EVENTS, STREAMS, Inbox, RequestBacklog, SampleBacklog
from skillwing.services.bus.clock import ROUNDING, Clock, FollowedClock, LockstepClock, WallClock
from skillwing.services.bus.identity import SessionIdentity, signed, split_asker
from skillwing.services.bus.zenoh_session import CONNECT_TIMEOUT, knows, open_session
from skillwing.services.ids import new_goal_id
from skillwing.services.protocol import (
    CLOCK_DONE_KEY,
    CLOCK_KEY,
    ClockDone,
    ClockTick,
    ErrorCode,
    ErrorReply,
    ProtocolError,
    decode,
    encode,
)

REFUSAL = zenoh.Encoding("application/vnd.skillwing.refusal+msgpack")
"""Encoding of our own error replies. Zenoh also sends error replies, for example at a query's timeout."""
TIMEOUT_REPLY = b"Timeout"
HEARTBEAT = 0.5
"""Seconds between an event publisher's heartbeats, which reveal the loss of the last event to subscribers."""
ANSWER_GRACE = 1.0
"""Seconds that Zenoh has after a query's timeout to report it."""

TIMER_SLACK = 0.005

logger = logging.getLogger(__name__)


class ZenohBus:
    """One node's session; see `Bus` for what each method promises.

    name: of the node; robot: its namespace; endpoint: of the router, `tcp/HOST:PORT`; clock: of robot time; topology:
    the session's connections. host: a bus of the same node in the namespace of another robot; both run on its thread
    and its clock. identity: the certificate to show, for a router with keys. loop_of: a bus of another robot, whose
    loop runs this one as well, each with a clock of its own.
    Raises RouterUnreachableError if the router does not answer within `connect_timeout` seconds.
    """

    def __init__(
        self,
        name: str,
        robot: str,
        endpoint: str,
        clock: Clock | None = None,
        connect_timeout: float = CONNECT_TIMEOUT,
        *,
        topology: Topology = "router",
        host: ZenohBus | None = None,
        identity: SessionIdentity | None = None,
        loop_of: ZenohBus | None = None,
    ) -> None:
        self._name, self._robot, self._endpoint = name, robot, endpoint
        self._topology: Topology = topology
        self._identity = identity
        self._clock: Clock = host._clock if host is not None else clock or WallClock()
        self._runner = loop_of
        self._together: tuple[ZenohBus, ...] = (self,)
        """All buses with a clock of their own that the loop of this one runs: itself, and the open ones beside it."""
        owner = host or loop_of
        self._mailbox: SimpleQueue[Callable[[], None]] = owner._mailbox if owner is not None else SimpleQueue()
        self._requests = RequestBacklog()
        self._streams = SampleBacklog(STREAMS)
        self._events = SampleBacklog(EVENTS)
        self._robot_agenda = host._robot_agenda if host is not None else Agenda()
        self._wall_agenda = host._wall_agenda if host is not None else Agenda()
        self._beside: list[ZenohBus] = []
        self._declared: set[_Declared] = set()
        self._awaited: float | None = None
        self._owed: float | None = None
        self._done: _Publisher | None = None
        self._running = False
        self._closed = False
        self._session = open_session(topology, endpoint, robot, connect_timeout, identity)
        if loop_of is not None:
            loop_of._together = (*loop_of._together, self)
        if isinstance(self._clock, FollowedClock):
            self._follow(self._clock)
        elif isinstance(self._clock, LockstepClock):
            self._lead(self._clock)

    @property
    def name(self) -> str:
        return self._name

    def beside(self, robot: str) -> ZenohBus:
        """See `MultiRobotBus`. Raises RouterUnreachableError."""
        if robot == self._robot:
            return self
        bus = ZenohBus(
            f"{self._name}@{self._robot}",
            robot,
            self._endpoint,
            topology=self._topology,
            host=self,
            identity=self._identity,
        )
        self._beside.append(bus)
        return bus

    @property
    def identity(self) -> SessionIdentity | None:
        return self._identity

    def is_known(self) -> bool:
        """True if the router knows this node's certificate by name, or if there is none. Waits for an answer."""
        return self._identity is None or knows(self._session, self._identity)

    def now(self) -> float:
        return self._clock.now()

    @property
    def follows_time(self) -> bool:
        return not isinstance(self._clock, WallClock)

    def new_id(self) -> str:
        return new_goal_id()

    def wall(self) -> float:
        return time.monotonic()

    @property
    def connected(self) -> bool:
        if self._closed:
            return False
        info = self._session.info
        # Connected peers need no router between them.
        return bool(info.routers_zid()) or bool(info.peers_zid())

    @property
    def routed(self) -> bool:
        return not self._closed and bool(self._session.info.routers_zid())

    # --- messages ----------------------------------------------------------------------------------------------------

    def advertise(self, key: str, *, events: bool = False) -> _Publisher:
        drop = zenoh.CongestionControl.DROP
        if not events:
            return _Publisher(self, self._session.declare_publisher(key, congestion_control=drop))
        publisher = zenoh.ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=drop,
            cache=zenoh.ext.CacheConfig(max_samples=EVENT_HISTORY),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT, sporadic_heartbeat=None),
        )
        return _Publisher(self, publisher)

    def subscribe(
        self,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool = False,
        latest_only: bool = False,
    ) -> Handle:
        handle = _Declared(self._declared)
        inbox = Inbox(
            self._events if events else self._streams,
            lambda sample: handle.while_declared(lambda: on_sample(sample)),
            self.post,
            latest_only=latest_only,
            label=f"{self._name} on {key_expression}",
        )

        def receive(sample: zenoh.Sample) -> None:
            # A copy waits. A sample of Zenoh's would keep alive the whole buffer that it was received in.
            inbox.receive(_sample(sample))

        callback = zenoh.handlers.Callback(receive, indirect=False)
        if not events:
            handle.hold(self._session.declare_subscriber(key_expression, callback))
            return handle
        subscriber = zenoh.ext.declare_advanced_subscriber(
            self._session,
            key_expression,
            callback,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
        )

        def on_miss(miss: zenoh.ext.Miss) -> None:
            logger.warning("%s lost %d events on %s for good", self._name, miss.nb, key_expression)

        misses = subscriber.sample_miss_listener(zenoh.handlers.Callback(on_miss, indirect=False))
        handle.hold(misses, subscriber)
        return handle

    def serve(self, key_expression: str, on_request: Callable[[Request], None]) -> Handle:
        handle = _Declared(self._declared)

        def receive(query: zenoh.Query) -> None:
            size = _size(query)
            if not self._requests.enter(size):
                text = f"`{self._name}` has not taken up the requests that came before this one."
                reply = ErrorReply(code=ErrorCode.UNAVAILABLE, message=text, help="Ask again.")
                query.reply_err(encode(reply), encoding=REFUSAL)
                return

            def take_up() -> None:
                self._requests.leave(size)
                handle.while_declared(lambda: on_request(_Request(query, signed_keys=self._identity is not None)))

            self.post(take_up)

        callback = zenoh.handlers.Callback(receive, indirect=False)
        served = key_expression if self._identity is None else signed(key_expression, "*")
        handle.hold(self._session.declare_queryable(served, callback, complete=True))
        return handle

    def ask(
        self,
        key: str,
        payload: bytes,
        on_answer: Callable[[Answer], None],
        *,
        timeout: float = 2.0,
        attachment: bytes = b"",
    ) -> None:
        if self._identity is not None:
            if (refusal := self._identity.refusal(key)) is not None:
                self.post(lambda: on_answer(Refused(refusal)))
                return
            key = signed(key, self._identity.name)
        question = _Question(on_answer)
        expiry = time.monotonic() + timeout
        question.expiry = self._wall_agenda.add(
            expiry + ANSWER_GRACE, lambda: question.complete(NoReply(timed_out=True))
        )

        def receive(reply: zenoh.Reply) -> None:
            question.answered = True
            self.post(lambda: question.complete(_answer(reply)))

        def finish() -> None:
            if question.answered:
                return  # no need to wake the node
            # The router's own timeout and an absent server end a query alike; only the time differs.
            timed_out = time.monotonic() > expiry - TIMER_SLACK
            self.post(lambda: question.complete(NoReply(timed_out)))

        self._session.get(
            key,
            zenoh.handlers.Callback(receive, finish, indirect=False),
            payload=payload,
            attachment=attachment or None,
            timeout=timeout,
            consolidation=zenoh.ConsolidationMode.NONE,
        )

    # --- liveliness --------------------------------------------------------------------------------------------------

    def declare_alive(self, key: str) -> Handle:
        handle = _Declared(self._declared)
        handle.hold(self._session.liveliness().declare_token(key))
        return handle

    def watch_alive(self, key_expression: str, on_change: Callable[[str, bool], None]) -> Handle:
        handle = _Declared(self._declared)
        known: set[str] = set()

        def note(key: str, alive: bool) -> None:
            if alive != (key in known):
                (known.add if alive else known.remove)(key)
                on_change(key, alive)

        def receive(sample: zenoh.Sample) -> None:
            key, alive = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            self.post(lambda: handle.while_declared(lambda: note(key, alive)))

        callback = zenoh.handlers.Callback(receive, indirect=False)
        handle.hold(self._session.liveliness().declare_subscriber(key_expression, callback, history=True))
        return handle

    # --- time --------------------------------------------------------------------------------------------------------

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Entry:
        if wall:
            return self._wall_agenda.add(time.monotonic() + delay, action)
        return self._robot_agenda.add(self.now() + delay, action)

    def every(self, period: float, action: Callable[[], None]) -> Entry:
        return self._robot_agenda.add_periodic(self.now(), period, action)

    def post(self, action: Callable[[], None]) -> None:
        self._mailbox.put(action)

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """See `Loop`. A closed bus runs nothing: this returns False at once unless `done()` holds."""
        if self._runner is not None:
            return self._runner.run_until(done, timeout)
        if self._running:
            raise RuntimeError("run_until was called from a callback; a node lives in callbacks and must not wait")
        deadline = None if timeout is None else time.monotonic() + timeout
        self._running = True
        try:
            while not done():
                if self._closed or (deadline is not None and time.monotonic() >= deadline):
                    return False
                self._turn(deadline)
            return True
        finally:
            self._running = False

    def close(self) -> None:
        """Leave the network. No callback runs afterwards. Idempotent."""
        if not self._closed:
            self._closed = True
            if self._runner is not None:
                self._runner._together = tuple(bus for bus in self._runner._together if bus is not self)
            for each in (*self._beside, *self._together[1:]):
                each.close()
            self._session.close()

    @property
    def closed(self) -> bool:
        return self._closed

    def _turn(self, deadline: float | None) -> None:
        """Run the waiting messages and a due timer of each bus. If there are none, wait for the first one."""
        self._catch_up()
        waiting = self._mailbox.qsize()
        for _ in range(waiting):
            self._mailbox.get_nowait()()
            if self._closed:
                return
        acted = [bus._act_when_due() for bus in self._together]
        if not any(acted) and not waiting:
            patience = [each for bus in self._together if (each := bus._patience(deadline)) is not None]
            try:
                message = self._mailbox.get(timeout=min(patience) if patience else None)
            except Empty:
                return
            self._catch_up()
            message()

    def _act_when_due(self) -> bool:
        """Run a timer that is due, or acknowledge robot time. False if there is nothing to do."""
        if self._closed:
            return False
        timer = self._due_timer()
        if timer is not None:
            timer()
        elif self._owed is not None:
            self._acknowledge(self._owed)
        else:
            return False
        return True

    def _catch_up(self) -> None:
        for bus in self._together:
            if isinstance(bus._clock, FollowedClock):
                bus._clock.catch_up()

    def _due_timer(self) -> Callable[[], None] | None:
        timer = self._wall_agenda.take(time.monotonic())
        if timer is not None:
            return timer
        due = self._robot_agenda.next_due()
        if due is None:
            return None
        wait = self._clock.seconds_until(due)
        if wait is None or wait > 0.0:
            return None
        self._clock.reach(due)
        return self._robot_agenda.take(max(due, self._clock.now()))

    def _patience(self, deadline: float | None) -> float | None:
        """Wall seconds until a timer is due or the deadline is over; None for never."""
        wall_due, robot_due = self._wall_agenda.next_due(), self._robot_agenda.next_due()
        # Set before the clock is read, so that a tick in between wakes this node.
        self._awaited = robot_due
        waits = [due - time.monotonic() for due in (deadline, wall_due) if due is not None]
        if robot_due is not None:
            wait = self._clock.seconds_until(robot_due)
            if wait is not None:
                waits.append(wait)
        return max(0.0, min(waits)) if waits else None

    def _follow(self, clock: FollowedClock) -> None:
        """Set the clock at each tick, and wake the node only if a timer waits for this tick."""

        acknowledged = -math.inf

        def start(tick: ClockTick, received: float) -> None:
            if not clock.has_started():
                self._robot_agenda.shift(tick.t)
                clock.tick(tick.t, tick.factor, received)

        def owe(t: float) -> None:
            self._owed = t

        def receive(sample: zenoh.Sample) -> None:
            nonlocal acknowledged
            received = time.monotonic()
            try:
                tick = decode(sample.payload.to_bytes(), ClockTick)
            except ProtocolError as error:
                logger.warning("%s ignores a clock tick: %s", self._name, error)
                return
            if not clock.has_started():
                self.post(lambda: start(tick, received))
                return
            clock.tick(tick.t, tick.factor, received)
            if tick.complete and clock.lag is not None and tick.t - acknowledged >= clock.lag - ROUNDING:
                # In the mailbox as on the network, this follows all earlier messages of the owner of time.
                acknowledged = tick.t
                self.post(lambda: owe(tick.t))
                return
            awaited = self._awaited
            if awaited is not None and clock.reaches(awaited):
                self.post(_nothing)

        self._session.declare_subscriber(CLOCK_KEY, zenoh.handlers.Callback(receive, indirect=False))

    def _acknowledge(self, t: float) -> None:
        """Report to the owner of time that all work up to `t` is done."""
        self._owed = None
        if self._done is None:
            key = f"{CLOCK_DONE_KEY}/{self._name}"
            self._done = self.advertise(key)
            self.declare_alive(key)
        assert isinstance(self._clock, FollowedClock)
        self._done.put(encode(ClockDone(t=t, lag=self._clock.lag or 0.0)))

    def _lead(self, clock: LockstepClock) -> None:
        """Receive the progress of the followers of this process's time, in the namespace of one robot."""

        def follower(key: str) -> str:
            return f"{self._robot}/{key.removeprefix(f'{CLOCK_DONE_KEY}/')}"

        def on_done(sample: Sample) -> None:
            try:
                done = decode(sample.payload, ClockDone)
            except ProtocolError as error:
                logger.warning("%s ignores the progress of %s: %s", self._name, follower(sample.key), error)
                return
            clock.done(follower(sample.key), done.t, done.lag)

        def on_change(key: str, alive: bool) -> None:
            if not alive:
                clock.gone(follower(key))

        self.subscribe(f"{CLOCK_DONE_KEY}/**", on_done)
        self.watch_alive(f"{CLOCK_DONE_KEY}/**", on_change)


# --- what is declared ------------------------------------------------------------------------------------------------

_Entity = (
    zenoh.Subscriber[None]
    | zenoh.Queryable[None]
    | zenoh.LivelinessToken
    | zenoh.ext.AdvancedSubscriber[None]
    | zenoh.ext.SampleMissListener[None]
)


class _Declared:
    """Declarations that are cancelled together. Messages that are still in the mailbox are then not delivered.

    Zenoh withdraws a token without references: `register` holds all that are not cancelled.
    """

    def __init__(self, register: set[_Declared]) -> None:
        self._register = register
        self._entities: tuple[_Entity, ...] = ()
        self._cancelled = False
        register.add(self)

    def hold(self, *entities: _Entity) -> None:
        self._entities = entities

    def cancel(self) -> None:
        self._cancelled = True
        self._register.discard(self)
        entities, self._entities = self._entities, ()
        for entity in entities:
            entity.undeclare()

    def while_declared(self, action: Callable[[], None]) -> None:
        if not self._cancelled:
            action()


class _Publisher:
    def __init__(self, bus: ZenohBus, publisher: zenoh.Publisher | zenoh.ext.AdvancedPublisher) -> None:
        self._bus = bus
        self._publisher = publisher

    def put(self, payload: bytes, attachment: bytes = b"") -> None:
        if not self._bus.closed:
            self._publisher.put(payload, attachment=attachment or None)


class _Question:
    """A query under way. The first answer completes it."""

    def __init__(self, on_answer: Callable[[Answer], None]) -> None:
        self._on_answer = on_answer
        self._completed = False
        self.answered = False
        """True if an answer is in the mailbox. Only Zenoh's thread uses it."""
        self.expiry: Entry | None = None

    def complete(self, answer: Answer) -> None:
        if self._completed:
            return
        self._completed = True
        if self.expiry is not None:
            self.expiry.cancel()
        self._on_answer(answer)


class _Request:
    """A received query. It drops Zenoh's query after the answer, which ends the query for the asker."""

    def __init__(self, query: zenoh.Query, *, signed_keys: bool) -> None:
        self._query: zenoh.Query | None = query
        self._reply_key = str(query.key_expr)
        self._key, self._asker = split_asker(self._reply_key) if signed_keys else (self._reply_key, None)
        self._payload = query.payload.to_bytes() if query.payload is not None else b""
        self._attachment = query.attachment.to_bytes() if query.attachment is not None else b""

    @property
    def key(self) -> str:
        return self._key

    @property
    def asker(self) -> str | None:
        return self._asker

    @property
    def payload(self) -> bytes:
        return self._payload

    @property
    def attachment(self) -> bytes:
        return self._attachment

    def reply(self, payload: bytes, attachment: bytes = b"") -> None:
        with self._take() as query:
            query.reply(self._reply_key, payload, attachment=attachment or None)

    def refuse(self, error: ErrorReply) -> None:
        with self._take() as query:
            query.reply_err(encode(error), encoding=REFUSAL)

    def _take(self) -> zenoh.Query:
        query, self._query = self._query, None
        if query is None:
            raise RuntimeError(f"the query on `{self._key}` was answered twice; answer each query once")
        return query


def _size(query: zenoh.Query) -> int:
    return sum(len(each) for each in (query.payload, query.attachment) if each is not None)


def _sample(sample: zenoh.Sample) -> Sample:
    attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
    return Sample(str(sample.key_expr), sample.payload.to_bytes(), attachment)


def _answer(reply: zenoh.Reply) -> Answer:
    """The answer in a reply: a payload, our own refusal, or silence for Zenoh's timeout and other errors."""
    if reply.ok is not None:
        sample = _sample(reply.ok)
        return Answered(sample.payload, sample.attachment)
    error = reply.err
    if error is None:
        return NoReply(timed_out=False)
    payload = error.payload.to_bytes()
    if error.encoding != REFUSAL:
        return NoReply(timed_out=payload == TIMEOUT_REPLY)
    try:
        return Refused(decode(payload, ErrorReply))
    except ProtocolError as problem:
        return Refused(ErrorReply(code=ErrorCode.INTERNAL, message=f"The refusal itself is malformed: {problem}."))


def _nothing() -> None:
    """An action without effect, which wakes a node to look at its agenda."""
