"""A mission in a Python file that is not installed."""

from __future__ import annotations

import sys
import traceback
from itertools import takewhile
from pathlib import Path
from types import CodeType, ModuleType

from skillwing.bt_missions.checking.misfit import FaultyMissionError, Misfit
from skillwing.bt_missions.running.mission import Mission
from skillwing.bt_missions.running.source_file import read_source, refuse_if_not_utf8
from skillwing.services.user_code_errors import exception_message, import_error_message

ATTRIBUTE = "MISSION"
"""What the file calls its mission."""


def load_python_mission(file: Path) -> Mission:
    """The mission that a file defines.

    Raises InvalidOptionError for a file that cannot be read, and FaultyMissionError for one that is no Python, that
    fails while it is loaded, or that defines no mission.
    """
    code = _compiled(file)
    module = ModuleType(f"mission_file_{file.stem}")
    module.__file__ = str(file)
    # Options find their types by the name of their module.
    sys.modules[module.__name__] = module
    try:
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:  # what somebody else writes may fail in any way
        raise FaultyMissionError([failure_in(file, error, "while it is loaded")]) from error
    mission = getattr(module, ATTRIBUTE, None)
    if not isinstance(mission, Mission):
        text = f"It defines no mission. Write `{ATTRIBUTE} = ...` with an instance of your Mission."
        raise FaultyMissionError([Misfit(text, str(file))])
    return mission


def failure_in(file: Path | None, error: BaseException, when: str) -> Misfit:
    """What went wrong in the code of a mission, with the last line of its file that took part. file: None where the
    mission was written in none."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    place = f"{file}:{frames[-1].lineno}" if frames else file and str(file)
    if isinstance(error, ImportError):
        return Misfit(import_error_message(error, after=place or ""), place)
    return Misfit(exception_message(error, when=f" {when}"), place)


def _compiled(file: Path) -> CodeType:
    content = read_source(file)
    try:
        return compile(content, str(file), "exec", dont_inherit=True)
    except SyntaxError as error:
        refuse_if_not_utf8(content, file)
        # Of a file as a whole some Pythons tell line -1.
        known = takewhile(lambda number: number is not None and number > 0, (error.lineno, error.offset))
        place = ":".join(map(str, (file, *known)))
        raise FaultyMissionError([Misfit(f"This is no Python: {error.msg}. Fix it.", place)]) from error
    except ValueError as error:
        refuse_if_not_utf8(content, file)
        raise FaultyMissionError([Misfit("This is no Python: there is a zero byte in it.", str(file))]) from error
