"""What a mission planner on the ground tells missions of a site before they fly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skillwing.m600.command import sentences
from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.scenario import ScenarioError, read_scenario
from skillwing.sim_mujoco.world.kinds import make_site
from skillwing.sim_mujoco.world.site import Site


def mission_options(run: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """By mission, its options in the `world` of this run and its `seed`; none for a mission that has nothing to do
    there, and none at all where no world is chosen: missions know the courtyard.

    Raises InvalidOptionError for a kind of world that there is not, and a negative seed.
    """
    if run.get("world") is None:
        return {}
    try:
        site = make_site(run.get("seed", 1), run["world"])
    except ValueError as error:
        raise InvalidOptionError("world", sentences(str(error))) from error
    told = {"mapping": mapping_options(site), "inspection": inspection_options(site)}
    return {mission: options for mission, options in told.items() if options is not None}


def check(run: dict[str, Any]) -> None:
    """Raise InvalidOptionError for a `scenario` that the simulator could not use."""
    if run.get("scenario") is not None:
        check_scenario(Path(run["scenario"]))


def check_scenario(path: Path) -> None:
    """Raise InvalidOptionError with all that is wrong in a scenario, before anything is started for it."""
    try:
        read_scenario(path)
    except ScenarioError as error:
        text = sentences(str(error))
        gap = "\n" if "\n" in text else " "
        raise InvalidOptionError("scenario", f"{text}{gap}docs/sensors.md tells how one is written.") from error


def mapping_options(site: Site) -> dict[str, Any]:
    """Where to fly, and where detours may lead."""
    return {"route": site.route, "area": site.area, "return_height": site.return_height}


def inspection_options(site: Site) -> dict[str, Any] | None:
    """The circle round the site's building; None where it has none."""
    if site.target is None:
        return None
    x, y = site.target.centre
    return {
        "center": (x, y, 0.0),
        "radius": round(site.target.radius, 2),
        "height": site.target.height,
        "return_height": site.return_height,
    }
