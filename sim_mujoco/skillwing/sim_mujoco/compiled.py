"""Compilation of loops over arrays to machine code, by Numba."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])
Constant = int | float | str | tuple | np.generic
"""Values that machine code keeps, and that can be imported from another file."""


def compiled(function: F) -> F:
    """Compile a function at its first call, and keep the machine code in `__pycache__` or in the user's cache.

    Operations keep their order and their precision, so results do not depend on the compiler. Division by zero gives
    infinity, as in NumPy. If neither folder can be written, each process compiles again. `NUMBA_CACHE_DIR` names a
    folder of its own.

    Numba notices a change of the function's own file only. Constants may be imported from others, so the qualified
    name, by which the machine code is found, gets their digest. They have to be defined above the function, and
    compiled functions that it calls have to be in the same file.

    Without Numba the function raises ImportError when it is called. On-board processes read tables from the modules of
    sensors, and call none of their loops.
    """
    try:
        from numba import njit  # noqa: PLC0415
    except ModuleNotFoundError:
        return cast("F", _absent)
    function.__qualname__ += f"_{constants_digest(function.__globals__)}"
    try:
        return njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        return njit(error_model="numpy")(function)


def constants_digest(names: Mapping[str, object]) -> str:
    """Twelve hexadecimal digits, equal for equal constants in the names of a module."""
    constants = {name: repr(value) for name, value in names.items() if isinstance(value, Constant)}
    found = sorted((name, value) for name, value in constants.items() if not name.startswith("__"))
    return hashlib.sha256(repr(found).encode()).hexdigest()[:12]


def _absent(*_: object) -> None:
    raise ImportError("The simulator needs Numba. Install it: `pip install skillwing[sim]`.")
