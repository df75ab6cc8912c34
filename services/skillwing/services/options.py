"""Reading the options that a process was started with."""

from __future__ import annotations

import traceback
from importlib import import_module
from typing import Any

from skillwing.services.errors import InvalidOptionError


def required(options: dict[str, Any], name: str) -> str:
    """The text of an option. Raises InvalidOptionError where it is missing."""
    value = options.get(name)
    if not isinstance(value, str) or not value:
        given = ", ".join(f"`{key}`" for key in options) or "none"
        raise InvalidOptionError(name, f"The option `{name}` is missing. Give it as text; there is {given}.")
    return value


def imported(options: dict[str, Any], name: str) -> Any:
    """What an option of the form `package.module:attribute` names. Raises InvalidOptionError.

    That the module is not there is told apart from a module that is, and cannot be loaded.
    """
    path = required(options, name)
    module, colon, attribute = path.partition(":")
    if not (colon and attribute and all(part.isidentifier() for part in module.split("."))):
        text = f"The option `{name}` is `{path}`. Write `package.module:attribute`."
        raise InvalidOptionError(name, text)
    try:
        found = import_module(module)
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError) and f"{module}.".startswith(f"{error.name}."):
            told = f"there is no module `{error.name}`. Write its name right, or install the package that has it."
        else:
            told = f"its module cannot be loaded. {import_failure(error)}"
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {told}") from error
    except (Exception, SystemExit) as error:  # what somebody else writes may fail in any way
        told = f"its module cannot be loaded. {_failure(error)}"
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {told}") from error
    try:
        return getattr(found, attribute)
    except AttributeError as error:
        told = f"`{module}` has no `{attribute}`. Name something that it defines"
        raise InvalidOptionError(name, f"The option `{name}` names `{path}`, but {told}.") from error


def import_failure(error: ImportError, *, told_at: str = "") -> str:
    """Which file imports what it cannot have, and what to do about it. told_at: `file:line` that stands before this."""
    importer = _importer(error)
    where = "It" if importer in ("", told_at) else f"`{importer}`"
    if isinstance(error, ModuleNotFoundError):
        return f"{where} imports `{error.name}`, and there is no such module. Install it, or mend the import."
    if error.name:
        return f"{where} imports from `{error.name}` what that cannot give: {error.msg}. Mend the import."
    return f"{where} imports what it cannot have: {error.msg}. Mend the import."


def _failure(error: BaseException) -> str:
    """Which file fails while it is loaded, in which line, and how."""
    if isinstance(error, SyntaxError) and error.filename is not None:
        place = ":".join(str(part) for part in (error.filename, error.lineno) if part)
        return f"`{place}` is no Python: {error.msg}. Mend it."
    # What a library says within a call is for the module to mend that calls it.
    loaded = [frame for frame in _frames(error) if frame.name == "<module>"]
    where = f"`{_place(loaded[-1])}`" if loaded else "It"
    if isinstance(error, SystemExit):
        return f"{where} ends Python. Take that out."
    told = f": {error}".rstrip(".") if str(error) else ""
    return f"{where} raises {type(error).__name__}{told}. Mend it."


def _importer(error: ImportError) -> str:
    """`file:line` of the innermost file that has asked for it."""
    frames = _frames(error)
    return _place(frames[-1]) if frames else ""


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """The lines that took part, the outermost first; Python's own machinery is none."""
    return [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith("<frozen")]


def _place(frame: traceback.FrameSummary) -> str:
    return f"{frame.filename}:{frame.lineno}"
