"""Detection of sensor faults: share noticed, delay, and rate of false alarms.

python benchmarks/fault_detection.py [--seeds 6] [--minutes 5] [--missions 20] [--jobs 2] [--write]

For each seed a drone flies rounds over its pad while every kind of fault hits every sensor, in random order and at
random moments. Then it flies for some minutes without faults. The simulator runs alone, because sensors detect their
faults themselves. Since rounds are all alike, the mapping mission is flown without faults as well.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np
from performance_page import machine, table, write_section
from scipy.stats import chi2
from workers import workers

from skillwing.evaluation.flights.conditions import Condition
from skillwing.evaluation.flights.observer import FlightObserver
from skillwing.evaluation.flights.plan import FlightPlan
from skillwing.evaluation.flights.result import End
from skillwing.evaluation.flights.session import in_process
from skillwing.evaluation.judged_flight import LONGEST, processes
from skillwing.m600.robot import ROBOT
from skillwing.onboard.sensor_data.names import GNSS
from skillwing.onboard.topics.sensors import HEALTH, Health, SensorStatus
from skillwing.services.bus import Bus
from skillwing.services.bus.reading import message_reader
from skillwing.sim_mujoco.autopilot.autopilot import Setpoint
from skillwing.sim_mujoco.sensors.faults import KINDS
from skillwing.sim_mujoco.sensors.health import ConditionChange, SensorCondition
from skillwing.sim_mujoco.sensors.table import SENSORS
from skillwing.sim_mujoco.simulator.simulator import Simulator
from skillwing.sim_mujoco.world.world import make_world

PAGE = Path(__file__).parents[1] / "docs" / "sensors.md"
WORLDS = ("courtyard", "street", "village", "industrial")
PAIRS = (("lidar", "range"), ("imu", "gnss"))
TOGETHER = (*((name,) for name in SENSORS if not any(name in pair for pair in PAIRS)), *PAIRS)
"""Sensors fitted together in flights with faults: the LiDAR checks the range-finder."""
STEP = 0.02
HOLD, HOLD_GNSS = 4.0, 3.0
"""Duration of a fault [s]. After a longer time without fixes the autopilot would land."""
PATIENCE = 20.0
"""Longest wait after a fault for the sensor to be trusted again [s]."""
RADIUS, SPEED = 3.5, 2.0
ENOUGH = 20
"""Least number of detections for a 95th percentile of the delay."""
CONFIDENCE = 0.95


@dataclass(slots=True)
class Trial:
    """One fault. noticed: delay after its begin [s]; recovered: time from its end until the sensor is trusted [s]."""

    sensor: str
    kind: str
    noticed: float | None
    reason: str = ""
    recovered: float | None = None


@dataclass(slots=True)
class Flight:
    """Result of one flight: trials, false alarms as sentences, time without faults [s], collisions."""

    trials: list[Trial] = field(default_factory=list)
    alarms: list[str] = field(default_factory=list)
    good: float = 0.0
    collisions: int = 0


class Rounds:
    """A drone that climbs and circles the pad at 3 to 5 m, with its nose swinging about the track."""

    def __init__(self, seed: int, sensors: Collection[str] = SENSORS) -> None:
        world = make_world(seed, WORLDS[seed % len(WORLDS)])
        self.simulator = Simulator(world, wind=(3.0, 1.0, 0.0), turbulence=4.0, sensors=sensors)
        self._angle = 0.0

    @property
    def t(self) -> float:
        return self.simulator.t

    def fly(self, seconds: float) -> Iterator[tuple[str, ConditionChange]]:
        """Fly for some time; yields changes of health."""
        end = self.t + seconds
        while self.t < end - 1e-9:
            self.simulator.command(self._setpoint(self.t))
            yield from self.simulator.advance(self.t + STEP).health

    def _setpoint(self, t: float) -> Setpoint:
        if t < 10.0:
            return Setpoint((0.0, 0.0, min(4.0, 0.8 * max(0.0, t - 1.5))), (0.0, 0.0, 0.0), 0.0)
        grown = min(1.0, (t - 10.0) / 5.0)
        rate = grown * SPEED / RADIUS
        self._angle += rate * STEP
        c, s = math.cos(self._angle), math.sin(self._angle)
        radius = grown * RADIUS
        position = radius * c, radius * s, 4.0 + math.sin(0.2 * t)
        velocity = -radius * rate * s, radius * rate * c, 0.2 * math.cos(0.2 * t)
        return Setpoint(position, velocity, self._angle + math.pi / 2 + math.sin(0.3 * t))


def try_faults(seed: int, fitted: Sequence[str]) -> Flight:
    """Fly with every kind of fault on each fitted sensor, once each."""
    flight, rounds, rng = Flight(), Rounds(seed, fitted), np.random.default_rng((seed, 5))
    for _ in rounds.fly(16.0):
        pass
    cells = [(sensor, kind) for sensor in fitted for kind in KINDS]
    for index in rng.permutation(len(cells)):
        sensor, kind = cells[index]
        watch = list(rounds.fly(rng.uniform(2.0, 4.0)))
        flight.alarms += _false(watch, f"between faults, seed {seed}")
        flight.trials.append(_try(rounds, sensor, kind, flight))
    flight.collisions = rounds.simulator.collisions
    return flight


def _try(rounds: Rounds, sensor: str, kind: str, flight: Flight) -> Trial:
    simulator, trial = rounds.simulator, Trial(sensor, kind, None)
    simulator.set_fault(sensor, kind, on=True)
    begun = rounds.t
    for name, change in rounds.fly(HOLD_GNSS if sensor == GNSS else HOLD):
        if name == sensor and change.condition is SensorCondition.FAILED and trial.noticed is None:
            trial.noticed, trial.reason = change.t - begun, change.reason
        elif name != sensor:
            flight.alarms += _false([(name, change)], f"{kind} of {sensor}")
    simulator.set_fault(sensor, kind, on=False)
    ended = rounds.t
    while simulator.condition(sensor) is not SensorCondition.OK and rounds.t < ended + PATIENCE:
        for _ in rounds.fly(0.1):
            pass
    if trial.noticed is not None and simulator.condition(sensor) is SensorCondition.OK:
        trial.recovered = rounds.t - ended
    return trial


def fly_well(seed: int, minutes: float) -> Flight:
    """Fly without faults, from takeoff on."""
    rounds = Rounds(seed)
    alarms = _false(list(rounds.fly(60.0 * minutes)), f"nothing wrong, seed {seed}")
    return Flight(alarms=alarms, good=60.0 * minutes, collisions=rounds.simulator.collisions)


class Listener(FlightObserver):
    """An observer that also receives the health of the sensors."""

    def __init__(self, seed: int) -> None:
        super().__init__(ROBOT.skillset.stem, make_world(seed).terrain)
        self.alarms: list[str] = []
        self._seed = seed

    def attach(self, bus: Bus) -> None:
        super().attach(bus)
        bus.subscribe(f"{HEALTH}/*", message_reader(Health, self._on_health), events=True)

    def _on_health(self, health: Health) -> None:
        if health.status is SensorStatus.FAILED:
            self.alarms.append(_alarm(health.sensor, health.t, f"mission, seed {self._seed}", health.reason))


def fly_mission(seed: int) -> Flight:
    """Fly the mapping mission without faults, as a campaign does."""
    plan = FlightPlan(mission="mapping", world="courtyard", seed=seed, condition=Condition.NONE)
    listener = Listener(seed)
    course = in_process(listener, processes(plan, plan.robot_options()), LONGEST)
    if course.end is End.BROKE_OFF:
        raise RuntimeError(f"the flight of seed {seed} broke off: {course.error}")
    return Flight(alarms=listener.alarms, good=course.end_time, collisions=listener.collisions)


def _false(changes: Sequence[tuple[str, ConditionChange]], when: str) -> list[str]:
    return [
        _alarm(name, change.t, when, change.reason)
        for name, change in changes
        if change.condition is SensorCondition.FAILED
    ]


def _alarm(sensor: str, t: float, when: str, reason: str) -> str:
    return f"{sensor} at {t:.1f} s ({when}): {reason}"


def page_section(tried: Sequence[Flight], rounds: Sequence[Flight], missions: Sequence[Flight], seeds: int) -> str:
    """Figures as Markdown: flights with faults, and both kinds of flights without."""
    trials = [trial for flight in tried for trial in flight.trials]
    rows = []
    for sensor in SENSORS:
        for kind in KINDS:
            own = [trial for trial in trials if (trial.sensor, trial.kind) == (sensor, kind)]
            rows.append([sensor, kind, *_cells(own)])
    heads = ("sensor", "fault", "noticed", "p50 [s]", "p95 [s]", "worst [s]", "trusted again after [s]")
    flights = [*tried, *rounds, *missions]
    lines = [
        table(heads, rows),
        "",
        table(
            ("false alarms", "flown, min", "seen", "an hour", f"an hour at most, {100 * CONFIDENCE:.0f} % sure"),
            [
                ("on rounds with nothing wrong", *_alarms(rounds)),
                (f"on {len(missions)} mapping missions with nothing wrong", *_alarms(missions)),
            ],
        ),
        "",
        f"While something else was wrong or just had been: {sum(len(flight.alarms) for flight in tried)}.",
        *[f"- {alarm}" for alarm in [alarm for flight in flights for alarm in flight.alarms][:12]],
        "",
        f"Seeds 0 to {seeds - 1}, worlds {', '.join(WORLDS)} in turn; always on a circle of {RADIUS:g} m about the "
        f"pad. Faults have their usual magnitude for {HOLD:g} s ({HOLD_GNSS:g} s for gnss); missions in the "
        f"courtyards from seed 0 on; {sum(flight.collisions for flight in flights)} collisions. {machine()}.",
    ]
    return "\n".join(lines)


def _alarms(flights: Sequence[Flight]) -> tuple[str, ...]:
    """Cells on false alarms: time, number, rate, and the exact upper limit of the rate for a Poisson process."""
    hours, seen = sum(flight.good for flight in flights) / 3600.0, sum(len(flight.alarms) for flight in flights)
    if not hours:
        return "0", "-", "-", "-"
    most = float(chi2.ppf(CONFIDENCE, 2 * (seen + 1))) / (2.0 * hours)
    return f"{60.0 * hours:.0f}", str(seen), f"{seen / hours:.1f}", f"{most:.1f}"


def _cells(trials: Sequence[Trial]) -> tuple[str, ...]:
    times = sorted(trial.noticed for trial in trials if trial.noticed is not None)
    share = f"{len(times)} of {len(trials)}"
    if not times:
        return share, "", "", "", ""
    back = [trial.recovered for trial in trials if trial.recovered is not None]
    again = f"{median(back):.1f}" if len(back) == len(times) else f"{len(back)} of {len(times)}"
    p95 = f"{np.quantile(times, 0.95):.2f}" if len(times) >= ENOUGH else ""
    return share, f"{median(times):.2f}", p95, f"{times[-1]:.2f}", again


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--seeds", type=int, default=6)
    options.add_argument("--minutes", type=float, default=5.0, help="of flight with nothing wrong, for each seed")
    options.add_argument("--missions", type=int, default=20, help="mapping missions with nothing wrong")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--write", action="store_true", help="put the figures into docs/sensors.md")
    wanted = options.parse_args()
    seeds = range(wanted.seeds)
    with workers(wanted.jobs) as pool:
        tried = [pool.submit(try_faults, seed, fitted) for seed in seeds for fitted in TOGETHER]
        flown = [pool.submit(fly_well, seed, wanted.minutes) for seed in seeds]
        missions = [pool.submit(fly_mission, seed) for seed in range(wanted.missions)]
        with_faults, rounds, missions = (
            [future.result() for future in futures] for futures in (tried, flown, missions)
        )
    section = page_section(with_faults, rounds, missions, wanted.seeds)
    write_section("fault_detection.py", "How soon faults are noticed", section, write=wanted.write, file=PAGE)


if __name__ == "__main__":
    main()
