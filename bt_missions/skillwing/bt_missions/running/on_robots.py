"""The node of a mission on board for several robots: it finds the others at its router, and then runs the mission."""

from __future__ import annotations

from collections.abc import Mapping

from skillwing.bt_missions.checking.mission_check import require_fit
from skillwing.bt_missions.mission.mission import Mission, MissionOptions
from skillwing.bt_missions.mission.robots import RobotModel
from skillwing.bt_missions.running.runner import MissionNode
from skillwing.dsl.suggest import listed
from skillwing.services.bus import Bus
from skillwing.services.client.robot_search import TIMEOUT, FoundRobot, RobotSearch, SearchBus
from skillwing.services.errors import PassingError
from skillwing.services.names import MISSION
from skillwing.services.protocol import MissionStatus

ACCESS = "With keys, `skillwing keys add-robot` needs `--with` for each of them."


class MissionOnRobots:
    """Runs `mission` on the robots with these names, by their names in the mission. One of them is `own`, the robot of
    its launcher, which it occupies. The alive token appears when the mission begins: until then the launcher can
    refuse it."""

    name = MISSION
    owns_clock = False
    tells_when_ready = True

    def __init__(
        self, mission: Mission, names: Mapping[str, str], own: str, options: MissionOptions, request_id: str = ""
    ) -> None:
        self._mission = mission
        self._names = dict(names)
        self._own = own
        self._options = options
        self._request_id = request_id
        self._search: RobotSearch | None = None
        self._node: MissionNode | None = None

    @property
    def over(self) -> bool:
        """True if the mission has ended."""
        return self._node is not None and self._node.over

    def attach(self, bus: Bus) -> None:
        """Look for the robots. Their answers start the mission, or raise PassingError from a callback."""
        if not isinstance(bus, SearchBus):
            raise TypeError(f"a mission on several robots needs a bus that reaches them, not a {type(bus).__name__}")
        self._bus: SearchBus = bus
        self._search = RobotSearch(bus, self._names.values(), self._begin)

    def detach(self) -> None:
        """Interrupt what still runs and publish the end of the mission, without waiting for replies."""
        if self._search is not None:
            self._search.cancel()
        if self._node is not None:
            self._node.detach()

    def _begin(self, found: Mapping[str, FoundRobot]) -> None:
        self._require_usable(found)
        robots = {role: found[name] for role, name in self._names.items()}
        models = {
            role: RobotModel(robot.skillset, robot.rescue_goal, robot.shared and self._names[role] != self._own)
            for role, robot in robots.items()
        }
        require_fit(self._mission, models, self._options)
        self._node = MissionNode.on_robots(
            *(self._mission, models, self._options), on_status=self._end_when_over, request_id=self._request_id
        )
        self._node.attach_to(
            {
                role: self._bus.with_own_time(self._names[role], follows=robot.follows_time)
                for role, robot in robots.items()
            }
        )

    def _end_when_over(self, status: MissionStatus) -> None:
        if status.phase.over:
            # The bus of this robot runs those of the others.
            self._bus.post(self._bus.close)

    def _require_usable(self, found: Mapping[str, FoundRobot]) -> None:
        """Raise PassingError for a robot that is missing, does not describe itself, or has another mission."""
        if self._search is not None and self._search.objections:
            name, reason = next(iter(self._search.objections.items()))
            raise PassingError(f"`{name}` cannot take part. {reason}")
        if missing := [name for name in self._names.values() if name not in found]:
            text = f"Within {TIMEOUT:g} s nothing is heard of the resource manager of {listed(missing)}."
            raise PassingError(f"{text} All robots of a mission on board share one router. {ACCESS}")
        if busy := [name for name, robot in found.items() if robot.mission_runs and not robot.shared]:
            text = f"Another mission runs at {listed(busy)}."
            raise PassingError(f"{text} Wait until it has ended, or abort it there.")
