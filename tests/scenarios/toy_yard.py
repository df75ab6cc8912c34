"""Toy robots that share the places of `examples/yard`, in virtual time: the ground truth of who is where."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import Any, ClassVar

import pytest
from py_trees.behaviour import Behaviour

from skillwing.bt_missions.leaves.conditions import DataCompare
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import Mission, MissionTrees
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.bt_missions.subtrees.composites import first_that_works, in_order
from skillwing.bt_missions.subtrees.lease import WithLease
from skillwing.dsl import parse
from skillwing.services.bus import Bus, Handle, Node
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.client.interface import SkillsetInterface
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.hooks import Goal, SkillHooks
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.names import RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import DataSample, Keys, Terminal, encode
from skillwing.services.robot import Robot, find_robot

FOLDER = Path(__file__).parents[2] / "examples" / "yard"
with pytest.MonkeyPatch.context() as patch:
    # The path is restored: other tests make robots with the names of folders beside this one.
    patch.setattr(sys, "path", list(sys.path))
    patch.setenv("PYTHONPATH", "")
    TABLE: Robot = find_robot(str(FOLDER))
    holds, places, watch = (import_module(f"yard.{name}") for name in ("holds", "places", "watch"))
    SITE = import_module("yard.robot")
YARD = TABLE.load_skillset()
SHUTTLE = parse(
    """
    skillset shuttle {
        type Position { x: float64 [m]  y: float64 [m] }
        data { position: Position period=0.1 }
        resource wheels { initial FREE  FREE -> USED  USED -> FREE }
        skill go {
            input { x: float64 [m]  y: float64 [m] }
            effect { take: wheels -> USED  give: wheels -> FREE }
            precondition { free: resource=(wheels == FREE)  success take }
            result { success THERE: apply=give }
            interrupt { apply=give }
        }
    }
    """,
    "shuttle.skillset",
)
SPEED = 2.0
"""Speed of a robot in m/s."""
COASTING = 0.3
"""Seconds for which a robot goes on after it was told to stop."""
STEP = 0.05
COMMANDED = 0.4
"""Seconds after which a robot stops whose manager is dead."""
ROBOTS = ("left", "right", "third")
HOMES = {"left": (20.0, 8.0), "right": (20.0, -8.0), "third": (20.0, 0.0)}
GATE, PAD = (8.5, 0.0), (0.0, 0.0)


class Body:
    """A robot on the ground plane. It goes to its target in a straight line, and coasts when it is told to stop."""

    def __init__(self, x: float, y: float) -> None:
        self.x, self.y = x, y
        self._target: tuple[float, float] | None = None
        self._commanded_at = 0.0
        self._stops_at = math.inf

    def go(self, x: float, y: float, t: float) -> None:
        self._target, self._commanded_at, self._stops_at = (x, y), t, math.inf

    def keep(self, t: float) -> None:
        self._commanded_at = t

    def stop(self, t: float) -> None:
        self._stops_at = min(self._stops_at, t + COASTING)

    @property
    def moves(self) -> bool:
        return self._target is not None

    def step(self, t: float) -> None:
        if self._target is None:
            return
        if t - self._commanded_at > COMMANDED:
            self.stop(t)
        dx, dy = self._target[0] - self.x, self._target[1] - self.y
        far, way = math.hypot(dx, dy), SPEED * STEP
        if far <= way:
            self.x, self.y = self._target
        else:
            self.x, self.y = self.x + dx / far * way, self.y + dy / far * way
        if far <= way or t >= self._stops_at:
            self._target = None


class GoHooks(SkillHooks[Any, Any, Any]):
    """Manager of `go`, for one body."""

    skill: ClassVar[str] = "go"

    def __init__(self, body: Body) -> None:
        self._body = body
        self._timer: Handle | None = None

    def on_dispatch(self, goal: Goal[Any]) -> None:
        self._body.go(goal.inputs["x"], goal.inputs["y"], self.bus.now())
        self._timer = self.bus.every(0.1, lambda: self._look(goal.id))

    def _look(self, goal_id: str) -> None:
        self._body.keep(self.bus.now())
        if not self._body.moves:
            self.terminated(goal_id, "THERE")

    def on_interrupt(self, goal: Goal[Any]) -> None:
        self._body.stop(self.bus.now())
        self.bus.after(COASTING + STEP, lambda: self.interrupted(goal.id))

    def on_ended(self, goal: Goal[Any], terminal: Terminal) -> None:
        self._body.stop(self.bus.now())
        if self._timer is not None:
            self._timer.cancel()


class Vehicle:
    """The node of a body: it moves, and publishes its position."""

    name = "vehicle"
    owns_clock = False

    def __init__(self, body: Body) -> None:
        self._body = body

    def attach(self, bus: Bus) -> None:
        out = bus.advertise(Keys(SHUTTLE.name).data("position"))
        bus.every(STEP, lambda: self._body.step(bus.now()))

        def publish() -> None:
            value = {"x": self._body.x, "y": self._body.y}
            out.put(encode(DataSample(name="position", value=value, t=bus.now())))

        bus.every(0.1, publish)

    def detach(self) -> None:
        pass


class Visit(Mission):
    """Takes the pad, then the corridor, goes to the pad through the corridor, and back in the same way.

    patience: for each lease, in seconds. swapped: takes the corridor first, against the order of places.
    """

    name = "visit"
    summary = "Visit the pad."
    robots = ("me", "yard")

    def __init__(self, robot: str, patience: float, *, swapped: bool = False) -> None:
        self.robot = robot
        self._patience = patience
        self._swapped = swapped

    def build(self, context: MissionContext, options: Any) -> MissionTrees:
        def go(name: str, at: tuple[float, float]) -> Behaviour:
            return SkillAction(name, context, "go", {"x": at[0], "y": at[1]}, robot="me")

        def within(name: str, place: str, body: Behaviour, *inside: str) -> Behaviour:
            lease = SkillAction(f"hold {place} {name}", context, f"hold_{place}", {"holder": self.robot}, robot="yard")
            seen = [
                DataCompare(f"in {each}?", context, f"{each}_robot", "==", self.robot, robot="yard")
                for each in (place, *inside)
            ]
            return WithLease(name, context, lease, body, first_that_works("seen?", *seen), patience=self._patience)

        through = in_order("to the pad", go("to the gate", GATE), go("to the pad", PAD))
        back = in_order("back", go("to the gate again", GATE), go("home", HOMES[self.robot]))
        if self._swapped:
            rounds = within("in", "corridor", within("stay", "pad", in_order("all", through, back)))
        else:
            # On its way in a robot has the lease of the pad as well, and may go on there.
            to_the_pad = within("stay", "pad", within("in", "corridor", through, "pad"))
            rounds = in_order("all", to_the_pad, within("out", "corridor", back))
        return MissionTrees(rounds)


class ToyYard:
    """Robots and the yard on one network. `met` has the pairs of robots that were in one place at the same time."""

    def __init__(self, robots: int = 2, *, seed: int = 0, jitter: float = 0.0) -> None:
        self.network = InProcessNetwork(seed=seed, jitter=jitter)
        self.robots = ROBOTS[:robots]
        self.bodies = {robot: Body(*HOMES[robot]) for robot in self.robots}
        self.met: list[tuple[str, str, str]] = []
        self.missions: dict[str, MissionNode] = {}
        self._places = places.read_places(SITE.PLACES)
        self._journal = Journal(None, Identity("", YARD.name, YARD.schema_hash))
        self._running: dict[tuple[str, str], Bus] = {}
        self._makers: dict[tuple[str, str], Callable[[], Node]] = {
            ("yard", RESOURCE_MANAGER): lambda: ResourceManagerNode(YARD, journal=self._journal),
            ("yard", "data_manager"): lambda: DataManagerNode(YARD),
            ("yard", "places"): self._make_watch,
        }
        for kind in (holds.HoldPad, holds.HoldCorridor, holds.HoldWay, holds.HoldCharger):
            make = lambda kind=kind: SkillManagerNode(kind(), YARD)  # noqa: E731
            self._makers["yard", skill_process(kind.skill)] = make
        for robot, body in self.bodies.items():
            self._makers |= {
                (robot, RESOURCE_MANAGER): lambda: ResourceManagerNode(SHUTTLE),
                (robot, "data_manager"): lambda: DataManagerNode(SHUTTLE),
                (robot, skill_process("go")): lambda body=body: SkillManagerNode(GoHooks(body), SHUTTLE),
                (robot, "vehicle"): lambda body=body: Vehicle(body),
            }
        for key in self._makers:
            self.start(*key)
        self.client = SkillsetInterface(self.network.bus("client", "yard"), YARD, client="client")
        self.network.bus("judge").every(STEP, self._judge)

    def _make_watch(self) -> Node:
        robots = dict.fromkeys(self.robots, SHUTTLE.name)
        return watch.PlacesNode(SITE.SKILLSET, self._places, robots)

    def start(self, robot: str, process: str) -> None:
        """Start a process that does not run."""
        if (robot, process) not in self._running:
            self._running[robot, process] = self.network.attach(self._makers[robot, process](), robot)

    def kill(self, robot: str, process: str) -> None:
        """Kill a process that runs, as by kill -9."""
        if (robot, process) in self._running:
            self._running.pop((robot, process)).close()

    def forget(self) -> None:
        """Lose the journal of the yard's resource manager: its next process begins without one."""
        self._journal = Journal(None, Identity("", YARD.name, YARD.schema_hash))

    def fly(self, robot: str, patience: float = 60.0, *, swapped: bool = False) -> None:
        """Start the mission of a robot."""
        mission = Visit(robot, patience, swapped=swapped)
        models = {"me": RobotModel(SHUTTLE), "yard": RobotModel(YARD, shared=True)}
        node = MissionNode.on_robots(mission, models, mission.read_options({}), ready_timeout=30.0)
        buses = {"me": self.network.bus("mission", robot), "yard": self.network.bus(f"mission-{robot}", "yard")}
        node.attach_to(buses)
        self.missions[robot] = node
        for role, bus in buses.items():
            self._running[robot, f"mission {role}"] = bus

    def kill_mission(self, robot: str) -> None:
        """Kill the process of a mission, at all of its robots."""
        for role in ("me", "yard"):
            self.kill(robot, f"mission {role}")
        self.missions.pop(robot, None)

    def state(self, place: str) -> str:
        """State of a place, as clients see it."""
        return self.client.state(place) or ""

    def inside(self, name: str) -> list[str]:
        """The robots in a place or its margin."""
        (place,) = (each for each in self._places if each.name == name)
        return [robot for robot, body in self.bodies.items() if place.covers(body.x, body.y, places.MARGIN)]

    def _judge(self) -> None:
        for place in self._places:
            inside = [robot for robot, body in self.bodies.items() if place.covers(body.x, body.y)]
            self.met += [(place.name, *pair) for pair in combinations(inside, 2)]
