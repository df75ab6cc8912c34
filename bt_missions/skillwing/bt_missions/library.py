"""Where missions are found: by name among those that are installed, or in a file."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from skillwing.bt_missions.mission.files import load_python_mission
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.xml.mission import load_mission
from skillwing.dsl.model import UnknownNameError
from skillwing.services.errors import InvalidOptionError
from skillwing.services.user_code_errors import load_error_message

ENTRY_POINTS = "skillwing.missions"


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

    Raises UnknownMissionError, InvalidOptionError for a file that cannot be read, and FaultyMissionError for one that
    cannot be used for what is written in it.
    """
    mission = find_draft(name)
    mission.require_usable()
    return mission


def find_draft(name: str) -> Mission:
    """The same for who lists what is wrong with it: of tree files only those are refused that cannot be read at all."""
    file = Path(name)
    if file.suffix == ".xml":
        return load_mission(file)
    if file.suffix == ".py":
        return load_python_mission(file)
    found = installed_missions()
    if name not in found:
        raise UnknownMissionError(name)
    try:
        return found[name].load()
    except (Exception, SystemExit) as error:  # what somebody else installs may fail in any way
        told = load_error_message(found[name].module, error)
        raise InvalidOptionError("mission", f"`{name}` is installed as `{found[name].value}`, but {told}") from error
