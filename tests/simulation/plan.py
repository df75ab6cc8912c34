"""Plan of a run, drawn from a seed: skillset, network, and the acts of clients, the robot and bad luck."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any

from faulty_network import NetworkConditions
from simulation.skillsets import SUBJECTS, Subject
from skillwing.services.names import DATA_MANAGER, RESOURCE_MANAGER, skill_process

CLIENTS = ("mission", "operator")
"""The first owns the goals that it starts, the second does not."""
OWNER_GRACE = 6.0
"""Grace of the goals of some missions, in seconds."""
ACTION_TIME = 8.0
"""Seconds of virtual time in which something is done; then everything is fixed."""


class Deed(StrEnum):
    """Acts of clients and the robot, and from `KILL` on of bad luck."""

    START = "starts"
    START_AGAIN = "starts again"
    MODIFY = "modifies"
    MODIFY_PAST = "modifies past the interface"
    INTERRUPT = "interrupts"
    INTERRUPT_AGAIN = "interrupts again"
    INTERRUPT_UNKNOWN = "interrupts before the start"
    TRIGGER = "triggers"
    FIRE = "fires"
    PUBLISH = "publishes"
    FALL_SILENT = "stops publishing"
    KILL = "is killed"
    LEAVE = "is shut down"
    STOP = "is stopped"
    TWIN = "is stopped and replaced"
    CUT = "is cut off"
    ROUTER = "ends"


FAULTS = (Deed.KILL, Deed.LEAVE, Deed.STOP, Deed.TWIN, Deed.CUT, Deed.ROUTER)


@dataclass(frozen=True, slots=True)
class Act:
    """One thing that happens. t: when, in seconds. who: a process. detail: what it takes, by name."""

    t: float
    who: str
    deed: Deed
    detail: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        detail = ", ".join(f"{name} {value}" for name, value in self.detail.items())
        return f"{self.t:8.4f}  {self.who} {self.deed}{': ' if detail else ''}{detail}"


@dataclass(frozen=True, slots=True)
class Plan:
    """journal: the resource manager remembers across a restart. calm: nothing bad happens to any process.

    owner_grace: of the goals that the mission owns [s].
    """

    seed: int
    skillset: str
    conditions: NetworkConditions
    journal: bool
    acts: tuple[Act, ...]
    owner_grace: float = 0.0

    @property
    def subject(self) -> Subject:
        return SUBJECTS[self.skillset]

    @property
    def calm(self) -> bool:
        return not any(act.deed in FAULTS for act in self.acts) and self.conditions == NetworkConditions()

    def without(self, index: int) -> Plan:
        return replace(self, acts=self.acts[:index] + self.acts[index + 1 :])


def draw_plan(seed: int) -> Plan:
    """The plan of a seed, always the same."""
    chance = random.Random(seed)
    name = chance.choice(list(SUBJECTS))
    subject = SUBJECTS[name]
    processes = (
        RESOURCE_MANAGER,
        *(skill_process(skill.name) for skill in subject.skillset.skills),
        *((DATA_MANAGER,) if subject.data else ()),
        *CLIENTS,
    )
    acts = _client_acts(chance, subject) + _robot_acts(chance, subject) + _bad_luck(chance, processes)
    acts += _modifications(random.Random(f"{seed}/modifications"), subject, acts)
    acts.sort(key=lambda act: act.t)
    # From another source of chance, so that a seed has the same acts as before there was a grace.
    grace = random.Random(f"{seed}/grace").choice((0.0, 0.0, OWNER_GRACE))
    conditions = _with_gaps(random.Random(f"{seed}/gaps"), _conditions(chance))
    return Plan(seed, name, conditions, chance.random() < 0.7, tuple(acts), grace)


def _conditions(chance: random.Random) -> NetworkConditions:
    kind = chance.random()
    if kind < 0.3:
        return NetworkConditions()
    share = chance.choice((0.0, 0.02, 0.1, 0.3))
    return NetworkConditions(
        latency=(0.0002, chance.choice((0.002, 0.02, 0.2))),
        slow=chance.choice((0.0, 0.02, 0.1)),
        slowest=chance.choice((0.5, 3.0)),
        loss=share,
        duplication=chance.choice((0.0, 0.05, 0.3)),
    )


def _with_gaps(chance: random.Random, conditions: NetworkConditions) -> NetworkConditions:
    """Conditions that lose events, unless they are the best ones. Drawn by a source of chance of its own."""
    if conditions == NetworkConditions():
        return conditions
    return replace(conditions, gaps=chance.choice((0.0, 0.0, 0.1, 0.4)))


def _time(chance: random.Random) -> float:
    """Things like to happen close to each other: some times are round."""
    time = chance.uniform(0.2, ACTION_TIME)
    return round(time, 1) + chance.choice((0.0, 0.001, 0.003)) if chance.random() < 0.4 else time


def _client_acts(chance: random.Random, subject: Subject) -> list[Act]:
    acts: list[Act] = []
    skills = [skill.name for skill in subject.skillset.skills]
    in_order = len(skills) if chance.random() < 0.4 else 0
    for number in range(chance.randint(2, 9)):
        client = chance.choice(CLIENTS)
        # Skills that build on each other run together only if they are started in their order.
        first = number < in_order
        skill = skills[number] if first else chance.choice(skills)
        t = 0.3 * (number + 1) if first else _time(chance)
        goal = {"goal": f"goal-{number}", "skill": skill}
        acts.append(Act(t, client, Deed.START, goal | {"valid": chance.random() < 0.93}))
        if chance.random() < 0.15:
            acts.append(Act(t + chance.choice((0.0, 0.01, 1.0)), chance.choice(CLIENTS), Deed.START_AGAIN, goal))
        if chance.random() < 0.5:
            after = chance.choice((0.0, 0.0, 0.001, 0.005, 0.1, chance.uniform(0.0, 4.0)))
            acts.append(Act(t + after, client, Deed.INTERRUPT, goal))
            if chance.random() < 0.3:
                acts.append(Act(t + after + chance.uniform(0.0, 2.0), client, Deed.INTERRUPT_AGAIN, goal))
        if chance.random() < 0.1:
            acts.append(Act(t - 0.05, chance.choice(CLIENTS), Deed.INTERRUPT_UNKNOWN, goal))
    return acts


def _modifications(chance: random.Random, subject: Subject, acts: list[Act]) -> list[Act]:
    """New inputs for goals of skills that take them. Each request has a speed that no other has.

    Other acts come from another source of chance, so that a seed has the same ones as before there were modifications.
    """
    found: list[Act] = []
    for start in [act for act in acts if act.deed is Deed.START]:
        if not subject.skillset.skill(start.detail["skill"]).modifiable or chance.random() < 0.5:
            continue
        goal = {"goal": start.detail["goal"], "skill": start.detail["skill"]}
        for _ in range(chance.randint(1, 3)):
            t = start.t + chance.choice((0.0, 0.005, 0.1, chance.uniform(0.0, 3.0)))
            detail = goal | {"speed": 1.5 + 0.001 * len(found)}
            if chance.random() < 0.7:
                found.append(Act(t, start.who, Deed.MODIFY, detail))
            else:  # and a late repetition
                found += [Act(t, start.who, Deed.MODIFY_PAST, detail)]
                found += [Act(t + chance.uniform(0.0, 2.0), chance.choice(CLIENTS), Deed.MODIFY_PAST, detail)]
    return found


def _robot_acts(chance: random.Random, subject: Subject) -> list[Act]:
    acts: list[Act] = []
    for _ in range(chance.randint(0, 5) if subject.extern else 0):
        resource, target = chance.choice(subject.extern)
        acts.append(Act(_time(chance), "robot", Deed.TRIGGER, {"resource": resource, "target": target}))
    for event in subject.skillset.events:
        if chance.random() < 0.3:
            acts.append(Act(_time(chance), "robot", Deed.FIRE, {"event": event.name}))
    for name, values in subject.data.items():
        for _ in range(chance.randint(0, 2)):
            t = _time(chance)
            value = chance.choice(values)
            silent = chance.random() < 0.4
            detail = {"datum": name} if silent else {"datum": name, "value": value}
            acts.append(Act(t, "robot", Deed.FALL_SILENT if silent else Deed.PUBLISH, detail))
            if chance.random() < 0.8:
                back = {"datum": name, "value": values[0]}
                acts.append(Act(t + chance.uniform(0.1, 4.0), "robot", Deed.PUBLISH, back))
    return acts


def _bad_luck(chance: random.Random, processes: tuple[str, ...]) -> list[Act]:
    acts: list[Act] = []
    for _ in range(chance.choice((0, 0, 1, 1, 2, 3))):
        who = CLIENTS[0] if chance.random() < 0.1 else chance.choice(processes)
        deed = chance.choice((Deed.KILL, Deed.KILL, Deed.LEAVE, Deed.STOP, Deed.CUT, Deed.CUT, Deed.TWIN, Deed.ROUTER))
        if deed is Deed.ROUTER:
            who = "router"
        elif deed in (Deed.TWIN, Deed.LEAVE) and not who.startswith("skill/"):
            deed = Deed.STOP
        acts.append(Act(_time(chance), who, deed, {"for": round(chance.choice((0.05, 0.5, 1.2, 2.5, 5.0)), 3)}))
    return acts
