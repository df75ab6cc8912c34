"""Inspection with another reaction to the loss of the video, for comparison with the library's mission.

Not for real flights: one of the reactions is none, and new nodes can be held neither by the operator nor by the safety
pilot. The tree is the library's with one node removed or exchanged, and without the return for want of a LiDAR.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.decorators import Decorator

from skillwing.bt_missions.drone.depth_map import NO_DEPTH_MAP
from skillwing.bt_missions.drone.flight import fly_home
from skillwing.bt_missions.leaves.context import MissionContext
from skillwing.bt_missions.leaves.skill_action import SkillAction
from skillwing.bt_missions.mission.mission import MissionTrees
from skillwing.bt_missions.missions.inspection import InspectionMission, InspectionOptions
from skillwing.bt_missions.subtrees.composites import alongside

GIVING_UP = "hover, then land"
"""Name of the library's node for flights without video."""
PAUSE = 2.0
"""Robot seconds before a video that ended is asked for again."""


class InspectionOtherwiseOptions(InspectionOptions, frozen=True, kw_only=True):
    """instead: no alternative, so that the guards above land the drone at once; come home at once; or fly on as if
    nobody watched the video."""

    instead: Literal["land", "home", "unwatched"]


class Unwatched(Decorator):
    """Asks again for a skill that failed, as a streaming program that is restarted, and never fails itself."""

    def __init__(self, name: str, context: MissionContext, child: Behaviour) -> None:
        super().__init__(name, child)
        self._context = context
        self._failed_at: float | None = None

    def tick(self) -> Iterator[Behaviour]:
        now = self._context.now()
        if self._failed_at is None or now - self._failed_at >= PAUSE:
            yield from self.decorated.tick()
            self._failed_at = None if self.decorated.status is Status.RUNNING else now
        self.status = Status.RUNNING
        yield self

    def update(self) -> Status:
        return Status.RUNNING


class InspectionOtherwise(InspectionMission):
    Options = InspectionOtherwiseOptions

    def build(self, context: MissionContext, options: InspectionOptions) -> MissionTrees:
        assert isinstance(options, InspectionOtherwiseOptions), "a mission is built with options of its own"
        trees = super().build(context, options)
        come_home = _named(trees.root, "come home")
        _parent(come_home).remove_child(come_home)
        match options.instead:
            case "land":
                giving_up = _named(trees.root, GIVING_UP)
                _parent(giving_up).remove_child(giving_up)
            case "home":
                # Another hover is that of a pause.
                giving_up = _named(trees.root, GIVING_UP)
                assert isinstance(giving_up, Composite), "it does one thing after the other"
                giving_up.replace_child(giving_up.children[-1], _home_at_once(context, options))
            case "unwatched":
                stream = _named(trees.root, "stream")
                parent = _parent(stream)
                # A child has one parent: the decorator becomes that of the stream, and takes its place.
                index = parent.remove_child(stream)
                parent.insert_child(Unwatched("nobody watches", context, stream), index)
        return trees


def _home_at_once(context: MissionContext, options: InspectionOptions) -> Behaviour:
    """The way home is watched as on every other flight of this mission."""
    return alongside(
        "home at once",
        SkillAction("lidar_depthmap", context, "lidar_depthmap", outcomes=NO_DEPTH_MAP),
        until=fly_home(context, options.return_height, options.speed),
    )


def _named(root: Behaviour, name: str) -> Behaviour:
    return next(node for node in root.iterate() if node.name == name)


def _parent(node: Behaviour) -> Composite:
    assert isinstance(node.parent, Composite), f"`{node.name}` is one of several"
    return node.parent


MISSION = InspectionOtherwise()
