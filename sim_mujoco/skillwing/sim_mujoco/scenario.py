"""A scenario: what happens to the drone and around it during a flight, written down in a file.

TOML or JSON. Each section is a structure below; a new one needs a structure and a field of `Scenario`, and whoever acts
on it reads the file with `read_scenario`. docs/sensors.md has an example.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from skillwing.sim_mujoco.link.radio import LinkFaultOptions, RadioOptions, RadioZone
from skillwing.sim_mujoco.sensors.zones import Zone
from skillwing.sim_mujoco.topics import Vector3

Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]
Percent = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]
Poses = Literal["odometry", "navigation", "small-gicp"]
"""Whence the map has its poses (docs/mapping.md)."""


class ScenarioError(ValueError):
    """A scenario that cannot be used; `str()` is a sentence that says where and why."""


class FaultOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A fault that comes by itself: `{"sensor": "zed", "kind": "blackout", "at": 60.0}`, optionally with `for` seconds,
    a `magnitude`, and a `zone` outside of which it is off."""

    sensor: str
    kind: str
    at: Seconds = 0.0
    duration: Seconds | None = None
    magnitude: float | None = None
    zone: Zone | None = None


class GustOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"duration": "for"}):
    """A gust: `{"at": 30.0, "velocity": [6.0, 0.0, 0.0], "for": 4.0}`, in s and m/s (ENU)."""

    at: Seconds
    velocity: Vector3
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
    wind: Vector3 | None = None
    turbulence: Annotated[float, msgspec.Meta(ge=0.0, le=50.0)] | None = None
    battery: Percent | None = None
    receiver: str | None = None
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
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ScenarioError(f"the scenario {path} cannot be read: {why}") from error
    try:
        content = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except ValueError as error:
        language = "JSON" if path.suffix == ".json" else "TOML"
        raise ScenarioError(f"the scenario {path} is no {language}: {error}") from error
    try:
        scenario = msgspec.convert(content, Scenario)
        _require_known(scenario.fault)
        _require_library(scenario.poses)
    except msgspec.ValidationError as error:
        raise ScenarioError(f"the scenario {path} does not fit: {_in_words(str(error))}") from error
    except (ValueError, ImportError) as error:
        raise ScenarioError(f"the scenario {path} does not fit: {error}") from error
    return scenario


def _require_known(faults: tuple[FaultOptions, ...]) -> None:
    """Raises ValueError for a fault that nothing can have."""
    if not faults:
        return
    from skillwing.sim_mujoco.simulator.fault_plan import check_fault  # noqa: PLC0415 - loads physics

    for number, fault in enumerate(faults, 1):
        try:
            check_fault(fault.sensor, fault.kind)
        except ValueError as error:
            raise ValueError(f"fault {number}: {error}") from error


def _require_library(poses: Poses | None) -> None:
    """Raises MissingLibraryError for poses that need a library which is not installed."""
    if poses == "small-gicp":
        from skillwing.sim_mujoco.slam.gicp import gicp_matcher  # noqa: PLC0415 - loads numpy

        gicp_matcher()


def _in_words(complaint: str) -> str:
    """A complaint of the validation, with its place as people count: the second fault is `fault 2`."""
    what, _, place = complaint.partition(" - at `$")
    names = re.sub(r"\[(\d+)\]", lambda index: f" {int(index[1]) + 1}", place).strip("`").replace(".", " ").split()
    kind = next((_SECTIONS[name] for name in reversed(names) if name in _SECTIONS), Scenario)
    known = f"; known are {', '.join(f.encode_name for f in msgspec.structs.fields(kind))}" if "field" in what else ""
    return f"{' '.join(names)}: {what}{known}".removeprefix(": ")


_SECTIONS: dict[str, type[msgspec.Struct]] = {
    "fault": FaultOptions,
    "gust": GustOptions,
    "pilot": PilotOptions,
    "zone": Zone,
    "link": RadioOptions,
    "zones": RadioZone,
    "faults": LinkFaultOptions,
}
"""By the name of a section or a field: what can be written there."""
