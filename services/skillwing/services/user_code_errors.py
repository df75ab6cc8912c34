"""What is told of somebody else's code that fails: in which line, how, and what to do about it."""

from __future__ import annotations

import traceback


def load_failure(module: str, error: BaseException) -> str:
    """Why a module cannot be had, to stand behind `but`: it is not there, or one of its files fails."""
    if isinstance(error, ModuleNotFoundError) and f"{module}.".startswith(f"{error.name}."):
        return f"there is no module `{error.name}`. Write its name right, or install the package that has it."
    return f"its module cannot be loaded. {_failing_file(error)}"


def _failing_file(error: BaseException) -> str:
    """Which file fails while it is loaded, in which line, and how."""
    if isinstance(error, ImportError):
        return import_failure(error)
    if isinstance(error, SyntaxError) and error.filename is not None:
        place = ":".join(str(part) for part in (error.filename, error.lineno) if part)
        return f"`{place}` is no Python: {error.msg}. Mend it."
    # What a library says within a call is for the module to mend that calls it.
    loaded = [frame for frame in _frames(error) if frame.name == "<module>"]
    return failure(error, f"`{_place(loaded[-1])}`" if loaded else "It")


def import_failure(error: ImportError, *, told_at: str = "") -> str:
    """Which file imports what it cannot have, and what to do about it. told_at: `file:line` that stands before this."""
    frames = _frames(error)
    importer = _place(frames[-1]) if frames else ""
    where = "It" if importer in ("", told_at) else f"`{importer}`"
    if isinstance(error, ModuleNotFoundError):
        return f"{where} imports `{error.name}`, and there is no such module. Install it, or mend the import."
    if error.name:
        return f"{where} imports from `{error.name}` what that cannot give: {error.msg}. Mend the import."
    return f"{where} imports what it cannot have: {error.msg}. Mend the import."


def failure(error: BaseException, where: str = "It", when: str = "") -> str:
    """How code has failed that is there and was begun. when: ` while it is built`, if that is not clear."""
    if isinstance(error, SystemExit):
        return f"{where} ends Python{when}. Take that out."
    told = f": {error}".rstrip(".") if str(error) else ""
    return f"{where} raises {type(error).__name__}{when}{told}. Mend it."


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """The lines that took part, the outermost first; Python's own machinery is none."""
    return [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith("<frozen")]


def _place(frame: traceback.FrameSummary) -> str:
    return f"{frame.filename}:{frame.lineno}"
