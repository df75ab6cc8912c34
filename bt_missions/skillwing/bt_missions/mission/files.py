"""Source files of missions, and missions in Python files that are not installed."""

from __future__ import annotations

import sys
from itertools import takewhile
from pathlib import Path
from types import CodeType, ModuleType

from skillwing.bt_missions.mission.mission import Mission
from skillwing.bt_missions.mission.problems import FaultyMissionError, MissionProblem, problem_of_exception
from skillwing.services.errors import InvalidOptionError
from skillwing.services.python_path import folder_of_packages, make_importable

ATTRIBUTE = "MISSION"
"""Name of the mission in a Python file."""


def read_source(file: Path) -> bytes:
    """Content of a file. Raises InvalidOptionError if it does not exist or cannot be read."""
    try:
        return file.read_bytes()
    except FileNotFoundError as error:
        raise InvalidOptionError("mission", f"There is no file `{file}`. Name the file of a mission.") from error
    except OSError as error:
        what = "is a directory" if file.is_dir() else f"cannot be read: {error.strerror or error}"
        raise InvalidOptionError("mission", f"`{file}` {what}. Name the file of a mission.") from error


def refuse_if_not_utf8(content: bytes, file: Path) -> None:
    """Raise InvalidOptionError if the content is not text in UTF-8."""
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidOptionError("mission", f"`{file}` is not a text file in UTF-8. Save it as one.") from error


def load_python_mission(file: Path) -> Mission:
    """The mission that a file defines. It may import the packages beside it, also while it runs.

    Raises InvalidOptionError for a file that cannot be read. Raises FaultyMissionError for a file that is not valid
    Python, fails while it is loaded, or defines no mission.
    """
    code = _compiled(file)
    module = ModuleType(f"mission_file_{file.stem}")
    module.__file__ = str(file)
    make_importable(folder_of_packages(file))
    # msgspec resolves the types of options by the name of their module.
    sys.modules[module.__name__] = module
    try:
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:  # code of users may raise anything
        raise FaultyMissionError([problem_of_exception(file, error, "while it is loaded")]) from error
    mission = getattr(module, ATTRIBUTE, None)
    if not isinstance(mission, Mission):
        text = f"It defines no mission. Write `{ATTRIBUTE} = ...` with an instance of your Mission."
        raise FaultyMissionError([MissionProblem(text, str(file))])
    return mission


def _compiled(file: Path) -> CodeType:
    content = read_source(file)
    try:
        return compile(content, str(file), "exec", dont_inherit=True)
    except SyntaxError as error:
        refuse_if_not_utf8(content, file)
        # For a problem of the whole file some versions of Python report line -1.
        known = takewhile(lambda number: number is not None and number > 0, (error.lineno, error.offset))
        place = ":".join(map(str, (file, *known)))
        raise FaultyMissionError([MissionProblem(f"This is not valid Python: {error.msg}. Fix it.", place)]) from error
    except ValueError as error:
        refuse_if_not_utf8(content, file)
        raise FaultyMissionError(
            [MissionProblem("This is not valid Python: there is a zero byte in it.", str(file))]
        ) from error
