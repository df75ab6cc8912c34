"""The bus of everything a user runs: a Zenoh session, one mailbox, one thread.

Zenoh calls back on threads of its own. Those callbacks only put actions into the mailbox of the node's loop, which runs
them on the node's one thread. So a node needs no locks.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable

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
from skillwing.services.bus.agenda import Entry
from skillwing.services.bus.backlog import EVENTS, STREAMS, Inbox, RequestBacklog, SampleBacklog
from skillwing.services.bus.clock import LAG, ROUNDING, Clock, FollowedClock, LockstepClock, WallClock
from skillwing.services.bus.identity import WHO, SessionIdentity, no_denial, signed
from skillwing.services.bus.node_loop import NodeLoop, NodeTime
from skillwing.services.bus.zenoh_entities import (
    REFUSAL,
    Declared,
    ZenohPublisher,
    ZenohQuestion,
    ZenohRequest,
    answer_of,
    sample_of,
    size_of,
)
from skillwing.services.bus.zenoh_session import CONNECT_TIMEOUT, open_session, role_at_router
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

HEARTBEAT = 0.5
"""Seconds between an event publisher's heartbeats, which reveal the loss of the last event to subscribers."""
ANSWER_GRACE = 1.0
"""Seconds that Zenoh has after a query's timeout to report it."""
ROLE_TIMEOUT = 1.0
"""Seconds in which the router says the role of a name."""

TIMER_SLACK = 0.005

logger = logging.getLogger(__name__)


