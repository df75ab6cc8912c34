"""Properties of the Zenoh bus alone: clocks that other processes follow, bounded backlogs, other threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest

from skillwing.dsl import parse
from skillwing.services.bus import Answer, Answered, Refused, Request, Sample
from skillwing.services.bus.backlog import MOST_REQUESTS, STREAM_BACKLOG
from skillwing.services.bus.clock import LONGEST_EXTRAPOLATION, ROUNDING, FollowedClock, LockstepClock, PacedClock
from skillwing.services.bus.zenoh_bus import ZenohBus
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.processes.router import start_router
from skillwing.services.protocol import CLOCK_KEY, ClockTick, ErrorCode, Keys, QueryStates, encode

PATIENCE = 10.0
FEW = 16
"""Samples of a stream that are on their way at most, so that none is lost on it."""


class NotingClock(LockstepClock):
    """Tells who has joined."""

    def __init__(self) -> None:
        super().__init__()
        self.joined: set[str] = set()

    def done(self, follower: str, t: float, lag: float) -> None:
        super().done(follower, t, lag)
        self.joined.add(follower)


class Network:
    def __init__(self) -> None:
        self._router, self._endpoint = start_router()
        self.buses: list[ZenohBus] = []

    def follower(self, name: str) -> ZenohBus:
        return self._add(ZenohBus(name, "r1", self._endpoint, FollowedClock()))

    def follower_by(self, wall: Callable[[], float]) -> tuple[ZenohBus, FollowedClock]:
        """A follower with another wall clock."""
        clock = FollowedClock(wall)
        return self._add(ZenohBus("follower", "r1", self._endpoint, clock)), clock

    def owner(self, factor: float) -> ZenohBus:
        """The owner of time, ticking at 50 Hz of robot time."""
        bus = self._add(ZenohBus("owner", "r1", self._endpoint, PacedClock(factor)))
        ticks = bus.advertise(CLOCK_KEY)
        bus.every(0.02, lambda: ticks.put(encode(ClockTick(t=bus.now(), factor=factor))))
        return bus

    def worker(self, name: str, lag: float) -> ZenohBus:
        """A follower whom the owner of a time in lockstep waits for."""
        return self._add(ZenohBus(name, "r1", self._endpoint, FollowedClock(lag=lag)))

    def leader(self, clock: LockstepClock | None = None) -> ZenohBus:
        """The owner of a time that runs as fast as its followers keep up; each step it asks them something."""
        bus = self._add(ZenohBus("leader", "r1", self._endpoint, clock or LockstepClock()))
        ticks, questions = bus.advertise(CLOCK_KEY), bus.advertise("question")

        def step() -> None:
            ticks.put(encode(ClockTick(t=bus.now(), factor=0.0)))
            questions.put(str(bus.now()).encode())
            ticks.put(encode(ClockTick(t=bus.now(), factor=0.0, complete=True)))

        bus.every(0.02, step)
        return bus

    def plain(self, name: str) -> ZenohBus:
        return self._add(ZenohBus(name, "r1", self._endpoint))

    def _add(self, bus: ZenohBus) -> ZenohBus:
        self.buses.append(bus)
        return bus

    def run_until(self, done: Callable[[], bool]) -> bool:
        deadline = time.monotonic() + PATIENCE
        while not done() and time.monotonic() < deadline:
            for bus in self.buses:
                bus.run_until(done, 0.001)
        return done()

    def wait_for_answer(self, asker: ZenohBus, key: str) -> None:
        """Ask until somebody answers: what was declared just now may not be known everywhere yet."""
        deadline = time.monotonic() + PATIENCE
        while not self.answers(asker, key):
            assert time.monotonic() < deadline, f"nobody answers on {key}"

    def answers(self, asker: ZenohBus, key: str) -> bool:
        """Ask, and tell whether somebody has answered."""
        answers: list[Answer] = []
        asker.ask(key, b"", answers.append)
        self.run_until(lambda: bool(answers))
        return isinstance(answers[0], Answered)

    def close(self) -> None:
        for bus in self.buses:
            bus.close()
        self._router.close()


@pytest.fixture
def network() -> Iterator[Network]:
    network = Network()
    yield network
    network.close()


def test_followers_live_in_the_owners_time(network: Network) -> None:
    follower = network.follower("follower")
    times: list[float] = []
    follower.every(0.1, lambda: times.append(follower.now()))
    owner = network.owner(factor=10.0)
    assert network.run_until(lambda: len(times) >= 20)
    assert times[-1] >= 2.0
    assert owner.now() >= times[-1] - LONGEST_EXTRAPOLATION - ROUNDING
    assert times == sorted(times)


def test_as_fast_as_possible_is_faster_than_the_wall(network: Network) -> None:
    owner = network.owner(factor=0.0)
    assert network.run_until(lambda: owner.now() >= 10.0 * PATIENCE)


def test_before_the_first_tick_robot_timers_wait_and_wall_timers_do_not(network: Network) -> None:
    follower = network.follower("follower")
    order: list[str] = []
    follower.after(0.0, lambda: order.append("robot"))
    follower.after(0.05, lambda: order.append("wall"), wall=True)
    assert network.run_until(lambda: bool(order))
    assert order == ["wall"]
    assert follower.now() == 0.0
    network.owner(factor=1.0)
    assert network.run_until(lambda: len(order) == 2)


def test_who_joins_late_waits_from_then_on(network: Network) -> None:
    owner = network.owner(factor=0.0)
    assert network.run_until(lambda: owner.now() >= 50.0)
    joined = owner.now()
    follower = network.follower("follower")
    fired: list[float] = []
    first: list[float] = []
    follower.after(0.0, lambda: first.append(follower.now()))
    follower.after(5.0, lambda: fired.append(follower.now()))
    assert network.run_until(lambda: bool(fired))
    assert first[0] >= 50.0
    assert fired[0] >= joined + 4.0  # `first` may run late, by seconds of a time that nobody holds back


@pytest.mark.parametrize("how", ["message", "wall timer", "robot timer"])
def test_a_node_that_was_stopped_does_nothing_before_it_knows_the_time(network: Network, how: str) -> None:
    ticks = network.plain("owner").advertise(CLOCK_KEY)
    asleep = 0.0

    def wall() -> float:
        if asleep:  # it wakes up, and the next ticks are under way
            for _ in range(2):
                ticks.put(encode(ClockTick(t=60.0)))
        return time.monotonic() + asleep

    follower, clock = network.follower_by(wall)

    def started() -> bool:
        ticks.put(encode(ClockTick(t=10.0)))  # until the first one arrives
        return clock.has_started()

    assert network.run_until(started)
    ticks.put(encode(ClockTick(t=50.0)))  # the last one: none is under way when the node falls asleep
    assert network.run_until(lambda: clock.now() >= 50.0)
    asleep = 10.0
    times: list[float] = []
    if how == "message":
        follower.post(lambda: times.append(follower.now()))
    else:
        follower.after(0.0, lambda: times.append(follower.now()), wall=how == "wall timer")
    assert network.run_until(lambda: bool(times))
    assert times[0] >= 60.0


def test_a_tick_that_is_none_is_ignored(network: Network) -> None:
    follower, liar = network.follower("follower"), network.plain("liar")
    seen: list[Sample] = []
    follower.subscribe(CLOCK_KEY, seen.append)
    publisher = liar.advertise(CLOCK_KEY)
    liar.every(0.01, lambda: publisher.put(b"\xff"))
    assert network.run_until(lambda: len(seen) >= 2)
    assert follower.now() == 0.0


def test_the_backlog_of_a_stream_is_bounded(network: Network) -> None:
    source, busy, idle = network.plain("source"), network.plain("busy"), network.plain("idle")
    late: list[Sample] = []
    prompt: list[Sample] = []
    busy.subscribe("x", late.append)
    idle.subscribe("x", prompt.append)
    stream = source.advertise("x")
    first = source.every(0.01, lambda: stream.put(b""))
    assert network.run_until(lambda: bool(late) and bool(prompt))
    first.cancel()
    late.clear()
    prompt.clear()
    for sent in range(1, 4 * STREAM_BACKLOG + 1):
        stream.put(b"")
        if sent % FEW == 0:
            assert idle.run_until(lambda sent=sent: len(prompt) >= sent, PATIENCE)
    busy.run_until(lambda: False, 0.1)
    assert STREAM_BACKLOG / 2 < len(late) < 2 * STREAM_BACKLOG


def test_a_busy_node_refuses_too_many_requests_and_gets_messages(network: Network) -> None:
    asker, busy, idle = network.plain("asker"), network.plain("busy"), network.plain("idle")
    heard: list[bytes] = []
    taken_up: list[bytes] = []
    answers: list[Answer] = []
    told: list[Answer] = []

    def take_up(request: Request) -> None:
        taken_up.append(request.payload)
        request.reply(b"")

    busy.serve("x", take_up)
    busy.subscribe("event", lambda sample: heard.append(sample.payload), events=True)
    idle.serve("y", lambda request: request.reply(b"y"))
    events = asker.advertise("event", events=True)
    network.wait_for_answer(asker, "x")
    taken_up.clear()
    busy.ask("y", b"", told.append, timeout=PATIENCE)
    too_many = MOST_REQUESTS + 20
    for number in range(too_many):
        asker.ask("x", str(number).encode(), answers.append, timeout=PATIENCE)
        events.put(b"")
    assert asker.run_until(lambda: len(answers) == 20, PATIENCE)
    assert all(isinstance(each, Refused) and each.error.code is ErrorCode.UNAVAILABLE for each in answers)
    assert network.run_until(lambda: len(answers) == too_many and len(heard) == too_many and bool(told))
    assert len(taken_up) == MOST_REQUESTS
    assert told == [Answered(b"y")]
    answers.clear()
    asker.ask("x", b"again", answers.append)
    assert network.run_until(lambda: answers == [Answered(b"")])


def test_other_threads_may_post(network: Network) -> None:
    bus = network.plain("a")
    threads: list[threading.Thread] = []
    poster = threading.Thread(target=lambda: bus.post(lambda: threads.append(threading.current_thread())))
    poster.start()
    assert bus.run_until(lambda: bool(threads), PATIENCE)
    poster.join()
    assert threads == [threading.current_thread()]


def test_in_lockstep_each_question_is_answered_before_time_goes_on(network: Network) -> None:
    """A loop over two processes: what the worker answers to a step is there before the next one."""
    worker = network.worker("worker", 0.0)
    answers = worker.advertise("answer")
    worker.subscribe("question", lambda sample: answers.put(sample.payload))
    clock = NotingClock()
    leader = network.leader(clock)
    answered: list[tuple[float, float]] = []
    leader.subscribe("answer", lambda sample: answered.append((leader.now(), float(sample.payload))))
    # Before the worker has joined the leader runs ahead of it; the answers to that come late.
    assert network.run_until(lambda: f"r1/{worker.name}" in clock.joined)
    answered.clear()
    assert network.run_until(lambda: bool(answered) and answered[-1][0] == answered[-1][1])
    answered.clear()
    assert network.run_until(lambda: len(answered) >= 100)
    assert [now for now, _ in answered] == [asked for _, asked in answered]
    assert [round(later - sooner, 6) for (sooner, _), (later, _) in pairwise(answered)] == [0.02] * (len(answered) - 1)


def test_in_lockstep_time_goes_on_when_a_worker_has_gone(network: Network) -> None:
    worker = network.worker("skill/worker", 0.1)
    leader = network.leader()
    ticks: list[Sample] = []
    worker.subscribe("question", ticks.append)
    assert network.run_until(lambda: len(ticks) > 50)
    network.buses.remove(worker)
    worker.close()
    gone = leader.now()
    begun = time.monotonic()
    assert network.run_until(lambda: leader.now() > gone + 10.0)
    assert time.monotonic() - begun < PATIENCE, "not with a pause of patience at each step"


@pytest.mark.parametrize("leaving", [0, 1])
def test_when_a_resource_manager_leaves_the_one_beside_it_answers_those_who_were_there(
    network: Network, leaving: int
) -> None:
    """A router would go on asking the one that has left, had that taken back what it served before it closed."""
    door = parse("skillset door { resource lock { initial SHUT  extern SHUT -> OPEN } }", "door.skillset")
    clients = [network.plain(f"client-{number}") for number in range(3)]
    managers = [ResourceManagerNode(door), ResourceManagerNode(door)]
    buses = [network.plain(manager.name) for manager in managers]
    for manager, bus in zip(managers, buses, strict=True):
        manager.attach(bus)

    def ask(client: ZenohBus) -> Answer:
        answers: list[Answer] = []
        client.ask(Keys("door").resource_states, encode(QueryStates()), answers.append)
        assert network.run_until(lambda: bool(answers))
        return answers[0]

    def answered_soon(client: ZenohBus) -> bool:
        return any(isinstance(ask(client), Answered) for _ in range(20))

    for client in clients:
        assert answered_soon(client)
    managers[leaving].detach()
    assert all(isinstance(ask(client), Answered | Refused) for client in clients)
    buses[leaving].close()
    assert answered_soon(clients[0])
    assert [type(ask(client)) for client in clients] == [Answered] * 3
