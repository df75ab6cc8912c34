"""A mapping mission as its managers would tell it: the depth camera fails at 20 s and the LiDAR branch finishes."""

from __future__ import annotations

from functools import partial
from itertools import count

from skillwing.dsl.model import Resource, Result, Skill, Skillset
from skillwing.services.bus import Bus
from skillwing.services.protocol import (
    Ending,
    GoalStatus,
    Keys,
    Message,
    MissionPhase,
    MissionStatus,
    Record,
    RecordKind,
    State,
    Terminal,
    TreeNode,
    TreeSnapshot,
    encode,
)


def _resource(name: str, *states: str) -> Resource:
    return Resource(name, states, states[0], ())


def _skill(name: str, success: str, *failures: str) -> Skill:
    return Skill(name, results=(Result(success, True), *(Result(failure, False) for failure in failures)))


SKILLSET = Skillset(
    "m600",
    resources=(
        _resource("axes_authority", "AVAILABLE", "USED"),
        _resource("zed_status", "UNKNOWN", "OK", "FAILED"),
        _resource("depthmap_source", "NONE", "ZED", "LIDAR"),
        _resource("battery_status", "NORMAL", "LOW", "CRITICAL"),
    ),
    skills=(
        _skill("takeoff", "AT_ALTITUDE", "BLOCKED"),
        _skill("goto_straight", "ARRIVED", "BLOCKED"),
        _skill("goto", "ARRIVED", "BLOCKED"),
        _skill("zed_depthmap", "ENDED", "NO_DATA"),
        _skill("lidar_depthmap", "ENDED", "NO_DATA"),
        _skill("land", "LANDED"),
    ),
)
INITIAL = {resource.name: resource.initial for resource in SKILLSET.resources}
MISSION = "mapping"


def succeeded(result: str) -> Terminal:
    return Terminal(ending=Ending.SUCCEEDED, result=result, success=True, reason=f"ended with {result}")


BLOCKED = Terminal(ending=Ending.SUCCEEDED, result="BLOCKED", reason="an obstacle is 2.9 m ahead")
INTERRUPTED = Terminal(ending=Ending.INTERRUPTED, reason="interrupted by the mission")
NOT_READY = Terminal(ending=Ending.NOT_READY, reason="axes_authority is USED", failing=("free",))
VIOLATED = Terminal(
    ending=Ending.INVARIANT_VIOLATED, invariant="zed_ok", subject="zed_status", reason="zed_ok: zed_status is FAILED"
)


class Story:
    """Collects messages; each method returns the id of the record that it tells."""

    def __init__(self) -> None:
        self.messages: list[tuple[float, Message]] = []
        self._number = count(1)
        self._states = dict(INITIAL)

    @property
    def records(self) -> list[Record]:
        return [message for _, message in self.messages if isinstance(message, Record)]

    @property
    def statuses(self) -> list[GoalStatus]:
        return [message for _, message in self.messages if isinstance(message, GoalStatus)]

    def record(
        self,
        t: float,
        kind: RecordKind,
        subject: str,
        before: str | None,
        after: str,
        cause: str | None = None,
        goal_id: str | None = None,
    ) -> str:
        name = f"teller#{next(self._number)}"
        record = Record(
            id=name,
            t=t,
            source="teller",
            kind=kind,
            subject=subject,
            before=before,
            after=after,
            cause=cause,
            goal_id=goal_id,
        )
        self.messages.append((t, record))
        return name

    def resource(self, t: float, name: str, state: str, cause: str | None = None) -> str:
        before, self._states[name] = self._states[name], state
        return self.record(t, RecordKind.RESOURCE, name, before, state, cause)

    def goal(
        self, skill: str, goal_id: str, start: float, end: float, terminal: Terminal, cause: str | None = None
    ) -> str:
        told: list[tuple[float, State, Terminal | None]] = [(start, State.VALIDATING, None)]
        if terminal.ending is not Ending.NOT_READY:
            told.append((start + 0.02, State.RUNNING, None))
        told.append((end, State.TERMINATED, terminal))
        record, before = "", None
        for t, state, how in told:
            after = how.label if how else str(state)
            record = self.record(t, RecordKind.GOAL, skill, before, after, cause if how else None, goal_id)
            before = after
            status = GoalStatus(goal_id=goal_id, skill=skill, state=state, t=t, terminal=how, record=record)
            self.messages.append((t, status))
        return record

    def tree(self, t: float, *statuses: str) -> None:
        shape = (
            (None, "mapping"),
            (0, "takeoff"),
            (0, "ZED or LiDAR"),
            (2, "ZED branch"),
            (2, "LiDAR branch"),
            (0, "land"),
        )
        nodes = tuple(
            TreeNode(index, parent, name, "Sequence", status)
            for index, ((parent, name), status) in enumerate(zip(shape, statuses, strict=True))
        )
        self.messages.append((t, TreeSnapshot(mission=MISSION, t=t, nodes=nodes)))

    def phase(self, t: float, before: str, after: str, text: str) -> None:
        self.record(t, RecordKind.MISSION, MISSION, before, after)
        self.messages.append(
            (t, MissionStatus(mission=MISSION, phase=MissionPhase(after), t=t, text=text, waypoint=1, waypoints=2))
        )


