"""The failing network: what it may do to messages and nodes, and what not."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from faulty_network import LEASE, FaultyNetwork, NetworkConditions
from skillwing.services.bus import Answer, Answered, NoReply, Request, Sample
from skillwing.services.bus.inprocess import InProcessBus

STORM = NetworkConditions(latency=(0.001, 0.1), slow=0.3, slowest=2.0, loss=0.4, duplication=0.5)


def _numbers_heard(network: FaultyNetwork, listener: InProcessBus) -> list[int]:
    heard: list[int] = []
    listener.subscribe("event", lambda sample: heard.append(sample.payload[0]), events=True)
    return heard


def _watch(listener: InProcessBus) -> list[tuple[str, bool]]:
    seen: list[tuple[str, bool]] = []
    listener.watch_alive("alive/*", lambda key, alive: seen.append((key, alive)))
    return seen


@given(st.integers(0, 10_000), st.floats(0.0, 3.0), st.floats(0.0, 5.0))
def test_events_arrive_once_and_in_order_whatever_the_weather(seed: int, cut_at: float, cut_for: float) -> None:
    network = FaultyNetwork(seed, STORM)
    speaker, listener = network.join("speaker"), network.join("listener")
    heard, publisher = _numbers_heard(network, listener), speaker.advertise("event", events=True)
    for number in range(20):
        speaker.after(number / 5, lambda number=number: publisher.put(bytes([number])))
    network.schedule(cut_at, lambda: network.cut(listener))
    network.schedule(cut_at + cut_for, lambda: network.reconnect(listener))
    network.run_for(60.0)
    assert heard == list(range(20))


def test_events_that_only_a_killed_process_had_are_lost() -> None:
    network = FaultyNetwork()
    speaker, listener = network.join("speaker"), network.join("listener")
    heard, publisher = _numbers_heard(network, listener), speaker.advertise("event", events=True)
    network.cut(listener)
    publisher.put(b"\x01")
    network.run_for(1.0)
    network.kill(speaker)
    network.reconnect(listener)
    network.run_for(10.0)
    assert heard == []


@given(st.integers(0, 10_000))
def test_gaps_lose_events_but_never_the_latest_and_never_the_order(seed: int) -> None:
    network = FaultyNetwork(seed, replace(STORM, gaps=0.5))
    speaker, listener = network.join("speaker"), network.join("listener")
    heard, publisher = _numbers_heard(network, listener), speaker.advertise("event", events=True)
    for number in range(20):
        speaker.after(number / 5, lambda number=number: publisher.put(bytes([number])))
    network.run_for(60.0)
    assert heard == sorted(set(heard))
    assert len(heard) < 20
    assert heard[-1] == 19


@given(st.integers(0, 10_000))
def test_every_question_is_settled_once(seed: int) -> None:
    network = FaultyNetwork(seed, STORM)
    asker, server = network.join("asker"), network.join("server")
    server.serve("key", lambda request: request.reply(b"yes"))
    answers: list[Answer] = []
    for _ in range(20):
        asker.ask("key", b"", answers.append)
    network.run_for(30.0)
    assert len(answers) == 20
    assert {type(answer) for answer in answers} <= {Answered, NoReply}


def test_a_stopped_node_does_late_what_it_was_asked_to() -> None:
    network = FaultyNetwork()
    asker, server = network.join("asker"), network.join("server")
    served: list[Request] = []
    server.serve("key", served.append)
    network.run_for(1.0)
    answers: list[Answer] = []
    asker.ask("key", b"", answers.append)
    network.stop(server)
    network.run_for(2.5)
    assert answers == [NoReply(timed_out=True)]
    assert served == []
    network.wake(server)
    network.run_for(1.0)
    assert len(served) == 1


def test_a_token_outlives_a_short_cut_and_no_lease() -> None:
    network = FaultyNetwork()
    node, watcher = network.join("node"), network.join("watcher")
    node.declare_alive("alive/node")
    seen = _watch(watcher)
    network.run_for(1.0)
    network.cut(node)
    network.run_for(0.5)
    network.reconnect(node)
    network.run_for(LEASE)
    assert seen == [("alive/node", True)]
    network.cut(node)
    network.run_for(LEASE + 0.1)
    assert not node.connected
    network.reconnect(node)
    network.run_for(1.0)
    assert seen == [("alive/node", True), ("alive/node", False), ("alive/node", True)]
    assert node.connected


def test_a_node_that_is_cut_off_sees_all_others_vanish() -> None:
    network = FaultyNetwork()
    node, other = network.join("node"), network.join("other")
    other.declare_alive("alive/other")
    seen = _watch(node)
    network.run_for(1.0)
    network.cut(node, noticed=True)
    network.run_for(0.1)
    network.reconnect(node)
    network.run_for(1.0)
    assert seen == [("alive/other", True), ("alive/other", False), ("alive/other", True)]


def test_streams_are_lost_while_a_node_is_cut_off() -> None:
    network = FaultyNetwork()
    speaker, listener = network.join("speaker"), network.join("listener")
    heard: list[Sample] = []
    listener.subscribe("stream", heard.append)
    publisher = speaker.advertise("stream")
    network.cut(listener)
    publisher.put(b"")
    network.run_for(0.5)
    network.reconnect(listener)
    network.run_for(1.0)
    assert heard == []
