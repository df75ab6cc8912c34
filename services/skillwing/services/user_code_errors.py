"""Messages for a user's code that fails: file and line, the failure, and the remedy."""

from __future__ import annotations

import traceback


def load_error_message(module: str, error: BaseException) -> str:
    """Text after `but` on a module that cannot be loaded: it is missing, or one of its files fails."""
    if isinstance(error, ModuleNotFoundError) and f"{module}.".startswith(f"{error.name}."):
        return f"there is no module `{error.name}`. Correct its name, or install the package that has it."
    return f"its module cannot be loaded. {_failing_file(error)}"


def _failing_file(error: BaseException) -> str:
    """File, line and kind of the failure."""
    if isinstance(error, ImportError):
        return import_error_message(error)
    if isinstance(error, SyntaxError) and error.filename is not None:
        place = ":".join(str(part) for part in (error.filename, error.lineno) if part)
        return f"`{place}` is no Python: {error.msg}. Fix it."
    # For an exception from within a library, the line that matters is that of the module which calls it.
    loaded = [frame for frame in _frames(error) if frame.name == "<module>"]
    return exception_message(error, f"`{_place(loaded[-1])}`" if loaded else "It")


def import_error_message(error: ImportError, *, after: str = "") -> str:
    """The file with the failing import, and the remedy. after: `file:line` that precedes this text."""
    frames = _frames(error)
    importer = _place(frames[-1]) if frames else ""
    where = "It" if importer in ("", after) else f"`{importer}`"
    if isinstance(error, ModuleNotFoundError):
        return f"{where} imports `{error.name}`, and there is no such module. Install it, or fix the import."
    if error.name:
        return f"{where} imports from `{error.name}` what that does not have: {error.msg}. Fix the import."
    return f"{where} has an import that fails: {error.msg}. Fix the import."


def exception_message(error: BaseException, where: str = "It", when: str = "") -> str:
    """The exception that running code has raised. when: ` while it is built`, if that is not clear."""
    if isinstance(error, SystemExit):
        return f"{where} ends Python{when}. Take that out."
    text = f": {error}".rstrip(".") if str(error) else ""
    return f"{where} raises {type(error).__name__}{when}{text}. Fix it."


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """The lines of the traceback, the outermost first, without Python's own."""
    return [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith("<frozen")]


def _place(frame: traceback.FrameSummary) -> str:
    return f"{frame.filename}:{frame.lineno}"
