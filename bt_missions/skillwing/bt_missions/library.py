"""Library of missions: installed ones by name, others by file."""

from __future__ import annotations

from collections.abc import Collection
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from skillwing.bt_missions.mission.files import load_python_mission
from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.xml.mission import load_mission
from skillwing.dsl.model import UnknownNameError
from skillwing.dsl.suggest import listed
from skillwing.services.errors import InvalidOptionError
from skillwing.services.user_code_errors import load_error_message

ENTRY_POINTS = "skillwing.missions"


class UnknownMissionError(UnknownNameError):
    """Unknown name of a mission. `str()` lists the installed missions, and mentions files.

    unfit: installed missions that do not fit `robot`, if it is known. They are not listed as known names.
    """

    def __init__(self, name: str, unfit: Collection[str] = (), robot: str = "") -> None:
        super().__init__("mission", name, [each for each in installed_missions() if each not in unfit])
        self._unfit = f" Other installed missions do not fit {robot}: {listed(unfit)}." if unfit else ""

    def __str__(self) -> str:
        return f"{super().__str__()}{self._unfit} A file may be named, too: `./{self.name}.xml` or `./{self.name}.py`."


def installed_missions() -> dict[str, EntryPoint]:
    """Entry points of all installed missions, by name. Loading one imports its module."""
    return {entry.name: entry for entry in sorted(entry_points(group=ENTRY_POINTS), key=lambda entry: entry.name)}


def find_mission(name: str) -> Mission:
    """The mission of that name, of a tree file (`.xml`), or `MISSION` of a Python file (`.py`).

    Raises UnknownMissionError, InvalidOptionError for a file that cannot be read, and FaultyMissionError for a mission
    that cannot run on any robot.
    """
    mission = find_draft(name)
    mission.require_usable()
    return mission


def find_draft(name: str) -> Mission:
    """Find a mission as `find_mission` does, but accept tree files with problems, for checks. They have to be XML."""
    file = Path(name)
    if file.suffix == ".xml":
        return load_mission(file)
    if file.suffix == ".py":
        return load_python_mission(file)
    found = installed_missions()
    if name not in found:
        if file.is_dir():
            raise InvalidOptionError("mission", f"`{name}` is a directory. Name the file of a mission.")
        if file.suffix or file.name != name or file.exists():
            text = f"`{name}` ends neither with .xml nor with .py. Name a file that does, or an installed mission"
            raise InvalidOptionError("mission", f"{text}: {listed(found)}.")
        raise UnknownMissionError(name)
    try:
        return found[name].load()
    except (Exception, SystemExit) as error:  # users' code may raise any exception
        reason = load_error_message(found[name].module, error)
        raise InvalidOptionError("mission", f"`{name}` is installed as `{found[name].value}`, but {reason}") from error
