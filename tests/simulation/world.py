"""A robot's managers and clients as nodes of a failing network, and the execution of a plan on them."""

from __future__ import annotations

import logging
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from faulty_network import FaultyNetwork, NetworkConditions
from simulation.plan import CLIENTS, FAULTS, Act, Deed, Plan
from simulation.skills import AnySkill, Logbook
from skillwing.services.bus import Answer, Bus, Handle, Node, Publisher
from skillwing.services.bus.inprocess import InProcessBus
from skillwing.services.client.interface import GoalHandle, SkillsetInterface
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.core.resource_core import ResourceCore
from skillwing.services.core.skill_core import SkillCore
from skillwing.services.journal.journal import Journal
from skillwing.services.journal.schema import Identity
from skillwing.services.managers.data_manager import DataManagerNode
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.managers.skill_manager import SkillManagerNode
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process
from skillwing.services.protocol import (
    DataSample,
    FireEvent,
    FireExtern,
    InterruptGoal,
    Keys,
    ModifyGoal,
    StartGoal,
    encode,
)

ROBOT = "robot"
ROUTER = "router"
WAKES_FOR = 0.3
"""Seconds for which a woken process may go on with a goal beside its replacement."""
SUPERVISION_PERIOD = 0.25
"""Seconds between two searches for processes that have ended by themselves, which are then started again."""


class Client:
    """A mission or an operator: a skillset interface, and its goals."""

    owns_clock = False

    def __init__(
        self,
        name: str,
        plan: Plan,
        on_goal: Callable[[Client, GoalHandle], None],
        on_change: Callable[[Client], None],
    ) -> None:
        self.name = name
        self._on_goal = on_goal
        self._on_change = on_change
        self._skillset = plan.subject.skillset
        self._owner_grace = plan.owner_grace
        self._names = random.Random(f"{plan.seed}/{name}")
        self.goals: dict[str, GoalHandle] = {}
        self.unwanted: set[str] = set()
        """Goals that the interface was asked to interrupt."""
        self.modifications: dict[tuple[str, float], Answer | None] = {}
        """Answers to the modifications that the interface was asked for, by goal and speed, in their order."""

    def attach(self, bus: Bus) -> None:
        self.bus = bus
        self.interface = SkillsetInterface(
            bus,
            self._skillset,
            client=self.name,
            owns_goals=self.name == CLIENTS[0],
            owner_grace=self._owner_grace,
            new_goal_id=lambda: f"{self._names.getrandbits(64):016x}",
        )
        self.interface.on_change(lambda: self._on_change(self))

    def detach(self) -> None:
        pass

    def start(self, skill: str, goal: str, inputs: dict[str, Any]) -> None:
        handle = self.goals[goal] = self.interface.start(skill, inputs, goal_id=goal)
        handle.on_change(lambda changed: self._on_goal(self, changed))

    def interrupt(self, goal: str) -> None:
        if goal in self.goals:
            self.unwanted.add(goal)
            self.interface.interrupt(self.goals[goal])

    def modify(self, goal: str, speed: float) -> None:
        if goal not in self.goals:
            return
        asked = goal, speed
        self.modifications[asked] = None
        self.interface.modify(
            self.goals[goal], {"speed": speed}, lambda answer: self.modifications.update({asked: answer})
        )

    def tell(self, key: str, message: StartGoal | InterruptGoal | ModifyGoal) -> None:
        """Send a message past the interface, as a client in another language might."""
        self.bus.ask(key, encode(message), lambda answer: None)


