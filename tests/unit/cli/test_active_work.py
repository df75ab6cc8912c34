"""Messages about work that `down` cuts short."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.m600.robot import ROBOT
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.names import RESOURCE_MANAGER
from skillwing.services.processes.run_state import announced, read_run_state
from skillwing.services.protocol import GoalStatus, Keys, MissionPhase, MissionStatus, Record, RecordKind, State, encode
from skillwing.services.terminal.active_work import REAL, SIMULATED, ActiveWork

KEYS = Keys("m600")


class System:
    """A robot on a bus that tells what it does."""

    def __init__(self, *, simulated: bool = True) -> None:
        self.network = InProcessNetwork()
        self.work = ActiveWork(ROBOT.name, ROBOT.load_skillset(), ROBOT.rescue_goal, simulated=simulated)
        self.told: list[str] = []
        self.work.attach(self.network.bus("supervisor"), on_change=lambda: self.told.append(self.work.text))
        self.bus = self.network.bus("robot")

    def tell(self, key: str, message: GoalStatus | MissionStatus | Record) -> str:
        self.bus.advertise(key, events=True).put(encode(message))
        self.network.run_for(0.1)
        return self.work.text

    def flight(self, state: str, t: float) -> str:
        kind = RecordKind.RESOURCE
        record = Record(
            id=f"r#{t}", t=t, source=RESOURCE_MANAGER, kind=kind, subject="flight_status", before=None, after=state
        )
        return self.tell(KEYS.timeline, record)

    def mission(self, phase: str) -> str:
        return self.tell(
            KEYS.mission_status, MissionStatus(mission="patrol", phase=MissionPhase(phase), t=1.0, text="")
        )

    def goto(self, state: State) -> str:
        return self.tell(KEYS.status("goto"), GoalStatus(goal_id="g", skill="goto", state=state, t=2.0))


@pytest.mark.parametrize(("simulated", "fate"), [(True, SIMULATED), (False, REAL)])
def test_a_robot_in_the_air_is_reported_with_what_was_cut_short(simulated: bool, fate: str) -> None:
    system = System(simulated=simulated)
    assert system.work.text == ""
    assert system.mission("RUNNING") == "Cut short: mission patrol."
    assert system.goto(State.RUNNING) == "Cut short: mission patrol, goto."
    assert system.flight("IN_AIR", 3.0) == f"Cut short: mission patrol, goto. m600 was in the air. {fate}"
    assert system.mission("ABORTED") == f"Cut short: goto. m600 was in the air. {fate}"
    assert system.goto(State.TERMINATED) == f"m600 was in the air. {fate}"
    assert system.flight("ON_GROUND", 9.0) == ""
    assert system.flight("IN_AIR", 4.0) == "", "an old word that comes late"


def test_every_change_is_reported_once_and_at_once() -> None:
    system = System()
    for phase in ("RUNNING", "PAUSED", "ABORTED"):
        system.mission(phase)
    system.flight("IN_AIR", 1.0)
    system.goto(State.RUNNING)
    system.goto(State.TERMINATED)
    in_air = f"m600 was in the air. {SIMULATED}"
    assert system.told == ["Cut short: mission patrol.", "", in_air, f"Cut short: goto. {in_air}", in_air]


def test_a_mission_that_was_killed_is_not_cut_short_any_more() -> None:
    system = System()
    alive = system.bus.declare_alive(KEYS.alive("mission"))
    assert system.mission("RUNNING")
    alive.cancel()
    system.network.run_for(0.1)
    assert system.work.text == ""


def test_it_is_known_to_other_commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with announced(ROBOT, "tcp/127.0.0.1:1", tmp_path) as announcement:
        announcement.update((), "Cut short: goto.")
        state = read_run_state("m600")
        assert state is not None
        assert state.active_work == "Cut short: goto."
