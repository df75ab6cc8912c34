"""A drone that only exists as positions: hooks for every skill of the m600, without any physics.

It flies straight lines at the requested speed, brakes at once, and needs half a second to come to rest. It stops before
poles, and a test can break its sensors and link. All else is real: managers, protocol, interface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from skillwing.dsl.model import Skillset
from skillwing.services.bus import Answer, Answered, Bus, Node
from skillwing.services.managers.skill_manager import Goal, SkillHooks, SkillManagerNode
from skillwing.services.protocol import DataSample, FireExtern, Keys, RecordKind, Terminal, encode
from skillwing.services.timeline import Timeline

PERIOD = 0.1
REST_AFTER = 0.5
STOP_BEFORE = 2.0
LOWEST_HOVER = 0.2
TUBE = 1.3
PIECES = 24
"""Straight lines in a lap round a building."""
LEAST_BANDWIDTH = 0.5
"""Bandwidth that a video needs [Mbit/s]; the video ends after `VIDEO_PATIENCE` seconds with less."""
VIDEO_PATIENCE = 4.0
VIDEO_LOOK = 0.25
Position = tuple[float, float, float]


@dataclass
class Motion:
    goal_id: str
    target: Position
    speed: float
    ended: Callable[[str, float], None]
    """Callback with `ARRIVED` or `BLOCKED`, and the free distance ahead [m]."""


class ToyDrone:
    """Drone that moves, publishes its position and heading, and reports the states of its extern resources."""

    name = "toy_drone"
    owns_clock = False

    def __init__(self, skillset: Skillset, poles: tuple[tuple[float, float], ...] = ()) -> None:
        self.position: Position = (0.0, 0.0, 0.0)
        self.heading = 0.0
        self.poles = poles
        self.nearest_pole = math.inf
        self.bandwidth = 8.0
        self.laps = 0.0
        """Laps flown round buildings so far."""
        self.truth = {
            "SDK_authority": "AVAILABLE",
            "homepoint_status": "VALID",
            "flight_status": "ON_GROUND",
            "zed_status": "OK",
            "lidar_status": "OK",
            "battery_status": "NORMAL",
            "link_status": "GOOD",
        }
        self._keys = Keys(skillset.name)
        self._told: dict[str, str] = {}
        self._motion: Motion | None = None
        self._frozen: set[str] = set()

    def attach(self, bus: Bus) -> None:
        self.bus = bus
        self._timeline = Timeline(bus, self._keys)
        self._outputs = {
            name: bus.advertise(self._keys.data(name)) for name in ("position", "heading", "link_bandwidth")
        }
        bus.every(PERIOD, self._step)

    def detach(self) -> None:
        pass

    def set(self, resource: str, state: str) -> None:
        """Change a state of the drone, and report it to the resource manager at once."""
        self.truth[resource] = state
        self._tell()

    def freeze(self, skill: str) -> None:
        """Keep `skill` from confirming any stop from now on."""
        self._frozen.add(skill)

    def confirms(self, skill: str) -> bool:
        return skill not in self._frozen

    def fly(self, motion: Motion) -> None:
        self._motion = motion

    def stop(self, goal_id: str, at_rest: Callable[[], None] = lambda: None) -> None:
        """End the motion of a goal, and call `at_rest` once the drone stands."""
        if self._motion is not None and self._motion.goal_id == goal_id:
            self._motion = None
        self.bus.after(REST_AFTER, at_rest)

    def _step(self) -> None:
        self._tell()
        if self._motion is not None:
            self._advance(self._motion)
        elif self.position[2] < LOWEST_HOVER:
            self.position = (*self.position[:2], 0.0)
        in_air = "IN_AIR" if self.position[2] >= LOWEST_HOVER else "ON_GROUND"
        if self.truth["flight_status"] != in_air:
            self.set("flight_status", in_air)
        x, y, z = self.position
        self._publish("position", {"x": x, "y": y, "z": z})
        self._publish("heading", self.heading)
        self._publish("link_bandwidth", self.bandwidth)
        self.nearest_pole = min([self.nearest_pole, *(math.dist((x, y), pole) for pole in self.poles)])

    def _advance(self, motion: Motion) -> None:
        length = math.dist(self.position, motion.target)
        free = self._free_distance(motion.target)
        if free <= STOP_BEFORE:
            self._motion = None
            motion.ended("BLOCKED", free)
        elif length <= motion.speed * PERIOD:
            self.position, self._motion = motion.target, None
            motion.ended("ARRIVED", 1000.0)
        else:
            share = motion.speed * PERIOD / length
            x, y, z = (a + share * (b - a) for a, b in zip(self.position, motion.target, strict=True))
            self.position = (x, y, z)

    def _free_distance(self, target: Position) -> float:
        """Distance along the ground plan to the first pole in the way."""
        (x, y), length = self.position[:2], math.dist(self.position[:2], target[:2])
        if length < 1e-6:
            return math.inf
        east, north = (target[0] - x) / length, (target[1] - y) / length
        tracks = [
            (px - x) * east + (py - y) * north
            for px, py in self.poles
            if abs((px - x) * north - (py - y) * east) < TUBE
        ]
        return min((track for track in tracks if 0.0 < track < length + STOP_BEFORE), default=math.inf)

    def note(self, subject: str, state: str, goal_id: str) -> str:
        """Record what the drone has observed, and return the id of the record."""
        return self._timeline.record(RecordKind.HEALTH, subject, None, state, goal_id=goal_id)

    def _publish(self, name: str, value: Any) -> None:
        self._outputs[name].put(encode(DataSample(name=name, value=value, t=self.bus.now())))

    def _tell(self) -> None:
        """Fire every extern transition that the resource manager has not acknowledged yet."""
        for resource, state in self.truth.items():
            if self._told.get(resource) != state:
                self._told[resource] = state
                request = FireExtern(resource=resource, target=state, source=self.name)

                def answered(answer: Answer, resource: str = resource) -> None:
                    if not isinstance(answer, Answered):
                        self._told.pop(resource, None)

                self.bus.ask(self._keys.resource_extern, encode(request), answered)


class ToySkill(SkillHooks[Any, Any, Any]):
    """Skill that runs until it is interrupted, and needs a moment to stop."""

    def __init__(self, skill: str, drone: ToyDrone) -> None:
        self.skill = skill
        self.drone = drone

    def on_interrupt(self, goal: Goal[Any]) -> None:
        if self.drone.confirms(self.skill):
            self.drone.stop(goal.id, at_rest=lambda: self.interrupted(goal.id))

    def on_ended(self, goal: Goal[Any], terminal: Terminal) -> None:
        self.drone.stop(goal.id)


class ToyMotion(ToySkill):
    """Skill that flies to its `target`, and ends with one of two results."""

    def __init__(
        self, skill: str, drone: ToyDrone, target: Callable[[dict[str, Any]], Position], arrived: str = "ARRIVED"
    ) -> None:
        super().__init__(skill, drone)
        self._target = target
        self._arrived = arrived
        self._has_output = skill in ("goto", "goto_straight")

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        def ended(result: str, free: float) -> None:
            x, y, z = self.drone.position
            output = {"stopped_at": {"x": x, "y": y, "z": z}, "obstacle_distance": free} if self._has_output else None
            self.terminated(goal.id, self._arrived if result == "ARRIVED" else result, output)

        self.drone.fly(Motion(goal.id, self._target(goal.inputs), float(goal.inputs["speed"]), ended))


class ToyInspect(ToySkill):
    """Skill that circles a building, from the nearest point of the circle on."""

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        center, (x, y, _) = goal.inputs["center"], self.drone.position
        self._start = math.atan2(y - center["y"], x - center["x"])
        self._flown = 0
        self._fly_on(goal)

    def progress(self, goal: Goal[dict[str, Any]]) -> dict[str, float]:
        return {"laps_done": self._flown / PIECES}

    def _fly_on(self, goal: Goal[dict[str, Any]]) -> None:
        center, radius = goal.inputs["center"], goal.inputs["radius"]
        angle = self._start + 2.0 * math.pi * self._flown / PIECES
        x, y = center["x"] + radius * math.cos(angle), center["y"] + radius * math.sin(angle)

        def ended(result: str, free: float) -> None:
            if self._flown >= goal.inputs["laps"] * PIECES:
                self.terminated(goal.id, "COMPLETED")
                return
            self._flown += 1
            self.drone.laps += 1.0 / PIECES
            self._fly_on(goal)

        self.drone.fly(Motion(goal.id, (x, y, goal.inputs["height"]), float(goal.inputs["speed"]), ended))


class ToyStream(ToySkill):
    """Skill that ends when the link has been too narrow for `VIDEO_PATIENCE` seconds."""

    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self._look(goal, self.drone.bus.now())

    def _look(self, goal: Goal[dict[str, Any]], good_at: float) -> None:
        if self.current is None or self.current.id != goal.id:
            return
        now = self.drone.bus.now()
        good_at = now if self.drone.bandwidth >= LEAST_BANDWIDTH else good_at
        if now - good_at > VIDEO_PATIENCE:
            self.terminated(goal.id, "FPS_LOST", cause=self.drone.note("video", "BAD", goal.id))
        else:
            self.drone.bus.after(VIDEO_LOOK, lambda: self._look(goal, good_at))


class ToyTurn(ToySkill):
    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        def aligned() -> None:
            self.drone.heading = goal.inputs["heading"]
            self.terminated(goal.id, "ALIGNED")

        self.drone.bus.after(1.0, aligned)


class ToyHover(ToySkill):
    def on_dispatch(self, goal: Goal[dict[str, Any]]) -> None:
        self.drone.bus.after(goal.inputs["duration"], lambda: self.terminated(goal.id, "DONE"))


def skill_hooks(drone: ToyDrone) -> Iterator[ToySkill]:
    def above(z: Callable[[dict[str, Any]], float]) -> Callable[[dict[str, Any]], Position]:
        return lambda inputs: (drone.position[0], drone.position[1], z(inputs))

    def target(inputs: dict[str, Any]) -> Position:
        return inputs["target"]["x"], inputs["target"]["y"], inputs["target"]["z"]

    yield ToyMotion("takeoff", drone, above(lambda inputs: inputs["height"]), "AT_ALTITUDE")
    yield ToyMotion("land", drone, above(lambda _: 0.0), "LANDED")
    yield ToyMotion("goto", drone, target)
    yield ToyMotion("goto_straight", drone, target)

    def home(inputs: dict[str, Any]) -> Position:
        is_over_home = math.hypot(*drone.position[:2]) < 1.0
        return 0.0, 0.0, drone.position[2] if is_over_home else inputs["height"]

    yield ToyMotion("return_home", drone, home)
    yield ToyTurn("rotate_head", drone)
    yield ToyHover("hover", drone)
    yield ToyInspect("inspect", drone)
    yield ToyStream("stream", drone)
    for skill in ("lock_head", "zed_depthmap", "lidar_depthmap", "lidar_mapping"):
        yield ToySkill(skill, drone)


def make_toy_drone(skillset: Skillset, drone: ToyDrone) -> list[Node]:
    """The drone and a manager for each of its skills."""
    return [drone, *(SkillManagerNode(hooks, skillset) for hooks in skill_hooks(drone))]