class Robot:
    """The functional layer: it publishes data, and reports the states of extern resources."""

    name = ROBOT
    owns_clock = False

    def __init__(self, plan: Plan) -> None:
        self._subject = plan.subject
        self._keys = Keys(plan.skillset)
        self.values = {name: good for name, (good, _) in plan.subject.data.items()}

    def attach(self, bus: Bus) -> None:
        self.bus = bus
        self._publishers: dict[str, Publisher] = {}
        self._timers: dict[str, Handle] = {}
        for name in self.values:
            self._publishers[name] = bus.advertise(self._keys.data(name))
            self.publish(name, self.values[name])

    def detach(self) -> None:
        pass

    def publish(self, name: str, value: float) -> None:
        """Publish a value from now on, at the promised period."""
        self.values[name] = value
        self.fall_silent(name)
        period = self._subject.skillset.datum(name).period or 1.0
        self._timers[name] = self.bus.every(period, lambda: self._put(name))
        self._put(name)

    def fall_silent(self, name: str) -> None:
        if name in self._timers:
            self._timers.pop(name).cancel()

    def trigger(self, resource: str, target: str) -> None:
        request = FireExtern(resource=resource, target=target, source=self.name)
        self.bus.ask(self._keys.resource_extern, encode(request), lambda answer: None)

    def fire(self, event: str) -> None:
        request = FireEvent(event=event, source=self.name)
        self.bus.ask(self._keys.event(event), encode(request), lambda answer: None)

    def insist(self, key: str, request: InterruptGoal) -> None:
        """Repeat a request until it is answered."""
        ask_until_answered(self.bus, key, encode(request), lambda answer: None)

    def _put(self, name: str) -> None:
        sample = DataSample(name=name, value=self.values[name], t=self.bus.now())
        self._publishers[name].put(encode(sample))


@dataclass(eq=False)
class Process:
    """A running node. number: which process of the run; ran_since: time of its last start or wake-up."""

    name: str
    number: int
    node: Any
    bus: InProcessBus
    ran_since: float
    linked_since: float
    stopped: bool = False
    cut: bool = False

    @property
    def skill_core(self) -> SkillCore:
        return cast(SkillManagerNode, self.node)._core

    @property
    def resource_core(self) -> ResourceCore:
        return cast(ResourceManagerNode, self.node)._core


@dataclass
class Absence:
    """A time [s] without the owner of goals."""

    begin: float
    end: float = math.inf


