"""Values that the launching side works out before a flight: what follows from the run's site and scenario.

On-board processes and missions get them as plain options, so that they need neither a site nor a scenario file.
`m600/robot.py` names these functions; they need numpy, which readers of the robot table lack.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skillwing.services.errors import InvalidOptionError
from skillwing.sim_mujoco.scenario.reading import ScenarioError, read_scenario
from skillwing.sim_mujoco.world.kinds import SiteOptions, make_site
from skillwing.sim_mujoco.world.site import Site
from skillwing.sim_mujoco.world.standing import MOST_DRONES


def guidance_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options of guidance: with the geofence of the `site`, unless they have one. Raises ValueError."""
    final, site = _site_of(options)
    return {"geofence": {"low": site.fence.low, "high": site.fence.high}} | final


def mapping_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options of mapping: with the corners of the `site` and the scenario's source of poses, unless they have others.

    Raises ValueError.
    """
    final, site = _site_of(options)
    scenario = final.pop("scenario", None)
    poses = None if scenario is None else read_scenario(Path(scenario)).poses
    return {"low": site.bounds.low, "high": site.bounds.high, **({} if poses is None else {"poses": poses})} | final


def _site_of(options: dict[str, Any]) -> tuple[dict[str, Any], Site]:
    """The options without their site, and the site; by default the courtyard."""
    return {name: value for name, value in options.items() if name != "site"}, SiteOptions(
        **options.get("site", {})
    ).site()


def mission_context(run: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Options of missions by mission, from the site of this run; none where no world is chosen: missions have the
    courtyard as default. A mission that cannot be flown there is left out.

    Raises InvalidOptionError for an unknown kind of world, and for a negative seed.
    """
    if run.get("world") is None:
        return {}
    try:
        site = make_site(run.get("seed", 1), run["world"])
    except ValueError as error:
        raise InvalidOptionError("world", _sentence(error)) from error
    inspection = inspection_mission(site)
    return {"mapping": mapping_mission(site)} | ({} if inspection is None else {"inspection": inspection})


def check(run: dict[str, Any]) -> None:
    """Raise InvalidOptionError for a `scenario`, or a number of `robots`, that the simulator could not use."""
    robots = len(run.get("robots") or ())
    if robots > MOST_DRONES:
        text = f"There is room for {MOST_DRONES} drones around the pad, not for {robots}. Name fewer robots."
        raise InvalidOptionError("with", text)
    if run.get("scenario") is not None:
        check_scenario(Path(run["scenario"]))


def check_scenario(path: Path) -> None:
    """Raise InvalidOptionError with all errors of a scenario, before anything is started for it."""
    try:
        read_scenario(path)
    except ScenarioError as error:
        text = _sentence(error)
        gap = "\n" if "\n" in text else " "
        raise InvalidOptionError("scenario", f"{text}{gap}docs/sensors.md describes the format.") from error


def mapping_mission(site: Site) -> dict[str, Any]:
    """Options of the mapping mission: the route, and the area and height of detours."""
    return {"route": site.route, "area": site.area, "return_height": site.return_height}


def inspection_mission(site: Site) -> dict[str, Any] | None:
    """Options of the inspection mission: the circle round the site's building; None where it has none."""
    if site.target is None:
        return None
    x, y = site.target.centre
    return {
        "center": (x, y, 0.0),
        "radius": round(site.target.radius, 2),
        "height": site.target.height,
        "return_height": site.return_height,
    }


def _sentence(error: ValueError) -> str:
    text = str(error)
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
