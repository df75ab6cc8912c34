"""The emulated radio: what it can do where, and what it carries."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skillwing.onboard.topics.common import Done
from skillwing.onboard.topics.faults import LINK_FAULT, SetLinkFault
from skillwing.onboard.topics.link import LINK_STATUS, LinkStatus
from skillwing.services.bus import Answer, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.options import OptionsError
from skillwing.services.protocol import ErrorCode, decode, encode
from skillwing.sim_mujoco.link.node import make_link
from skillwing.sim_mujoco.link.packet_queue import BURST, CAPACITY, HEADER, LONGEST_WAIT, Packet, PacketQueue
from skillwing.sim_mujoco.link.radio import Conditions, Radio
from skillwing.sim_mujoco.scenario.format import LinkFaultOptions, RadioOptions, RadioZone

OPEN = RadioOptions(bandwidth=4.0, reach=100.0, latency=0.02, loss=0.0)
BALL = RadioZone(center=(50.0, 0.0), radius=10.0, edge=5.0, bandwidth=0.1, latency=0.2, loss=0.3)
places = st.tuples(*[st.floats(-200.0, 200.0)] * 3)


def test_bandwidth_falls_with_the_square_of_the_distance() -> None:
    radio = Radio(OPEN)
    assert radio.at(0.0, (0.0, 0.0, 0.0)).bandwidth == 4e6
    assert radio.at(0.0, (0.0, 100.0, 0.0)).bandwidth == pytest.approx(2e6)
    assert radio.at(0.0, (0.0, 1000.0, 0.0)).bandwidth == pytest.approx(4e4, rel=0.02)


def test_a_zone_holds_inside_and_ends_with_its_edge() -> None:
    radio, clear = Radio(RadioOptions(reach=1e6, zones=(BALL,))), Radio(RadioOptions(reach=1e6))
    within = radio.at(0.0, (45.0, 0.0, 3.0))
    assert within.bandwidth == pytest.approx(0.1e6)
    assert (within.latency, within.loss) == pytest.approx((0.2, 0.3))
    outside = (50.0, 15.1, 0.0)
    assert radio.at(0.0, outside) == clear.at(0.0, outside)


@given(places, places)
def test_nothing_jumps(start: tuple[float, float, float], end: tuple[float, float, float]) -> None:
    """A step of so many metres changes the logarithm of the bandwidth by no more than the zone's slope allows."""
    box = RadioZone(low=(-20.0, -20.0, -5.0), high=(0.0, 0.0, 30.0), edge=4.0, bandwidth=0.0, loss=1.0)
    radio = Radio(RadioOptions(bandwidth=4.0, reach=100.0, zones=(BALL, box)))
    a, b = radio.at(0.0, start), radio.at(0.0, end)
    steepest = 1.5 / 4.0 * math.log(4e6) + 1.0 / 100.0
    assert abs(math.log(a.bandwidth) - math.log(b.bandwidth)) <= steepest * math.dist(start, end) + 1e-6
    assert abs(a.loss - b.loss) <= 1.5 / 4.0 * math.dist(start, end) + 1e-9


@given(places)
def test_zones_never_make_it_better(place: tuple[float, float, float]) -> None:
    good = RadioZone(center=(0.0, 0.0), radius=50.0, bandwidth=1000.0, latency=0.0, loss=0.0)
    with_zone, without = Radio(RadioOptions(loss=0.1, zones=(good,))), Radio(RadioOptions(loss=0.1))
    assert with_zone.at(0.0, place) == without.at(0.0, place)


def test_faults_come_by_the_clock_and_by_hand() -> None:
    fault = LinkFaultOptions(kind="narrow", at=10.0, duration=5.0, magnitude=0.2)
    radio = Radio(RadioOptions(faults=(fault,)))
    here = (0.0, 0.0, 0.0)
    assert [radio.at(t, here).bandwidth for t in (9.9, 10.0, 14.9, 15.0)] == [4e6, 0.2e6, 0.2e6, 4e6]
    radio.switch(16.0, "cut", on=True)
    assert radio.at(16.0, here) == Conditions(0.0, 0.03, 1.0)
    radio.switch(17.0, "cut", on=False)
    assert radio.at(17.0, here).bandwidth == 4e6


def test_a_scheduled_fault_can_be_switched_off_by_hand_and_stays_off() -> None:
    radio = Radio(RadioOptions(faults=(LinkFaultOptions(kind="cut", at=10.0),)))
    here = (0.0, 0.0, 0.0)
    radio.switch(11.0, "cut", on=False)
    assert [radio.faults(t) for t in (11.0, 12.0)] == [(), ()], "it had begun before, though nobody had looked since"
    assert radio.at(12.0, here).bandwidth == 4e6
    radio.switch(13.0, "narrow", on=True, magnitude=0.3)
    assert (radio.faults(13.0), radio.at(14.0, here).bandwidth) == (("narrow",), 0.3e6)


def test_a_scheduled_fault_that_begins_or_ends_counts_for_more_than_what_was_switched_by_hand_before() -> None:
    radio = Radio(RadioOptions(faults=(LinkFaultOptions(kind="narrow", at=10.0, duration=5.0, magnitude=0.2),)))
    here = (0.0, 0.0, 0.0)
    radio.switch(9.0, "narrow", on=True, magnitude=0.1)
    assert [radio.at(t, here).bandwidth for t in (9.0, 10.0, 15.0)] == [0.1e6, 0.2e6, 4e6]


