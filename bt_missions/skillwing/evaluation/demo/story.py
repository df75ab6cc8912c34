"""Plan of a demo: its mission, its world and its failure."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidOptionError

MAPPING, INSPECTION = "mapping", "inspection"
CAMERA_FAILS_AT = 45.0
"""Robot time of the fault [s]: the drone has passed its first obstacle and flies the second leg."""
CRITICAL = 0.008
"""Capacity of a narrowed link [Mbit/s], the same as behind a building."""


@dataclass(frozen=True)
class Story:
    """Settings of a demo. world: its kind. happens: the fault, in a few words. robot, options: options of the robot and
    of the mission. way: the planned one; None for the route of the world."""

    mission: str
    world: str
    happens: str
    robot: dict[str, Any]
    options: dict[str, Any] = field(default_factory=dict[str, Any])
    way: tuple[tuple[float, float, float], ...] | None = None


def make_story(mission: str, seed: int, *, fault: bool, fault_at: float | None, scenario: Path | None) -> Story:
    """The story of a demo. fault_at: robot seconds, None for the worst place. scenario: a file of faults, instead.
    Raises UnknownNameError and InvalidOptionError."""
    if scenario is not None and (fault_at is not None or not fault):
        text = "What happens is all in the scenario. Leave out --no-fault and --fault-at, or the scenario."
        raise InvalidOptionError("scenario", text)
    if fault_at is not None and not fault:
        raise InvalidOptionError(
            "fault_at", "Without a fault there is no time for it. Leave out --fault-at or --no-fault."
        )
    match mission:
        case "mapping":
            happens = ("no fault", {"faults": []}) if not fault else _camera_fails(fault_at)
            story = Story(mission, "courtyard", *happens)
        case "inspection":
            story = _inspection(seed, fault=fault, fault_at=fault_at)
        case _:
            raise UnknownNameError("mission of demo", mission, (MAPPING, INSPECTION))
    return story if scenario is None else _by_scenario(story, scenario)


def _camera_fails(at: float | None) -> tuple[str, dict[str, Any]]:
    at = CAMERA_FAILS_AT if at is None else at
    return f"depth camera fails at {at:g} s", {"faults": [{"sensor": "zed", "kind": "blackout", "at": at}]}


def _inspection(seed: int, *, fault: bool, fault_at: float | None) -> Story:
    """Story of a flight around the site's building. Behind it the link is critical, as in Section 2.1 of the paper."""
    from skillwing.evaluation.flights.conditions import Condition  # noqa: PLC0415
    from skillwing.evaluation.flights.plan import (  # noqa: PLC0415 - loads numpy
        FlightPlan,
        options_on,
        planned_way,
    )

    site = FlightPlan(mission=INSPECTION, world=INSPECTION, seed=seed, condition=Condition.NONE).site()
    options = options_on(site, INSPECTION)
    if not fault:
        happens, link = "no fault", dict[str, Any]()
    elif fault_at is not None:
        happens = f"the link narrows at {fault_at:g} s"
        link = {"faults": [{"kind": "narrow", "at": fault_at, "magnitude": CRITICAL}]}
    else:
        happens, link = "a critical link behind the building", {"shadow": True}
    robot = {"world": INSPECTION, "link": link}
    return Story(INSPECTION, INSPECTION, happens, robot, options, planned_way(site, INSPECTION))


def _by_scenario(story: Story, path: Path) -> Story:
    from skillwing.sim_mujoco.launching import check_scenario  # noqa: PLC0415 - loads numpy

    check_scenario(path)
    robot = {name: value for name, value in story.robot.items() if name not in ("faults", "link")}
    robot["scenario"] = str(path.absolute())
    return replace(story, happens=f"scenario {path.name}", robot=robot)
