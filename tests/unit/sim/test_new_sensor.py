"""One file and one row add a sensor: it is published, watched, corrupted, and listed by `skillwing fault --list`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from imaginary_barometer import ROW, TOPIC, Pressure

from skillwing.onboard.interface.page import TEMPLATE
from skillwing.onboard.topics import common, faults, sensors
from skillwing.onboard.topics.processes import VEHICLE
from skillwing.onboard.topics.rows import stream
from skillwing.services.bus import Answer, Answered, Refused
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.bus.reading import message_reader
from skillwing.services.protocol import ErrorCode, Message, decode, encode
from skillwing.services.wire.channel import Duty
from skillwing.services.wire.template import Meaning
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.node import make_sim
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import make_world


class Scene:
    """A drone on its pad with this barometer, and an operator."""

    def __init__(self) -> None:
        self.network = InProcessNetwork()
        self.network.attach(make_sim({"seed": 4, "sensors": ["barometer"]}))
        self._bus = self.network.bus("operator")
        self.measured: list[Pressure] = []
        self.health: list[sensors.Health] = []
        self._bus.subscribe(TOPIC, message_reader(Pressure, self.measured.append))
        said = message_reader(sensors.Health, self.health.append)
        self._bus.subscribe(sensors.health_key("barometer"), said, events=True)

    def ask(self, key: str, message: Message) -> Answer:
        answers: list[Answer] = []
        self._bus.ask(key, encode(message), answers.append)
        assert self.network.run_until(lambda: bool(answers), 2.0)
        return answers[0]

    def switch(self, kind: str, *, on: bool = True, magnitude: float | None = None) -> Answer:
        return self.ask(faults.FAULT, faults.SetFault(sensor="barometer", kind=kind, on=on, magnitude=magnitude))

    def state(self) -> faults.FaultState:
        answer = self.ask(faults.FAULTS, common.Empty())
        assert isinstance(answer, Answered)
        (found,) = (each for each in decode(answer.payload, faults.Faults).of if each.name == "barometer")
        return found


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    monkeypatch.setitem(SENSORS, "barometer", ROW)
    return Scene()


def test_it_is_published_at_its_rate_and_watched(scene: Scene) -> None:
    scene.network.run_for(2.0)
    assert len(scene.measured) == pytest.approx(40, abs=1)
    values = [each.pressure for each in scene.measured]
    assert np.mean(values) == pytest.approx(101_318.0, abs=3.0)
    assert 1.0 < np.std(values) < 3.0
    assert [each.status for each in scene.health] == [sensors.SensorStatus.OK]


def test_it_is_corrupted_and_notices(scene: Scene) -> None:
    scene.network.run_for(2.0)
    scene.switch("bias", magnitude=50.0)
    scene.network.run_for(0.5)
    assert scene.measured[-1].pressure == pytest.approx(101_818.0, abs=10.0)
    scene.switch("bias", on=False)
    scene.switch("freeze")
    scene.network.run_for(0.5)
    assert scene.health[-1].status is sensors.SensorStatus.FAILED
    assert (scene.health[-1].cause or "").startswith("fault/barometer/freeze@")


def test_it_is_listed_with_its_faults_and_has_their_largest_magnitude(scene: Scene) -> None:
    scene.switch("noise")
    state = scene.state()
    assert state.active == ("noise",)
    assert state.kinds == ("blackout", "freeze", "noise", "bias", "dropout", "slow")
    answer = scene.switch("bias", magnitude=1001.0)
    assert isinstance(answer, Refused)
    assert answer.error.code is ErrorCode.BAD_REQUEST


def test_a_scenario_may_name_it(scene: Scene, tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text('[[fault]]\nsensor = "barometer"\nkind = "blackout"\n', encoding="utf-8")
    assert read_scenario(file).fault[0].sensor == "barometer"
    file.write_text('[[fault]]\nsensor = "barometer"\nkind = "bias"\nmagnitude = 1e5\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"bias has to be from -1,000 to 1,000"):
        read_scenario(file)


def test_the_others_measure_as_they_did(monkeypatch: pytest.MonkeyPatch) -> None:
    world, seen = make_world(4), list[list[bytes]]()
    for extra in ([], ["barometer"]):
        if extra:
            monkeypatch.setitem(SENSORS, "barometer", ROW)
        measured = Simulator(world, sensors=("lidar", "imu", "range", *extra)).advance(0.5).measurements
        seen.append([each.data.tobytes() for each in measured if each.sensor not in extra])
    assert seen[0] == seen[1]


def test_its_topic_needs_no_prose_while_nobody_uses_it() -> None:
    row = stream(TOPIC, Pressure, VEHICLE, (), Duty.TRIALS, rate=20.0)
    assert TEMPLATE.meaning(row) == Meaning("Air pressure at `t` [Pa].", "No effect on the robot.")


def test_a_sensor_that_is_in_no_row_is_refused() -> None:
    with pytest.raises(ValueError, match="there is no sensor 'sextant'; choose one of zed"):
        Simulator(make_world(4), sensors=("sextant",))