class World:
    """Simulated robot of a plan, at time 0."""

    def __init__(self, plan: Plan) -> None:
        # Complaints of the managers are consequences of the plan.
        logging.getLogger("skillwing").setLevel(logging.CRITICAL)
        self.plan = plan
        self.keys = Keys(plan.skillset)
        self.network = FaultyNetwork(plan.seed, plan.conditions)
        self.logbook = Logbook()
        self.running: dict[str, Process] = {}
        self.zombies: list[Process] = []
        self.fallen: list[Process] = []
        self.on_new_books: Callable[[], None] = lambda: None
        self.on_goal: Callable[[Client, GoalHandle], None] = lambda client, goal: None
        """Listener to each change of a goal that a client sees."""
        self.on_change: Callable[[Client], None] = lambda client: None
        """Listener to each change of goals or states that a client sees."""
        self.absences: list[Absence] = []
        """Times for which the owner of goals was killed, stopped or cut off."""
        self._router_up = True
        self._books = self._new_journal()
        self._number = 0

    def begin(self) -> None:
        """Start all processes, and schedule the plan's acts."""
        names = [RESOURCE_MANAGER, DATA_MANAGER]
        names += [skill_process(skill.name) for skill in self.plan.subject.skillset.skills]
        for name in (*names, ROBOT, *CLIENTS):
            self.launch(name)
        for act in self.plan.acts:
            self.network.schedule(act.t, lambda act=act: self._carry_out(act))
        self.network.schedule_periodic(SUPERVISION_PERIOD, self._restart_ended_processes)

    @property
    def resource_manager(self) -> Process:
        return self.running[RESOURCE_MANAGER]

    @property
    def skill_managers(self) -> list[Process]:
        return [each for name, each in self.running.items() if name.startswith("skill/") and not each.bus.closed]

    @property
    def replaced(self) -> list[Process]:
        """Replaced processes that still run."""
        return [each for each in self.zombies if not each.bus.closed]

    @property
    def clients(self) -> list[Process]:
        return [self.running[name] for name in CLIENTS if name in self.running]

    # --- processes ---------------------------------------------------------------------------------------------------

    def launch(self, name: str) -> None:
        """Start a process, as soon as there is a router, unless it runs."""
        if name in self.running:
            return
        if not self._router_up:
            self.network.schedule(0.1, lambda: self.launch(name))
            return
        self._number += 1
        node = self._make(name, self._number)
        bus = self.network.join(name)
        now = self.network.now()
        self.running[name] = Process(name, self._number, node, bus, now, now)
        node.attach(bus)

    def _make(self, name: str, number: int) -> Node:
        plan, skillset = self.plan, self.plan.subject.skillset
        match name:
            case "resource_manager":
                return ResourceManagerNode(skillset, journal=self._books)
            case "data_manager":
                return DataManagerNode(skillset)
            case "robot":
                return Robot(plan)
            case "mission" | "operator":
                return Client(name, plan, self.on_goal, self.on_change)
            case _:
                model = skillset.skill(name.removeprefix("skill/"))
                return SkillManagerNode(AnySkill(model, self.logbook, plan.seed, number), skillset)

    def _new_journal(self) -> Journal:
        skillset = self.plan.subject.skillset
        return Journal(None, Identity("", skillset.name, skillset.schema_hash))

    def _restart_ended_processes(self) -> None:
        """Start processes again that have ended, and end replaced processes.

        A replaced manager ends by itself, but is killed after WAKES_FOR if it runs a goal: two with goals answer twice.
        """
        for name, process in list(self.running.items()):
            if process.bus.closed:
                self.fallen.append(self.running.pop(name))
                self.launch(name)
        for process in list(self.zombies):
            awake = not process.stopped and self.network.now() > process.ran_since + WAKES_FOR
            if process.bus.closed or (awake and process.skill_core.current is not None):
                self._end_zombie(process)

    def kill(self, name: str) -> None:
        process = self.running.pop(name, None)
        if process is not None:
            self._note_absence(process)
            self.network.kill(process.bus)
            self.fallen.append(process)
            if name == RESOURCE_MANAGER and not self.plan.journal:
                self._books = self._new_journal()
                self.on_new_books()

    def _shut_down(self, name: str) -> None:
        process = self.running.pop(name, None)
        if process is not None:
            if process.stopped:
                self.network.wake(process.bus)
            process.node.detach()
            process.bus.close()

    def _stop(self, process: Process) -> None:
        process.stopped = True
        self._note_absence(process)
        self.network.stop(process.bus)

    def _wake(self, process: Process) -> None:
        process.stopped = False
        process.ran_since = self.network.now()
        self._end_absence(process)
        self.network.wake(process.bus)

    def _replace(self, name: str, after: float) -> None:
        """Stop a process and start another in its place. The first wakes up later, and ends when it notices that."""
        process = self.running.pop(name, None)
        if process is None:
            return
        self._stop(process)
        self.zombies.append(process)
        self.launch(name)
        self.network.schedule(after, lambda: self._wake(process))

    def _end_zombie(self, process: Process) -> None:
        self.zombies.remove(process)
        self.fallen.append(process)
        if not process.bus.closed:
            self.network.kill(process.bus)

    def _cut(self, process: Process, *, noticed: bool = False) -> None:
        process.cut = True
        self._note_absence(process)
        self.network.cut(process.bus, noticed=noticed)

    def _fix(self, process: Process) -> None:
        if process.cut:
            process.cut = False
            process.linked_since = self.network.now()
            self._end_absence(process)
            self.network.reconnect(process.bus)

    def _note_absence(self, process: Process) -> None:
        if process.name == CLIENTS[0] and not (self.absences and self.absences[-1].end == math.inf):
            self.absences.append(Absence(self.network.now()))

    def _end_absence(self, process: Process) -> None:
        """End an absence of the owner, unless it is stopped and cut off at once."""
        if process.name == CLIENTS[0] and self.absences and not process.stopped and not process.cut:
            self.absences[-1].end = self.network.now()

    def _end_router(self, seconds: float) -> None:
        if not self._router_up:
            return
        self._router_up = False
        for process in self._everybody():
            self._cut(process, noticed=True)
        self.network.schedule(seconds, self._restart_router)

    def _restart_router(self) -> None:
        if self._router_up:
            return
        self._router_up = True
        pace = random.Random(f"{self.plan.seed}/{self.network.now()}")
        for process in self._everybody():
            # Each tries again at its own pace, from 0.1 to 1 s.
            self.network.schedule(pace.uniform(0.0, 1.0), lambda process=process: self._fix(process))

    def fix_all(self) -> None:
        """End all faults. Their consequences stay."""
        self.network.conditions = NetworkConditions()
        self._router_up = True
        for process in self._everybody():
            if process.stopped:
                self._wake(process)
            self._fix(process)
        for name, (good, _) in self.plan.subject.data.items():
            cast(Robot, self.running[ROBOT].node).publish(name, good)
        for name in (RESOURCE_MANAGER, DATA_MANAGER):
            self.launch(name)
        for skill in self.plan.subject.skillset.skills:
            self.launch(skill_process(skill.name))

    def _everybody(self) -> list[Process]:
        return [*self.running.values(), *self.zombies]

    # --- acts --------------------------------------------------------------------------------------------------------

    def _carry_out(self, act: Act) -> None:
        if act.deed is Deed.ROUTER:
            self._end_router(act.detail["for"])
        elif act.deed in FAULTS and act.who in self.running:
            self._have_trouble(self.running[act.who], act)
        elif act.who in self.running and not self.running[act.who].stopped:
            self._have_done(self.running[act.who].node, act)

    def _have_trouble(self, process: Process, act: Act) -> None:
        seconds = act.detail["for"]
        match act.deed:
            case Deed.KILL | Deed.LEAVE:
                (self.kill if act.deed is Deed.KILL else self._shut_down)(act.who)
                if act.who not in CLIENTS:
                    self.network.schedule(seconds, lambda: self.launch(act.who))
            case Deed.STOP if not process.stopped:
                self._stop(process)
                self.network.schedule(seconds, lambda: self._wake(process) if process.stopped else None)
            case Deed.TWIN if not process.stopped:
                self._replace(act.who, seconds)
            case Deed.CUT if not process.cut:
                self._cut(process)
                self.network.schedule(seconds, lambda: self._fix(process) if self._router_up else None)
            case _:
                pass

    def _have_done(self, node: Any, act: Act) -> None:
        if isinstance(node, Robot):
            self._have_robot(node, act)
        else:
            self._have_client(node, act)

    def _have_robot(self, robot: Robot, act: Act) -> None:
        match act.deed:
            case Deed.TRIGGER:
                robot.trigger(act.detail["resource"], act.detail["target"])
            case Deed.FIRE:
                robot.fire(act.detail["event"])
            case Deed.PUBLISH:
                robot.publish(act.detail["datum"], act.detail["value"])
            case _:
                robot.fall_silent(act.detail["datum"])

    def _have_client(self, client: Client, act: Act) -> None:
        goal, skill = act.detail["goal"], act.detail["skill"]
        inputs: dict[str, Any] = {}
        if self.plan.subject.skillset.skill(skill).inputs:
            inputs = {"speed": 1.0 if act.detail.get("valid", True) else 9.0}
        match act.deed:
            case Deed.START:
                client.start(skill, goal, inputs)
            case Deed.START_AGAIN:
                schema = self.plan.subject.skillset.schema_hash
                again = StartGoal(goal_id=goal, inputs=inputs, client=client.name, schema=schema, deadline=act.t + 30.0)
                client.tell(self.keys.start(skill), again)
            case Deed.MODIFY:
                client.modify(goal, act.detail["speed"])
            case Deed.MODIFY_PAST:
                schema, speed = self.plan.subject.skillset.schema_hash, act.detail["speed"]
                request = ModifyGoal(
                    goal_id=goal, request_id=f"{goal} {speed}", inputs={"speed": speed}, client="past", schema=schema
                )
                client.tell(self.keys.modify(skill), request)
            case Deed.INTERRUPT:
                client.interrupt(goal)
            case _:
                client.tell(self.keys.interrupt(skill), InterruptGoal(goal_id=goal, client=client.name))
