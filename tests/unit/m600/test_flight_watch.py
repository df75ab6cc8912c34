"""Process exits that end a flight, and those that do not."""

from __future__ import annotations

import io
from dataclasses import replace
from signal import SIGKILL

import pytest
from rich.console import Console

from skillwing.evaluation.demo.flight_deck import FlightDeck
from skillwing.evaluation.demo.flight_watch import RETURN, SILENCE, STALL, FlightWatch
from skillwing.m600.robot import ROBOT
from skillwing.services.bus import Bus
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.processes.launcher import ProcessExit
from skillwing.services.protocol import Keys, MissionPhase, MissionStatus, encode

SKILLSET = ROBOT.load_skillset()
KEYS = Keys(SKILLSET.name)
ESSENTIAL = frozenset({"router", "sim", "mission"})
END = 60.0
"""End time of the mission in these flights."""


def death(process: str) -> ProcessExit:
    return ProcessExit(process, 1, None, SIGKILL, ())


class Flight:
    """Three processes that live, a mission that ends after a minute, and a watch whose wall clock is robot time."""

    def __init__(self) -> None:
        self.network = InProcessNetwork()
        self.exits: list[ProcessExit] = []
        self.console = Console(file=io.StringIO(), width=200)
        self.processes: dict[str, Bus] = {}
        for name in ("sim", "mission", "recorder"):
            self.appear(name)
        self.bus = self.network.bus("demo")
        deck = FlightDeck(self.bus, SKILLSET, self.console, "a flight")
        self.watch = FlightWatch(self.bus, KEYS, deck, self.exits, ESSENTIAL, wall=self.network.now)
        status = self.network.bus("teller").advertise(KEYS.mission_status, events=True)
        over = MissionStatus(mission="mapping", phase=MissionPhase.SUCCEEDED, t=END, text="done")
        self.bus.after(END, lambda: status.put(encode(over)))

    def appear(self, name: str) -> None:
        self.processes[name] = self.network.bus(name)
        self.processes[name].declare_alive(KEYS.alive(name))

    def vanish(self, name: str) -> None:
        self.processes.pop(name).close()

    def printed(self) -> list[str]:
        assert isinstance(self.console.file, io.StringIO)
        return [line.partition(" s  ")[2] for line in self.console.file.getvalue().splitlines()]


def test_the_mission_ends_its_flight() -> None:
    flight = Flight()
    assert flight.watch.follow() == ""
    assert flight.network.now() == pytest.approx(END, abs=1.0)
    assert flight.printed() == []


@pytest.mark.parametrize("process", sorted(ESSENTIAL))
def test_the_death_of_what_it_needs_ends_a_flight_at_once(process: str) -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.exits.append(death(process)))
    assert flight.watch.follow() == f"{process} was killed by SIGKILL."
    assert flight.network.now() == pytest.approx(10.0, abs=1.0)
    assert flight.printed() == [f"{process} was killed by SIGKILL. The flight ends here."]


def test_without_the_rest_a_flight_goes_on_and_says_so_once() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.exits.append(death("recorder")))
    flight.bus.after(10.1, lambda: flight.vanish("recorder"))
    assert flight.watch.follow() == ""
    assert flight.printed() == ["recorder was killed by SIGKILL. The mission goes on as it can."]


def test_what_is_started_again_ends_no_flight() -> None:
    flight = Flight()
    returning = replace(death("sim"), pause=0.2, outlook="It is started again in 0.2 s.")
    flight.bus.after(10.0, lambda: flight.exits.append(returning))
    flight.bus.after(10.0, lambda: flight.vanish("sim"))
    flight.bus.after(10.0 + RETURN / 2, lambda: flight.appear("sim"))
    assert flight.watch.follow() == ""
    assert flight.printed() == [f"{returning} {returning.outlook} The mission goes on as it can."]


def test_what_does_not_come_back_ends_the_flight_that_needs_it() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.exits.append(replace(death("sim"), pause=0.2)))
    flight.bus.after(10.0, lambda: flight.vanish("sim"))
    assert flight.watch.follow() == "sim does not answer any more."
    assert flight.network.now() == pytest.approx(10.0 + RETURN, abs=1.0)


def test_what_is_given_up_in_the_end_ends_the_flight() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.exits.append(replace(death("sim"), pause=0.2)))
    flight.bus.after(11.0, lambda: flight.exits.append(death("sim")))
    assert flight.watch.follow() == "sim was killed by SIGKILL."
    assert flight.network.now() == pytest.approx(11.0, abs=1.0)


def test_a_process_that_hangs_ends_the_flight_that_needs_it() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.vanish("recorder"))
    flight.bus.after(20.0, lambda: flight.vanish("sim"))
    assert flight.watch.follow() == "sim does not answer any more."
    assert flight.network.now() == pytest.approx(20.0 + SILENCE, abs=1.0)
    assert flight.printed()[0] == "recorder does not answer any more. The mission goes on as it can."


def test_a_process_that_was_cut_off_for_a_moment_is_forgiven() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: flight.vanish("sim"))
    flight.bus.after(10.0 + SILENCE / 2, lambda: flight.appear("sim"))
    assert flight.watch.follow() == ""


def test_when_nobody_answers_it_is_the_router() -> None:
    flight = Flight()
    flight.bus.after(10.0, lambda: [flight.vanish(name) for name in list(flight.processes)])
    assert "router must have stopped" in flight.watch.follow()


def test_a_flight_whose_time_stands_still_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = Flight()
    monkeypatch.setattr(flight.bus, "now", lambda: 1.0)
    assert flight.watch.follow() == f"Robot time has stood still for {STALL:g} s."
    assert flight.network.now() == pytest.approx(STALL, abs=1.0)
