"""Properties of the in-process network: virtual time, order, reproducibility."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skillwing.services.bus import Answer, Bus, NoReply, Sample
from skillwing.services.bus.inprocess import InProcessNetwork


def test_time_moves_only_with_events() -> None:
    network = InProcessNetwork()
    seen: list[float] = []
    bus = network.bus("a")
    bus.every(0.25, lambda: seen.append(bus.now()))
    network.run_for(1.0)
    assert seen == [0.25, 0.5, 0.75, 1.0]
    assert network.now() == 1.0


def test_what_is_due_at_the_same_time_runs_in_the_order_it_was_asked_for() -> None:
    network = InProcessNetwork()
    bus, order = network.bus("a"), list[int]()
    for number in range(5):
        bus.after(1.0, lambda number=number: order.append(number))
    network.run_for(1.0)
    assert order == [0, 1, 2, 3, 4]


def test_messages_take_their_latency() -> None:
    network = InProcessNetwork(latency=0.01)
    a, b = network.bus("a"), network.bus("b")
    arrivals: list[float] = []
    b.subscribe("x", lambda _: arrivals.append(b.now()))
    a.after(1.0, lambda: a.advertise("x").put(b""))
    network.run_for(2.0)
    assert arrivals == [1.01]


def test_an_exception_in_a_callback_reaches_the_test() -> None:
    network = InProcessNetwork()

    def fail() -> None:
        raise ZeroDivisionError

    network.bus("a").post(fail)
    with pytest.raises(ZeroDivisionError):
        network.run_for(1.0)


def test_waiting_in_a_callback_is_refused() -> None:
    network = InProcessNetwork()
    bus = network.bus("a")

    def wait() -> None:
        bus.run_until(lambda: True)

    bus.post(wait)
    with pytest.raises(RuntimeError, match="must not wait"):
        network.run_for(1.0)


def test_without_a_timeout_the_run_ends_when_nothing_can_happen_any_more() -> None:
    network = InProcessNetwork()
    network.bus("a").after(3.0, lambda: None)
    assert not network.run_until(lambda: False)
    assert network.now() == 3.0


def test_names_are_unique_in_a_robot_until_the_bus_is_closed() -> None:
    network = InProcessNetwork()
    bus = network.bus("a")
    network.bus("a", robot="r2")
    with pytest.raises(ValueError, match="already has a node `a`"):
        network.bus("a")
    bus.close()
    network.bus("a")


def test_a_query_on_its_way_to_a_node_that_dies_is_unanswered_at_once() -> None:
    network = InProcessNetwork()
    a, b = network.bus("a"), network.bus("b")
    answers: list[Answer] = []
    b.serve("x", lambda _: b.close())
    a.ask("x", b"", answers.append, timeout=60.0)
    assert network.run_until(lambda: bool(answers), 1.0)
    assert answers == [NoReply(timed_out=False)]


def _gossip(seed: int) -> list[tuple[float, str, bytes]]:
    """Three nodes that pass a few numbers around; returns everything that anyone heard."""
    network = InProcessNetwork(seed, jitter=0.01)
    heard: list[tuple[float, str, bytes]] = []
    for name in ("a", "b", "c"):
        bus = network.bus(name)
        publisher = bus.advertise(f"from/{name}")

        def on_sample(sample: Sample, bus: Bus = bus) -> None:
            heard.append((bus.now(), f"{sample.key} at {bus.name}", sample.payload))

        bus.subscribe("from/*", on_sample)
        numbers = iter(range(1000))
        bus.every(0.005, lambda p=publisher, n=numbers: p.put(str(next(n)).encode()))
    network.run_for(0.2)
    return heard


@given(st.integers(0, 2**32))
def test_the_same_seed_gives_the_same_run_and_links_keep_their_order(seed: int) -> None:
    heard = _gossip(seed)
    assert heard == _gossip(seed)
    for link in {link for _, link, _ in heard}:
        numbers = [int(payload) for _, other, payload in heard if other == link]
        assert numbers == list(range(len(numbers)))


def test_different_seeds_give_different_orders() -> None:
    assert len({tuple(link for _, link, _ in _gossip(seed)) for seed in range(5)}) > 1
