"""The bus: messages, timers, one thread and one clock for a node.

A `Node` attaches itself to a `Bus` and acts in callbacks from then on. The bus runs them one at a time on the node's
one thread. There are two buses. `zenoh_bus.ZenohBus` connects the processes that a user runs. In an
`inprocess.InProcessNetwork` any number of nodes share one virtual time and advance in lockstep, bit-reproducibly.
Code above this module works alike on both.

Keys are relative to the robot's namespace. Payloads are bytes: see `skillwing.services.protocol`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.protocol import ErrorReply

Topology = Literal["router", "mesh"]
"""Connections between the processes of a system: each to a router, or each to each."""

EVENT_HISTORY = 1000
"""Publications of an event publisher that are kept for late and cut-off subscribers."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One publication. Streams carry raw array bytes in `payload` and their MessagePack header in `attachment`."""

    key: str
    payload: bytes
    attachment: bytes = b""


@dataclass(frozen=True, slots=True)
class Answered:
    """A reply to a query."""

    payload: bytes
    attachment: bytes = b""


@dataclass(frozen=True, slots=True)
class Refused:
    """A typed error reply to a query."""

    error: ErrorReply


@dataclass(frozen=True, slots=True)
class NoReply:
    """No reply: nobody there, or nobody in time. The request may still be executed; ask again with the same id."""

    timed_out: bool


Answer = Answered | Refused | NoReply


class Request(Protocol):
    """A query that the server answers exactly once, now or later. A second answer raises RuntimeError."""

    @property
    def key(self) -> str: ...
    @property
    def asker(self) -> str | None:
        """Name of the sender, guaranteed by the router; None where there are no keys."""
        ...

    @property
    def payload(self) -> bytes: ...
    @property
    def attachment(self) -> bytes: ...
    def reply(self, payload: bytes, attachment: bytes = b"") -> None: ...
    def refuse(self, error: ErrorReply) -> None: ...


class Publisher(Protocol):
    def put(self, payload: bytes, attachment: bytes = b"") -> None: ...


class Handle(Protocol):
    """A declaration on the bus, or a timer. `cancel` is idempotent."""

    def cancel(self) -> None: ...


class RobotTime(Protocol):
    """The time in which a node lives."""

    def now(self) -> float:
        """Robot time in seconds."""
        ...

    def wall(self) -> float:
        """Transport time in seconds from any origin. It always passes: wall time on Zenoh, virtual time in process."""
        ...

    @property
    def follows_time(self) -> bool:
        """True where one process of the robot owns robot time, which starts again with that process's world.

        False where robot time is Unix time, which goes back only if somebody sets the machine's clock.
        """
        ...


class Timers(RobotTime, Protocol):
    """Callbacks at a time. Each runs on the node's one thread."""

    def after(self, delay: float, action: Callable[[], None], *, wall: bool = False) -> Handle:
        """Call `action` once, `delay` seconds from now, in robot time unless `wall`."""
        ...

    def every(self, period: float, action: Callable[[], None]) -> Handle:
        """Call `action` at each multiple of `period` seconds of robot time from now on, without drift."""
        ...

    def post(self, action: Callable[[], None]) -> None:
        """Run `action` on the node's thread soon. The only method that other threads may call."""
        ...


class Network(Protocol):
    """Messages and liveliness. Each callback runs on the node's one thread."""

    @property
    def name(self) -> str:
        """The node's name, unique in its robot."""
        ...

    @property
    def identity(self) -> SessionIdentity | None:
        """The certificate that this node shows; None where there are no keys."""
        ...

    def new_id(self) -> str:
        """An id that is new on this network: random on Zenoh, in process the same in each run."""
        ...

    @property
    def connected(self) -> bool:
        """False while this node is cut off from the network, so that the silence of others means nothing."""
        ...

    @property
    def routed(self) -> bool:
        """False while no router is linked. Peers may still be connected, but clients outside are not heard: they
        connect to the router."""
        ...

    def advertise(self, key: str, *, events: bool = False) -> Publisher:
        """A publisher. `events=True`: nothing is lost on the way (cache, recovery, history for late subscribers).

        Otherwise it is a stream, where an old sample may be dropped for a new one.
        """
        ...

    def subscribe(
        self,
        key_expression: str,
        on_sample: Callable[[Sample], None],
        *,
        events: bool = False,
        latest_only: bool = False,
    ) -> Handle:
        """`latest_only`: while the node is busy only the newest sample of each key waits. `bus.backlog` has the bounds
        of all that waits."""
        ...

    def serve(self, key_expression: str, on_request: Callable[[Request], None]) -> Handle: ...

    def ask(
        self,
        key: str,
        payload: bytes,
        on_answer: Callable[[Answer], None],
        *,
        timeout: float = 2.0,
        attachment: bytes = b"",
    ) -> None:
        """Send a query; `on_answer` is called exactly once. `timeout` is in seconds of transport time."""
        ...

    def declare_alive(self, key: str) -> Handle:
        """A liveliness token that vanishes with this process."""
        ...

    def watch_alive(self, key_expression: str, on_change: Callable[[str, bool], None]) -> Handle:
        """`on_change(key, alive)` for every token there is, and from then on at each change."""
        ...

    def close(self) -> None:
        """Leave the network as a process that ends, with everything that was declared. Idempotent."""
        ...


class Bus(Timers, Network, Protocol):
    """One node's view of its world: everything that a node may ask for."""


@runtime_checkable
class MultiRobotBus(Protocol):
    """A bus that opens further namespaces: for a process of several robots, such as the simulator of their world."""

    def beside(self, robot: str) -> Bus:
        """The bus of this node in the namespace of another robot, or this bus for its own.

        Both share thread, clock and timers. The new bus closes with this one. There its name is `NAME@ROBOT`, because
        the other robot may have a node of the same name.
        """
        ...

    def with_own_time(self, robot: str, *, follows: bool) -> Bus:
        """The same with the time of that robot, and timers of its own. Both share the thread.

        follows: a process of that robot owns its time; False for wall time.
        """
        ...


class Loop(Protocol):
    """The one thread on which a node's callbacks run."""

    def run_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """Run callbacks until `done()` holds (True) or `timeout` seconds of transport time passed (False)."""
        ...


class RunnableBus(Bus, Loop, Protocol):
    """A bus with its loop: for the code that runs nodes, or that waits at a terminal. Nodes must not wait."""


class Node(Protocol):
    """The content of a process, made by a factory `(options: dict[str, Any]) -> Node`.

    Process tables name the factory as `"package.module:factory"`. `owns_clock` is True for the one node that advances
    robot time, the simulator. A node inside a control loop also has `closes_loop` = True: robot time never runs ahead
    of it. A node that is not ready when it is attached has `tells_when_ready` = True, and declares the liveliness token
    of its process itself. A node whose work comes to an end closes its bus then, and has `over` = True.
    """

    @property
    def name(self) -> str: ...
    @property
    def owns_clock(self) -> bool: ...

    def attach(self, bus: Bus) -> None:
        """Declare everything and return at once. From then on the node acts in callbacks."""
        ...

    def detach(self) -> None:
        """The process ends in good order: publish final messages, and release resources that outlive a process."""
        ...
