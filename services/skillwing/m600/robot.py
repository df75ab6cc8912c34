"""The table of the M600: its skillset, its functional layer, and its skill managers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from skillwing.dsl.model import UnknownNameError
from skillwing.m600.generated.processes import HOOKS, SKILLSET
from skillwing.services.rescue_goal import RescueGoal
from skillwing.services.robot import ProcessSpec, Robot

SIMULATION = "skillwing.sim_mujoco"
LAUNCHING = f"{SIMULATION}.launching"
ONBOARD = "skillwing.onboard"
SIM_TAKES = ("seed", "world", "faults", "scenario", "wind", "turbulence", "gusts", "battery", "packs_fail", "pilot")
FENCE = {"fence": "geofence"}
"""One fence for guidance, for the autopilot's guard and for the ground truth."""
TO_SIM = {**{name: name for name in SIM_TAKES}, "speed": "factor", **FENCE}
"""Options of the functional layer for the simulator, with its names for them."""
TO_WORLD = {"seed": "seed", "world": "world", "speed": "factor", **FENCE}
TO_DRONE = {name: to for name, to in TO_SIM.items() if name not in TO_WORLD}
"""The same in two parts, for a simulator of several drones."""
TO_GUIDANCE = {"watch": "watch", **FENCE}
TO_LINK = {"seed": "seed", "scenario": "scenario"}
TO_MAPPING = {"poses": "poses", "scenario": "scenario"}
OF_THE_RUN = ("run_dir", "durable", "keep", "viewer", "viewer_url")
"""Options of managers and recorder (`services/robot.py`)."""
SHARING = ("robots", "world_of")
"""Options of robots that share a simulated world."""
OPTIONS = tuple(dict.fromkeys((*TO_SIM, *TO_GUIDANCE, *TO_LINK, *TO_MAPPING, "link", "bounds", *SHARING, *OF_THE_RUN)))


def functional_layer(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The simulated drone, and the bridge to its skillset. Raises UnknownNameError for an unknown option.

    - `seed`, `world`: the site. `speed`: robot seconds per wall second, 0 for as fast as possible.
    - `faults`: a schedule such as `[{"sensor": "zed", "kind": "blackout", "at": 60.0}]`. `scenario`: path of a file.
    - `wind`, `turbulence`, `gusts`, `battery` at the start, `packs_fail`, `pilot`: as in a scenario.
    - `fence`, `bounds`: boxes from `low` to `high`, by default those of the site.
    - `watch`: False lets guidance ignore obstacles. `link`: the radio (docs/video.md). `poses`: docs/mapping.md.
    - `robots`: options of each drone by robot, such as `{"left": {}, "right": {}}`. The simulator of the first flies
      all. `world_of`: the name of that first robot, for the others.
    """
    if unknown := options.keys() - set(OPTIONS):
        raise UnknownNameError(f"option of {ROBOT.name}", min(unknown), OPTIONS)
    site = _site(options)
    guidance = site | _given(options, TO_GUIDANCE)
    link = dict(options.get("link") or {}) | _given(options, TO_LINK) | site
    mapping = site | dict(options.get("bounds") or {}) | _given(options, TO_MAPPING)
    return (
        *_simulator(options),
        ProcessSpec(
            "guidance",
            f"{ONBOARD}.guidance.node:make_guidance",
            guidance,
            extra="onboard",
            resolver=f"{LAUNCHING}:guidance_options",
        ),
        ProcessSpec("obstacles", f"{ONBOARD}.obstacles.node:make_obstacles", essential=False, extra="onboard"),
        ProcessSpec(
            "mapping",
            f"{ONBOARD}.mapping.node:make_mapping",
            mapping,
            essential=False,
            extra="onboard",
            resolver=f"{LAUNCHING}:mapping_options",
        ),
        ProcessSpec("video", f"{ONBOARD}.video.node:make_video", essential=False, extra="onboard"),
        ProcessSpec("link", f"{SIMULATION}.link.node:make_link", link, essential=False, extra="sim"),
        ProcessSpec("ground", f"{ONBOARD}.video.ground:make_ground", essential=False, extra="onboard"),
        ProcessSpec("bridge", "skillwing.m600.bridge.node:make_bridge", {"skillset": str(SKILLSET)}),
    )


def _simulator(options: dict[str, Any]) -> tuple[ProcessSpec, ...]:
    """The simulator of one drone, or of all that share a world; none for a robot in the world of another.

    It is not restarted: a new one would begin with a drone on the ground at time 0, against the state of all others.
    """
    if options.get("world_of") is not None:
        return ()
    sim = _given(options, TO_SIM)
    factory = f"{SIMULATION}.simulator.node:make_sim"
    if options.get("robots"):
        factory = f"{SIMULATION}.simulator.shared_node:make_shared_sim"
        (first, own), *others = options["robots"].items()
        # What happens to this robot, such as a fault, happens to its own drone only.
        drones = {first: _given({**options, **own}, TO_DRONE)}
        drones |= {robot: _given(own, TO_DRONE) for robot, own in others}
        sim = _given(options, TO_WORLD) | {"robots": drones}
    return (ProcessSpec("sim", factory, sim, extra="sim", restart="never"),)


def _given(options: dict[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """The given options among these, by the names of the process."""
    return {names[option]: value for option, value in options.items() if option in names and value is not None}


def _site(options: dict[str, Any]) -> dict[str, Any]:
    """The site as an option. Resolvers turn it into values, because managers read this table too and have no numpy."""
    if options.get("world") is None:
        return {}
    return {"site": {"seed": options.get("seed", 1), "kind": options["world"]}}


def recorder(options: dict[str, Any]) -> dict[str, Any]:
    """Options of the recorder: the drone's dashboard with the site, and the flight log for the ground truth.

    The dashboard of a robot whose simulator flies several drones shows the others as well.
    """
    others = list(options.get("robots") or ())[1:]
    return {
        "scene": "skillwing.evaluation.dashboard.scene:make_scene",
        "scene_options": _site(options) | ({"others": others} if others else {}),
        "collectors": ["skillwing.evaluation.judge.flight_log:make_flight_log"],
    }


ROBOT = Robot(
    name="m600",
    skillset=SKILLSET,
    functional_layer=functional_layer,
    recorder=recorder,
    mission_context=f"{LAUNCHING}:mission_context",
    checker=f"{LAUNCHING}:check",
    judge="skillwing.evaluation.judge.evaluation:judge",
    hooks=HOOKS,
    published_by={
        "obstacle_distance": ("zed_depthmap", "lidar_depthmap"),
        "map_statistics": ("lidar_mapping",),
        "video_quality": ("stream",),
    },
    # A draft from the skillset would fly to the origin, on the ground, and without its camera.
    mission_templates="skillwing.bt_missions.drone.templates",
    topics="skillwing.onboard.interface.table:TOPICS",
    shared_processes=("sim",),
    rescue_goal=RescueGoal(
        resource="flight_status",
        state="ON_GROUND",
        away={"IN_AIR": "in the air"},
        skill="land",
        left_by=("takeoff",),
        reached="on the ground",
        action="landing",
    ),
    without_goals="A drone that no goal commands holds its position for 30 s, then it lands.",
)