def tell() -> Story:
    story = Story()
    run, done, off, failed = "RUNNING", "SUCCESS", "INVALID", "FAILURE"
    story.resource(0.5, "zed_status", "OK")
    story.phase(1.0, "IDLE", "RUNNING", "taking off")
    story.tree(1.0, run, run, off, off, off, off)
    story.goal("takeoff", "g1", 1.1, 6.0, succeeded("AT_ALTITUDE"))
    story.record(6.1, RecordKind.MISSION, "branch", None, "ZED branch")
    story.tree(6.1, run, done, run, run, off, off)
    story.resource(6.2, "depthmap_source", "ZED")
    story.goal("goto_straight", "g3", 6.4, 12.0, BLOCKED)
    fault = story.record(20.0, RecordKind.FAULT, "zed blackout", None, "ON")
    health = story.record(20.5, RecordKind.HEALTH, "zed", "OK", "FAILED", fault)
    change = story.resource(20.51, "zed_status", "FAILED", health)
    story.resource(20.52, "depthmap_source", "NONE", change)
    end = story.goal("zed_depthmap", "g2", 6.2, 20.53, VIOLATED, change)
    switch = story.record(20.54, RecordKind.MISSION, "branch", "ZED branch", "LiDAR branch", end)
    story.goal("goto_straight", "g4", 12.2, 21.5, INTERRUPTED, switch)
    story.tree(20.54, run, done, run, failed, run, off)
    story.goal("goto", "g5", 20.6, 20.6, NOT_READY)
    story.goal("lidar_depthmap", "g6", 20.6, 30.0, INTERRUPTED)
    story.goal("goto", "g7", 21.6, 29.8, succeeded("ARRIVED"))
    story.goal("land", "g8", 30.1, 36.0, succeeded("LANDED"))
    story.tree(36.0, done, done, done, failed, done, done)
    story.phase(36.1, "RUNNING", "SUCCEEDED", "all waypoints visited")
    return story


class Teller:
    """A node that tells a story at the times at which it happened."""

    name = "teller"
    owns_clock = False

    def __init__(self, story: Story) -> None:
        self._messages = sorted(story.messages, key=lambda item: item[0])

    def attach(self, bus: Bus) -> None:
        keys = Keys(SKILLSET.name)
        publishers = {
            Record: bus.advertise(keys.timeline, events=True),
            TreeSnapshot: bus.advertise(keys.mission_tree, events=True),
            MissionStatus: bus.advertise(keys.mission_status, events=True),
        }
        skills = {skill.name: bus.advertise(keys.status(skill.name), events=True) for skill in SKILLSET.skills}

        for t, message in self._messages:
            publisher = skills[message.skill] if isinstance(message, GoalStatus) else publishers[type(message)]
            bus.after(t, partial(publisher.put, encode(message)))

    def detach(self) -> None:
        pass