def test_the_word_of_the_link_and_what_it_carries_agree() -> None:
    network = InProcessNetwork()
    network.attach(make_link({"faults": [{"kind": "cut", "at": 0.5}]}))
    bus, told, answers = network.bus("operator"), list[LinkStatus](), list[Any]()
    bus.subscribe(LINK_STATUS, message_reader(LinkStatus, told.append))
    network.run_for(2.0)
    assert told[-1].faults == ("cut",)
    bus.ask(LINK_FAULT, encode(SetLinkFault(kind="cut", on=False)), answers.append)
    network.run_for(2.0)
    assert decode(answers[0].payload, Done).text == "cut of the link is off"
    assert (told[-1].faults, told[-1].loss) == ((), 0.0)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"zones": [{"radius": 3.0}]}, "either `low` and `high`, or `center` and `radius`"),
        ({"zones": [{"center": [0, 0], "radius": -1.0}]}, "zones"),
        ({"faults": [{"kind": "wobbly"}]}, "wobbly"),
        ({"loss": 1.5}, "loss"),
        ({"bandwith": 1.0}, "known are"),
        ({"scenario": "/nowhere.toml"}, "cannot be read"),
    ],
)
def test_options_that_do_not_fit_are_named(options: dict[str, object], sentence: str) -> None:
    with pytest.raises(OptionsError, match=sentence):
        make_link(options)


@pytest.mark.parametrize("name", ["at", "for"])
@pytest.mark.parametrize("seconds", [math.nan, math.inf, -1.0, 1e300])
def test_a_time_at_which_no_fault_can_be_is_named(name: str, seconds: float) -> None:
    with pytest.raises(OptionsError, match=rf"faults\[0\]\.{name}"):
        make_link({"faults": [{"kind": "cut", name: seconds}]})


@pytest.mark.parametrize("magnitude", [math.nan, math.inf, -1.0, 1e300])
def test_a_magnitude_that_no_fault_of_the_link_has_is_refused_by_command(magnitude: float) -> None:
    network = InProcessNetwork()
    network.attach(make_link({}))
    answers = list[Answer]()
    wanted = msgspec.msgpack.encode(SetLinkFault(kind="narrow", magnitude=magnitude))
    network.bus("operator").ask(LINK_FAULT, wanted, answers.append)
    network.run_for(0.1)
    (answer,) = answers
    assert isinstance(answer, Refused)
    assert answer.error.code is ErrorCode.BAD_REQUEST
    assert "$.magnitude" in answer.error.message
    assert answer.error.help


def test_a_scenario_adds_its_section(tmp_path: Path) -> None:
    file = tmp_path / "valley.toml"
    file.write_text("[link]\nbandwidth = 1.0\n[[link.zones]]\ncenter = [0.0, 0.0]\nradius = 5.0\nloss = 0.5\n")
    node = make_link({"scenario": str(file)})
    assert node.conditions == Conditions(1e6, 0.03, 0.5)
    file.write_text("[[link.zones]]\ncentre = [0.0, 0.0]\n")
    with pytest.raises(OptionsError, match=r"link zones 1: .*centre.*known are .*center"):
        make_link({"scenario": str(file)})


def packet(size: int, name: bytes = b"") -> Packet:
    return Packet(bytes(size), name)


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.floats(0.001, 0.3), st.integers(1, 1200)), min_size=1, max_size=80),
    st.floats(2e4, 4e6),
    st.floats(0.0, 0.9),
    st.integers(0, 2**32),
)
def test_packets_arrive_in_order_in_time_and_no_faster_than_the_link(
    traffic: list[tuple[float, int]], bandwidth: float, loss: float, seed: int
) -> None:
    pipe, conditions = PacketQueue(np.random.default_rng(seed)), Conditions(bandwidth, 0.05, loss)
    t, sent_at, names, carried = 0.0, {}, [], 0
    pipe.serve(t, conditions)

    def take() -> None:
        nonlocal carried
        for arrived in pipe.serve(t, conditions):
            names.append(int(arrived.attachment))
            carried += arrived.size
            waited = t - sent_at[int(arrived.attachment)]
            assert waited >= 0.05 - 1e-9
            assert waited <= LONGEST_WAIT + 0.05 + 2 * 0.3 + 1e-6

    for number, (pause, size) in enumerate(traffic):
        t += pause
        take()
        sent_at[number] = t
        pipe.put(t, packet(size, str(number).encode()))
        assert pipe.held <= CAPACITY
    while not pipe.idle:
        t += 0.1
        take()
    assert names == sorted(names)
    assert carried <= BURST + bandwidth * t / 8.0 + 1e-6
    assert len(names) + pipe.dropped + pipe.lost == len(traffic)


def test_what_does_not_fit_is_dropped_at_the_tail_and_old_news_too() -> None:
    pipe, dead = PacketQueue(np.random.default_rng(0)), Conditions(0.0, 0.05, 0.0)
    pipe.serve(0.0, dead)
    size = 1000 + HEADER
    for number in range(100):
        pipe.put(0.0, packet(1000, str(number).encode()))
    assert pipe.dropped == 100 - CAPACITY // size
    pipe.serve(0.0, dead)
    assert pipe.held == (CAPACITY // size - BURST // size) * size
    pipe.serve(LONGEST_WAIT + 0.1, dead)
    assert pipe.held == 0


def test_the_same_seed_loses_the_same_packets() -> None:
    def run(seed: int) -> list[bytes]:
        pipe, arrived = PacketQueue(np.random.default_rng(seed)), []
        for step in range(200):
            pipe.put(step * 0.01, packet(100, str(step).encode()))
            arrived += pipe.serve(step * 0.01, Conditions(1e6, 0.03, 0.2))
        return [p.attachment for p in arrived]

    assert run(3) == run(3) != run(4)
    assert len(run(3)) == pytest.approx(0.8 * 197, abs=25)
