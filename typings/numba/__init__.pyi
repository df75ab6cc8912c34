# Only what the simulator uses.
from collections.abc import Callable
from typing import Any, TypeVar, overload

from numba import types as types

_F = TypeVar("_F", bound=Callable[..., Any])

@overload
def njit(function: _F, /) -> _F: ...
@overload
def njit(*, cache: bool = ...) -> Callable[[_F], _F]: ...
