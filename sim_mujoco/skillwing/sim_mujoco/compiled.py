"""Compilation of loops over arrays to machine code, by Numba."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile a function at its first call, and keep the machine code in `__pycache__` or in the user's cache.

    Operations keep their order and their precision, so results do not depend on the compiler. Division by zero gives
    infinity, as in NumPy. If neither folder can be written, each process compiles again. `NUMBA_CACHE_DIR` names a
    folder of its own.

    Without Numba the function raises ImportError when it is called. On-board processes read tables from the modules of
    sensors, and call none of their loops.
    """
    try:
        from numba import njit  # noqa: PLC0415
    except ModuleNotFoundError:
        return cast("F", _absent)
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        return njit(error_model="numpy")(function)


def _absent(*_: object) -> None:
    raise ImportError("The simulator needs Numba. Install it: `pip install skillwing[sim]`.")
