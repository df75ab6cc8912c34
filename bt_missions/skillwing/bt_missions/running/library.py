"""Where missions are found: by name among those that are installed, or in a file."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from skillwing.bt_missions.running.mission import Mission
from skillwing.bt_missions.xml.mission import XmlMission, load_mission
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidOptionError

ENTRY_POINTS = "skillwing.missions"
ATTRIBUTE = "MISSION"
"""What a Python file of a mission calls it."""


class UnknownMissionError(UnknownNameError):
    """No mission of that name is installed. Besides what is, `str()` says what else a mission may be named by."""

    def __init__(self, name: str) -> None:
        super().__init__("mission", name, installed_missions())

    def __str__(self) -> str:
        return f"{super().__str__()} A file may be named, too: `./{self.name}.xml` or `./{self.name}.py`."


def installed_missions() -> dict[str, EntryPoint]:
    """Every mission that is installed, by name; loading an entry imports its module."""
    return {entry.name: entry for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name)}


def find_mission(name: str) -> Mission:
    """The mission of that name; that of a tree file, where the name ends with `.xml`; or `MISSION` of a `.py` file.

    Raises UnknownMissionError, TreeFileError for a tree file that cannot be used, and InvalidOptionError for a Python
    file that cannot be loaded.
    """
    mission = find_draft(name)
    if isinstance(mission, XmlMission):
        mission.require_usable()
    return mission


def find_draft(name: str) -> Mission:
    """The same for who only checks it: of tree files only those are refused that cannot be read at all."""
    file = Path(name)
    if file.suffix == ".xml":
        return load_mission(file)
    if file.suffix == ".py":
        return _loaded(file)
    found = installed_missions()
    if name not in found:
        raise UnknownMissionError(name)
    return found[name].load()


def _loaded(file: Path) -> Mission:
    if not file.is_file():
        raise InvalidOptionError("mission", f"There is no file `{file}`. Name one that defines `{ATTRIBUTE}`.")
    name = f"mission_file_{file.stem}"
    spec = spec_from_file_location(name, file)
    assert spec is not None, "a name that ends with .py has a loader"
    assert spec.loader is not None
    module = module_from_spec(spec)
    # Options find their types by the name of their module.
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # what somebody else writes may fail in any way
        sentence = f"The mission `{file}` cannot be loaded: {type(error).__name__}: {error}. Mend its module."
        raise InvalidOptionError("mission", sentence) from error
    mission = getattr(module, ATTRIBUTE, None)
    if not isinstance(mission, Mission):
        sentence = f"`{file}` defines no mission. Write `{ATTRIBUTE} = ...` with an instance of your Mission."
        raise InvalidOptionError("mission", sentence)
    return mission
