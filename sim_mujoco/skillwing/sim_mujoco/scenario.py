"""A scenario: what happens to the drone and around it during a flight, written down in a file.

TOML or JSON. Each section is a structure below; a new one needs a structure and a field of `Scenario`, and whoever acts
on it reads the file with `read_scenario`. docs/sensors.md has an example.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import msgspec

from skillwing.onboard.topics.common import LARGEST_COMPONENT
from skillwing.onboard.topics.faults import Magnitude
from skillwing.sim_mujoco.link.radio import RadioOptions
from skillwing.sim_mujoco.scenario_slips import slips
from skillwing.sim_mujoco.sensors.fault_schedule import Seconds
from skillwing.sim_mujoco.sensors.gnss import ReceiverName
from skillwing.sim_mujoco.sensors.zones import Zone

STRONGEST_WIND = 50.0
"""In each direction, of a gust as of the mean wind [m/s]: half as much again as the least wind of a hurricane."""
WindSpeed = Annotated[float, msgspec.Meta(ge=-STRONGEST_WIND, le=STRONGEST_WIND)]
WindVector = tuple[WindSpeed, WindSpeed, WindSpeed]
WindStrength = Annotated[float, msgspec.Meta(ge=0.0, le=STRONGEST_WIND)]
Percent = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]
Poses = Literal["odometry", "navigation", "small-gicp"]
"""Whence the map has its poses (docs/mapping.md)."""


class ScenarioError(ValueError):
    """A scenario that cannot be used; `str()` says where and why, with all that is wrong in it."""


class FaultOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A fault that comes by itself: `{"sensor": "zed", "kind": "blackout", "at": 60.0}`, optionally with `for` seconds,
    a `magnitude`, and a `zone` outside of which it is off."""

    sensor: str
    kind: str
    at: Seconds = 0.0
    duration: Seconds | None = None
    magnitude: Magnitude | None = None
    zone: Zone | None = None


class GustOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A gust: `{"at": 30.0, "velocity": [6.0, 0.0, 0.0], "for": 4.0}`, in s and m/s (ENU)."""

    at: Seconds
    velocity: WindVector
    duration: Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]


class PilotOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The safety pilot takes the authority at `at` (`authority` False), or gives it to the computer."""

    at: Seconds
    authority: bool


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Sections that may be repeated (`[[fault]]`), and single values. What is absent keeps its default."""

    fault: tuple[FaultOptions, ...] = ()
    gust: tuple[GustOptions, ...] = ()
    pilot: tuple[PilotOptions, ...] = ()
    wind: WindVector | None = None
    turbulence: WindStrength | None = None
    battery: Percent | None = None
    receiver: ReceiverName | None = None
    poses: Poses | None = None
    link: RadioOptions | None = None

    def sim_options(self) -> dict[str, Any]:
        """The same as options of the simulator node."""
        single = {"wind": self.wind, "turbulence": self.turbulence, "battery": self.battery, "receiver": self.receiver}
        return {
            "faults": self.fault,
            "gusts": self.gust,
            "pilot": self.pilot,
            **{name: value for name, value in single.items() if value is not None},
        }


def read_scenario(path: Path) -> Scenario:
    """The scenario in a file. Raises ScenarioError."""
    try:
        # Some editors put a byte order mark ahead of the text.
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ScenarioError(f"the scenario {path} cannot be read: {why}") from error
    language, read = ("JSON", json.loads) if path.suffix == ".json" else ("TOML", tomllib.loads)
    try:
        content: object = read(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise ScenarioError(f"the scenario {path} is no {language}: {error}") from error
    except ValueError as error:
        raise ScenarioError(f"the scenario {path} cannot be read: a number in it has thousands of digits") from error
    except RecursionError as error:
        raise ScenarioError(f"the scenario {path} cannot be read: sections or lists nest too deep in it") from error
    wrong = [*slips(content, Scenario), *_impossible_faults(content)]
    if wrong:
        told = f" {wrong[0]}" if len(wrong) == 1 else "".join(f"\n    {each}" for each in wrong)
        raise ScenarioError(f"the scenario {path} does not fit:{told}")
    scenario = msgspec.convert(content, Scenario)
    try:
        _require_library(scenario.poses)
    except ImportError as error:
        raise ScenarioError(f"the scenario {path} does not fit: {error}") from error
    return scenario


def _impossible_faults(content: object) -> Iterator[str]:
    """A clause for each fault that nothing can have, whatever else is wrong with it."""
    match content:
        case {"fault": [_, *_] as faults}:
            pass
        case _:
            return
    from skillwing.sim_mujoco.simulator.fault_plan import check_fault  # noqa: PLC0415 - loads physics

    for number, fault in enumerate(cast("list[object]", faults), 1):
        match fault:
            case {"sensor": "link"}:
                yield f"fault {number}: the link is no sensor; write its faults as `[[link.faults]]`"
            case {"sensor": str(sensor), "kind": str(kind), **rest}:
                try:
                    check_fault(sensor, kind, _magnitude(rest.get("magnitude")))
                except ValueError as error:
                    yield f"fault {number}: {error}"
            case _:
                pass


def _magnitude(value: object) -> float | None:
    """What is a magnitude at all; of what is not, the structure tells."""
    return value if isinstance(value, int | float) and abs(value) <= LARGEST_COMPONENT else None


def _require_library(poses: Poses | None) -> None:
    """Raises MissingLibraryError for poses that need a library which is not installed."""
    if poses == "small-gicp":
        from skillwing.onboard.odometry.gicp import gicp_matcher  # noqa: PLC0415 - loads numpy

        gicp_matcher()