class ZenohBus:
    """One node's session; see `Bus` for what each method promises.

    name: of the node; robot: its namespace; endpoint: of the router, `tcp/HOST:PORT`; clock: of robot time; topology:
    the session's connections; identity: the certificate to show, for a router with keys. sibling: a bus of the same
    node in the namespace of another robot, whose loop runs this one as well. Without `clock` both have one clock.
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
        identity: SessionIdentity | None = None,
        sibling: ZenohBus | None = None,
    ) -> None:
        self._name, self._robot, self._endpoint = name, robot, endpoint
        self._topology: Topology = topology
        self._identity = identity
        self._requests = RequestBacklog()
        self._streams = SampleBacklog(STREAMS)
        self._events = SampleBacklog(EVENTS)
        self._declared: set[Declared] = set()
        self._done: ZenohPublisher | None = None
        self._closed = False
        self._session = open_session(topology, endpoint, robot, connect_timeout, identity)
        self._siblings: list[ZenohBus] = sibling._siblings if sibling is not None else []
        """All open buses of the node. The first one closes the others with itself."""
        self._siblings.append(self)
        self._loop = sibling._loop if sibling is not None else NodeLoop()
        shared = sibling._time if sibling is not None and clock is None else None
        self._time = shared or NodeTime(clock or WallClock())
        if shared is None:
            self._loop.add(self._time)
        if isinstance(self._time.clock, LockstepClock):
            self._lead(self._time.clock)
        elif isinstance(self._time.clock, FollowedClock) and shared is None:
            self._follow(self._time.clock)

    @property
    def name(self) -> str:
        return self._name

    def beside(self, robot: str) -> ZenohBus:
        """See `MultiRobotBus`. Raises RouterUnreachableError."""
        return self._sibling(robot, None)

    def with_own_time(self, robot: str, *, follows: bool) -> ZenohBus:
        """See `MultiRobotBus`. Raises RouterUnreachableError."""
        return self._sibling(robot, FollowedClock(lag=LAG) if follows else WallClock())

    def _sibling(self, robot: str, clock: Clock | None) -> ZenohBus:
        if robot == self._robot:
            return self
        return ZenohBus(
            f"{self._name}@{self._robot}",
            robot,
            self._endpoint,
            clock,
            topology=self._topology,
            identity=self._identity,
            sibling=self,
        )

    @property
    def identity(self) -> SessionIdentity | None:
        return self._identity

    def is_known(self) -> bool:
        """True if the router knows this node's certificate by name, or if there is none. Waits for an answer.

        From then on, questions are refused by the role that the router knows.
        """
        if self._identity is None:
            return True
        role = role_at_router(self._session, self._identity)
        self._identity = self._identity.in_role(role or "")
        return role is not None

    def now(self) -> float:
        return self._time.clock.now()

    @property
    def follows_time(self) -> bool:
        return not isinstance(self._time.clock, WallClock)

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

    @property
    def router(self) -> str:
        """Id of the router, another one after each of its starts; empty while it is away."""
        return "" if self._closed else next((str(each) for each in self._session.info.routers_zid()), "")

    # --- messages ----------------------------------------------------------------------------------------------------

    def advertise(self, key: str, *, events: bool = False) -> ZenohPublisher:
        drop = zenoh.CongestionControl.DROP
        if not events:
            return ZenohPublisher(self._session.declare_publisher(key, congestion_control=drop), self._is_closed)
        publisher = zenoh.ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=drop,
            cache=zenoh.ext.CacheConfig(max_samples=EVENT_HISTORY),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=HEARTBEAT, sporadic_heartbeat=None),
        )
        return ZenohPublisher(publisher, self._is_closed)

    def subscribe(
        self,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool = False,
        latest_only: bool = False,
    ) -> Handle:
        handle = Declared(self._declared)
        inbox = Inbox(
            self._events if events else self._streams,
            lambda sample: handle.while_declared(lambda: on_sample(sample)),
            self.post,
            latest_only=latest_only,
            label=f"{self._name} on {key_expression}",
        )

        def receive(sample: zenoh.Sample) -> None:
            inbox.receive(sample_of(sample))

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
        handle = Declared(self._declared)

        def receive(query: zenoh.Query) -> None:
            size = size_of(query)
            if not self._requests.enter(size):
                text = f"`{self._name}` has not taken up the requests that came before this one."
                reply = ErrorReply(code=ErrorCode.UNAVAILABLE, message=text, help="Ask again.")
                query.reply_err(encode(reply), encoding=REFUSAL)
                return

            def take_up() -> None:
                self._requests.leave(size)
                handle.while_declared(lambda: on_request(ZenohRequest(query, signed_keys=self._identity is not None)))

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
        if self._identity is None:
            self._query(key, payload, on_answer, timeout, attachment)
        elif (refusal := self._identity.refusal(key)) is not None:
            self.post(lambda: on_answer(Refused(refusal)))
        else:
            explained = self._explaining(self._identity, key, on_answer)
            self._query(signed(key, self._identity.name), payload, explained, timeout, attachment)

    def _explaining(
        self, identity: SessionIdentity, key: str, on_answer: Callable[[Answer], None]
    ) -> Callable[[Answer], None]:
        """The same callback, which gets a denial by the router as one. Zenoh reports it like an absent server, at once.

        The router may have started again since this node joined, and know another role. It is asked for that role.
        """

        def explain(answer: Answer) -> None:
            if not isinstance(answer, NoReply) or answer.timed_out:
                on_answer(answer)
                return

            def take(role: Answer) -> None:
                denial = identity.denial(role.payload.decode(), key) if isinstance(role, Answered) else None
                on_answer(answer if denial is None else Refused(denial))

            self._query(f"{WHO}/{identity.name}", b"", take, ROLE_TIMEOUT)

        return on_answer if identity.denial is no_denial else explain

    def _query(
        self, key: str, payload: bytes, on_answer: Callable[[Answer], None], timeout: float, attachment: bytes = b""
    ) -> None:
        question = ZenohQuestion(on_answer)
        expiry = time.monotonic() + timeout
        question.expiry = self._time.wall_agenda.add(
            expiry + ANSWER_GRACE, lambda: question.complete(NoReply(timed_out=True))
        )

        def receive(reply: zenoh.Reply) -> None:
            question.answered = True
            self.post(lambda: question.complete(answer_of(reply)))

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
        handle = Declared(self._declared)
        handle.hold(self._session.liveliness().declare_token(key))
        return handle

    def watch_alive(self, key_expression: str, on_change: Callable[[str, bool], None]) -> Handle:
        handle = Declared(self._declared)
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
            return self._time.wall_agenda.add(time.monotonic() + delay, action)
        return self._time.robot_agenda.add(self.now() + delay, action)

    def every(self, period: float, action: Callable[[], None]) -> Entry:
        return self._time.robot_agenda.add_periodic(self.now(), period, action)

    def post(self, action: Callable[[], None]) -> None:
        self._loop.post(action)

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """See `Loop`. A closed bus runs nothing: this returns False at once unless `done()` holds."""
        return self._loop.run_until(done, timeout)

    def close(self) -> None:
        """Leave the network. No callback runs afterwards. Idempotent."""
        if self._closed:
            return
        self._closed = True
        first = self._siblings[0] is self
        self._siblings.remove(self)
        if first:
            self._loop.close()
            for sibling in tuple(self._siblings):
                sibling.close()
        elif all(sibling._time is not self._time for sibling in self._siblings):
            self._loop.remove(self._time)
        for declared in self._declared:
            declared.silence()
        try:
            self._session.close()
        except zenoh.ZError as error:  # the router at the other end is frozen
            logger.warning("the link to the router could not be closed: %s", error)

    @property
    def closed(self) -> bool:
        return self._closed

    def _is_closed(self) -> bool:
        return self._closed

    def _follow(self, clock: FollowedClock) -> None:
        """Set the clock at each tick, and wake the node only if a timer waits for this tick."""

        acknowledged = -math.inf

        def start(tick: ClockTick, received: float) -> None:
            if not clock.has_started():
                self._time.robot_agenda.shift(tick.t)
                clock.tick(tick.t, tick.factor, received)

        def owe(t: float) -> None:
            self._time.acknowledge = lambda: self._acknowledge(t, clock)

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
            if self._time.wakes_for(clock):
                self.post(_nothing)

        self._session.declare_subscriber(CLOCK_KEY, zenoh.handlers.Callback(receive, indirect=False))

    def _acknowledge(self, t: float, clock: FollowedClock) -> None:
        """Report to the owner of time that all work up to `t` is done."""
        if self._done is None:
            key = f"{CLOCK_DONE_KEY}/{self._name}"
            self._done = self.advertise(key)
            self.declare_alive(key)
        self._done.put(encode(ClockDone(t=t, lag=clock.lag or 0.0)))

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


def _nothing() -> None:
    """An action without effect, which wakes a node to look at its agenda."""
